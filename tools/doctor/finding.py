"""Result of a check."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "warning", "wrong"]


@dataclass(frozen=True)
class Finding:
    """check: title of the check.  words: result as text.  remedy: recommended action; empty when nothing is wrong."""

    check: str
    verdict: Verdict
    words: str
    remedy: str = ""


def ok(check: str, words: str) -> Finding:
    return Finding(check, "ok", words)


def warning(check: str, words: str, remedy: str) -> Finding:
    return Finding(check, "warning", words, remedy)


def wrong(check: str, words: str, remedy: str) -> Finding:
    return Finding(check, "wrong", words, remedy)
