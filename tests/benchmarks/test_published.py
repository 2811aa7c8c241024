"""Published figures are those of the stored results, and every kind runs."""

import re
import shlex
from pathlib import Path

import pytest

from benchmarks import __main__ as program
from benchmarks.harness import pages, results
from benchmarks.kinds import KINDS
from benchmarks.pictures import DRAWN
from tests.support.documentation import sections
from tests.support.places import ROOT
from zenocap.common.table import attribute

DOCUMENTS = (*pages.pages(), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md")
MEASURED = ROOT / "docs" / "measured.md"
COMMAND = re.compile(r"python -m benchmarks((?: [^`\n|#,;)]+)?)")
LINK = re.compile(r"\[([^\]]*)\]\(([^)#\s]*)#([^)\s]+)\)")
MOST_BYTES = 1_000_000
TESTED_ELSEWHERE = {"chaos", "faults"}  # tests/system


@pytest.mark.slow  # kinds without results are imported
def test_the_pages_have_the_stored_figures() -> None:
    assert [page.name for page, _ in pages.stale(results.load_all())] == [], "python -m benchmarks --publish writes them"


@pytest.mark.parametrize("page", [ROOT / "README.md", MEASURED], ids=lambda page: page.name)
def test_pages_of_figures_have_no_table_without_them(page: Path) -> None:
    assert pages.NOT_YET not in page.read_text(encoding="utf-8").lower()


def test_links_to_measurements_lead_to_figures() -> None:
    checked, empty = 0, []
    for page in DOCUMENTS:
        for text, file, target in LINK.findall(page.read_text(encoding="utf-8")):
            place = (page.parent / file).resolve() if file else page
            if place == MEASURED or text.lower() == "measured":
                section = sections(place).get(target, "").lower()
                checked += 1
                if "<!-- table " not in section or pages.NOT_YET in section:
                    empty.append(f"{page.name}: [{text}]({file}#{target})")
    assert checked > 10
    assert empty == []


def test_results_are_small_and_of_known_kinds() -> None:
    files = list(results.FOLDER.glob("*.json"))
    assert {path.stem for path in files} <= set(KINDS.names())
    assert sum(path.stat().st_size for path in files) < MOST_BYTES


def test_every_figure_was_measured_by_the_harness() -> None:
    for found in results.load_all().values():
        for row in found.figures:
            assert re.fullmatch(r"[0-9a-f]{8,}", row.commit), (found.kind, row.case)
            assert re.fullmatch(r"\d{4}-\d\d-\d\d", row.date), (found.kind, row.case)
            assert row.command.startswith("python -m benchmarks"), (found.kind, row.case)


@pytest.mark.slow
def test_stored_columns_and_cases_are_those_of_the_kind() -> None:
    for name, found in results.load_all().items():
        kind = KINDS.row(name)
        assert {heading.name for heading in found.columns} == {column.name for column in kind.columns}
        assert {row.case for row in found.figures} <= set(kind.cases)


@pytest.mark.slow
def test_documented_commands_name_kinds_and_options_that_exist() -> None:
    commands = {match[1].strip() for page in DOCUMENTS for match in COMMAND.finditer(page.read_text(encoding="utf-8"))}
    assert len(commands) > 3
    parser = program.parser()
    for command in commands:
        words = shlex.split(command)
        if words and words[0] not in ("KIND", "..."):
            options = parser.parse_args(words)
            for kind in [] if options.kind == ["all"] else options.kind:
                assert KINDS.row(kind).selected(options.only), command


@pytest.mark.slow
def test_pictures_have_a_program() -> None:
    assert all(callable(attribute(place)) for place in DRAWN.values())


@pytest.mark.nightly
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", [name for name in KINDS.names() if name not in TESTED_ELSEWHERE])
def test_the_smallest_case_of_a_kind_runs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main([name, "--small"]) == 0, capsys.readouterr().err
    out = capsys.readouterr().out
    assert "smallest" in out
    if "skipped" in out:
        pytest.skip(out.strip())
