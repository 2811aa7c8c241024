"""Silhouettes of a take from its end to its beginning, a chunk at a time."""

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

from mcap.reader import SeekingReader

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.errors import UserError
from zenocap.common.topics import SILHOUETTE
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.tracker.both_ways.passes import ForwardPose, SceneMasks
from zenocap.services.tracker.states import Setup

WAIT_FRAMES = 3  # frame periods, greatest disorder of recorded silhouettes against their capture; by hand


def scenes_backwards(take: Path, rig: str, setup: Setup, forward: Sequence[ForwardPose]) -> Iterator[SceneMasks]:
    """Yield every pose, the last first, with the masks of the views that it used, by viewer.

    Raises UserError for a file without silhouettes, or without the index that is needed to read it backwards.
    """
    waiting: dict[tuple[str, int], m.Silhouette] = {}
    at = len(forward) - 1
    for silhouette in chain(_silhouettes_backwards(take, rig, setup), [None]):
        while at >= 0 and (
            silhouette is None or silhouette.captured_ns < forward[at].captured_ns - WAIT_FRAMES * setup.frame_ns
        ):
            pose = forward[at]
            masks: dict[str, Mask] = {}
            for (viewer, captured_ns), one in waiting.items():
                if viewer in pose.views and abs(captured_ns - pose.captured_ns) <= setup.frame_ns // 2:
                    masks[viewer] = unpack(one.size, one.region, one.data)
            yield pose, {viewer: masks[viewer] for viewer in setup.cameras if viewer in masks}
            waiting = {key: one for key, one in waiting.items() if key[1] < pose.captured_ns - setup.frame_ns // 2}
            at -= 1
        if silhouette is not None:
            waiting[silhouette.viewer, silhouette.captured_ns] = silhouette


def _silhouettes_backwards(take: Path, rig: str, setup: Setup) -> Iterator[m.Silhouette]:
    """Silhouettes, the last first; a chunk of the file is in memory at a time."""
    keys = [SILHOUETTE.at(rig, viewer=viewer) for viewer in setup.cameras]
    with take.open("rb") as file:
        reader = SeekingReader(file)
        summary = reader.get_summary()
        if summary is None or not summary.chunk_indexes:
            raise UserError(f"{take}: no index: it cannot be read backwards; `zenocap recover` writes a copy with one")
        if not any(channel.topic in keys for channel in summary.channels.values()):
            raise UserError(f"{take}: no silhouettes: they are needed for a second pass")
        for _, _, recorded in reader.iter_messages(topics=keys, reverse=True):
            message = codec.decode(recorded.data, m.Silhouette)
            assert isinstance(message, m.Silhouette)
            yield message
