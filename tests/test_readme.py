"""README and documentation agree with the code: commands, tables, files, links."""

import re
import tomllib
from pathlib import Path

import pytest

from tests.support.documentation import ALL, COMMANDS, LINES, PAGES, TEXTS, command_of, parse, sections
from tests.support.places import ROOT
from zenocap.common.topics import TOPICS

WIRE = TEXTS[ROOT / "docs" / "wire.md"]
CODE = TEXTS[ROOT / "docs" / "code.md"]
REFUSED = {
    "zenocap trak walk -o walk.mcap": "did you mean zenocap track",
    "zenocap calibrate bord films --square 35": "No such command 'bord'",
    "zenocap track walk -o walk.mcap --particels 60": "No such option: --particels",
    "zenocap track walk -o walk.mcap --seed seven": "valid integer",
    "zenocap track walk -o walk.mcap --method joint": "'joint': allowed: auto, two-view, hybrid, ",
    "zenocap animator studio.toml --port 70000": "less than or equal to 65535",
    "zenocap replay monday.mcap --rate": "requires an argument",
    "zenocap export -o walk.bvh": "Missing parameter: take",
    "zenocap info monday.mcap tuesday.mcap": "unexpected extra argument",
}


def test_the_first_commands_are_clone_demo_and_test() -> None:
    assert len(COMMANDS) > 10
    assert LINES[0].startswith("git clone ")
    assert LINES[1:3] == ["make demo", "make test"]


def test_the_first_screen_has_the_moving_picture_and_the_first_commands() -> None:
    first = "\n".join(TEXTS[PAGES[0]].splitlines()[:20])
    assert all(part in first for part in (".webp)", "git clone", "make demo"))


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_parses(line: str) -> None:
    """Its options exist and are in its help, values have the right type, and no argument is missing or too many."""
    command, _, words = command_of(line)
    if words:  # else only named
        parse(line)
    shown = {
        name for one in command.params if not getattr(one, "hidden", False) for name in (*one.opts, *one.secondary_opts)
    }
    assert {word for word in words if re.match(r"--?[a-z]", word)} <= shown | {"-h", "--help"}


@pytest.mark.parametrize("line", REFUSED)
def test_a_wrong_command_does_not_parse(line: str) -> None:
    with pytest.raises(Exception, match=REFUSED[line]) as refused:
        parse(line)
    assert refused.value.exit_code == 2


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_topic_is_in_the_table(topic: object) -> None:
    row = next(t for t in TOPICS if t is topic)
    rate = f"{row.rate_hz:g}" if row.rate_hz else "on change"
    assert f"| `{row.key}` | {row.message.__name__} | {rate} | {row.queueing.value} |" in WIRE


def test_every_extra_is_in_the_table_and_its_command_in_one_place() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    rows = "".join(re.findall(r"^\|[^|]*\|", sections(PAGES[0])["extras"], re.MULTILINE))
    assert {*re.findall(r"`(\w+)`", rows)} == {*extras} - {"all", "dev", "docs"}
    files = [path for folder in ("common", "services", "tools") for path in (ROOT / folder).rglob("*.py")]
    assert [path.name for path in files if "pip install 'zenocap" in path.read_text(encoding="utf-8")] == ["errors.py"]
    assert "pip install 'zenocap" not in ALL


def test_every_named_file_exists() -> None:
    folders = "common|services|simulation|tools|zenocap|tests|benchmarks|examples|deploy|docs"
    files = re.findall(rf"`((?:{folders})/[\w/.]+\.\w+)`", ALL)
    assert len(files) > 20
    assert [file for file in files if not (ROOT / file).is_file()] == []


def test_the_map_of_the_code_has_every_room() -> None:
    shown = CODE.split("```")[1]
    folders = {path.parent for layer in ("common", "services", "tools") for path in (ROOT / layer).glob("*/__init__.py")}
    modules = {path for path in (ROOT / "tools").glob("*.py") if path.stem != "__init__"}
    assert len(folders) > 25
    assert [path.name for path in folders if f"\n  {path.name}/ " not in shown] == []
    assert [path.stem for path in modules if not re.search(rf"^  (\w+ · )?{path.stem} ", shown, re.MULTILINE)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_a_file_and_a_heading(page: Path) -> None:
    links = [link for link in re.findall(r"\]\(([^)\s]+)\)", TEXTS[page]) if not link.startswith("http")]
    for link in links:
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.is_file(), f"{page.name}: {link}"
        assert not anchor or anchor in sections(target), f"{page.name}: {link}"


def test_every_page_is_linked_from_the_readme() -> None:
    linked = {(ROOT / link).resolve() for link in re.findall(r"\]\(([\w/-]+\.md)\)", TEXTS[PAGES[0]])}
    assert linked == set(PAGES[1:])


def test_every_named_make_target_exists() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make ([\w-]+)", " ".join([*LINES, *re.findall(r"`(make [^`]*)`", ALL)])):
        assert f"\n{target}:" in makefile


def test_the_moving_picture_of_the_readme_is_small_and_moves() -> None:
    (name,) = re.findall(r"\]\((docs/\w+\.webp)\)", TEXTS[ROOT / "README.md"])
    content = (ROOT / name).read_bytes()
    assert len(content) < 1_500_000
    assert content[8:16] == b"WEBPVP8X"
    assert content.count(b"ANMF") > 20  # frames of an animation
