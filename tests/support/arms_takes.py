"""Takes of a simulated person who raises both arms once, kept on disk."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.stored import stored_files
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import Actor
from zenocap.common.rig.tracker import TrackerOverrides
from zenocap.tools.takes.both_ways import add_both_ways, track_both_ways
from zenocap.tools.takes.rig_changes import with_tracker
from zenocap.tools.takes.track import track

SOURCES = (__name__, "zenocap.tools.takes.both_ways")
TAKE = "take.mcap"


def arms_rig() -> Rig:
    rig = demo_rig()
    return replace(rig, viewers=tuple(replace(viewer, source=Actor("raise-both-arms", 3)) for viewer in rig.viewers))


def forward_take(folder: Path) -> Path:
    """Tracked forwards only."""
    return _kept(folder, "forward", lambda path: track(arms_rig(), path))


def both_ways_take(folder: Path) -> Path:
    """The same film tracked both ways, from the take of the forward pass."""

    def make(take: Path) -> None:
        with TemporaryDirectory() as place:
            shutil.copy(forward_take(Path(place) / "forward"), take)
        add_both_ways(arms_rig(), take)

    return _kept(folder, "both ways", make)


def reversed_take(folder: Path) -> Path:
    """The same film tracked both ways from the wrong heading."""
    wrong = with_tracker(arms_rig(), TrackerOverrides(heading=180.0))
    return _kept(folder, "reversed", lambda path: track_both_ways(wrong, path))


def _kept(folder: Path, name: str, make: Callable[[Path], object]) -> Path:
    folder.mkdir(parents=True)
    return stored_files(folder, lambda place: make(place / TAKE), "arms", name, sources=SOURCES) / TAKE
