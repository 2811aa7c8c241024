"""Cost of the Foxglove channels, by kind of message."""

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.built_messages import silhouette
from tests.support.foxglove_reader import in_envelope
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.kinematics import end_ellipses, part_frames
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.rig.rig import demo_rig

VIEWERS = 8
SIZES = ((160, 120), (640, 480))
ANGLES = angles_by_name(TEN_PARTS, TEN_PARTS.neutral)
BODY = body_from_lengths(TEN_PARTS, average_lengths(1.75))
BDP = m.UniversalBdp(frame=0, captured_ns=0, body=body_of(TEN_PARTS, BODY), ratio=1.0)


def ragged(size: tuple[int, int], viewer: str, frame: int) -> m.Silhouette:
    """Silhouette of the model with a ragged edge, as from a camera."""
    camera = demo_rig("two-view").viewers[0].camera.resized(size)
    mask = np.zeros((size[1], size[0]), np.uint8)
    pose = neutral_pose(TEN_PARTS, np.array([0.002 * frame, 0.95, 0.0]))
    for part_to_world, part in zip(part_frames(TEN_PARTS, BODY, pose), BODY.sizes, strict=True):
        hull = cv2.convexHull(camera.project(end_ellipses(part_to_world, part)).astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
    noise = np.random.default_rng(frame).random(mask.shape) < 0.3
    mask[(cv2.dilate(mask, np.ones((3, 3), np.uint8)) > mask) & noise] = 1
    return silhouette(viewer, frame, 0, mask)


def sighting(viewer: str, frame: int) -> m.Sighting:
    return m.Sighting(
        frame=frame, captured_ns=0, viewer=viewer, present=True, x=0.1, y=0.2, height=1.0, width=0.3, view="facade",
        score=0.5, turns=[-1.5] * 5, arms=[-2.5] * 12, legs=[-3.5] * 12,
    )  # fmt: skip


def partial_bap(viewer: str, frame: int) -> m.PartialBap:
    limb = m.LimbMatch(score=0.7, visible=0.6, matchings=[7, 8])
    limbs = dict.fromkeys(("right_arm", "left_arm", "right_leg", "left_leg"), limb)
    return m.PartialBap(
        frame=frame, captured_ns=0, viewer=viewer, view="facade", angles=dict(list(ANGLES.items())[:11]), limbs=limbs,
        exchange=0.1, score=0.7,
    )  # fmt: skip


def universal_bap(frame: int) -> m.UniversalBap:
    viewers = [str(k) for k in range(VIEWERS)]
    return m.UniversalBap(
        frame=frame, captured_ns=0, position=(0.002 * frame, 0.95, 0.0), angles=ANGLES, scores=dict.fromkeys(viewers, 0.7),
        views=dict.fromkeys(viewers, "facade"), stale=[], lost=[],
    )  # fmt: skip


def converter() -> FoxgloveConverter:
    made = FoxgloveConverter(TEN_PARTS, "r")
    made.convert(in_envelope(BDP, "r"))
    return made


@pytest.mark.parametrize(
    "message",
    [universal_bap(1), ragged(SIZES[0], "1", 1), ragged(SIZES[1], "1", 1), sighting("1", 1), partial_bap("1", 1)],
    ids=["UniversalBap", "Silhouette 160x120", "Silhouette 640x480", "Sighting", "PartialBap"],
)
def test_convert(benchmark: BenchmarkFixture, message: m.Message) -> None:
    envelope = in_envelope(message, "r")
    assert isinstance(benchmark(converter().convert, envelope), list)
