"""What a check finds."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "warning", "wrong"]


@dataclass(frozen=True)
class Finding:
    """check: what was looked at.  words: how it is.  remedy: what to do; empty where all is well."""

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
