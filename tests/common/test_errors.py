"""Errors that a user can put right."""

from pathlib import Path

import pytest

from zenocap.common.errors import UserError, reading


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (FileNotFoundError(2, "No such file or directory"), "No such file or directory"),
        (OSError("the lens is gone"), "the lens is gone"),
    ],
    ids=["with a number", "with a text only"],
)
def test_an_unreadable_file_is_an_error_that_names_it_and_the_reason(error: OSError, reason: str) -> None:
    with pytest.raises(UserError, match=f"^a.toml: cannot be read: {reason}$"), reading(Path("a.toml")):
        raise error


def test_other_errors_of_reading_stay_what_they_are() -> None:
    with pytest.raises(UserError, match=r"^a\.toml: too long$"), reading(Path("a.toml")):
        raise UserError("a.toml: too long")
