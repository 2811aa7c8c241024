"""The verdict on the shared clips, with faults in calibration, order and time of the videos.

    python -m benchmarks.verdict.clips [--clip NAME ...] [--fault NAME ...] [--jobs 1]

Every case is a folder with the clip's videos, tracked by `zenocap track` in a process of its own and scored against the
clip's truth by time (`zenocap evaluate`).  No parameter was chosen on these clips.  The references of the real clips are
triangulated key points, a few centimetres off.
"""

import argparse
import json
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.pool import ThreadPool
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.clips import SHARED
from benchmarks.table import Cell, table
from benchmarks.verdict.truth import CLASSES
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.verdict.parameters import GOOD_ERROR_M, GOOD_LOST, UNUSABLE_ERROR_M, UNUSABLE_LOST

STATUS = {0: "good", 3: "doubtful", 4: "unusable"}
RING = ("cam01", "cam03", "cam05")  # of seven cameras, a third of the ring or more apart
VERDICT = "verdict: "
TRUTHS = ("truth.trc", "reference.trc", "reference_P1.trc")


@dataclass(frozen=True)
class Folder:
    """What `zenocap track` gets.  videos: source by camera.  offsets_s: of sync.toml."""

    cameras: dict[str, Camera]
    videos: dict[str, Path]
    offsets_s: dict[str, float] = field(default_factory=dict)

    @property
    def changed(self) -> str:
        """Camera that a fault changes."""
        return sorted(self.videos)[1]


Fault = Callable[[Folder], Folder]


def none(folder: Folder) -> Folder:
    return folder


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


FAULTS: dict[str, Fault] = {
    "none": none,
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


@dataclass(frozen=True)
class Case:
    """One tracked folder.  mean_m and lost: against the truth; verdict: line of `track`."""

    clip: str
    fault: str
    status: int
    mean_m: float
    lost: float
    verdict: str

    @property
    def truth(self) -> str:
        if not np.isfinite(self.mean_m) or self.mean_m > UNUSABLE_ERROR_M or self.lost > UNUSABLE_LOST:
            return "unusable"
        return "good" if self.mean_m <= GOOD_ERROR_M and self.lost <= GOOD_LOST else "doubtful"

    @property
    def found(self) -> str:
        return self.verdict.split()[0].rstrip(":,;") if self.verdict else STATUS.get(self.status, f"status {self.status}")


def tried(clip: str, fault: str) -> Case:
    source = SHARED / "clips" / clip.split(",")[0]
    settings = tomllib.loads((source / "clip.toml").read_text())
    videos = {path.stem: path for path in sorted((source / "videos").iterdir()) if path.suffix in (".mp4", ".mkv", ".avi")}
    chosen = {name: path for name, path in videos.items() if name in (CLIPS[clip] or videos)}
    up_axis = str(settings["up_axis"])
    folder = FAULTS[fault](Folder(read_calibration(source / "calibration.toml", up_axis), chosen))
    with TemporaryDirectory(prefix="zenocap-") as place:
        root, take = Path(place) / source.name, Path(place) / "take.mcap"
        (root / "videos").mkdir(parents=True)
        for name, path in folder.videos.items():
            (root / "videos" / f"{name}{path.suffix}").symlink_to(path)
        for name in ("background", "stretched", "clip.toml"):
            if (source / name).exists():
                (root / name).symlink_to(source / name)
        write_calibration(root / "calibration.toml", folder.cameras, up_axis)
        if folder.offsets_s:
            lines = (f"{name} = {offset}\n" for name, offset in folder.offsets_s.items())
            (root / "sync.toml").write_text("[offset_s]\n" + "".join(lines))
        done = _zenocap("track", str(root), "-o", str(take), "--jobs", "1", "--cameras", ",".join(sorted(folder.videos)))
        printed = (done.stdout + done.stderr).splitlines()
        verdict = next((line.removeprefix(VERDICT) for line in printed if line.startswith(VERDICT)), "")
        mean_m, lost = float("nan"), 1.0
        truth = next(
            source / name for name in ("truth.trc", "reference.trc", "reference_P1.trc") if (source / name).is_file()
        )
        if take.is_file():
            halpe = ["--joints", "halpe"] if truth.name != "truth.trc" else []
            since = str(settings.get("motion_from_frame", 0))
            scored = _zenocap("evaluate", str(take), "--truth", str(truth), "--from", since, "--json", *halpe)
            if scored.returncode == 0:
                figures = json.loads(scored.stdout)
                mean_m, lost = figures["mpjpe_mm"] / 1e3, figures["lost_pct"] / 100
        return Case(clip, fault, done.returncode, mean_m, lost, verdict)


def _zenocap(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "zenocap", *arguments], capture_output=True, text=True, check=False)


def summary(cases: Sequence[Case]) -> str:
    counts = Counter((case.truth, case.found) for case in cases)
    rows: list[list[Cell]] = [[f"{true} in truth", *(counts[true, found] for found in CLASSES)] for true in CLASSES]
    return table("Verdict on the shared clips", ("takes", *CLASSES), rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", nargs="+", choices=CLIPS, default=list(CLIPS), metavar="NAME")
    parser.add_argument("--fault", nargs="+", choices=FAULTS, default=list(FAULTS), metavar="NAME")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    if not (SHARED / "clips").is_dir():
        print(f"verdict.clips: skipped: {SHARED / 'clips'} missing (expected beside the checkout)")
        return
    with ThreadPool(options.jobs) as pool:
        cases = pool.starmap(tried, [(clip, fault) for clip in options.clip for fault in options.fault], chunksize=1)
    columns = ("clip", "fault", "mean mm", "lost %", "in truth", "verdict")
    rows: list[list[Cell]] = [
        [c.clip, c.fault, c.mean_m * 1e3, c.lost * 100, c.truth, c.verdict or f"status {c.status}"] for c in cases
    ]
    print(table("Takes", columns, rows))
    print(summary(cases))


if __name__ == "__main__":
    main()
