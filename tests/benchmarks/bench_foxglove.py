"""What Foxglove's channels cost.  `make benchmark` times each kind of message; `python -m tests.benchmarks.bench_foxglove`
adds up a second of 8 viewers at 60 frames/s, with the share of one core and of the file.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.body.definition import neutral_pose
from common.body.kinematics import part_frames
from common.body.proportions import body_from_lengths, lengths_of_height
from common.body.surface import end_ellipses
from common.bus.protocol import Envelope
from common.codec import encode
from common.conversion import angles_by_name, body_of
from common.formats.foxglove.converter import Foxglove
from common.runtime.rig import demo_rig
from common.take.recording import Recording, nothing_beside
from common.topics import topic_of
from common.vision.packing import pack

VIEWERS, RATE, SECONDS = 8, 60, 5
SIZES = ((160, 120), (640, 480))
ANGLES = angles_by_name(TEN_PARTS, TEN_PARTS.neutral)
BODY = body_from_lengths(TEN_PARTS, lengths_of_height(1.75))
BDP = m.UniversalBdp(frame=0, captured_ns=0, body=body_of(TEN_PARTS, BODY), ratio=1.0)


def silhouette(size: tuple[int, int], viewer: str, frame: int) -> m.Silhouette:
    """The model's own, with a ragged edge as a camera's has."""
    camera = demo_rig().viewers[0].camera.resized(size)
    mask = np.zeros((size[1], size[0]), np.uint8)
    pose = neutral_pose(TEN_PARTS, np.array([0.002 * frame, 0.95, 0.0]))
    for part_to_world, part in zip(part_frames(TEN_PARTS, BODY, pose), BODY.sizes, strict=True):
        hull = cv2.convexHull(camera.project(end_ellipses(part_to_world, part)).astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
    noise = np.random.default_rng(frame).random(mask.shape) < 0.3
    mask[(cv2.dilate(mask, np.ones((3, 3), np.uint8)) > mask) & noise] = 1
    region, data = pack(mask)
    return m.Silhouette(frame=frame, captured_ns=0, viewer=viewer, size=size, region=region, data=data)


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


def enveloped(message: m.Message, received_ns: int = 0) -> Envelope:
    topic = topic_of(type(message))
    return Envelope(topic.at("r", **topic.names_of(message)), topic, message, received_ns, encode(message))


def converter() -> Foxglove:
    made = Foxglove(TEN_PARTS, "r")
    made.beside(enveloped(BDP))
    return made


@pytest.mark.parametrize(
    "message",
    [universal_bap(1), silhouette(SIZES[0], "1", 1), silhouette(SIZES[1], "1", 1), sighting("1", 1), partial_bap("1", 1)],
    ids=["UniversalBap", "Silhouette 160x120", "Silhouette 640x480", "Sighting", "PartialBap"],
)
def test_beside(benchmark: BenchmarkFixture, message: m.Message) -> None:
    envelope = enveloped(message)
    assert isinstance(benchmark(converter().beside, envelope), list)


def mixture(size: tuple[int, int]) -> list[Envelope]:
    """`SECONDS` of everything that 8 viewers and an integrator say each frame."""
    said: list[Envelope] = [enveloped(BDP)]
    drawn = [silhouette(size, "0", frame) for frame in range(RATE)]
    for frame in range(SECONDS * RATE):
        now_ns = frame * 10**9 // RATE
        for viewer in map(str, range(VIEWERS)):
            of = drawn[frame % RATE]
            seen = m.Silhouette(frame=frame, captured_ns=0, viewer=viewer, size=size, region=of.region, data=of.data)
            said += [enveloped(each, now_ns) for each in (seen, sighting(viewer, frame), partial_bap(viewer, frame))]
        said.append(enveloped(universal_bap(frame), now_ns))
    return said


def main() -> None:
    for size in SIZES:
        said = mixture(size)
        shown = converter()
        started_s = time.process_time()
        for envelope in said:
            shown.beside(envelope)
        share = (time.process_time() - started_s) / SECONDS
        print(f"{VIEWERS} viewers, {size[0]}x{size[1]}, {RATE}/s: beside() {100 * share:.1f} % of a core")
        for words, beside in (("without", nothing_beside), ("with", Foxglove(TEN_PARTS, "r").beside)):
            with TemporaryDirectory() as folder:
                path = Path(folder) / "take.mcap"
                started_s = time.process_time()
                recording = Recording(path, rig="r", start_ns=0, beside=beside)
                for envelope in said:
                    recording.record(envelope)
                end = recording.close()
                spent_s = time.process_time() - started_s
                size_mb = path.stat().st_size / 1e6
            print(
                f"  log {words} Foxglove's channels: {100 * spent_s / SECONDS:.1f} % of a core, "
                f"{end.messages / SECONDS:.0f} messages/s, {size_mb / SECONDS:.2f} MB/s of file"
            )


if __name__ == "__main__":
    main()
