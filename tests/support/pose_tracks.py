"""Pose tracks for the tests of formats: a body, and random or smooth motion of it."""

import numpy as np
from hypothesis import strategies as st

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.formats.pose_track import PoseTrack

NAMES = tuple(marker.name for marker in TEN_PARTS.markers)


def body(height: float = 1.75) -> Bdp:
    return body_from_lengths(TEN_PARTS, average_lengths(height))


def track_of(positions: Floats, angles: Floats, *, first: int = 0, rate: float = 30.0, bdp: Bdp | None = None) -> PoseTrack:
    """A row per frame from `first`; positions (n, 3), angles (n, angles); NaN positions are lost."""
    count = len(positions)
    frames = np.arange(count, dtype=np.int64) + first
    lost = np.isnan(positions).any(axis=1)
    return PoseTrack(
        anatomy=TEN_PARTS, bdp=bdp or body(), frames=frames, times_s=frames / rate, positions=positions,
        angles=np.where(lost[:, None], np.nan, angles), scores={"1": np.linspace(0, 1, count), "2": np.full(count, np.nan)},
        views={"1": ("facade",) * count, "2": ("",) * count}, lost=tuple("person" if gone else "" for gone in lost),
        rate=rate,
    )  # fmt: skip


def moving(count: int = 12, *, seed: int = 1, lost: tuple[int, ...] = (), first: int = 0, rate: float = 30.0) -> PoseTrack:
    """Poses at random, within the limits of the joints."""
    random = np.random.default_rng(seed)
    low, high = TEN_PARTS.limits.T
    positions = random.uniform((-2, 0.5, -2), (2, 1.2, 2), (count, 3))
    positions[list(lost)] = np.nan
    return track_of(positions, random.uniform(low, high, (count, len(low))), first=first, rate=rate)


@st.composite
def tracks(draw: st.DrawFn) -> PoseTrack:
    """Random poses, including singular ones; some lost, not all."""
    count = draw(st.integers(2, 8))
    whole_turns = st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi, 3 * np.pi / 2])
    angle = st.one_of(whole_turns, st.floats(-2 * np.pi, 2 * np.pi))
    size = len(TEN_PARTS.angles)
    angles = np.array(draw(st.lists(st.lists(angle, min_size=size, max_size=size), min_size=count, max_size=count)))
    positions = np.random.default_rng(draw(st.integers(0, 1000))).uniform(-3, 3, (count, 3))
    lost = draw(st.lists(st.integers(0, count - 1), max_size=count - 1, unique=True))
    positions[lost] = np.nan
    rate = draw(st.sampled_from([10.0, 15.0, 24.0, 29.97, 30.0, 60.0, 120.0]))
    return track_of(positions, angles, rate=rate, bdp=body(draw(st.floats(1.0, 2.1))))
