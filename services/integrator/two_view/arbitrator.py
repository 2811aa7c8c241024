"""Facade/flank arbitration between the two viewers.  [Two-view 4.3]"""

from dataclasses import dataclass
from typing import Literal

View = Literal["facade", "flank"]


@dataclass(frozen=True)
class Claim:
    """View decision of one viewer: view before, own decision, upper-body width and thresholds (in one unit)."""

    before: View
    own: View
    width: float
    low: float
    high: float

    @property
    def changes(self) -> bool:
        """True when the viewer decides for another view than before."""
        return self.own != self.before


def arbitrate(first: Claim, second: Claim) -> tuple[View, View]:
    """Views of viewer 1 and 2: always one facade and one flank.

    When one viewer changes, the change holds if it is further past its threshold than the other viewer is from its own:
    cases 1 to 4 of the paper, symmetric in the viewers.  Two changes to opposite views hold.
    """
    # Paper (open): 4.3 does not define changes of both; both hold, as the views are then opposite again.
    if first.changes == second.changes:
        if first.own != second.own:
            return first.own, second.own
        return first.before, second.before
    changing, staying = (first, second) if first.changes else (second, first)
    winner = changing.own != staying.own or _passed(changing) > _margin(staying)
    moved = changing.own if winner else changing.before
    other: View = "flank" if moved == "facade" else "facade"
    return (moved, other) if first.changes else (other, moved)


def _passed(claim: Claim) -> float:
    """Distance of the changing viewer past the threshold it crossed."""
    return abs(claim.width - (claim.high if claim.own == "facade" else claim.low))


def _margin(claim: Claim) -> float:
    """Distance of the staying viewer from the threshold that it would cross."""
    return abs(claim.width - (claim.low if claim.own == "facade" else claim.high))
