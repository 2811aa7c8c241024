"""Lines, files, complexity and words of a checkout: python -m tests.measures.house [CHECKOUT ...]

Several checkouts are columns of one table, for example the state before a change and after it.  A function's branches are
those of ruff's C901.  Lines are repeated where six and more in a row stand also elsewhere, but for space.
"""

import ast
import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from tests.support.places import ROOT

PACKAGE = ("common", "simulation", "services", "tools", "zenocap")
SMALL = 60  # lines
ALIKE = 6  # lines
MOST_BRANCHES = 12
MOST_POSITIONAL = 10
NO_SENTENCES = re.compile(r"^ *```.*?^ *```$|<!-- (?:table|kinds) .*?<!-- end -->|<!-- .*? -->", re.DOTALL | re.MULTILINE)


def sources(checkout: Path, *folders: str) -> list[Path]:
    """Python files of folders, each once: folders inside `zenocap` are links to those beside it."""
    found = {path.resolve() for folder in folders for path in (checkout / folder).rglob("*.py")}
    return sorted(path for path in found if path.is_relative_to(checkout.resolve()))


def lines_of(paths: Sequence[Path]) -> int:
    return sum(path.read_text(encoding="utf-8").count("\n") for path in paths)


def rooms(checkout: Path) -> dict[str, int]:
    """Lines of each room: the folders in `common`, `services` and `tools`, and the other folders at the top."""
    found = {}
    for layer in ("common", "services", "tools"):
        found[f"{layer}/*.py"] = lines_of(sorted((checkout / layer).glob("*.py")))
        for folder in sorted(path for path in (checkout / layer).iterdir() if path.is_dir()):
            if its := sources(checkout, f"{layer}/{folder.name}"):  # not caches, nor what an earlier commit has left
                found[f"{layer}/{folder.name}"] = lines_of(its)
    found["zenocap/*.py"] = lines_of(sorted((checkout / "zenocap").glob("*.py")))
    return found | {name: lines_of(sources(checkout, name)) for name in ("simulation", "benchmarks", "tests")}


class Function(NamedTuple):
    lines: int
    positional: int  # parameters, without `self` and `cls`
    is_kernel: bool


class Definitions(NamedTuple):
    """Functions of a module, and the names of its classes, at any depth."""

    functions: tuple[Function, ...]
    classes: tuple[str, ...]


@cache
def definitions(path: Path) -> Definitions:
    functions, classes = [], []
    for node in statements(ast.parse(path.read_bytes()).body):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            positional = sum(one.arg not in ("self", "cls") for one in node.args.posonlyargs + node.args.args)
            functions.append(Function((node.end_lineno or 0) - node.lineno + 1, positional, _is_kernel(node)))
        elif isinstance(node, ast.ClassDef):
            classes.append(node.name)
    return Definitions(tuple(functions), tuple(classes))


def statements(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements at any depth.  Without their expressions: `ast.walk` takes several times as long."""
    for node in body:
        yield node
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            for inner in getattr(node, name, ()):
                yield from statements([inner] if isinstance(inner, ast.stmt) else inner.body)


def _is_kernel(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    names = {node.id for each in function.decorator_list for node in ast.walk(each) if isinstance(node, ast.Name)}
    return bool(names & {"kernel", "leaf_kernel", "njit"})


def repeated(paths: Sequence[Path]) -> int:
    """Lines of code that stand, in a run of at least six, also elsewhere; imports are no code here."""
    places: Counter[tuple[str, ...]] = Counter()
    runs = []
    for path in paths:
        kept = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
        code = [line for line in kept if line and not line.startswith(("#", "import ", "from "))]
        windows = [tuple(code[start : start + ALIKE]) for start in range(len(code) - ALIKE + 1)]
        places.update(windows)
        runs.append(windows)
    total = 0
    for windows in runs:
        doubled = [start for start, window in enumerate(windows) if places[window] > 1]
        total += sum(min(ALIKE, after - start) for start, after in pairwise([*doubled, (doubled or [0])[-1] + ALIKE]))
    return total


def complex_functions(checkout: Path) -> int:
    """Functions of package and benchmarks above twelve branches, as ruff counts them."""
    command = [
        sys.executable, "-m", "ruff", "check", "--isolated", "--select", "C901", "--output-format", "json", "--exit-zero",
        "--config", f"lint.mccabe.max-complexity={MOST_BRANCHES}", *PACKAGE[:-1], "benchmarks",
    ]  # fmt: skip
    return len(json.loads(subprocess.run(command, cwd=checkout, check=True, capture_output=True, text=True).stdout))


def words(*pages: Path) -> int:
    """Words of pages: blanks separate them, and the bars of tables are none."""
    return sum(not set(word) <= set("|:-") for page in pages for word in page.read_text(encoding="utf-8").split())


def sentences(page: Path) -> list[str]:
    """Sentences of a page, without code, tables and headings; a colon and a semicolon end one, too."""
    lines = NO_SENTENCES.sub("", page.read_text(encoding="utf-8")).splitlines()
    apart = ["\n" if not line.strip() or line.lstrip().startswith(("|", "#", "!")) else line for line in lines]
    text = " ".join(re.sub(r"^\s*([-*]|\d+\.) ", "\n", line) for line in apart)
    return [" ".join(one.split()) for one in re.split(r"(?<=[.!?:;])[\"*)`]*\s|\n", text) if one.strip()]


def figures(checkout: Path) -> Mapping[str, int]:
    """Sizes of a checkout, by name."""
    package, benchmarks = sources(checkout, *PACKAGE), sources(checkout, "benchmarks")
    its = [function for path in (*package, *benchmarks) for function in definitions(path).functions]
    scripts = [path for folder in PACKAGE[:-1] for path in (checkout / folder).rglob("*") if path.suffix in (".js", ".css")]
    return {
        "lines of the package": lines_of(package),
        "lines of benchmarks": lines_of(benchmarks),
        "lines of tests": lines_of(sources(checkout, "tests")),
        "lines of scripts and styles": lines_of(scripts),
        "files of the package": len(package),
        f"of them below {SMALL} lines": sum(lines_of([path]) < SMALL for path in package),
        "longest function, lines": max(function.lines for function in its),
        "longest command-line function, lines": max(
            function.lines for path in sources(checkout, "tools/cli") for function in definitions(path).functions
        ),
        f"functions above {MOST_BRANCHES} branches": complex_functions(checkout),
        f"functions above {MOST_POSITIONAL} positional parameters, no kernels": sum(
            function.positional > MOST_POSITIONAL and not function.is_kernel for function in its
        ),
        "repeated lines of package and benchmarks": repeated([*package, *benchmarks]),
        "words of README": words(checkout / "README.md"),
        "words of docs": words(*(checkout / "docs").glob("*.md")),
    }


def main(checkouts: Sequence[str]) -> None:
    places = [Path(name) for name in checkouts] or [ROOT]
    if others := [str(place) for place in places if not (place / PACKAGE[0]).is_dir()]:
        sys.exit(f"no checkout: {', '.join(others)}\n\n{__doc__}")
    for table in (figures, rooms):
        columns = [table(place) for place in places]
        for name in dict.fromkeys(name for column in columns for name in column):
            print(f"{name:56}", *(f"{column.get(name, 0):9,}" for column in columns))
        print()


if __name__ == "__main__":
    main(sys.argv[1:])
