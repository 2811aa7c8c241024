"""Silhouettes with the tracker in the loop: all views of a seed, with and without its pose fed back to them.

    python -m benchmarks.rooms.loop [--seeds 6] [--first-seed 0] [--views 3] [--only NAME] [--variants off,on]

overlap, edge, unusable: as of `benchmarks.rooms`, of all views.  joints: mean distance of the joints from the true ones
from SETTLED_S after the person has come into view, mm.  lost: share of those instants without a pose.  Variants: off: no
pose is fed back; on; no-prior: nothing is decided by the prior; no-learn: nothing of a person's region is learnt; stuck:
from STUCK_S on the tracker repeats its pose, as one that follows a false person.
"""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from time import process_time
from unittest.mock import patch

import cv2
import numpy as np
from msgspec import structs

from benchmarks.rooms.__main__ import SETTLED_S, SMALLEST, UNUSABLE, edge_px, overlap
from benchmarks.rooms.film import EMPTY_S, FPS, Scene, Shot, shots
from benchmarks.rooms.situations import SITUATIONS
from benchmarks.table import table
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.conversion import angles_of, bdp_of
from zenocap.common.messages import Message, Silhouette, TrackerBdp, TrackerPose
from zenocap.common.rig.sources import parse_background
from zenocap.common.topics import topic_of
from zenocap.common.vision.adaptive import follow, judgement
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import Options
from zenocap.services.tracker.states import Setup as TrackerSetup
from zenocap.services.viewer import silhouette_step as viewer
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.states import viewer_setup
from zenocap.simulation.ground_truth import landmarks

COLUMNS = ("situation", "variant", "overlap", "edge", "unusable", "joints", "lost", "ms a frame")
Row = tuple[float, float, float, float, float, float]
EPOCH_S = 1e6
STUCK_S = 12.0


class Loop:
    """Viewers and tracker of one variant, run in lockstep."""

    def __init__(self, scenes: list[Scene], variant: str) -> None:
        self.variant = variant
        self._cameras = {scene.view: scene.camera for scene in scenes}
        self._setups = {
            view: viewer_setup(view, camera, parse_background("adaptive", Path()), True)
            for view, camera in self._cameras.items()
        }
        self._viewers: dict[str, viewer.State] = {view: viewer.initial_state(self._setups[view]) for view in self._cameras}
        self._setup = TrackerSetup(FOURTEEN_PARTS, self._cameras, round(1e9 / FPS), None, Options())
        self._tracker = tracker.initial_state(self._setup)
        self._kept: list[TrackerPose] = []
        self.body: Bdp | None = None
        self.pose: TrackerPose | None = None
        self.time_s = 0.0
        self.frames = 0

    def process(self, number: int, time_s: float, images: dict[str, Shot]) -> dict[str, Mask]:
        """Silhouettes (height, width) of an instant by view; empty while the background is learnt."""
        captured_ns = round((EPOCH_S + time_s) * 1e9)
        silhouettes: list[Message] = []
        with without(self.variant):
            for view, shot in images.items():
                start = process_time()
                self._viewers[view], messages = viewer.step(
                    self._setups[view], self._viewers[view], Frame(number, captured_ns, shot.image)
                )
                self.time_s += process_time() - start
                self.frames += 1
                silhouettes += messages
        for message in silhouettes:
            self._tracker, _ = tracker.step(self._setup, self._tracker, _envelope(message))
        self.pose = None
        if tracker.pending(self._tracker):
            self._tracker, results = tracker.step(self._setup, self._tracker, Tick(captured_ns))
            self._receive(results, time_s)
        return {one.viewer: unpack(one.size, one.region, one.data) for one in silhouettes if isinstance(one, Silhouette)}

    def _receive(self, results: list[Message], time_s: float) -> None:
        for message in results:
            if isinstance(message, TrackerBdp):
                self.body = bdp_of(FOURTEEN_PARTS, message.body)
            elif isinstance(message, TrackerPose):
                self.pose = message
        fed: list[TrackerBdp | TrackerPose] = [one for one in results if isinstance(one, TrackerBdp | TrackerPose)]
        if self.variant == "off":
            return
        if self.variant == "stuck" and time_s >= STUCK_S and self._kept:
            now_ns = round((EPOCH_S + time_s) * 1e9)
            fed = [structs.replace(self._kept[-1], captured_ns=now_ns)]
        self._kept = [one for one in fed if isinstance(one, TrackerPose)] or self._kept
        for message in fed:
            for view in self._viewers:
                self._viewers[view], _ = viewer.step(self._setups[view], self._viewers[view], _envelope(message))


def _envelope(message: Message) -> Envelope:
    topic = topic_of(type(message))
    return Envelope(topic.at("rooms", **topic.names_of(message)), topic, message, message.captured_ns)


def without(variant: str) -> ExitStack:
    """Context in which the part of the feedback that a variant names is off."""
    stack = ExitStack()
    if variant == "no-prior":
        stack.enter_context(patch.object(follow, "with_prior", lambda silhouette, *_: silhouette))
    if variant == "no-learn":
        stack.enter_context(patch.object(judgement, "_explain", lambda *_: None))
    return stack


def measured(job: tuple[int, str], size: tuple[int, int], views: int, variants: tuple[str, ...]) -> list[Row]:
    """Figures of every variant of a seed and situation."""
    cv2.setNumThreads(1)
    seed, name = job
    situation = next(one for one in SITUATIONS if one.name == name)
    scenes = [Scene(seed, size, views, f"cam{k + 1:02}") for k in range(views)]
    subject = scenes[0].walker.person if situation.dressed is None else situation.dressed(scenes[0])
    loops = [Loop(scenes, variant) for variant in variants]
    seen_s = (EMPTY_S if situation.empty else 0.0) + SETTLED_S
    figures: list[dict[str, list[float]]] = [{"overlap": [], "edge": [], "joints": []} for _ in loops]
    films: list[Iterator[Shot]] = [shots(scene, situation) for scene in scenes]
    for number, instant in enumerate(zip(*films, strict=True)):
        time_s = instant[0].time_s
        images = {scene.view: shot for scene, shot in zip(scenes, instant, strict=True)}
        for loop, figure in zip(loops, figures, strict=True):
            masks = loop.process(number, time_s, images)
            if time_s < seen_s or instant[0].pose is None:
                continue
            for view, shot in images.items():
                if np.count_nonzero(shot.truth) >= SMALLEST * shot.truth.size:
                    mask = masks.get(view, np.zeros_like(shot.truth))
                    figure["overlap"].append(overlap(mask, shot.truth))
                    figure["edge"].append(edge_px(mask, shot.truth))
            figure["joints"].append(_error_mm(loop, landmarks(subject, instant[0].pose)))
    return [_row(loop, figure) for loop, figure in zip(loops, figures, strict=True)]


def _row(loop: Loop, figure: dict[str, list[float]]) -> Row:
    overlaps, joints = np.array(figure["overlap"]), np.array(figure["joints"])
    known = np.isfinite(joints)
    return (
        float(overlaps.mean()),
        float(np.mean(figure["edge"])),
        float(np.mean(overlaps < UNUSABLE)),
        float(joints[known].mean()) if known.any() else float("nan"),
        1.0 - float(known.mean()),
        1e3 * loop.time_s / loop.frames,
    )


def _error_mm(loop: Loop, true: dict[str, Floats]) -> float:
    """Mean distance of the joints, mm; infinite without a pose."""
    if loop.pose is None or loop.pose.lost or loop.body is None:
        return float("inf")
    angles = angles_of(FOURTEEN_PARTS, loop.pose.angles, FOURTEEN_PARTS.neutral)
    found = joint_centres(FOURTEEN_PARTS, loop.body, Pose(np.array(loop.pose.position), angles))
    names = [marker.name for marker in FOURTEEN_PARTS.markers]
    far = [np.linalg.norm(found[k] - true[name]) for k, name in enumerate(names) if name in true]
    return 1e3 * float(np.mean(far))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--views", type=int, default=3)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--variants", default="off,on")
    parser.add_argument("--only", default="", help="situations whose name contains one of these, separated by commas")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    names = [one.name for one in SITUATIONS if any(part in one.name for part in options.only.split(","))]
    variants = tuple(options.variants.split(","))
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [(seed, name) for name in names for seed in seeds]
    with Pool(options.jobs) as pool:
        work = partial(measured, size=(width, height), views=options.views, variants=variants)
        rows = dict(zip(jobs, pool.map(work, jobs, chunksize=1), strict=True))
    cells = []
    for name in names:
        for number, variant in enumerate(variants):
            of = np.array([rows[seed, name][number] for seed in seeds])
            cells.append(
                (
                    name,
                    variant,
                    f"{of[:, 0].mean():.3f} ({of[:, 0].min():.3f})",
                    f"{of[:, 1].mean():.1f} ({of[:, 1].max():.1f})",
                    f"{of[:, 2].mean():.0%} ({of[:, 2].max():.0%})",
                    f"{np.nanmean(of[:, 3]):.0f} ({np.nanmax(of[:, 3]):.0f})",
                    f"{of[:, 4].mean():.0%} ({of[:, 4].max():.0%})",
                    f"{np.median(of[:, 5]):.2f}",
                )
            )
    print(table("", COLUMNS, cells))


if __name__ == "__main__":
    main()
