"""The verdict on the shared clips, with faults in calibration, order, time and format of the videos.

Every case is a folder with the clip's videos, tracked by `zenocap track` in a process of its own and scored against the
clip's truth by time (`zenocap evaluate`).  No parameter was chosen on these clips.  The references of the real clips are
triangulated key points, a few centimetres off.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.cases.verdict.kinds import ALL, CLASS_COLUMNS
from benchmarks.cases.verdict.truth import true_rating
from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from benchmarks.people.shared_clips import clip_table, motion_from
from tests.support.stored import stored
from tests.support.video_file import write_video
from zenocap.common.arrays import Image
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.video.reader import VideoReader

STATUS = {0: "good", 3: "doubtful", 4: "unusable"}
RING = ("cam01", "cam03", "cam05")  # of seven cameras, a third of the ring or more apart
VERDICT = "verdict: "
TRUTHS = ("truth.trc", "reference.trc", "reference_P1.trc")


@dataclass(frozen=True)
class VideoFrames:
    """Frames of a video, times in seconds, frames/s."""

    images: list[Image]
    times: list[float]
    fps: int


def read_film(path: Path) -> VideoFrames:
    with VideoReader(path) as reader:
        images, times = [], []
        while (frame := reader.next()) is not None:
            images.append(frame.image())
            times.append(frame.time_ns / 1e9)
        return VideoFrames(images, times, round(reader.fps))


@dataclass(frozen=True)
class Folder:
    """What `zenocap track` gets.  videos: source by camera.  offsets_s: of sync.toml.  written: video that is written."""

    cameras: dict[str, Camera]
    videos: dict[str, Path]
    offsets_s: dict[str, float] = field(default_factory=dict)
    written: Callable[[Path, VideoFrames], None] | None = None

    @property
    def changed(self) -> str:
        """Camera that a fault changes."""
        return sorted(self.videos)[1]


Fault = Callable[[Folder], Folder]


def swapped(folder: Folder) -> Folder:
    """The videos of the first two cameras are exchanged."""
    one, other = sorted(folder.videos)[:2]
    return replace(folder, videos={**folder.videos, one: folder.videos[other], other: folder.videos[one]})


def focal_length(folder: Folder, factor: float) -> Folder:
    """The focal length of one camera is wrong."""
    camera = folder.cameras[folder.changed]
    return _recalibrated(folder, replace(camera, matrix=camera.matrix * [[factor, 1, 1], [1, factor, 1], [1, 1, 1]]))


def turned(folder: Folder, degrees: float) -> Folder:
    """One camera was turned to the side after its calibration."""
    camera = folder.cameras[folder.changed]
    turn = Rotation.from_euler("y", degrees, degrees=True).as_matrix()
    return _recalibrated(folder, replace(camera, rotation=turn @ camera.rotation, translation=turn @ camera.translation))


def _recalibrated(folder: Folder, camera: Camera) -> Folder:
    return replace(folder, cameras={**folder.cameras, folder.changed: camera})


def late(folder: Folder, seconds: float) -> Folder:
    """One video is later than the others, and nothing says so."""
    return replace(folder, offsets_s={**dict.fromkeys(folder.videos, 0.0), folder.changed: seconds})


def kept(choose: Callable[[int, int], list[int]], every: int = 1) -> Fault:
    """Only some frames of one video.  choose: of their number and rate.  every: by which the rate is divided."""

    def write(path: Path, film: VideoFrames) -> None:
        chosen = choose(len(film.images), film.fps)
        images, times = [film.images[k] for k in chosen], [film.times[k] for k in chosen]
        write_video(path.with_suffix(".mp4"), images, times, fps=film.fps // every)

    return lambda folder: replace(folder, written=write)


def converted(suffix: str, codec: str, pixels: str, scale: float = 1.0, share: float = 1.0) -> Fault:
    """One video in another format or size.  share: of the file that is there."""

    def write(path: Path, film: VideoFrames) -> None:
        path = path.with_suffix(suffix)
        resized = (cv2.resize(one, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) for one in film.images)
        images = [np.asarray(one, dtype=np.uint8) for one in resized]
        write_video(path, images, film.times, fps=film.fps, codec=codec, pixels=pixels)
        path.write_bytes(path.read_bytes()[: round(share * path.stat().st_size)])

    return lambda folder: replace(folder, written=write)


def _three_of_ten_missing(count: int, fps: int) -> list[int]:
    rng = np.random.default_rng(1)
    return [k for k in range(count) if k < fps or rng.random() > 0.3]


def _gap(count: int, fps: int) -> list[int]:
    return [k for k in range(count) if not count * 3 // 4 <= k < count * 3 // 4 + fps // 2]


VIDEOS: dict[str, Fault] = {  # as strangers have them
    "a third shorter": kept(lambda count, _: list(range(count * 2 // 3))),
    "half the frame rate": kept(lambda count, _: list(range(0, count, 2)), 2),
    "variable frame rate, three of ten frames missing": kept(_three_of_ten_missing),
    "gap of half a second": kept(_gap),
    "half the size": converted(".mp4", "libx264", "yuv420p", scale=0.5),
    "HEVC, 10 bit": converted(".mp4", "libx265", "yuv420p10le"),
    "VP9": converted(".webm", "libvpx-vp9", "yuv420p"),
    "grey": converted(".mkv", "ffv1", "gray"),
    "cut file": converted(".mkv", "libx264", "yuv420p", share=2 / 3),
}
FAULTS: dict[str, Fault] = {
    "none": lambda folder: folder,
    "two videos exchanged": swapped,
    "focal length 5 % off": lambda folder: focal_length(folder, 1.05),
    "focal length 15 % off": lambda folder: focal_length(folder, 1.15),
    "camera turned by 2°": lambda folder: turned(folder, 2.0),
    "camera turned by 6°": lambda folder: turned(folder, 6.0),
    "0.1 s late": lambda folder: late(folder, 0.1),
    "0.5 s late": lambda folder: late(folder, 0.5),
}
CLIPS: dict[str, tuple[str, ...]] = {  # the cameras used; none: all
    "walk2": (), "bend2": (), "kick2": (), "turned2": (), "jump2": (), "walk7": (), "jog7": (), "box7": (),
    "walk7, three": RING, "jog7, three": RING, "box7, three": RING, "real_beam4": (), "real_pair4": (),
}  # fmt: skip


def run(one: Case) -> Figures:
    """Error, and the class in truth and by the verdict, of one clip with a fault, or of all.  Options: fault."""
    if one.film != ALL:
        return _tried(one.film, one.option("fault", "none"))
    every = [_tried(clip, fault) for clip in CLIPS for fault in FAULTS]
    return {column.name: total for column in CLASS_COLUMNS if (total := sum(each.get(column.name, 0) for each in every))}


def _tried(clip: str, fault: str) -> dict[str, float]:
    sources = (__name__, "zenocap.tools", "zenocap.services")  # `zenocap track` runs them by name
    mean_m, lost, found = stored(lambda: _tracked(clip, fault), clip, fault, sources=sources)
    return {"mean": 1e3 * mean_m, "lost": 100.0 * lost, f"{true_rating(mean_m, lost)} in truth, called {found}": 1}


def _tracked(clip: str, fault: str) -> tuple[float, float, str]:
    """Mean error (m), share of lost joints, and the verdict."""
    name = clip.split(",")[0]
    source = SHARED / "clips" / name
    videos = {path.stem: path for path in sorted((source / "videos").iterdir()) if path.suffix in (".mp4", ".mkv", ".avi")}
    chosen = {camera: path for camera, path in videos.items() if camera in (CLIPS[clip] or videos)}
    up_axis = str(clip_table(name)["up_axis"])
    folder = (FAULTS | VIDEOS)[fault](Folder(read_calibration(source / "calibration.toml", up_axis), chosen))
    with TemporaryDirectory(prefix="zenocap-") as place:
        root, take = Path(place) / source.name, Path(place) / "take.mcap"
        (root / "videos").mkdir(parents=True)
        for camera, path in folder.videos.items():
            if folder.written is not None and camera == folder.changed:
                folder.written(root / "videos" / camera, read_film(path))
            else:
                (root / "videos" / f"{camera}{path.suffix}").symlink_to(path)
        for each in ("background", "stretched", "clip.toml"):
            if (source / each).exists():
                (root / each).symlink_to(source / each)
        write_calibration(root / "calibration.toml", folder.cameras, up_axis)
        if folder.offsets_s:
            lines = (f"{camera} = {offset}\n" for camera, offset in folder.offsets_s.items())
            (root / "sync.toml").write_text("[offset_s]\n" + "".join(lines))
        done = _zenocap("track", str(root), "-o", str(take), "--jobs", "1", "--cameras", ",".join(sorted(folder.videos)))
        printed = (done.stdout + done.stderr).splitlines()
        verdict = next((line.removeprefix(VERDICT) for line in printed if line.startswith(VERDICT)), "")
        mean_m, lost = float("nan"), 1.0
        truth = next(source / each for each in TRUTHS if (source / each).is_file())
        if take.is_file():
            halpe = ["--joints", "halpe"] if truth.name != "truth.trc" else []
            since = str(motion_from(name))
            scored = _zenocap("evaluate", str(take), "--truth", str(truth), "--from", since, "--json", *halpe)
            if scored.returncode == 0:
                figures = json.loads(scored.stdout)
                mean_m, lost = figures["mpjpe_mm"] / 1e3, figures["lost_pct"] / 100
        words = verdict.split()
        return mean_m, lost, words[0].rstrip(":,;") if words else STATUS[done.returncode]


def _zenocap(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "zenocap", *arguments], capture_output=True, text=True, check=False)


CLIP_VERDICTS = Kind(
    "verdict-clips",
    "The verdict on the shared clips, which nothing was fitted to, with the videos as they are and with faults, tracked by "
    "`zenocap track`. Nothing in it is random.",
    run,
    (Quantity("mean", "mm", 0), Quantity("lost", "%", 1), *CLASS_COLUMNS),
    {ALL: case(ALL)}
    | {f"{clip}, {fault}": case(clip, fault=fault) for clip in CLIPS for fault in FAULTS}
    | {f"walk2, {fault}": case("walk2", fault=fault) for fault in VIDEOS},
    case("walk2"),
    seeds=1,
    rows="clip, fault",
    inputs=lambda one: ("clips",) if one.film == ALL else (f"clips/{one.film.split(',')[0]}",),
)
