"""Priors to track with: those that come with the project, and those learnt here from motion, never from the clip's own."""

import hashlib
import re
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from common.body.coordinates import coordinates_of
from services.tracker.motions import Motion, read_motion
from services.tracker.prior.file import write_prior
from services.tracker.prior.ship import PEOPLE, recording
from services.tracker.prior.shipped import find_prior
from services.tracker.prior.training import Plan, Recording, train
from tests.evaluation.hybrid.runs import ANATOMY
from tests.evaluation.hybrid.silhouettes import ROOT

TRAINING_CODE = ("services/tracker/prior", "services/tracker/motions.py", "common/body")
TAKE_FRAMES = 100  # of the same take's truth, as the paper has it; half of a shorter one
WALKS = ("cmu_02_02", "cmu_07_01", "cmu_07_02", "cmu_07_03", "cmu_07_04", "cmu_07_05", "cmu_07_06")
KICKS = ("cmu_10_01",)
KINDS = {
    "walk7": "walking",
    "jog7": "running",
    "box7": "boxing",
    "walk2": "walking",
    "bend2": "general",
    "kick2": "general",
}


@dataclass(frozen=True)
class Priors:
    """clips, motions: folders that are read.  kept: gets what is learnt.

    A prior is named `walking` (one that comes with the project), `motion:cmu_02_02+cmu_07_01` (learnt from those),
    `take:walk7/100` (from the first frames of motion of that clip's truth) or `actor:walking` (from the synthetic actor, as
    those that come with the project); with `@M` for so many regions.
    """

    clips: Path
    motions: Path
    kept: Path

    def path(self, name: str) -> Path:
        """Its file, learnt now if it was not before.  Raises PriorError, MotionError and FormatError."""
        if ":" not in name:
            return find_prior(name)
        told = hashlib.sha256(name.encode())
        for place in TRAINING_CODE:
            path = ROOT / place
            for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
                told.update(file.read_bytes())
        path = self.kept / f"{re.sub('[:+/]', '-', name)[:60]}-{told.hexdigest()[:12]}.prior"
        if not path.is_file():
            self.kept.mkdir(parents=True, exist_ok=True)
            print(f"  learning {name}", flush=True)
            self._learn(name, path)
        return path

    def _learn(self, name: str, path: Path) -> None:
        text, _, regions = name.partition("@")
        kind, _, names = text.partition(":")
        recordings = self._recordings(kind, names)
        plan = Plan(rate=recordings[0].rate)
        if regions:
            plan = replace(plan, regions=int(regions), candidates=(int(regions),))
        write_prior(path, train(coordinates_of(ANATOMY), recordings, [], plan))

    def _recordings(self, kind: str, names: str) -> list[Recording]:
        match kind:
            case "actor":
                return [recording(names, person) for person in PEOPLE]
            case "take":
                motions = [self._take(names)]
            case "motion":
                motions = [read_motion(self.motions / f"{name}.bvh", ANATOMY) for name in names.split("+")]
            case _:
                raise ValueError(f"prior {kind}:{names}: allowed: actor:KIND, motion:NAME+NAME, take:CLIP/FRAMES")
        return [Recording(motion.name, motion.rate, motion.coordinates) for motion in motions]

    def _take(self, name: str) -> Motion:
        clip, _, frames = name.partition("/")
        first = int(tomllib.loads((self.clips / clip / "clip.toml").read_text())["motion_from_frame"])
        return read_motion(self.clips / clip / "truth.trc", ANATOMY, range(first, first + int(frames)))


def taken_frames(motion_frames: int) -> int:
    """How many frames of a take are learnt from, so that there are others to score."""
    return min(TAKE_FRAMES, motion_frames // 2)


def another_take(clip: str, motion: str) -> str | None:
    """The prior of other takes of a clip's kind of motion; None where the motions have but the one that drove it.

    motion: the file that drove the clip, of which nothing is learnt.
    """
    takes = {"walk7": WALKS, "walk2": WALKS, "kick2": KICKS}.get(clip, ())
    own = "cmu_" + motion.removesuffix(".bvh").removeprefix("0")
    others = [name for name in takes if name != own]
    return "motion:" + "+".join(others) if others else None
