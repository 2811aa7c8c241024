"""Wrong inputs: none is good, and the first reason of each is its cause."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.cases.verdict import faults
from benchmarks.cases.verdict.faults import FaultyScene
from benchmarks.cases.verdict.takes import tracker_messages
from tests.support.built_messages import camera_message, silhouette
from tests.support.stored import stored
from tests.support.walkers import walker
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.camera.validation import Z_UP_TO_Y_UP
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.seen import no_legs
from zenocap.tools.judge.verdict import verdict_of

pytestmark = pytest.mark.nightly
SEED, VIEWS, SIZE, FPS, FRAMES = 3, 3, (160, 120), 25.0, 80
CONTRADICTION = ("overlap", "views-apart")  # both name calibration, moved and swapped cameras


def scene() -> FaultyScene:
    """A person who walks among three cameras, without a T-pose."""
    return stored(_scene, sources=(__name__,))


def _scene() -> FaultyScene:
    one = walker(SEED, VIEWS, SIZE, 14)
    masks = {}
    for name, camera in one.cameras.items():
        film = SimulatedCamera(camera, one.person, 0)
        poses = [one.motion.pose_at(k / FPS) for k in range(FRAMES)]
        masks[name] = [np.asarray(film.silhouette(pose) != 0, dtype=np.uint8) for pose in poses]
    return FaultyScene(dict(one.cameras), masks, {}, 0, FPS)


def short(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    return replace(found, masks={view: film[:20] for view, film in found.masks.items()})


def rotated(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    """One video is upside down, and nothing in it says so."""
    view = sorted(found.masks)[0]
    return replace(found, masks={**found.masks, view: [np.ascontiguousarray(one[::-1, ::-1]) for one in found.masks[view]]})


def upper_half(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    """The cameras look so high that the lower border of each image cuts the person in the middle."""
    down = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5 * SIZE[1]], [0.0, 0.0, 1.0]])
    cameras = {view: replace(one, matrix=down @ one.matrix) for view, one in found.cameras.items()}
    half = SIZE[1] // 2
    masks = {view: [np.pad(one[:half], ((half, 0), (0, 0))) for one in film] for view, film in found.masks.items()}
    return replace(found, cameras=cameras, masks=masks)


def no_legs_anywhere(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    """The lower third of the person is missing in all silhouettes."""

    def cut(mask: Mask) -> Mask:
        rows = np.flatnonzero(mask.any(axis=1))
        kept = mask.copy()
        if len(rows):
            kept[rows[0] + round(0.67 * len(rows)) :] = 0
        return kept

    return replace(found, masks={view: [cut(one) for one in film] for view, film in found.masks.items()})


def other_axis(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    """A calibration with Z up is read as one with Y up."""
    cameras = {view: replace(one, rotation=one.rotation @ Z_UP_TO_Y_UP) for view, one in found.cameras.items()}
    return replace(found, cameras=cameras)


def other_set(found: FaultyScene, _: np.random.Generator) -> FaultyScene:
    """The calibration of other cameras with the same names."""
    return replace(found, cameras=dict(walker(7, VIEWS, SIZE).cameras))


def verdict(fault: Callable[[FaultyScene, np.random.Generator], FaultyScene]) -> m.Verdict:
    return verdict_of(evidence_of(tracker_messages(fault(scene(), np.random.default_rng(SEED)), 0)))


@pytest.mark.parametrize(
    ("fault", "kinds", "words"),
    [
        (faults.swapped, CONTRADICTION, "swapped"),
        (faults.moved, CONTRADICTION, "a camera that was moved"),
        (faults.another_rig, CONTRADICTION, "wrong calibration"),
        (other_set, ("no-pose", *CONTRADICTION), "calibration"),
        (rotated, ("no-pose", *CONTRADICTION), "calibration"),
        (short, ("no-pose",), "a longer recording"),
        (upper_half, ("half-person",), "half of the person is outside the pictures"),
        (faults.grey, ("silhouettes", "overlap", "view-missing"), "contrast"),
        (faults.no_legs, ("no-legs",), "the legs are missing in the silhouettes of camera"),
        (no_legs_anywhere, ("no-legs",), "the legs are missing in the silhouettes of camera cam01, cam02, cam03"),
        (other_axis, ("no-pose", *CONTRADICTION), "calibration"),
    ],
    ids=lambda one: getattr(one, "__name__", None),
)
def test_the_first_reason_of_a_wrong_input_is_its_cause(
    fault: Callable[[FaultyScene, np.random.Generator], FaultyScene], kinds: tuple[str, ...], words: str
) -> None:
    found = verdict(fault)
    assert found.rating == "unusable"
    assert found.reasons[0].kind in kinds, [(one.kind, one.text) for one in found.reasons]
    assert words in found.reasons[0].text


def test_the_camera_that_was_moved_is_named() -> None:
    before, after = scene(), faults.moved(scene(), np.random.default_rng(SEED))
    others = [
        view
        for view in before.masks
        if any((a != b).any() for a, b in zip(before.masks[view], after.masks[view], strict=True))
    ]
    assert len(others) == 1
    assert verdict(faults.moved).reasons[0].viewers == others


@pytest.mark.parametrize("seed", range(5))
def test_legs_that_are_there_are_not_missed(seed: int) -> None:
    """Also where nothing is tracked: other people, cameras and ways than those of the scene above."""
    one = walker(seed, 2 + seed % 3, SIZE, 14)
    found: list[m.Message] = []
    for name, camera in one.cameras.items():
        film = SimulatedCamera(camera, one.person, 0)
        masks = [np.asarray(film.silhouette(one.motion.pose_at(k / 5.0)) != 0, dtype=np.uint8) for k in range(30)]
        found.append(camera_message(camera))
        found += [silhouette(name, k, k * 200_000_000, mask) for k, mask in enumerate(masks)]
    assert no_legs(evidence_of(found)) is None
