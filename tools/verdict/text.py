"""Lines of text for a verdict: of `zenocap track` and `zenocap info`."""

from collections.abc import Iterator
from itertools import groupby

from zenocap.common import messages as m
from zenocap.common.runtime.foreign_text import printable

MAX_REASON = 1000  # characters, as in the message
SHOWN_PARTS = 10  # of a take that are less than good
EVIDENCE = {
    "both-ways": "poses of both passes, silhouettes",
    "one-pass": "poses of one pass, silhouettes",
    "two-view": "poses of two-view, silhouettes",
    "poses-only": "poses alone",
    "none": "nothing",
}


def verdict_lines(verdict: m.Verdict) -> Iterator[str]:
    """The class with the expected error, and a line for every reason."""
    if verdict.evidence == "none":
        yield f"verdict: {verdict.rating}"
    else:
        yield f"verdict: {verdict.rating}: expected error of the joints {1000 * verdict.error:.0f} mm"
    for reason in verdict.reasons:
        yield f"  {printable(reason.text, MAX_REASON)}"


def part_lines(verdict: m.Verdict, start_ns: int) -> Iterator[str]:
    """A line for every part of a take that is less than good.  start_ns: of the take, from which seconds count."""
    parts = []
    for (rating, reasons), group in groupby(verdict.stretches, key=lambda one: (one.rating, tuple(one.reasons[:2]))):
        stretches = list(group)
        if rating != "good":
            error = sum(one.error for one in stretches) / len(stretches)
            times = f"{(stretches[0].start_ns - start_ns) / 1e9:7.1f} to {(stretches[-1].end_ns - start_ns) / 1e9:.1f} s"
            parts.append(f"{times}: {rating}, {1000 * error:.0f} mm: {', '.join(reasons) or '-'}")
    yield from parts[:SHOWN_PARTS]
    if len(parts) > SHOWN_PARTS:
        yield f"  and {len(parts) - SHOWN_PARTS} more parts: --json"
