"""Validation of received partial BDPs and BAPs, before they wait for their pair."""

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.proportions import FRONT_LENGTHS, PAPER_FRONT_LENGTHS, PAPER_SIDE_LENGTHS, SIDE_LENGTHS
from zenocap.common.conversion import angles_of
from zenocap.common.messages import PartialBap, PartialBdp
from zenocap.common.rig.two_view import Additions


def validate(anatomy: Anatomy, message: PartialBdp | PartialBap, additions: Additions) -> None:
    """Raise ValueError for joint angles of another anatomy, and for lengths other than those of this side."""
    match message:
        case PartialBap():
            angles_of(anatomy, message.angles, anatomy.neutral)
        case PartialBdp():
            names = (FRONT_LENGTHS, SIDE_LENGTHS) if "body" in additions else (PAPER_FRONT_LENGTHS, PAPER_SIDE_LENGTHS)
            expected = names[message.side == "side"]
            if message.lengths.keys() != set(expected) or min(message.lengths.values()) <= 0:
                found = ", ".join(f"{name} {length:g}" for name, length in sorted(message.lengths.items())) or "none"
                raise ValueError(f"lengths of the {message.side}, metres: {found}; expected above 0: {', '.join(expected)}")
