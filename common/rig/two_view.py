"""Variants of the two-view method: as printed, or with additions that are switches."""

from collections.abc import Sequence

VARIANTS = ("improved", "paper")

# Name: what it adds, and to which section of [Two-view].  Two others were measured with motion capture and removed:
# `prediction`, which continued the last motion (26.3 degrees without it, 28.4 with it), and `draws` (25.2 and 25.4).
ADDITIONS = {
    "body": "2.4: widths measured in bands of the body and anthropometric proportions, instead of shares of the torso",
    "proportions": "2.4: torso : leg = 37 : 63 by anthropometry, instead of 4 : 6; the addition body has its own",
    "perspective": "3.2: the model is drawn in perspective, instead of orthographically and scaled by r_t",
    "position": "3.2: repeated shifts of a model without arms from coarse to fine, Y from both viewers",
    "tilt": "3: lean and roll of the torso, which the paper keeps upright",
    "turn": "3.1: continuous turn of the body, instead of quarter turns when facade and flank change",
    "toes": "5.2: front and back distinguished by the feet and the walking direction",
    "directions": "3.3, 3.4: limbs turn about the view axis and slant out of the image, instead of about X_N and Z_N",
    "hypotheses": "3.3, 3.4: both viewers score the same limb directions, and the searches start from the best",
    "exchange": "3.4: legs that crossed are exchanged",
    "restart": "3.3, 3.4: limbs are also searched from the hanging arm, and all around when the score falls",
    "merging": "4.4: limb directions of both views weighted by visibility, instead of each angle from one view",
}
Additions = frozenset[str]
PAPER: Additions = frozenset()
IMPROVED: Additions = frozenset(ADDITIONS)


def additions_of(variant: str, added: Sequence[str], without: Sequence[str]) -> Additions:
    """Additions in use.  added: to the variant paper.  without: left out of the variant improved.

    Raises ValueError, whose text starts with the key and contains value and allowed values.
    """
    if variant not in VARIANTS:
        raise ValueError(f"variant = {variant!r}: allowed: {', '.join(VARIANTS)}")
    for key, names, of in (("additions", added, "paper"), ("without", without, "improved")):
        if names and variant != of:
            raise ValueError(f"{key} = {list(names)!r}: allowed: only with variant = {of!r}")
        for name in names:
            if name not in ADDITIONS:
                raise ValueError(f"{key}: {name!r}: allowed: {', '.join(ADDITIONS)}")
    return PAPER | set(added) if variant == "paper" else IMPROVED - set(without)
