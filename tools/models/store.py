"""The model files in the user's data folder: added, listed, removed."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.services.viewer.people.model_file import SHA256, is_model, model_path

LICENCE_NOTE = f"""selfie_segmentation.tflite: the general model of MediaPipe Selfie Segmentation.
Copyright The MediaPipe Authors.  Licensed under the Apache License, Version 2.0; text: the file LICENSE of zenocap, or
https://www.apache.org/licenses/LICENSE-2.0
Taken unchanged from a wheel of the package mediapipe.  SHA-256 {SHA256}
"""
NOTE = "LICENCE.txt"


@dataclass(frozen=True)
class ModelState:
    """state: "missing", "present", or "damaged" for a file of another content.  size: bytes, 0 where missing."""

    name: str
    path: Path
    state: str
    size: int


def people_state() -> ModelState:
    """State of the model `people`.  Raises UserError for a file that cannot be read."""
    path = model_path()
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return ModelState("people", path, "missing", 0)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror or error}") from error
    return ModelState("people", path, "present" if is_model(content) else "damaged", len(content))


def add_people(content: Callable[[], bytes]) -> tuple[Path, bool]:
    """Keep the model file: its path, and whether it was written; a file that is there and right is left alone.

    content: returns the file, and is called only when it is needed.  Raises UserError; an earlier file is unchanged then.
    """
    state = people_state()
    if state.state == "present":
        return state.path, False
    data = content()
    try:
        state.path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(state.path.with_name(NOTE), LICENCE_NOTE.encode())
        write_atomically(state.path, data)
    except OSError as error:
        raise UserError(f"{state.path}: cannot be written: {error.strerror or error}") from error
    return state.path, True


def remove_people() -> bool:
    """Delete the model file and its note; returns whether there was one.  Raises UserError."""
    path = model_path()
    try:
        there = path.exists()
        path.unlink(missing_ok=True)
        path.with_name(NOTE).unlink(missing_ok=True)
        if path.parent.is_dir() and not any(path.parent.iterdir()):
            path.parent.rmdir()
    except OSError as error:
        raise UserError(f"{path}: cannot be removed: {error.strerror or error}") from error
    return there
