"""Facade/flank arbitration between the two viewers.  [Two-view 4.3]"""

from dataclasses import dataclass
from typing import Literal

View = Literal["facade", "flank"]


@dataclass(frozen=True)
class Claim:
    """What one viewer says: its view until now, its own new view, its upper-body width and thresholds (one unit)."""

    before: View
    own: View
    width: float
    low: float
    high: float

    @property
    def changes(self) -> bool:
        return self.own != self.before


def arbitrate(first: Claim, second: Claim) -> tuple[View, View]:
    """The views of viewer 1 and 2: always one facade and one flank.

    When one viewer changes and the other does not, the changing one wins if it is further past its threshold than the
    staying one is from the threshold that it would have to cross: the paper's cases 1 to 4, which do not depend on who is
    called viewer 1.  Both changing at once to opposite views agree; both changing to the same view is what the paper
    leaves open, and nothing changes.
    """
    if first.changes == second.changes:
        if first.own != second.own:
            return first.own, second.own
        return first.before, second.before
    mover, stayer = (first, second) if first.changes else (second, first)
    wins = mover.own != stayer.own or _passed(mover) > _short(stayer)
    moved = mover.own if wins else mover.before
    other: View = "flank" if moved == "facade" else "facade"
    return (moved, other) if first.changes else (other, moved)


def _passed(claim: Claim) -> float:
    """How far the changing viewer is past the threshold it crossed."""
    return abs(claim.width - (claim.high if claim.own == "facade" else claim.low))


def _short(claim: Claim) -> float:
    """How far the staying viewer is from the threshold that it would cross."""
    return abs(claim.width - (claim.low if claim.own == "facade" else claim.high))
