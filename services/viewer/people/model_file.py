"""The model of the network: where its file is, and the check that it is the right one."""

import hashlib
import os
from pathlib import Path

from zenocap.common.errors import UserError

MODEL = "selfie_segmentation.tflite"
SHA256 = "9ee168ec7c8f2a16c56fe8e1cfbc514974cbbb7e434051b455635f1bd1462f5c"
COMMAND = "zenocap models add people"


class ModelError(UserError):
    """The model file is missing, or is another one."""


def models_folder() -> Path:
    """Folder of the models of the user who runs this: `zenocap/models` in the data folder of the XDG rules."""
    home = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(home) / "zenocap" / "models"


def model_path() -> Path:
    """Path of the model file, which may not exist."""
    return models_folder() / "people" / MODEL


def is_model(content: bytes) -> bool:
    """Whether this is the content of the model file."""
    return hashlib.sha256(content).hexdigest() == SHA256


def read_model() -> bytes:
    """Content of the model file.  Raises ModelError."""
    path = model_path()
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise ModelError(
            f"people = true: no model file {path}: `{COMMAND}` gets it (0.25 MB kept, 36 MB fetched)"
        ) from None
    except OSError as error:
        raise ModelError(f"people = true: {path}: {error.strerror or error}") from error
    if not is_model(content):
        raise ModelError(
            f"people = true: {path}: damaged, or another file: allowed: SHA-256 {SHA256}; `{COMMAND}` replaces it"
        )
    return content
