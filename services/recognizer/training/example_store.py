"""Files of examples beside a model, for `posture add`.

Data only, with a checksum, as model files; features are stored exactly, so that training again gives the same model.  The
file names its model by a digest: beside a model that was trained otherwise since, its examples would be others.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError, reading
from zenocap.common.formats.model_files import MAX_BYTES, ModelFormat, fail
from zenocap.services.recognizer.training.examples import LONGEST_LABEL, Example, TrainingSettings

SUFFIX = ".examples"
FORMAT = ModelFormat(b"ZCEX", 1, "set of examples", "zenocap posture train")
Name = Annotated[str, Meta(min_length=1, max_length=LONGEST_LABEL)]


class _Example(Struct, forbid_unknown_fields=True):
    label: Name
    person: Name
    repetition: Name
    rate: Annotated[float, Meta(gt=0, le=10_000)]
    source: Annotated[str, Meta(max_length=4096)]
    rows: Annotated[int, Meta(ge=1)]
    features: bytes  # (rows, width) little-endian float64, NaN in frames without a pose


class _StoredExamples(Struct, forbid_unknown_fields=True):
    model: Annotated[bytes, Meta(min_length=32, max_length=32)]  # SHA-256 of its file
    settings: dict[str, Any]
    width: Annotated[int, Meta(ge=1, le=10_000)]
    examples: Annotated[list[_Example], Meta(min_length=1)]


def store_path(model: Path) -> Path:
    """File of the examples of a model file."""
    return model.with_suffix(SUFFIX)


def write_examples(model: Path, examples: Sequence[Example], settings: TrainingSettings) -> None:
    """Write the examples of a model file, and the settings of their training, beside it, atomically.

    Raises UserError for too many, and OSError.
    """
    path = store_path(model)
    stored = [
        _Example(
            one.label, one.person, one.repetition, one.rate, one.source[:4096], len(one.features),
            np.ascontiguousarray(one.features, dtype="<f8").tobytes(),
        )
        for one in examples
    ]  # fmt: skip
    contents = _StoredExamples(_digest(model), asdict(settings), examples[0].features.shape[1], stored)
    data = FORMAT.with_header(msgspec.msgpack.encode(contents))
    if len(data) > MAX_BYTES:
        raise UserError(f"{path}: {len(data)} bytes of examples: allowed: at most {MAX_BYTES}")
    write_atomically(path, data)


def read_stored(model: Path) -> tuple[list[Example], TrainingSettings]:
    """Examples and settings of a model file.  Raises UserError, which names the file."""
    path = store_path(model)
    try:
        with reading(path):
            body = FORMAT.body_of(path, FORMAT.read(path))
        contents = msgspec.msgpack.decode(body, type=_StoredExamples)
        settings = msgspec.convert(contents.settings, TrainingSettings)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: no examples of this version of zenocap: {error}: train the model again") from error
    with reading(model):
        same = contents.model == _digest(model)
    if not same:
        raise UserError(
            f"{path}: of another model than {model}: allowed: the examples that it was trained with; train it again"
        )
    return [_unpacked(path, number, one, contents.width) for number, one in enumerate(contents.examples)], settings


def _digest(model: Path) -> bytes:
    return hashlib.sha256(model.read_bytes()).digest()


def _unpacked(path: Path, number: int, one: _Example, width: int) -> Example:
    if len(one.features) != 8 * one.rows * width:
        fail(path, f"examples[{number}].features", f"{len(one.features)} bytes", f"{8 * one.rows * width} bytes")
    rows: Floats = np.frombuffer(one.features, dtype="<f8").reshape(one.rows, width).astype(np.float64)
    if np.isinf(rows).any():
        fail(path, f"examples[{number}].features", "infinite", "finite numbers, or NaN without a pose")
    return Example(one.label, one.person, one.repetition, one.rate, rows, one.source)


def joined(stored: Sequence[Example], further: Sequence[Example]) -> list[Example]:
    """Stored examples and further ones, in this order; repetitions that a person has already get the next free number.

    Raises UserError for a further example that is stored already: it would count twice.
    """
    known = {(one.label, one.features.tobytes()): one for one in stored}
    taken = {(one.label, one.person, one.repetition) for one in stored}
    result = list(stored)
    for one in further:
        earlier = known.get((one.label, one.features.tobytes()))
        if earlier is not None:
            raise UserError(f"{one}: the same movement as {earlier}, which the model has: allowed: further examples only")
        number = 1
        repetition = one.repetition
        while (one.label, one.person, repetition) in taken:
            repetition, number = str(number), number + 1
        taken.add((one.label, one.person, repetition))
        result.append(replace(one, repetition=repetition))
    return result
