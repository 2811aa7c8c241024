"""Command line that saves a take for a page: `zenocap export` or `zenocap render`."""

import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np

from zenocap.common.errors import UserError, reading
from zenocap.common.formats.export_format import FORMATS, ExportFormat
from zenocap.common.formats.trajectories import Axes
from zenocap.common.recording.summary import read_summary
from zenocap.services.animator.page.save_messages import DRAWN, FILMS, SaveFormat, SaveTake
from zenocap.services.animator.replay_process import ERROR_PREFIX

logger = logging.getLogger(__name__)
BINARY_USD = ".usdc"  # .usd may be of either kind
EDGE_S = 0.0005  # added at either end of a part: the page gives milliseconds, poses have nanoseconds
NOTES = ("note: ", "lost: ")  # prefixes of lines on what a file lacks


class Progress(msgspec.Struct, frozen=True):
    """Line of a command with `--remote`.  total: None where it is unknown."""

    done: int
    total: int | None = None


def page_formats() -> Mapping[str, ExportFormat]:
    """Formats that a page saves: of one file, and without another that they need.  A row that cannot be used is logged."""
    found = {}
    for name in FORMATS.names():
        try:
            row = FORMATS.row(name)
        except UserError as error:
            logger.warning("not offered on the page: %s", error)
            continue
        if row.suffixes and not row.model and name not in DRAWN:
            found[name] = row
    return found


def format_choices() -> list[SaveFormat]:
    """The same for a page."""
    return [
        SaveFormat(name, row.title or name.upper(), row.points, list(row.axes or get_args(Axes)))
        for name, row in page_formats().items()
    ]


def file_name(take: str, request: SaveTake) -> str:
    """Name of the file: that of the take, with the part in seconds, such as walk_2.50-8.00s.bvh."""
    part = ""
    if request.start_s is not None or request.end_s is not None:
        start = f"{request.start_s or 0.0:.2f}"
        part = f"_{start}s" if request.end_s is None else f"_{start}-{request.end_s:.2f}s"
    if request.kind in DRAWN:
        return f"{take}{part}.{request.kind}"
    return f"{take}{part}{BINARY_USD if request.kind == 'usd' else FORMATS.row(request.kind).suffixes[0]}"


def shift_s(take: Path, request: SaveTake, *, raw: bool) -> float:
    """Time of the player's position 0 on the clock of `--from` and `--until`, which is 0 at frame 0; seconds.

    raw: see `read_poses`.  Reads the whole take.  Raises UserError for a part without poses, and for a take without an
    index.
    """
    with reading(take):
        index = read_summary(take)
    if index is None:
        raise UserError(f"{take}: its index is lost, so that no part can be chosen: zenocap recover repairs it")
    from zenocap.common.formats.take_poses import summary_of  # its import takes a third of a second, and pages wait for it

    poses = summary_of(take, raw=raw)
    places_s = (poses.captured_ns - index.start_ns) / 1e9
    start_s, end_s = request.start_s or 0.0, np.inf if request.end_s is None else request.end_s
    if not np.any((places_s >= start_s - EDGE_S) & (places_s <= end_s + EDGE_S)):
        raise UserError(f"the part has no pose: allowed: between {max(0.0, places_s[0]):.2f} and {places_s[-1]:.2f} s")
    return (index.start_ns - poses.start_ns) / 1e9


def command_line(take: Path, output: Path, request: SaveTake, shift: float, *, raw: bool) -> list[str]:
    """The command that writes `output`.  shift: of `shift_s`."""
    command = "render" if request.kind in DRAWN else "export"
    line = [sys.executable, "-P", "-m", "zenocap", command, str(take), "-o", str(output), "--remote"]
    for option, place_s, edge_s in (("--from", request.start_s, -EDGE_S), ("--until", request.end_s, EDGE_S)):
        if place_s is not None:
            line += [option, f"{max(0.0, place_s + shift + edge_s):.9f}s"]
    if request.smooth_hz is not None:
        line += ["--smooth", f"{request.smooth_hz:g}"]
    if raw:
        line.append("--raw")
    if request.kind in DRAWN:
        line += ["--view", request.view, "--size", request.size, "--theme", request.theme]
        line += ["--trails", f"{request.trails_s:g}"] if request.trails_s else []
        line += ["--follow"] if request.follow and request.kind in FILMS else []
        return line
    line += ["--to", request.kind]
    to = FORMATS.row(request.kind)
    line += ["--joints", request.joints] if to.points else []
    axes = request.axes if to.axes is None or len(to.axes) > 1 else to.axes[0]
    line += ["--axes", axes] if to.axes != ("y-up",) else []
    return line


def progress_of(line: str) -> Progress | None:
    """The progress that a line states; None for another line."""
    try:
        return msgspec.json.decode(line, type=Progress)
    except msgspec.MsgspecError:
        return None


def reason(lines: Sequence[str], status: int) -> str:
    """One line on why a command failed.  lines: of its standard error."""
    found = next((line for line in lines if line.startswith(ERROR_PREFIX)), None)
    if found is not None:
        return found.removeprefix(ERROR_PREFIX)
    last = next((line for line in reversed(lines) if line.strip(" │╭╮╰╯─")), "")
    return f"the command ended with status {status}" + (f": {last.strip(' │')}" if last else "")


def notes_of(lines: Sequence[str]) -> list[str]:
    """Notes on what a file lacks, one line each."""
    found = []
    for line in lines:
        for prefix in NOTES:
            if line.startswith(prefix):
                found.append(line.removeprefix(prefix) if prefix == "note: " else line)
    return found
