"""Videos as strangers have them: one clip with its second camera's video changed in one way, tracked and scored.

The folder of the clip with the changed video is tracked by `zenocap track` in a process of its own and scored against the
clip's truth at the times of the truth's frames: there can be a pose only where both cameras filmed, so that the joints are
interpolated between poses up to two periods of the truth apart.
"""

import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.harness.case import SHARED, Case, Column, Figures, Kind, case
from benchmarks.people.shared_clips import clip_table, motion_from
from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.formats.motion_files import read_centres
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.video.reader import VideoReader
from zenocap.simulation.rendering.video_file import write_video
from zenocap.tools.recordings.evaluate import Accuracy, Selection, accuracy
from zenocap.tools.recordings.track import track
from zenocap.tools.verdict.parameters import GOOD_ERROR_M, GOOD_LOST, UNUSABLE_ERROR_M, UNUSABLE_LOST

CLIP = "walk2"
CHANGED, OTHER = "cam02", "cam01"
LATE_S = 0.5  # by which the second camera starts
EMPTY_FRAMES = 14  # empty also in the video that begins late, and at half the frame rate
VERDICT = "verdict: "
CLASSES = ("good", "doubtful", "unusable")
INTERPOLATED_PERIODS = 2.0  # of the truth, between poses
TIMES_S = 0.002  # rounding of times in files


@dataclass(frozen=True)
class Film:
    """Frames of a video, times in seconds, frames/s."""

    images: list[Image]
    times: list[float]
    fps: int


Change = Callable[[Path, Film], None]  # writes the changed video into a folder


def _write(path: Path, film: Film, kept: list[int] | None = None, codec: str = "libx264", pixels: str = "yuv420p") -> None:
    kept = list(range(len(film.images))) if kept is None else kept
    images, times = [film.images[k] for k in kept], [film.times[k] for k in kept]
    write_video(path, images, times, fps=film.fps, codec=codec, pixels=pixels)


def _video(folder: Path, suffix: str = "mp4") -> Path:
    return folder / "videos" / f"{CHANGED}.{suffix}"


def unchanged(folder: Path, film: Film) -> None:
    _write(_video(folder), film)


def shorter(folder: Path, film: Film) -> None:
    _write(_video(folder), film, list(range(len(film.images) * 2 // 3)))


def half_rate(folder: Path, film: Film) -> None:
    kept = list(range(0, len(film.images), 2))
    write_video(_video(folder), [film.images[k] for k in kept], [film.times[k] for k in kept], fps=film.fps // 2)


def variable(folder: Path, film: Film) -> None:
    """Three of ten frames left out at random, after the empty scene."""
    rng = np.random.default_rng(1)
    _write(_video(folder), film, [k for k in range(len(film.images)) if k < film.fps or rng.random() > 0.3])


def gap(folder: Path, film: Film) -> None:
    """Half a second without frames in the middle of the motion."""
    middle = len(film.images) * 3 // 4
    _write(_video(folder), film, [k for k in range(len(film.images)) if not middle <= k < middle + film.fps // 2])


def late(folder: Path, film: Film, *, said: bool) -> None:
    """The video begins LATE_S later; said: sync.toml says so."""
    first = round(LATE_S * film.fps)
    _write(_video(folder), film, list(range(first, len(film.images))))
    if said:
        (folder / "sync.toml").write_text(f"[offset_s]\n{OTHER} = 0.0\n{CHANGED} = {first / film.fps}\n")


def half_size(folder: Path, film: Film) -> None:
    size = film.images[0].shape[1] // 2, film.images[0].shape[0] // 2
    halves = [np.asarray(cv2.resize(one, size, interpolation=cv2.INTER_AREA), dtype=np.uint8) for one in film.images]
    write_video(_video(folder), halves, film.times, fps=film.fps)


def converted(folder: Path, film: Film, *, suffix: str, codec: str, pixels: str) -> None:
    _write(_video(folder, suffix), film, codec=codec, pixels=pixels)


def cut(folder: Path, film: Film) -> None:
    """A file that ends in the middle of a frame."""
    path = _video(folder, "mkv")
    _write(path, film)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])


TRIALS: Mapping[str, Change] = {
    "unchanged": unchanged,
    "a third shorter": shorter,
    "half the frame rate": half_rate,
    "variable frame rate": variable,
    "gap of half a second": gap,
    "starts 0.5 s late, sync.toml": partial(late, said=True),
    "starts 0.5 s late, not said": partial(late, said=False),
    "half the size": half_size,
    "HEVC, 10 bit": partial(converted, suffix="mp4", codec="libx265", pixels="yuv420p10le"),
    "VP9": partial(converted, suffix="webm", codec="libvpx-vp9", pixels="yuv420p"),
    "grey": partial(converted, suffix="mkv", codec="ffv1", pixels="gray"),
    "cut file": cut,
}


def read_film(path: Path) -> Film:
    with VideoReader(path) as reader:
        images, times = [], []
        while (frame := reader.next()) is not None:
            images.append(frame.image())
            times.append(frame.time_ns / 1e9)
        return Film(images, times, round(reader.fps))


def run(one: Case) -> Figures:
    """Errors of one changed video, and classes as numbers: 0 good, 1 doubtful, 2 unusable."""
    clip = SHARED / "clips" / CLIP
    with TemporaryDirectory(prefix="zenocap-") as place:
        folder, take = Path(place) / CLIP, Path(place) / "take.mcap"
        (folder / "videos").mkdir(parents=True)
        for file in ("calibration.toml", f"videos/{OTHER}.mp4"):
            shutil.copy(clip / file, folder / file)
        up = clip_table(CLIP)["up_axis"]
        (folder / "clip.toml").write_text(f'up_axis = "{up}"\nempty_frames = {EMPTY_FRAMES}\n')
        TRIALS[one.film](folder, read_film(clip / "videos" / f"{CHANGED}.mp4"))
        command = [sys.executable, "-m", "zenocap", "track", str(folder), "-o", str(take), "--jobs", "1"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        verdict = next((line for line in (done.stdout + done.stderr).splitlines() if line.startswith(VERDICT)), VERDICT)
        word = verdict.removeprefix(VERDICT).split(":")[0].split(",")[0].strip() or "unusable"
        found = {"status": float(done.returncode), "verdict": float(CLASSES.index(word))}
        errors = scored(take, clip / "truth.trc", motion_from(CLIP)) if take.is_file() else None
    if errors is None:
        return found | {"lost": 100.0, "truth": 2.0}
    return found | {"mean": errors.mpjpe_mm, "lost": errors.lost_pct, "truth": float(CLASSES.index(true_class(errors)))}


def scored(take: Path, truth_path: Path, motion_from: int) -> Accuracy | None:
    """Errors of a take at the times of the truth's frames from `motion_from` on; None without poses."""
    truth = read_centres(truth_path)
    try:
        found = at_times(read_poses(take).trajectories(), truth)
        return accuracy(found, truth, Selection(Bound(motion_from)))
    except UserError:
        return None


def at_times(found: Trajectories, truth: Trajectories) -> Trajectories:
    """The joints at the truth's times: linear between poses at most INTERPOLATED_PERIODS apart, NaN elsewhere."""
    known = ~np.isnan(found.points).any(axis=(1, 2))
    times_s, points = found.times_s[known], found.points[known]
    made = np.full((len(truth.times_s), *found.points.shape[1:]), np.nan)
    if not len(times_s):
        return replace(found, frames=truth.frames, times_s=truth.times_s, points=made)
    after = np.clip(np.searchsorted(times_s, truth.times_s - TIMES_S), 0, len(times_s) - 1)
    before = np.where(np.abs(times_s[after] - truth.times_s) <= TIMES_S, after, np.maximum(after - 1, 0))
    span = times_s[after] - times_s[before]
    inside = (times_s[before] <= truth.times_s + TIMES_S) & (truth.times_s <= times_s[after] + TIMES_S)
    near = inside & (span <= INTERPOLATED_PERIODS / truth.rate + TIMES_S)
    share = np.where(span > 0, (truth.times_s - times_s[before]) / np.where(span > 0, span, 1.0), 0.0)
    made[near] = (points[before] + share[:, None, None] * (points[after] - points[before]))[near]
    return replace(found, frames=truth.frames, times_s=truth.times_s, points=made)


def true_class(found: Accuracy) -> str:
    error_m, lost = found.mpjpe_mm / 1000, found.lost_pct / 100
    if error_m > UNUSABLE_ERROR_M or lost > UNUSABLE_LOST:
        return "unusable"
    return "good" if error_m <= GOOD_ERROR_M and lost <= GOOD_LOST else "doubtful"


VIDEO_TRIALS = Kind(
    "video-trials",
    "The two videos of `walk2`, one of them changed in one way, tracked by `zenocap track`; classes: 0 good, 1 doubtful, 2 "
    "unusable; lost: joints without an estimate or more than 250 mm off, also of frames that no video shows. Nothing in "
    "it is random.",
    run,
    (
        Column("status", "", 0, ""),
        Column("mean", "mm", 0),
        Column("lost", "%", 1),
        Column("truth", "class", 0, ""),
        Column("verdict", "class", 0, ""),
    ),
    {name: case(name) for name in TRIALS},
    case("a third shorter"),
    seeds=1,
    rows="video",
    inputs=lambda _: (f"clips/{CLIP}",),
)
assert track.__module__  # `zenocap track` runs it in a process of its own: a result depends on it
