"""Priors of the evaluation: shipped ones, and ones trained here, never on the motion of the evaluated clip."""

import hashlib
import re
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.hybrid.runs import ANATOMY
from benchmarks.hybrid.silhouettes import ROOT
from benchmarks.simulated_clip import cycle_clip
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.services.tracker.prior.file import find_prior, write_prior
from zenocap.services.tracker.prior.motions import Motion, motion_of, read_motion
from zenocap.services.tracker.prior.training import Plan, Recording, train
from zenocap.tools.dataset.build_priors import PEOPLE, recording

TRAINING_CODE = ("services/tracker/prior", "common/body")
TAKE_FRAMES = 100  # of the same take's ground truth, as in the paper; half of a shorter take
WALKS = ("cmu_02_02", "cmu_07_01", "cmu_07_02", "cmu_07_03", "cmu_07_04", "cmu_07_05", "cmu_07_06")
KICKS = ("cmu_10_01",)
KINDS = {
    "walk7": "walking",
    "jog7": "running",
    "box7": "boxing",
    "walk2": "walking",
    "bend2": "general",
    "kick2": "general",
    "turned2": "general",
    "jump2": "general",
}


@dataclass(frozen=True)
class Priors:
    """clips, motions: input folders.  trained: folder of trained priors.

    A prior is named `walking` (shipped), `motion:cmu_02_02+cmu_07_01` (trained on those), `take:walk7/100` (on the first
    frames of motion of that clip's ground truth) or `actor:walking` (on the simulated person, as the shipped ones); with
    `@M` for a number of regions.
    """

    clips: Path
    motions: Path
    trained: Path

    def path(self, name: str, anatomy: Anatomy = ANATOMY) -> Path:
        """File of a prior, trained now for the anatomy if it does not exist.  Raises UserError."""
        if ":" not in name:
            return find_prior(name)
        digest = hashlib.sha256(f"{name} {anatomy.name}".encode())
        for place in TRAINING_CODE:
            path = ROOT / place
            for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
                digest.update(file.read_bytes())
        path = self.trained / f"{re.sub('[:+/]', '-', name)[:60]}-{digest.hexdigest()[:12]}.prior"
        if not path.is_file():
            self.trained.mkdir(parents=True, exist_ok=True)
            print(f"  training {name}", flush=True)
            self._train(name, anatomy, path)
        return path

    def _train(self, name: str, anatomy: Anatomy, path: Path) -> None:
        text, _, regions = name.partition("@")
        kind, _, names = text.partition(":")
        recordings = self._recordings(kind, names, anatomy)
        plan = Plan(rate=recordings[0].rate)
        if regions:
            plan = replace(plan, regions=int(regions), candidates=(int(regions),))
        write_prior(path, train(coordinates_of(anatomy), recordings, [], plan))

    def _recordings(self, kind: str, names: str, anatomy: Anatomy) -> list[Recording]:
        match kind:
            case "actor":
                return [recording(names, person, anatomy) for person in PEOPLE]
            case "take":
                motions = [self._take(names, anatomy)]
            case "motion":
                motions = [read_motion(self.motions / f"{name}.bvh", anatomy) for name in names.split("+")]
            case _:
                raise ValueError(f"prior {kind}:{names}: allowed: actor:KIND, motion:NAME+NAME, take:CLIP/FRAMES")
        return [Recording(motion.name, motion.rate, motion.coordinates) for motion in motions]

    def _take(self, name: str, anatomy: Anatomy) -> Motion:
        clip, _, frames = name.partition("/")
        if not (self.clips / clip).is_dir():
            film = cycle_clip(clip)
            rows = film.truth.points[(film.truth.frames >= film.motion_from)][: int(frames)]
            centres = {joint: rows[:, k] for k, joint in enumerate(film.truth.names)}
            return motion_of(clip, film.truth.rate, anatomy, poses_from_centres(anatomy, centres))
        first = int(tomllib.loads((self.clips / clip / "clip.toml").read_text())["motion_from_frame"])
        return read_motion(self.clips / clip / "truth.trc", anatomy, range(first, first + int(frames)))


def training_frames(motion_frames: int) -> int:
    """Number of training frames of a take; the other frames are scored."""
    return min(TAKE_FRAMES, motion_frames // 2)


def another_take(clip: str, motion: str) -> str | None:
    """Prior of other takes of a clip's kind of motion; None without another take.

    motion: file that drove the clip, which is not used.
    """
    takes = {"walk7": WALKS, "walk2": WALKS, "kick2": KICKS}.get(clip, ())
    own = "cmu_" + motion.removesuffix(".bvh").removeprefix("0")
    others = [name for name in takes if name != own]
    return "motion:" + "+".join(others) if others else None
