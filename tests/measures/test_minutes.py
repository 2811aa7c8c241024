"""The table of minutes in CONTRIBUTING.md is that of the stored results, which hold medians of one commit."""

import json

import pytest

from tests.measures.minutes import BEGIN, END, PAGE, RESULTS, with_table


def row(case: str, seconds: float, commit: str = "b", **fields: object) -> dict[str, object]:
    return {"case": case, "seconds": seconds, "commit": commit, "load": False, "status": 0, **fields}


def test_the_page_shows_the_stored_results() -> None:
    page = PAGE.read_text()
    assert with_table(page, json.loads(RESULTS.read_text())) == page


def test_medians_of_the_last_commit_are_shown() -> None:
    rows = [
        row("test", 6000, "a"), row("test", 60), row("test", 120), row("test", 600), row("test", 300, load=True),
        row("test", 6000, status=1), row("test-unit", 30, "a"),
    ]  # fmt: skip
    page = with_table(f"before\n{BEGIN}old\n{END}after\n", rows)
    assert page.startswith(f"before\n{BEGIN}| ")
    assert page.endswith(f"|\n{END}after\n")
    assert "| `make test` | 2.0 | 5.0 | 4 | b |\n" in page
    assert "| `make test-unit` | 0.5 |  | 1 | a |\n" in page
    assert "old" not in page


def test_a_page_without_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="are missing"):
        with_table("text", [])
