"""A camera's faults as text for people, and the worst of them over a take."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault

SHORTEST_SHARE = 0.1  # of the reports of a camera, from which a fault counts for the whole take; chosen by hand
SHOWN = 3  # of the faults of a take; chosen by hand
LEAST_REPORTS = 3  # with the fault; chosen by hand
PARTS = {
    "": "the person",
    "upper": "the upper third of the person",
    "middle": "the middle third of the person",
    "lower": "the lower third of the person",
}


@dataclass(frozen=True)
class Wording:
    """short: for a table.  found: what was measured, with {value}, {limit} and {part}.  change: what to change."""

    short: str
    found: str
    change: str


WORDINGS: Mapping[AdviceCode, Wording] = {
    AdviceCode.CONTRAST: Wording(
        "contrast",
        "{part} differs from the room by only {value:.0f} levels of 255",
        "wear another colour than the wall and the floor behind, or hang up a cloth",
    ),
    AdviceCode.HOLES: Wording(
        "holes",
        "{value:.0f} % of the silhouette or more is missing in holes and cracks",
        "wear another colour than the room, light the room evenly, or use less compression",
    ),
    AdviceCode.GLOSSY_FLOOR: Wording(
        "glossy floor",
        "the silhouette contains the person's mirror image in the floor, in {value:.0f} % of the images",
        "lay a mat or carpet, or place the camera higher",
    ),
    AdviceCode.CUT_OFF: Wording(
        "cut off",
        "the border of the image cuts the person off in {value:.0f} % of the images",
        "turn or move the camera so that the whole person stays in the image",
    ),
    AdviceCode.SMALL: Wording(
        "small",
        "the person is only {value:.0f} px tall; from about {limit:.0f} px on it works",
        "move the camera nearer, zoom in, or use a larger working size",
    ),
    AdviceCode.LIGHT_DRIFT: Wording(
        "light drifts",
        "the brightness changed by {value:.0f} % within 10 s",
        "fix exposure and gain of the camera, and keep daylight out",
    ),
    AdviceCode.WHITE_BALANCE: Wording(
        "white balance", "the colours shifted by {value:.0f} % within 10 s", "fix the white balance of the camera"
    ),
    AdviceCode.FLICKER: Wording(
        "flicker",
        "the light flickers by {value:.1f} %",
        "set the exposure to a multiple of 1/100 s (mains of 50 Hz) or 1/120 s (60 Hz), or use other lamps",
    ),
    AdviceCode.DARK: Wording("dark", "the image is dark: mean level {value:.0f} of 255", "add light, or open the aperture"),
    AdviceCode.SATURATED: Wording(
        "saturated",
        "{value:.0f} % of the image is saturated",
        "shorten the exposure, lower the gain, or keep windows and lamps out of the image",
    ),
    AdviceCode.FOCUS: Wording(
        "focus",
        "the image is soft: its sharpest edges are {value:.1f} px wide",
        "focus the lens on the place of the person, then fix it",
    ),
    AdviceCode.MOTION_BLUR: Wording(
        "motion blur",
        "what moves is blurred over {value:.1f} % of the person's height",
        "shorten the exposure, and add light for it",
    ),
    AdviceCode.OCCUPIED: Wording(
        "not empty",
        "a person is in {value:.0f} % of the images that should show the empty scene; left out where enough show none",
        "give a time before a person enters (empty_seconds, --empty-seconds), or leave the scene empty for longer",
    ),
    AdviceCode.UNCOVERED: Wording(
        "not empty",
        "a person or thing stood in what was learnt as empty, and left a place that {value:.0f} % of the images show",
        "film the scene without a person first, or leave it all the time to background = adaptive",
    ),
    AdviceCode.PEOPLE: Wording(
        "two people",
        "a second person, or another thing at least half as tall, is in {value:.0f} % of the images",
        "one person at a time: poses are those of one",
    ),
}


def found_text(fault: CameraFault) -> str:
    """Text of the measurement."""
    return WORDINGS[fault.code].found.format(value=fault.value, limit=fault.limit, part=PARTS[fault.part])


def change_text(fault: CameraFault) -> str:
    """Text of the remedy."""
    return WORDINGS[fault.code].change


def sentence(fault: CameraFault) -> str:
    """Measurement and remedy, in one sentence without a stop."""
    return f"{found_text(fault)}: {change_text(fault)}"


def marks(advice: CameraAdvice) -> str:
    """Names of the faults in few words, such as `focus, holes`; empty without any."""
    return ", ".join(dict.fromkeys(WORDINGS[fault.code].short for fault in advice.faults))


def severity(fault: CameraFault) -> float:
    """Ratio of a value to its limit, 1 or more."""
    large, small = max(abs(fault.value), abs(fault.limit)), min(abs(fault.value), abs(fault.limit))
    return large / max(small, 1e-3 * large, 1e-9)


@dataclass(frozen=True)
class TakeFault:
    """A fault of one camera over a take.  fault: with the median value.  share: of the reports that have it, 0 to 1."""

    viewer: str
    fault: CameraFault
    share: float


class TakeAdvice:
    """Collects the advice of all cameras of a take."""

    def __init__(self) -> None:
        self._reports: defaultdict[str, int] = defaultdict(int)
        self._found: defaultdict[tuple[str, AdviceCode, str], list[CameraFault]] = defaultdict(list)

    def add(self, advice: CameraAdvice) -> None:
        self._reports[advice.viewer] += 1
        for fault in advice.faults:
            self._found[advice.viewer, fault.code, fault.part].append(fault)

    def faults(self) -> list[TakeFault]:
        """Faults of more than a few moments, the worst first; of one code and camera the worst part only."""
        found: dict[tuple[str, AdviceCode], TakeFault] = {}
        for (viewer, code, _), every in self._found.items():
            share = len(every) / self._reports[viewer]
            if len(every) < LEAST_REPORTS or share < SHORTEST_SHARE:
                continue
            middle = sorted(every, key=lambda one: one.value)[len(every) // 2]
            one = TakeFault(viewer, middle, share)
            before = found.get((viewer, code))
            if before is None or _weight(one) > _weight(before):
                found[viewer, code] = one
        return sorted(found.values(), key=lambda one: (-_weight(one), one.viewer, one.fault.code))


def take_lines(faults: Sequence[TakeFault]) -> Iterator[str]:
    """A line for each of the worst faults of a take."""
    if faults:
        yield "cameras: what to improve first"
    for one in faults[:SHOWN]:
        yield f"  camera {one.viewer}: {sentence(one.fault)} ({one.share:.0%} of the time)"


def _weight(one: TakeFault) -> float:
    return one.share * severity(one.fault)
