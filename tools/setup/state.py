"""State of a set-up: what its folder contains, so that it can be left and taken up again.

cameras.toml        names and sources of the cameras, size and rate; looked = true after the cameras were looked at
calibration.toml    of the cameras
rig.toml            the rig file
recordings/         takes
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.source_kinds import named_source, parse_source
from zenocap.common.rig.sources import Announced, VideoFile
from zenocap.common.rig.viewers import SAME_SHAPE
from zenocap.common.toml_file import quoted, read_toml
from zenocap.tools.setup.network import OPEN, Network, network_of

Step = Literal["cameras", "look", "calibration", "rig", "take"]
STEPS: tuple[Step, ...] = get_args(Step)
CAMERAS, CALIBRATION, RIG, TAKES = "cameras.toml", "calibration.toml", "rig.toml", "recordings"
WORKING_WIDTH = 960  # px; wider images are reduced: the tracker needs no more, and segmentation costs by the pixel


class StepError(UserError):
    """What a step has left is not right.  step: with which the set-up goes on."""

    def __init__(self, step: Step, folder: Path, problem: UserError) -> None:
        super().__init__(f"{problem}; then: zenocap setup {folder} --again {step}")
        self.step: Step = step


@dataclass(frozen=True)
class Cameras:
    """sources: by name, as in a rig file.  size: (width, height) px.  looked: whether they were looked at.

    network: of the cameras of other machines.
    """

    sources: Mapping[str, str]
    size: tuple[int, int] = (1280, 720)
    fps: float = 30.0
    looked: bool = False
    network: Network = OPEN

    @property
    def away(self) -> dict[str, Announced]:
        """Those of other machines."""
        parsed = {name: parse_source(source, Path()) for name, source in self.sources.items()}
        return {name: source for name, source in parsed.items() if isinstance(source, Announced)}


def named(text: str) -> tuple[str, str]:
    """Name and source of NAME=SOURCE.  Raises UserError."""
    name, parsed = named_source(text, "left=/dev/video0")
    source = text.partition("=")[2]
    return name, str(Path(source).resolve()) if isinstance(parsed, VideoFile) else source


def read_cameras(folder: Path) -> Cameras | None:
    """Cameras of the set-up; None before the first step.  Raises UserError."""
    path = folder / CAMERAS
    if not path.is_file():
        return None
    content = read_toml(path)
    sources, size, fps = content.get("sources"), content.get("size"), content.get("fps")
    if not isinstance(sources, dict) or len(sources) < 2 or not all(isinstance(one, str) for one in sources.values()):
        raise UserError(f'{path}: sources: allowed: a table with two cameras or more, NAME = "SOURCE"')
    if not isinstance(size, list) or len(size) != 2 or not all(isinstance(one, int) and 16 <= one <= 16384 for one in size):
        raise UserError(f"{path}: size = {size!r}: allowed: [width, height], 16 to 16384 px")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 1 <= fps <= 240:
        raise UserError(f"{path}: fps = {fps!r}: allowed: 1 to 240")
    for name, source in sources.items():
        named(f"{name}={source}")
    network = network_of(path, content.get("zenoh"))
    return Cameras(sources, (size[0], size[1]), float(fps), content.get("looked") is True, network)


def write_cameras(folder: Path, cameras: Cameras) -> None:
    """Write the first step's file; only its owner may read it, for it may have passwords.  Raises OSError."""
    lines = [f"size = [{cameras.size[0]}, {cameras.size[1]}]", f"fps = {cameras.fps:g}"]
    lines += [f"looked = {str(cameras.looked).lower()}", "", "[sources]"]
    lines += [f"{quoted(name)} = {quoted(source)}" for name, source in cameras.sources.items()]
    lines += cameras.network.lines()
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / CAMERAS, ("\n".join(lines) + "\n").encode(), mode=0o600)


def takes_in(folder: Path) -> list[Path]:
    """Takes of the set-up, oldest first."""
    return sorted((folder / TAKES).glob("*.mcap"), key=lambda path: path.stat().st_mtime)


def next_step(folder: Path) -> Step | None:
    """The first step that is not done; None after the last.  Raises StepError, UserError for files that are not right."""
    cameras = read_cameras(folder)
    if cameras is None:
        return "cameras"
    if not cameras.looked:
        return "look"
    if not (folder / CALIBRATION).is_file():
        return "calibration"
    try:
        check_calibration(folder / CALIBRATION, cameras)
    except UserError as problem:
        raise StepError("calibration", folder, problem) from problem
    if not (folder / RIG).is_file():
        return "rig"
    try:
        load_rig(folder / RIG, files=False)
    except UserError as problem:
        raise StepError("rig", folder, problem) from problem
    return None if takes_in(folder) else "take"


def reached_step(folder: Path) -> Step | None:
    """As `next_step`, also where a later step has to be repeated because of what it has left.  Raises UserError."""
    try:
        return next_step(folder)
    except StepError as problem:
        return problem.step


def check_calibration(path: Path, cameras: Cameras) -> None:
    """Raise UserError where a camera is not in the calibration, or is there for images of another shape."""
    calibrated = read_calibration(path)
    if missing := [name for name in cameras.sources if name not in calibrated]:
        raise UserError(
            f"{path}: no camera {', '.join(missing)}; there are: {', '.join(calibrated)}: allowed: one for each camera of "
            f"{CAMERAS}"
        )
    for name in cameras.sources:
        width, height = calibrated[name].size
        if not has_shape(cameras.size, (width, height)):
            raise UserError(
                f"{path}: {name}: for images of {width} x {height}, and {CAMERAS} requests {cameras.size[0]} x "
                f"{cameras.size[1]}, of another shape: allowed: size = [{width}, {height}] there, or a calibration of the "
                "images that are requested"
            )


def has_shape(size: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether sizes (width, height) have the same aspect ratio."""
    return abs(size[0] * other[1] / (size[1] * other[0]) - 1.0) <= SAME_SHAPE


def rig_text(name: str, cameras: Cameras) -> str:
    """The rig file: every camera a viewer, the tracker, takes of all."""
    width, height = cameras.size
    lines = [
        "# Written by zenocap setup; docs/cameras.md, docs/tracker.md and docs/machines.md have the keys.",
        f'name = "{plain_name(name)}"',
        f'calibration = "{CALIBRATION}"',
        'method = "hybrid"',
        "",
        "[log]",
        f'folder = "{TAKES}"',
        *cameras.network.lines(),
    ]
    for camera, source in cameras.sources.items():
        lines += ["", "[[viewer]]", f'id = "{camera}"', f'camera = "{camera}"', f"source = {quoted(source)}"]
        lines.append('background = "adaptive"  # learnt all the time; best when the scene is empty at first')
        lines.append(f"fps = {cameras.fps:g}")
        if width > WORKING_WIDTH:
            factor = -(-width // WORKING_WIDTH)
            lines.append(f"size = [{width // factor}, {height // factor}]  # images are reduced to this")
        lines.append("preview = true  # small images for the page; false: no image leaves this machine")
    return "\n".join(lines) + "\n"
