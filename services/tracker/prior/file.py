"""Prior files: data only, with a checksum.

See `zenocap.common.formats.model_files` for header and arrays.
"""

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.atomic_write import write_atomically
from zenocap.common.body.anatomy import ANATOMIES, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.errors import UserError
from zenocap.common.formats.model_files import Array, ModelFormat, fail, packed_array, unpacked_array
from zenocap.services.tracker.prior.model import Names, Prior, PriorTraining

FORMAT = ModelFormat(b"zenocap prior\n", 1, "prior", "zenocap prior train")
ROUNDING = 1e-6


class _Contents(Struct, forbid_unknown_fields=True):
    anatomy: Annotated[str, Meta(max_length=4096)]
    names: Names
    rate: Annotated[float, Meta(gt=0, le=1e6)]
    centres: Array
    bases: Array
    variances: Array
    residuals: Array
    transitions: Array
    occupancy: Array
    speeds: Array
    training: PriorTraining


def write_prior(path: Path, prior: Prior) -> None:
    """Write a prior atomically.  Raises OSError, and UserError for a prior that could not be read back."""
    found = {name: getattr(prior, name) for name in _Contents.__struct_fields__}
    content = {name: packed_array(one) if isinstance(one, np.ndarray) else one for name, one in found.items()}
    data = FORMAT.with_header(msgspec.msgpack.encode(content))
    parse_prior(path, data)
    write_atomically(path, data)


def read_prior(path: Path, anatomy: Anatomy | None = None) -> Prior:
    """Prior in a file.  anatomy: required one.  Raises UserError and OSError."""
    return parse_prior(path, FORMAT.read(path), anatomy)


def parse_prior(path: Path, data: bytes, anatomy: Anatomy | None = None) -> Prior:
    """Prior in the bytes of a file; path: for errors.  Raises UserError."""
    try:
        contents = msgspec.msgpack.decode(FORMAT.body_of(path, data), type=_Contents)
    except (ValueError, RecursionError) as error:
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
    return Prior(contents.anatomy, contents.names, contents.rate, **arrays, training=contents.training)


def _check_anatomy(path: Path, contents: _Contents, required: Anatomy | None) -> None:
    if contents.anatomy not in ANATOMIES:
        fail(path, "anatomy", repr(contents.anatomy), ", ".join(ANATOMIES))
    if required is not None and contents.anatomy != required.name:
        fail(path, "anatomy", repr(contents.anatomy), f"{required.name!r}, the body that is tracked")
    expected = coordinates_of(ANATOMIES[contents.anatomy]).names
    if contents.names != expected:
        fail(path, "names", list(contents.names), f"those of {contents.anatomy}: {list(expected)}")


def _check_values(path: Path, prior: Prior) -> None:
    if np.abs(prior.centres).max() > 4 * np.pi:
        fail(path, "centres", np.abs(prior.centres).max(), "radians within two turns")
    products = np.einsum("kij,kil->kjl", prior.bases, prior.bases)
    off = np.abs(products - np.eye(prior.dimensions)).max()
    if off > ROUNDING:
        fail(path, "bases", f"columns {off:.3g} off from orthonormal", f"{ROUNDING:g}")
    for name in ("variances", "residuals", "transitions", "occupancy", "speeds"):
        lowest, least = float(getattr(prior, name).min()), 1e-12 if name == "variances" else 0.0
        if lowest < least:
            fail(path, name, lowest, f"{least:g} or more")
    for name, sums in (("transitions", prior.transitions.sum(axis=1)), ("occupancy", prior.occupancy.sum())):
        worst = float(np.abs(sums - 1.0).max())
        if worst > ROUNDING:
            fail(path, name, f"a sum {worst:.3g} off from 1", f"{ROUNDING:g}")
