"""Adaptive model between two runs of a viewer: a file of its arrays, and the check before reuse.

The file is a NumPy archive (.npz, not compressed) with `version`, `rig`, `viewer`, `source`, `mean`, `weight`, `noise` and
`halo`.  Its mean is a picture of the room: only its owner may read it.
"""

import io
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.vision.adaptive.follow import SUDDEN_SHARE
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.background import Background
from zenocap.common.vision.foreground import ForegroundOptions, foreground
from zenocap.common.vision.relight import relit

VERSION = 2  # 1 had neither rig, viewer nor source
FITTING_SHARE = SUDDEN_SHARE  # of the image, largest that differs where a model still fits: as much as a sudden light
SHIFTS_PX = (-8, -6, -4, -2, -1, 0, 1, 2, 4, 6, 8)  # px, that are compared in both directions; chosen by hand
BETTER, FAR_SIGMAS = 0.9, 4.0  # of the cost without a shift, from which another fits better; see `shift_px`; by hand
LARGEST_BYTES = 2**30  # of a file, before anything of it is read
# Raised by NumPy and zipfile for damaged archives, also of a header that is no Python
UNREADABLE = (KeyError, ValueError, EOFError, SyntaxError, TokenError, zipfile.BadZipFile, zlib.error, RuntimeError)
ARRAYS = ("mean", "weight", "noise", "halo")


@dataclass(frozen=True)
class Owner:
    """The camera that a model belongs to.  source: digest of its device file or address."""

    rig: str
    viewer: str
    source: str


def packed(model: Adaptive, owner: Owner) -> bytes:
    """Content of the file of a model."""
    content = io.BytesIO()
    background = model.background
    np.savez(
        content, version=np.int64(VERSION), rig=owner.rig, viewer=owner.viewer, source=owner.source,
        mean=background.mean, weight=background.weight,
        noise=np.float64(model.noise), halo=np.float64(background.halo),
    )  # fmt: skip
    return content.getvalue()


def write(path: Path, content: bytes) -> None:
    """Write the packed model for its owner only; the folder is made.  Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    write_atomically(path, content, mode=0o600)


def read(path: Path, size: tuple[int, int], owner: Owner) -> Adaptive:
    """The model of a file.  size: (width, height) px of the camera.

    Raises UserError, which names the file, for one that cannot be read, of another version, camera or size.
    """
    try:
        if path.stat().st_size > LARGEST_BYTES or _unpacked(path) > LARGEST_BYTES:
            raise UserError(f"{path}: larger than {LARGEST_BYTES} bytes: no background model")
        with np.load(path, allow_pickle=False) as file:
            version = file["version"]
            if version.shape != () or version != VERSION:
                raise UserError(f"{path}: version = {version}: allowed: {VERSION}")
            kept = Owner(*(str(file[name]) for name in ("rig", "viewer", "source")))
            mean, weight, noise, halo = (file[name] for name in ARRAYS)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror or error}") from error
    except UNREADABLE as error:
        raise UserError(f"{path}: no background model: {error}") from error
    if (kept.rig, kept.viewer) != (owner.rig, owner.viewer):
        raise UserError(
            f"{path}: of viewer {kept.viewer!r} of rig {kept.rig!r}: allowed: {owner.viewer!r} of {owner.rig!r}"
        )
    if kept != owner:
        raise UserError(f"{path}: viewer {owner.viewer!r} had another source: the background is of another camera")
    shape = (size[1], size[0], 3)
    for name, array in (("mean", mean), ("weight", weight)):
        if array.shape != shape or array.dtype != np.float32:
            raise UserError(f"{path}: {name} {array.shape} {array.dtype}: allowed: {shape} float32")
    if not (_within(mean, 0, 256) and _within(weight, 0, 1e6) and _within(noise, 1e-3, 256) and _within(halo, 1, 100)):
        raise UserError(f"{path}: values out of range: no background model")
    return _model(Background(mean, weight, float(halo)), float(noise))


def taken_up(model: Adaptive, frame: Image, options: ForegroundOptions) -> Adaptive | None:
    """A saved model in the light of a frame; None when it shows another view, or too much of the room is different.

    People may be in the frame.  The camera counts as moved where the frame fits the model better when it is shifted.
    Raises ValueError when the frame's shape is not the model's.
    """
    background, most = model.background, FITTING_SHARE * frame[..., 0].size
    labels, gain = foreground(background, frame, options, background.halo)
    if np.count_nonzero(labels) > most:
        changed = relit(background, frame, None, int(np.count_nonzero(labels)), options)
        if changed is None:
            return None
        background = changed
        labels, gain = foreground(background, frame, options, background.halo)
    if np.count_nonzero(labels) > most or shift_px(background, frame, gain) > 0:
        return None
    return _model(background, model.noise)


def shift_px(background: Background, frame: Image, gain: Floats32) -> int:
    """Largest coordinate of the shift, px, at which a frame (height, width, 3) fits a model best; 0 unless clearly better.

    gain: (3,) of the frame.  A pixel counts with its difference in grey, at most FAR_SIGMAS of the noise, so that people
    and moved furniture have little influence.
    """
    known, here = _grey(background.mean * gain), _grey(frame)
    far, reach = FAR_SIGMAS * background.noise, SHIFTS_PX[-1]
    inner = known[reach:-reach:2, reach:-reach]
    height, width = known.shape

    def cost(across: int, down: int) -> float:
        shifted = here[reach + down : height - reach + down : 2, reach + across : width - reach + across]
        return float(np.minimum(np.abs(shifted - inner), far).mean())

    costs = {(across, down): cost(across, down) for across in SHIFTS_PX for down in SHIFTS_PX}
    best = min(costs, key=lambda shift: costs[shift])
    return max(map(abs, best)) if costs[best] < BETTER * costs[0, 0] else 0


def _grey(picture: Image | Floats32) -> Floats32:
    return np.asarray(cv2.cvtColor(np.asarray(picture, dtype=np.float32), cv2.COLOR_BGR2GRAY), dtype=np.float32)


def _model(background: Background, noise: float) -> Adaptive:
    never = np.full(background.mean.shape[:2], -1e9, np.float32)
    return Adaptive(background, background.mean.copy(), never, noise)


def _unpacked(path: Path) -> int:
    with zipfile.ZipFile(path) as archive:
        return sum(entry.file_size for entry in archive.infolist())


def _within(values: Floats32, least: float, most: float) -> bool:
    return bool(np.isfinite(values).all() and (values >= least).all() and (values <= most).all())
