"""A take of a simulated person who performs three postures three times, with pauses and one other movement."""

from pathlib import Path

from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import session_timeline
from zenocap.tools.dataset.generate import dataset_rig, generate_take

NAMES = ("raise-right-arm", "squat", "kick-left")
REPETITIONS = 3
PAUSE_S = 1.0


def posture_take(path: Path, seed: int = 7) -> Path:
    """Write the take, of true poses."""
    movements = [(name, number) for number in range(REPETITIONS) for name in NAMES]
    movements += [("reach", 0)]
    timeline = session_timeline(person(seed), movements, [PAUSE_S] * len(movements), seed)
    generate_take(dataset_rig("truth"), "truth", timeline, 0, path)
    return path
