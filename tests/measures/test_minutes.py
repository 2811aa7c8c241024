"""Table of minutes in CONTRIBUTING.md: the stored results."""

import json

import pytest

from tests.measures.minutes import BEGIN, END, PAGE, RESULTS, parts_of, with_table


def row(case: str, seconds: float, commit: str = "b", **fields: object) -> dict[str, object]:
    return {"case": case, "seconds": seconds, "commit": commit, "load": False, "status": 0, **fields}


def test_the_page_shows_the_stored_results() -> None:
    page = PAGE.read_text()
    assert with_table(page, json.loads(RESULTS.read_text())) == page


def test_medians_of_the_last_commit_are_shown() -> None:
    rows = [
        row("test", 6000, "a"), row("test", 60), row("test", 120), row("test", 600), row("test", 300, "a", load=True),
        row("test", 6000, status=1), row("test-unit", 30, "a"),
    ]  # fmt: skip
    page = with_table(f"before\n{BEGIN}old\n{END}after\n", rows)
    assert page.startswith(f"before\n{BEGIN}| ")
    assert page.endswith(f"|\n{END}after\n")
    assert "| `make test` | 2.0 | 3, b | 5.0 | 1, a |\n" in page
    assert "| `make test-unit` | 0.5 | 1, a |  |  |\n" in page
    assert "old" not in page


def test_parts_end_with_their_first_line() -> None:
    lines = [
        (1.0, "Setting up .venv (once) ...\n"), (11.0, "compiling tracker (first run only) ...\n"), (21.0, "compiling\n"),
        (60.0, "compiled in 49 s\n"), (70.0, " 9 s | tracking | frame 3: searching for the person\n"),
        (75.0, "14 s | tracking | frame 80: right arm 5°\n"), (80.0, "15 s | tracking | frame 95: right arm 6°\n"),
    ]  # fmt: skip
    assert parts_of(lines) == {"packages": 11.0, "kernels": 60.0, "first pose": 75.0}


def test_a_page_without_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="are missing"):
        with_table("text", [])
