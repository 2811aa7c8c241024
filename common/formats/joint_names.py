"""Names of joints and markers without side and spelling: `mixamorig:LeftUpLeg` is `L.upleg`."""

import re
from collections.abc import Mapping

# Names by role in the order of preference, without side, in lower case, letters only.
STEMS: Mapping[str, tuple[str, ...]] = {
    "Hip": ("upleg", "thigh", "upperleg", "femur", "hip"),
    "Knee": ("knee", "leg", "shin", "calf", "lowerleg", "lowleg", "tibia"),
    "Ankle": ("ankle", "foot"),
    "Shoulder": ("arm", "shldr", "upperarm", "uparm", "humerus", "shoulder"),
    "Elbow": ("elbow", "forearm", "lowerarm", "lowarm", "radius"),
    "Wrist": ("wrist", "hand"),
    "Toe": ("toebase", "toe", "toes", "ball", "foot"),
}
KNOWN = frozenset(stem for stems in STEMS.values() for stem in stems)
PREFIX = re.compile(r"^(.*:|mixamorig\d*_?|cc_base_|bip\d*[ _]|rl_|j_bip_(c_)?|def-)", re.IGNORECASE)
# Forms of a name with its side: LeftLeg, L_Leg, lLeg; LegLeft, Leg_L; Lleg.  The first whose rest is a stem counts.
SIDED = (
    re.compile(r"^(?P<side>(?i:left|right)|[LRlr](?=[A-Z _.\-]))[ _.\-]*(?P<rest>.*)$"),
    re.compile(r"^(?P<rest>.*?)[ _.\-]?(?P<side>(?i:left|right)|(?<=[ _.\-])[LRlr])$"),
    re.compile(r"^(?P<side>[LRlr])(?P<rest>[a-z].*)$"),
)


def plain_name(name: str) -> str:
    """Normalized name: `R.` or `L.` if it has a side, then the letters of the rest in lower case."""
    rest = name
    while (short := PREFIX.sub("", rest)) != rest:
        rest = short
    forms = [match for pattern in SIDED if (match := pattern.match(rest))]
    known = [match for match in forms if _letters(match["rest"]) in KNOWN]  # `leg` is not `eg` of the left side
    sure = [match for match in forms if match.re is not SIDED[2]]
    for match in (known or sure)[:1]:
        return f"{match['side'][0].upper()}.{_letters(match['rest'])}"
    return _letters(rest)


def _letters(name: str) -> str:
    return re.sub(r"[^a-z]", "", name.lower())
