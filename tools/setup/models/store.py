"""The model files of detectors in the user's data folder: added, listed, removed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.rig.detectors import NOTE, Detector


@dataclass(frozen=True)
class ModelState:
    """state: "missing", "present", or "damaged" where a file has another content.  size: bytes.

    path: of the file, or of the folder of several.
    """

    name: str
    path: Path
    state: str
    size: int


def state_of(detector: Detector) -> ModelState:
    """State of the files of a detector.  Raises UserError for one that cannot be read."""
    paths = [detector.folder / file.name for file in detector.files]
    state, size = "present", 0
    for path, file in zip(paths, detector.files, strict=True):
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            state = "missing"
            continue
        except OSError as error:
            raise UserError(f"{path}: {error.strerror or error}") from error
        size += len(content)
        if not file.is_content(content) and state == "present":
            state = "damaged"
    return ModelState(detector.name, paths[0] if len(paths) == 1 else detector.folder, state, size)


def add(detector: Detector, contents: Callable[[], Sequence[bytes]]) -> tuple[Path, bool]:
    """Keep the files of a detector: their path, and whether they were written; right ones that are there are left alone.

    contents: returns those of its files, and is called only when they are needed.  Raises UserError; earlier files are
    unchanged then.
    """
    state = state_of(detector)
    if state.state == "present":
        return state.path, False
    found = contents()
    for file, content in zip(detector.files, found, strict=True):
        if not file.is_content(content):
            raise UserError(f"models add {detector.name}: {file.name}: another file: allowed: SHA-256 {file.sha256}")
    try:
        detector.folder.mkdir(parents=True, exist_ok=True)
        write_atomically(detector.folder / NOTE, detector.licence.encode())
        for file, content in zip(detector.files, found, strict=True):
            write_atomically(detector.folder / file.name, content)
    except OSError as error:
        raise UserError(f"{state.path}: cannot be written: {error.strerror or error}") from error
    return state.path, True


def remove(detector: Detector) -> bool:
    """Delete the files of a detector and their note; returns whether there was one.  Raises UserError."""
    paths = [detector.folder / file.name for file in detector.files]
    try:
        there = any(path.exists() for path in paths)
        for path in (*paths, detector.folder / NOTE):
            path.unlink(missing_ok=True)
        if detector.folder.is_dir() and not any(detector.folder.iterdir()):
            detector.folder.rmdir()
    except OSError as error:
        raise UserError(f"{paths[0]}: cannot be removed: {error.strerror or error}") from error
    return there
