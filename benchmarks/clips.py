"""The shared two-view clips `walk2`, `bend2`, `kick2` at 160 x 120 and 640 x 480, scored by the shared `score_trc.py`.

    python -m benchmarks.clips [NAME ...]

Every frame of the clip is tracked.  mean: of all joints' distances; mesh's joints: the same after conversion to the joint
convention of the truth, see `mesh_joints`; shape: RMSE without each joint's constant offset.
lost: share of joints with no estimate or more than 250 mm off.  Targets: 95 mm and 75 mm with nothing lost.
"""

import argparse
import json
import subprocess
import sys
import tomllib
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2

from benchmarks.errors import JOINTS
from benchmarks.loop import EPOCH_NS, Loop, Track
from benchmarks.mesh_joints import in_mesh_convention
from benchmarks.table import table
from benchmarks.takes import LARGE, SMALL, VIEWERS, Size
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.formats.trc import read_trc, write_trc
from zenocap.common.rig.sources import FirstFrames, VideoFile
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.video import video_frames

SHARED = Path(__file__).resolve().parents[1].parent / "shared"
SCORE = SHARED / "tools" / "score_trc.py"
NAMES = ("walk2", "bend2", "kick2")
TARGETS = {SMALL: 95, LARGE: 75}


def track_clip(folder: Path, size: Size, additions: Additions = IMPROVED) -> Track:
    """The track of a two-camera clip at a working size (width, height)."""
    clip = tomllib.loads((folder / "clip.toml").read_text())
    calibrated = read_calibration(folder / "calibration.toml", clip["up_axis"])
    named = dict(zip(VIEWERS, calibrated.items(), strict=True))
    playback = Playback(EPOCH_NS, ManualClock(EPOCH_NS), live=False)
    cameras = {viewer: camera.resized(size) for viewer, (_, camera) in named.items()}
    loop = Loop(cameras, {viewer: FirstFrames(clip["empty_frames"]) for viewer in named}, clip["fps"], additions)
    films = [
        video_frames(VideoFile(folder / "videos" / f"{name}.mp4"), clip["fps"], camera.size, size, playback)
        for name, camera in named.values()
    ]
    for frames in zip(*films, strict=True):
        loop.feed(dict(zip(VIEWERS, frames, strict=True)))
    return loop.track


def trc(track: Track, fps: float) -> str:
    """A TRC file of the track's joint centres, metres, Y up."""
    rows = []
    for frame in sorted(track.baps):
        found = track.estimate(frame)
        if found is not None:
            values = "\t".join(f"{v:.5f}" for v in found.joints.reshape(-1))
            rows.append(f"{frame}\t{frame / fps:.5f}\t{values}")
    names = "\t".join(f"{name}\t\t" for name in JOINTS)
    axes = "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(JOINTS) + 1))
    return "\n".join(
        [
            "PathFileType\t4\t(X/Y/Z)\tevaluation.trc",
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
            f"{fps}\t{fps}\t{len(rows)}\t{len(JOINTS)}\tm\t{fps}\t0\t{len(rows)}",
            f"Frame#\tTime\t{names}",
            f"\t\t{axes}",
            *rows,
            "",
        ]
    )


def scored(job: tuple[str, Size], clips: Path, additions: Additions = IMPROVED) -> dict[str, float]:
    """Output of score_trc.py for one clip at one size, and `mesh_mm`, its mean in the convention of the truth.

    Empty without any estimate.
    """
    cv2.setNumThreads(1)
    name, size = job
    folder = clips / name
    clip = tomllib.loads((folder / "clip.toml").read_text())
    track = track_clip(folder, size, additions)
    with TemporaryDirectory() as place:
        path, converted = Path(place) / f"{name}.trc", Path(place) / f"{name}-mesh.trc"
        path.write_text(trc(track, clip["fps"]))
        result = _score(path, folder, clip["motion_from_frame"])
        if result:
            write_trc(converted, in_mesh_convention(read_trc(path)))
            result["mesh_mm"] = _score(converted, folder, clip["motion_from_frame"])["mpjpe_mm"]
    return result


def _score(path: Path, folder: Path, first: int) -> dict[str, float]:
    """Output of score_trc.py for a TRC file against the truth of a clip; empty when it refuses the file."""
    command = [sys.executable, str(SCORE), str(path), str(folder / "truth.trc"), "--json", "--from", str(first)]
    completed = subprocess.run(command, capture_output=True, text=True)
    if completed.returncode != 0:
        print(f"{folder.name}: {completed.stderr.strip()}", file=sys.stderr)
        return {}
    result: dict[str, float] = json.loads(completed.stdout)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip", nargs="*", default=list(NAMES))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    clips = SHARED / "clips"
    missing = [str(p) for p in (SCORE, *(clips / name for name in options.clip)) if not p.exists()]
    if missing:
        print(f"clips: skipped: {', '.join(missing)} missing (the shared test clips are expected beside the checkout)")
        return
    jobs = [(name, size) for name in options.clip for size in (SMALL, LARGE)]
    with Pool(options.jobs) as pool:
        results = pool.map(partial(scored, clips=clips), jobs, chunksize=1)
    keys = ("mpjpe_mm", "mesh_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct")
    rows = [
        (name, f"{size[0]}x{size[1]}", *(result.get(key, float("nan")) for key in keys), TARGETS[size])
        for (name, size), result in zip(jobs, results, strict=True)
    ]
    columns = ("clip", "size", "mean mm", "mesh's joints", "RMSE mm", "shape mm", "median mm", "lost %", "target mm")
    print(table("Clips, two-view", columns, rows))


if __name__ == "__main__":
    main()
