"""What a viewer says is checked as it comes: a part that fits no body must not wait for its pair, nor spoil it."""

from common.body.anatomy import Anatomy
from common.body.proportions import FRONT_LENGTHS, SIDE_LENGTHS
from common.conversion import angles_of
from common.messages import PartialBap, PartialBdp


def check(anatomy: Anatomy, message: PartialBdp | PartialBap) -> None:
    """Raises ValueError for joint angles of another anatomy, and for other lengths than this side of a body has."""
    match message:
        case PartialBap():
            angles_of(anatomy, message.angles, anatomy.neutral)
        case PartialBdp():
            expected = FRONT_LENGTHS if message.side == "front" else SIDE_LENGTHS
            if message.lengths.keys() != set(expected) or min(message.lengths.values()) <= 0:
                found = ", ".join(f"{name} {length:g}" for name, length in sorted(message.lengths.items())) or "none"
                raise ValueError(f"lengths of the {message.side}, metres: {found}; expected above 0: {', '.join(expected)}")
