"""Files of learnt models and detected corners: data only, with a checksum.

A header (magic, version, CRC-32 and length of the rest), then one MessagePack map.  An array is its shape and its
little-endian float64 values, or float32 where they have no more digits.
"""

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Annotated, NoReturn, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError

MAX_BYTES = 64 << 20
Contents = TypeVar("Contents", bound=Struct)


class Array(Struct, forbid_unknown_fields=True):
    """An array in a file."""

    shape: Annotated[list[Annotated[int, Meta(ge=0, le=10_000)]], Meta(max_length=3)]
    data: bytes


@dataclass(frozen=True)
class ModelFormat:
    """Header of one kind of file.  magic: its first bytes.  noun: of the model, for errors.  command: that writes it.

    again: what to do with a file of another version.
    """

    magic: bytes
    version: int
    noun: str
    command: str
    again: str = "train it again"

    @property
    def header(self) -> struct.Struct:
        return struct.Struct(f"<{len(self.magic)}sHIQ")

    def with_header(self, body: bytes) -> bytes:
        """Content of a file.  body: the MessagePack map."""
        return self.header.pack(self.magic, self.version, zlib.crc32(body), len(body)) + body

    def body_of(self, path: Path, data: bytes) -> bytes:
        """The MessagePack map of a file's content.  path: for errors.  Raises UserError."""
        if data[: len(self.magic)] != self.magic[: len(data)] or not data:
            begins = data[: len(self.magic)]
            raise UserError(f"{path}: begins with {begins!r}: allowed: {self.magic!r}, a file of `{self.command}`")
        if len(data) < self.header.size:
            raise UserError(f"{path}: cut: {len(data)} bytes: allowed: {self.header.size} or more")
        _, version, checksum, length = self.header.unpack_from(data)
        body = data[self.header.size :]
        if version != self.version:
            allowed = f"{self.version}; {self.again} with this version of zenocap"
            raise UserError(f"{path}: version = {version}: allowed: {allowed}")
        if len(body) != length:
            how = "cut" if len(body) < length else f"bytes after the {self.noun}"
            raise UserError(f"{path}: {how}: {len(body)} bytes after the header: allowed: {length}")
        if zlib.crc32(body) != checksum:
            raise UserError(f"{path}: damaged: checksum = {zlib.crc32(body):08x}: allowed: {checksum:08x}")
        return body

    def encoded(self, path: Path, content: Mapping[str, object], kind: type[Struct]) -> bytes:
        """Content of a file.  content: fields of `kind`.  path: for errors.  Raises UserError for wrong values."""
        try:
            return self.with_header(msgspec.msgpack.encode(msgspec.convert(content, kind, strict=False)))
        except msgspec.ValidationError as error:
            raise UserError(f"{path}: {error}") from None

    def decoded(self, path: Path, data: bytes, kind: type[Contents]) -> Contents:
        """The map of a file's content.  path: for errors.  Raises UserError."""
        try:
            return msgspec.msgpack.decode(self.body_of(path, data), type=kind)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            raise UserError(f"{path}: {error}") from None

    def read(self, path: Path) -> bytes:
        """Content of a file.  Raises UserError for one larger than MAX_BYTES, and OSError."""
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise UserError(f"{path}: {size} bytes: allowed: at most {MAX_BYTES} of a {self.noun}")
        return path.read_bytes()


def _type(single: bool) -> str:
    return "<f4" if single else "<f8"


def packed_array(array: Floats, *, single: bool = False) -> dict[str, object]:
    """The array as in a file.  single: in single precision."""
    return {"shape": list(array.shape), "data": np.ascontiguousarray(array, dtype=_type(single)).tobytes()}


def unpacked_array(path: Path, name: str, packed: Array, shape: tuple[int, ...], *, single: bool = False) -> Floats:
    """Array of this shape with finite numbers.  path, name: for errors.  single: see `packed_array`.  Raises UserError."""
    kind = np.dtype(_type(single))
    if tuple(packed.shape) != shape:
        fail(path, f"{name}.shape", packed.shape, list(shape))
    size = kind.itemsize * prod(shape)
    if len(packed.data) != size:
        fail(path, f"{name}.data", f"{len(packed.data)} bytes", f"{size} bytes")
    array = np.frombuffer(packed.data, dtype=kind).reshape(shape).astype(np.float64)
    if not np.all(np.isfinite(array)):
        fail(path, name, array[~np.isfinite(array)][0], "finite numbers")
    return array


def fail(path: Path, field: str, value: object, allowed: object) -> NoReturn:
    """Raise UserError for a field."""
    raise UserError(f"{path}: {field} = {value}: allowed: {allowed}")
