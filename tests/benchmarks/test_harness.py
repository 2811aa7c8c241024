"""The harness: what a result depends on, what is kept, honest statistics, stored figures, the command."""

import subprocess
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from benchmarks import __main__ as program
from benchmarks.harness import cache, pages, results
from benchmarks.harness.cache import Closure
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.harness.pool import runs
from zenocap.common.errors import UserError

NAN = float("nan")
calls: list[Case] = []


def doubled(one: Case) -> Figures:
    calls.append(one)
    if one.film == "broken":
        raise ValueError("the film is broken")
    return {"mm": 2.0 * one.option("size", 1) + one.seed, "lost": 0.0}


KIND = Kind(
    "doubled",
    "Twice the size.",
    doubled,
    (Quantity("mm", "mm"), Quantity("lost", "%", 0, "")),
    {"small": case("film"), "large": case("film", size=10)},
    case("film"),
)


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path / "cache"))
    calls.clear()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of stored results in place of that of the repository, with one page and one kind."""
    place = tmp_path / "results"
    page = tmp_path / "page.md"
    page.write_text('Twice is <!-- figure doubled "small" mm --><!-- end -->.\n')
    monkeypatch.setattr(results, "FOLDER", place)
    monkeypatch.setattr(pages, "pages", lambda: [page])
    monkeypatch.setattr(program, "KINDS", _Table())
    return place


class _Table:
    def names(self) -> tuple[str, ...]:
        return (KIND.name,)

    def row(self, name: str) -> Kind:
        if name != KIND.name:
            raise UserError(f"{name!r}: allowed: {KIND.name}")
        return KIND

    def rows(self) -> dict[str, Kind]:
        return {KIND.name: KIND}


@pytest.mark.parametrize(("changed", "same"), [("b", False), ("c", False), ("d", True)])
def test_a_digest_changes_with_all_that_is_imported_also_by_name(tmp_path: Path, changed: str, same: bool) -> None:
    texts = {"a": "from zenocap import b\n", "b": 'ROW = "zenocap.c:ROW"\n', "c": "ROW = 1\n", "d": "ROW = 2\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text)
    before = Closure({"zenocap": tmp_path}).digest(["zenocap/a.py"])
    (tmp_path / f"{changed}.py").write_text(texts[changed] + "\n")
    assert (Closure({"zenocap": tmp_path}).digest(["zenocap/a.py"]) == before) == same


def test_a_digest_changes_with_the_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "SHARED", tmp_path)
    kind = replace(KIND, inputs=lambda one: (one.film,))
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "video.mp4").write_text(name)
    assert cache.digest(kind, case("one")) != cache.digest(kind, case("two"))
    assert cache.digest(kind, case("one")) == cache.digest(kind, case("one", size=3))


def test_a_case_runs_once() -> None:
    seeds = [case("film", size=3).of_seed(seed) for seed in range(2)]
    first = {done.case: done.figures for done in runs(KIND, seeds)}
    again = {done.case: done.figures for done in runs(KIND, [*seeds, case("film")])}
    assert again.items() > first.items()
    assert calls == [*seeds, case("film")]
    list(runs(KIND, seeds, fresh=True))
    assert len(calls) == 5


def test_what_is_timed_is_not_kept() -> None:
    for _ in range(2):
        list(runs(replace(KIND, timed=True), [case("film")]))
    assert len(calls) == 2


def test_a_case_that_fails_does_not_end_the_others_and_is_not_kept() -> None:
    found = list(runs(KIND, [case("broken"), case("film")]))
    assert "the film is broken" in found[0].problem
    assert found[1].figures["mm"] == 2.0
    assert cache.read(KIND, case("broken")) is None


def test_a_figure_without_a_column_is_an_error() -> None:
    (done,) = runs(replace(KIND, columns=(Quantity("mm"),)), [case("film")])
    assert "figures without a column: lost" in done.problem


def test_an_option_has_the_type_of_its_default() -> None:
    assert case("film", size=3).option("size", 1) == 3
    with pytest.raises(ValueError, match="film: size = 3: str expected"):
        case("film", size=3).option("size", "")


def test_equal_options_make_equal_cases() -> None:
    assert case("film", a=1, b=2) == case("film", b=2, a=1)
    assert hash(case("film", a=1)) == hash(case("film").with_options(a=1))


@pytest.mark.parametrize(
    ("column", "values", "expected"),
    [
        (Quantity("mm"), (1.0, 2.0, 6.0), [3.0, 6.0]),
        (Quantity("overlap", worst="low"), (0.5, 0.9), [0.7, 0.5]),
        (Quantity("ms", joined="median"), (1.0, 2.0, 9.0), [2.0, 9.0]),
        (Quantity("losses", joined="sum"), (1.0, 2.0), [3.0]),
        (Quantity("true", worst=""), (1.0, 3.0), [2.0]),
        (Quantity("mm"), (5.0,), [5.0]),
        (Quantity("mm"), (5.0, NAN, 7.0), [6.0, 7.0]),
        (Quantity("mm"), (NAN, NAN), [None]),
    ],
)
def test_seeds_make_one_figure_and_the_worst(column: Quantity, values: tuple[float, ...], expected: list[float]) -> None:
    assert column.summary(values) == pytest.approx(expected)


def test_seeds_without_a_figure_are_counted() -> None:
    row = results.summary("small", KIND, [{"mm": 1.0, "lost": 0.0}, {"lost": 100.0}, {"mm": 3.0, "lost": 0.0}], "")
    assert (row.figures["mm"], row.missing, row.seeds) == ([2.0, 3.0], {"mm": 1}, 3)
    page = pages.written("<!-- figure doubled small mm --><!-- end -->", {"doubled": results.results_of(KIND, [row])})
    assert page == "<!-- figure doubled small mm -->2.0 (3.0) [1 of 3 without]<!-- end -->"


def row_of(name: str, mm: float, **changes: str) -> results.Row:
    return results.Row(name, {"mm": [mm, mm + 1]}, 3, "abc", "2026-01-01", "python -m benchmarks doubled", **changes)


def test_a_row_replaces_that_of_the_same_case_and_machine(folder: Path) -> None:
    results.store(KIND, [row_of("large", 20.0), row_of("small", 2.0), row_of("small", 9.0, machine="other")])
    results.store(KIND, [row_of("small", 3.0)])
    found = results.load(folder / "doubled.json")
    assert [(row.case, row.figures["mm"][0], row.machine) for row in found.figures] == [
        ("small", 9.0, "other"), ("small", 3.0, ""), ("large", 20.0, ""),
    ]  # fmt: skip
    results.store(replace(KIND, cases={"large": case("film")}), [])
    assert [row.case for row in results.load(folder / "doubled.json").figures] == ["large"]


def test_rows_whose_sources_have_changed_since_are_listed(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    row = results.summary("small", KIND, [{"mm": 1.0, "lost": 0.0}], cache.source_digest(KIND, KIND.cases["small"]))
    measured = f"commit {row.commit}, {row.date}"

    def listed() -> list[str]:
        assert program.main(["--stale"]) == 0
        return capsys.readouterr().out.splitlines()

    results.store(KIND, [row, row_of("large", 20.0)])
    before = "doubled: large: before digests: commit abc, 2026-01-01"
    assert listed() == [before]
    changed = [f"doubled: small: sources changed since {measured}", before]
    with monkeypatch.context() as patch:
        patch.setattr(cache, "module_digest", lambda module: "other")
        assert listed() == changed
    for kind in (
        replace(KIND, cases={"small": case("film", size=2)}),
        replace(KIND, columns=(Quantity("mm", "mm", joined="median"),)),
        replace(KIND, cases={}),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(_Table, "row", lambda _, name, kind=kind: kind)
            assert listed() == changed
    assert listed() == [before]
    assert calls == []


def test_published_pages_do_not_make_a_checkout_dirty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def git(*arguments: str) -> None:
        subprocess.run(["git", "-c", "user.name=x", "-c", "user.email=x", *arguments], cwd=tmp_path, check=True)

    monkeypatch.setattr(results, "ROOT", tmp_path)
    assert results.commit() == ""
    for name in ("docs/page.md", "code.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("before\n")
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "one")
    clean = results.commit()
    (tmp_path / "docs" / "page.md").write_text("after\n")
    assert results.commit() == clean != ""
    (tmp_path / "code.py").write_text("after\n")
    assert results.commit() == f"{clean}-dirty"


def test_kinds_without_results_are_named() -> None:
    page = pages.written("<!-- kinds unmeasured --><!-- end -->", {})
    assert "`chaos`, `faults`" in page.replace("\n", " ")
    found = {"chaos": results.results_of(KIND, [])}
    assert "`chaos`" not in pages.written("<!-- kinds unmeasured --><!-- end -->", found)
    with pytest.raises(UserError, match="page: <!-- kinds all -->: `unmeasured` expected"):
        pages.written("<!-- kinds all --><!-- end -->", {}, "page")


def test_a_full_name_chooses_only_that_case() -> None:
    kind = replace(KIND, cases={name: case(name) for name in ("paper", "paper, large", "improved, large")})
    assert list(kind.selected(["paper"])) == ["paper"]
    assert list(kind.selected(["large"])) == ["paper, large", "improved, large"]
    assert list(kind.selected(["paper", "impr"])) == ["paper", "improved, large"]


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "doubled.json"
    path.write_text('{"kind": "doubled", "figures": [')
    with pytest.raises(UserError, match=r"doubled\.json: no results of a benchmark"):
        results.load(path)


def test_a_table_has_a_row_a_case_and_says_where_its_figures_come_from() -> None:
    later = msgspec.structs.replace(row_of("large", 20.0), commit="def")
    found = {"doubled": results.results_of(KIND, [row_of("small", 2.0), later])}
    page = pages.written("<!-- table doubled mm --><!-- end -->", found)
    assert page.splitlines()[1:5] == ["| case | mm, mm |", "|---|--:|", "| small | 2.0 (3.0) |", "| large | 20.0 (21.0) |"]
    assert "*`python -m benchmarks doubled`, commit abc, 2026-01-01, 3 seeds (1 row).*" in page
    assert "*`python -m benchmarks doubled`, commit def, 2026-01-01, 3 seeds (1 row).*" in page
    assert "| small |" not in pages.written("<!-- table doubled rows=lar --><!-- end -->", found)


def test_one_column_of_a_table_goes_across() -> None:
    rows = [row_of(name, mm) for name, mm in (("a, b, x", 1.0), ("a, b, y", 2.0), ("c, y", 3.0), ("alone", 4.0))]
    page = pages.written("<!-- table doubled mm across --><!-- end -->", {"doubled": results.results_of(KIND, rows)})
    assert page.splitlines()[1:5] == [
        "| case: mm, mm | x | y |", "|---|--:|--:|", "| a, b | 1.0 (2.0) | 2.0 (3.0) |", "| c |  | 3.0 (4.0) |",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("marker", "text"),
    [
        ("figure doubled large mm", "not measured yet"),
        ("table doubled mm rows=lar", "\n*Not measured yet: `python -m benchmarks doubled`.*\n"),
    ],
)
def test_what_a_kind_has_not_measured_is_said(marker: str, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "KINDS", _Table())
    for found in ({}, {"doubled": results.results_of(KIND, [row_of("small", 2.0)])}):
        assert pages.written(f"<!-- {marker} --><!-- end -->", found) == f"<!-- {marker} -->{text}<!-- end -->"


@pytest.mark.parametrize(
    ("marker", "problem"),
    [
        ("figure halved small mm", "no results of 'halved': allowed: doubled"),
        ("figure doubled huge mm", "no result of 'huge': allowed: small"),
        ("figure doubled small cm", "no column 'cm': allowed: mm, lost"),
        ("figure doubled small", "KIND CASE COLUMN expected"),
        ("table doubled rows=huge", "no result of huge"),
        ("table doubled rows=(", "unterminated subpattern"),
        ("table doubled across", "across: one COLUMN expected"),
    ],
)
def test_a_wrong_marker_is_named_with_its_page(marker: str, problem: str) -> None:
    found = {"doubled": results.results_of(KIND, [row_of("small", 2.0)])}
    with pytest.raises(UserError) as error:
        pages.written(f"<!-- {marker} --><!-- end -->", found, "page.md")
    assert str(error.value).startswith(f"page.md: <!-- {marker} -->: ")
    assert problem in str(error.value)


@pytest.mark.slow  # two processes are started
def test_publishing_stores_the_figures_and_writes_the_pages(folder: Path) -> None:
    assert program.main(["doubled", "--publish"]) == 0
    (page,) = pages.pages()
    assert page.read_text() == 'Twice is <!-- figure doubled "small" mm -->3.0 (4.0)<!-- end -->.\n'
    assert list(pages.stale(results.load_all())) == []
    row = results.load(folder / "doubled.json").row("small")
    assert (row.seeds, row.command) == (3, "python -m benchmarks doubled")
    assert row.sources == cache.source_digest(KIND, KIND.cases["small"])
    page.write_text(page.read_text().replace("3.0", "1.0"))
    assert [stale for stale, _ in pages.stale(results.load_all())] == [page]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ("halved", "'halved': allowed: doubled"),
        ("doubled --only huge", "--only 'huge': allowed: a part of small, large"),
        ("doubled --seeds 2 --publish", "--seeds 2 with --publish: allowed: 3 and more"),
    ],
)
def test_a_wrong_command_says_what_is_allowed(
    words: str, problem: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert program.main(words.split()) == 1
    assert problem in capsys.readouterr().err
    assert not folder.exists()


@pytest.mark.parametrize("words", ["", "doubled --small --publish", "--pictures nothing"])
def test_a_command_that_cannot_be_parsed_ends_with_2(words: str, folder: Path) -> None:
    with pytest.raises(SystemExit) as ended:
        program.main(words.split())
    assert ended.value.code == 2


def test_missing_inputs_skip_a_case_and_a_named_kind_without_any_has_failed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(_Table, "row", lambda _, name: replace(KIND, inputs=lambda _: ("clips/none",)))
    assert program.main(["all"]) == 0
    assert program.main(["doubled"]) == 1
    assert "doubled: small: skipped: clips/none missing" in capsys.readouterr().out
    assert calls == []


def test_kinds_and_cases_are_listed_and_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main(["--list"]) == 0
    assert capsys.readouterr().out.splitlines() == ["doubled: Twice the size.", "    small", "    large"]
    assert program.main(["all", "--only", "large", "--seeds", "1"]) == 0
    assert "20.0" in capsys.readouterr().out


@pytest.mark.parametrize(("most", "status", "word"), [(22.0, 0, "yes"), (21.0, 1, "NO")])
def test_a_limit_that_one_seed_breaks_is_named_and_fails(
    most: float, status: int, word: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def limited(one: Case) -> Figures:
        return doubled(one) | {"holds": doubled(one)["mm"] <= most}

    kind = replace(KIND, run=limited, columns=(*KIND.columns, Quantity("holds", worst="low")), timed=True)
    monkeypatch.setattr(_Table, "row", lambda _, name: kind)
    assert program.main(["doubled", "--only", "large"]) == status
    text, error = capsys.readouterr()
    assert f" {word} " in text
    assert error == ("doubled: large: a limit does not hold\n" if status else "")
