"""Prior files (data only, with a checksum), and the shipped priors.

See `zenocap.common.formats.model_files` for header and arrays.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.atomic_write import write_atomically
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.errors import UserError
from zenocap.common.formats.model_files import Array, ModelFormat, fail, packed_array, unpacked_array
from zenocap.common.rig import tracker as tracker_table
from zenocap.data import PRIORS
from zenocap.services.tracker.prior.model import Prior, Reconstruction, Training

FORMAT = ModelFormat(b"zenocap prior\n", 1, "prior", "zenocap prior train")
ANATOMIES = {anatomy.name: anatomy for anatomy in (TEN_PARTS, FOURTEEN_PARTS)}
ROUNDING = 1e-6


Count = Annotated[int, Meta(ge=0, le=1 << 40)]
Text = Annotated[str, Meta(max_length=4096)]
Names = Annotated[list[Text], Meta(max_length=10_000)]
Positive = Annotated[float, Meta(gt=0, le=1e6)]
Radians = Annotated[float, Meta(ge=0, le=100)]


class _Errors(Struct, forbid_unknown_fields=True):
    regions: Annotated[int, Meta(ge=1, le=10_000)]
    training: Radians
    held: Radians


class _Training(Struct, forbid_unknown_fields=True):
    motions: Names
    held: Names
    frames: Count
    mirrored: bool
    seed: int
    errors: Annotated[list[_Errors], Meta(max_length=1000)]
    distances: tuple[Radians, Radians, Radians]


class _Contents(Struct, forbid_unknown_fields=True):
    anatomy: Text
    names: Names
    rate: Positive
    centres: Array
    bases: Array
    variances: Array
    residuals: Array
    transitions: Array
    occupancy: Array
    speeds: Array
    training: _Training


ARRAYS = ("centres", "bases", "variances", "residuals", "transitions", "occupancy", "speeds")


def write_prior(path: Path, prior: Prior) -> None:
    """Write a prior atomically.  Raises OSError, and UserError for a prior that could not be read back."""
    content: dict[str, object] = {name: packed_array(getattr(prior, name)) for name in ARRAYS}
    content |= {"anatomy": prior.anatomy, "names": prior.names, "rate": prior.rate, "training": asdict(prior.training)}
    body = msgspec.msgpack.encode(msgspec.convert(content, _Contents, strict=False))
    data = FORMAT.with_header(body)
    parse_prior(path, data)
    write_atomically(path, data)


def read_prior(path: Path, anatomy: Anatomy | None = None) -> Prior:
    """Prior in a file.  anatomy: required one.  Raises UserError and OSError."""
    return parse_prior(path, FORMAT.read(path), anatomy)


def parse_prior(path: Path, data: bytes, anatomy: Anatomy | None = None) -> Prior:
    """Prior in the bytes of a file; path: for errors.  Raises UserError."""
    try:
        contents = msgspec.msgpack.decode(FORMAT.body_of(path, data), type=_Contents)
    except msgspec.MsgspecError as error:
        raise UserError(f"{path}: {error}") from None
    _check_anatomy(path, contents, anatomy)
    prior = _unpacked(path, contents)
    _check_values(path, prior)
    return prior


def _unpacked(path: Path, contents: _Contents) -> Prior:
    """Prior whose arrays have the shapes given by the names, the centres and the bases."""
    regions = contents.centres.shape[0] if contents.centres.shape else 0
    d = len(contents.names)
    m = contents.bases.shape[-1] if contents.bases.shape else 0
    if not (regions >= 1 and 1 <= m <= d):
        fail(path, "bases", f"{regions} regions of {m} dimensions", f"1 or more regions of 1 to {d} dimensions")
    shapes: dict[str, tuple[int, ...]] = {
        "centres": (regions, d),
        "bases": (regions, d, m),
        "variances": (regions, m),
        "residuals": (regions, d),
        "transitions": (regions, regions),
        "occupancy": (regions,),
        "speeds": (d,),
    }
    arrays = {name: unpacked_array(path, name, getattr(contents, name), shape) for name, shape in shapes.items()}
    record = contents.training
    training = Training(
        tuple(record.motions),
        tuple(record.held),
        record.frames,
        record.mirrored,
        record.seed,
        tuple(Reconstruction(row.regions, row.training, row.held) for row in record.errors),
        record.distances,
    )
    return Prior(contents.anatomy, tuple(contents.names), contents.rate, **arrays, training=training)


def _check_anatomy(path: Path, contents: _Contents, required: Anatomy | None) -> None:
    if contents.anatomy not in ANATOMIES:
        fail(path, "anatomy", repr(contents.anatomy), ", ".join(ANATOMIES))
    if required is not None and contents.anatomy != required.name:
        fail(path, "anatomy", repr(contents.anatomy), f"{required.name!r}, the body that is tracked")
    expected = list(coordinates_of(ANATOMIES[contents.anatomy]).names)
    if contents.names != expected:
        fail(path, "names", contents.names, f"those of {contents.anatomy}: {expected}")


def _check_values(path: Path, prior: Prior) -> None:
    if np.abs(prior.centres).max() > 4 * np.pi:
        fail(path, "centres", np.abs(prior.centres).max(), "radians within two turns")
    products = np.einsum("kij,kil->kjl", prior.bases, prior.bases)
    off = np.abs(products - np.eye(prior.dimensions)).max()
    if off > ROUNDING:
        fail(path, "bases", f"columns {off:.3g} off from orthonormal", f"{ROUNDING:g}")
    for name, least in (
        ("variances", 1e-12),
        ("residuals", 0.0),
        ("transitions", 0.0),
        ("occupancy", 0.0),
        ("speeds", 0.0),
    ):
        lowest = float(getattr(prior, name).min())
        if lowest < least:
            fail(path, name, lowest, f"{least:g} or more")
    for name, sums in (("transitions", prior.transitions.sum(axis=1)), ("occupancy", prior.occupancy.sum())):
        worst = float(np.abs(sums - 1.0).max())
        if worst > ROUNDING:
            fail(path, name, f"a sum {worst:.3g} off from 1", f"{ROUNDING:g}")


PRIOR_FOLDER = PRIORS
SUFFIX = tracker_table.SUFFIX


def shipped_names() -> tuple[str, ...]:
    """Names of the shipped priors."""
    return tuple(sorted(path.stem for path in PRIOR_FOLDER.glob(f"*{SUFFIX}")))


def find_prior(text: str) -> Path:
    """Path of a prior given by a shipped name, or as a path from the working directory.  Raises UserError."""
    return tracker_table.find_prior(text, Path())
