"""Hooks of the documentation site: pages from outside docs/, and links that lead to the right page of the site."""

import re
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
PAGES = {
    "README.md": "index.md",
    "deploy/README.md": "deploy.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
}
SOURCES = {page: source for source, page in PAGES.items()}
LINK = re.compile(r"(!?)\[((?:[^\]\[]|\[[^\]]*\])*)\]\(([^)\s]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are kept outside docs/."""
    for source, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Rewrite links between files of the repository to links between pages; other files become plain text."""
    uri = page.file.src_uri
    here = PurePosixPath(SOURCES.get(uri, f"docs/{uri}")).parent

    def rewritten(match: re.Match[str]) -> str:
        image, text, target = match.groups()
        if "://" in target or target.startswith(("#", "mailto:")):
            return match[0]
        path, mark, anchor = target.partition("#")
        source = normpath(str(here / path))
        found = PAGES.get(source, source.removeprefix("docs/"))
        if files.get_file_from_path(found) is None:
            if not (ROOT / source).exists():
                return match[0]  # mkdocs reports it
            return text
        return f"{image}[{text}]({relpath(found, str(PurePosixPath(uri).parent))}{mark}{anchor})"

    return LINK.sub(rewritten, markdown)
