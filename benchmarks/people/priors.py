"""Priors of the evaluation: shipped, or trained without the motion of the evaluated clip."""

from dataclasses import replace
from functools import partial

from benchmarks.harness.case import SHARED
from benchmarks.people.shared_clips import motion_from
from benchmarks.people.simulated_clips import cycle_clip
from benchmarks.people.tracker import ANATOMY
from tests.support.stored import stored
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.rig.tracker import find_prior
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.prior.motions import motion_of, read_motion
from zenocap.services.tracker.prior.sequences import TrainingMotion
from zenocap.services.tracker.prior.training import TrainingPlan, train
from zenocap.tools.teach.dataset.build_priors import PEOPLE, recording

TAKE_FRAMES = 100  # of the same take's ground truth, as in the paper; half of a shorter take
KINDS = {"walk7": "walking", "jog7": "running", "box7": "boxing", "walk2": "walking"} | dict.fromkeys(
    ("bend2", "kick2", "turned2", "jump2"), "general"
)


def prior_named(name: str, anatomy: Anatomy = ANATOMY) -> Prior | None:
    """A prior, trained now for the anatomy where it is not shipped; None for no name.  Raises UserError.

    A prior is named `walking` (shipped), `motion:cmu_02_02+cmu_07_01` (trained on those), `take:walk7/100` (on the first
    frames of motion of that clip's ground truth) or `actor:walking` (on the simulated person, as the shipped ones); with
    `@M` for a number of regions.
    """
    if ":" not in name:
        return read_prior(find_prior(name), anatomy) if name else None
    return stored(
        partial(_trained, name, anatomy), name, anatomy.name, sources=(__name__, "zenocap.tools.teach.dataset.build_priors")
    )


def _trained(name: str, anatomy: Anatomy) -> Prior:
    text, _, regions = name.partition("@")
    kind, _, names = text.partition(":")
    recordings = _recordings(kind, names, anatomy)
    plan = TrainingPlan(rate=recordings[0].rate)
    if regions:
        plan = replace(plan, regions=int(regions), candidates=(int(regions),))
    return train(coordinates_of(anatomy), recordings, [], plan)


def _recordings(kind: str, names: str, anatomy: Anatomy) -> list[TrainingMotion]:
    match kind:
        case "actor":
            return [recording(names, person, anatomy) for person in PEOPLE]
        case "take":
            motions = [_take(names, anatomy)]
        case "motion":
            motions = [read_motion(SHARED / "motions" / f"{name}.bvh", anatomy) for name in names.split("+")]
        case _:
            raise ValueError(f"prior {kind}:{names}: allowed: actor:KIND, motion:NAME+NAME, take:CLIP/FRAMES")
    return motions


def _take(name: str, anatomy: Anatomy) -> TrainingMotion:
    clip, _, frames = name.partition("/")
    folder = SHARED / "clips" / clip
    if not folder.is_dir():
        film = cycle_clip(clip)
        rows = film.truth.points[(film.truth.frames >= film.motion_from)][: int(frames)]
        centres = {joint: rows[:, k] for k, joint in enumerate(film.truth.names)}
        return motion_of(clip, film.truth.rate, anatomy, poses_from_centres(anatomy, centres))
    first = motion_from(clip)
    return read_motion(folder / "truth.trc", anatomy, range(first, first + int(frames)))


def training_frames(motion_frames: int) -> int:
    """Number of training frames of a take; the other frames are scored."""
    return min(TAKE_FRAMES, motion_frames // 2)
