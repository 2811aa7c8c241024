"""Result of a check."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "warning", "wrong"]


@dataclass(frozen=True)
class CheckResult:
    """check: title of the check.  words: result as text.  remedy: recommended action; empty when nothing is wrong."""

    check: str
    verdict: Verdict
    words: str
    remedy: str = ""


def ok(check: str, words: str) -> CheckResult:
    return CheckResult(check, "ok", words)


def warning(check: str, words: str, remedy: str) -> CheckResult:
    return CheckResult(check, "warning", words, remedy)


def wrong(check: str, words: str, remedy: str) -> CheckResult:
    return CheckResult(check, "wrong", words, remedy)
