"""Take of a simulated person who performs three postures three times."""

from pathlib import Path

from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.teach.dataset.generate import dataset_rig, generate_take

NAMES = ("raise-right-arm", "squat", "kick-left")
REPETITIONS = 3
PAUSE_S = 1.0


def posture_timeline(seed: int = 7) -> MotionTimeline:
    """Time line of the take."""
    movements = [(name, number) for number in range(REPETITIONS) for name in NAMES]
    movements += [("reach", 0)]
    return session_timeline(person(seed), movements, [PAUSE_S] * len(movements), seed)


def posture_spans(seed: int = 7) -> list[tuple[str, float, float]]:
    """Name, begin and end (s) of each posture."""
    return [(one.name, one.start_s, one.end_s) for one in posture_timeline(seed).segments if one.name in NAMES]


def posture_take(path: Path, seed: int = 7) -> Path:
    """Write the take, of true poses."""
    generate_take(dataset_rig("truth"), "truth", posture_timeline(seed), 0, path)
    return path
