"""`zenocap export`: a take in the formats of other programs."""

from collections.abc import Callable, Mapping
from pathlib import Path

from common.formats.csv import write_csv
from common.formats.poses import Poses, read_poses
from common.formats.trc import FormatError, write_trc

WRITERS: Mapping[str, Callable[[Path, Poses], None]] = {
    "trc": lambda path, poses: write_trc(path, poses.trajectories()),
    "csv": write_csv,
}


def export(take: Path, to: str, output: Path) -> Poses:
    """Write the poses of `take` to `output`.  Raises FormatError and TakeError."""
    poses = read_poses(take)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        WRITERS[to](output, poses)
    except OSError as error:
        raise FormatError(f"{output}: cannot be written: {error.strerror or error}") from error
    return poses
