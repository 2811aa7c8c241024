"""MessagePack encoding and decoding of messages, with all limits of received data.

All bytes from outside pass through `decode`: it bounds size, nesting and counts before building anything large, then
checks types, ranges and field names.  It raises only `BadMessage`.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TypeVar

import msgpack
import msgspec
import msgspec.inspect as mi
import numpy as np

from zenocap.common.messages import SCHEMA_VERSION, Message, PartialBdp
from zenocap.common.runtime.foreign_text import printable

M = TypeVar("M", bound=Message)

SMALL_BYTES = 64 << 10  # a message without its `bytes` fields
MAX_CONTAINERS = 4096  # number of lists and maps in a message with `bytes` fields
MAX_LENGTH = 256  # elements of a list or map
MAX_TEXT = 4096
MAX_BINARY = 4 << 20
# Fields without a reader that takes of earlier versions have.
REMOVED_FIELDS: Mapping[type[Message], frozenset[str]] = {PartialBdp: frozenset({"height_px", "score"})}


class BadMessage(ValueError):
    """Bytes or values that are not a valid message; the text names the message, the field and the reason."""


class OtherVersion(BadMessage):
    """A message of another wire version; the text has both versions and the remedy."""


def encode(message: Message) -> bytes:
    """MessagePack bytes of `message`, checked as on receipt, so that an invalid value fails at its origin.

    Raises BadMessage.
    """
    expected = type(message)
    try:
        plain = msgspec.to_builtins(message, builtin_types=(bytes,), enc_hook=_plain_number)
        msgspec.convert(plain, expected)
        data: bytes = msgpack.packb(plain)
    except (ValueError, TypeError, OverflowError, msgspec.MsgspecError) as error:
        raise BadMessage(f"{expected.__name__}: {error}") from error
    if len(data) > size_limit(expected):
        raise BadMessage(f"{expected.__name__}: {len(data)} bytes, more than {size_limit(expected)}")
    return data


def _plain_number(value: object) -> object:
    """Convert a numpy number to Python's own type, which can be encoded."""
    if isinstance(value, np.floating | np.integer | np.bool_):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be sent")


def decode(data: bytes, expected: type[M]) -> M:
    """The message in `data`.

    Raises BadMessage when it is not exactly one valid message of type `expected`, OtherVersion for another wire version.
    """
    limit = size_limit(expected)
    if len(data) > limit:
        raise BadMessage(f"{expected.__name__}: {len(data)} bytes, more than {limit}")
    try:
        plain = _unpack(data)
        if not isinstance(plain, dict) or "type" not in plain:
            raise BadMessage(f"{expected.__name__}: not a map with the key 'type'")
        version = plain.get("version", SCHEMA_VERSION)
        if isinstance(version, int) and version != SCHEMA_VERSION:
            raise OtherVersion(
                f"{expected.__name__}: the sender has wire version {version}, this program {SCHEMA_VERSION}: install the "
                "same zenocap on every machine (`zenocap doctor` names the versions)"
            )
        removed = REMOVED_FIELDS.get(expected, ())
        return msgspec.convert({key: value for key, value in plain.items() if key not in removed}, expected)
    except BadMessage:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError, MemoryError, msgspec.MsgspecError) as error:
        raise BadMessage(f"{expected.__name__}: {printable(error) or type(error).__name__}") from error


@cache
def size_limit(message: type[Message]) -> int:
    """Largest size of a message of this type, bytes: 64 KiB plus the limits of its `bytes` fields.

    Raises TypeError for a type that cannot be checked: a float without a range accepts NaN and infinity, and `bytes`
    without max_length have no limit.
    """
    limit = SMALL_BYTES
    for path, leaf in _leaves(mi.type_info(message), message.__name__):
        match leaf:
            case mi.FloatType(ge=None, gt=None) | mi.FloatType(le=None, lt=None):
                raise TypeError(f"{path}: a float on the wire needs a range on both sides (Meta(ge=..., le=...))")
            case mi.BytesType(max_length=None):
                raise TypeError(f"{path}: bytes on the wire need Meta(max_length=...)")
            case mi.BytesType(max_length=int(length)):
                limit += length
            case mi.AnyType() | mi.RawType():
                raise TypeError(f"{path}: no fixed type, so it cannot be checked")
            case _:
                pass
    return limit


@cache
def json_schema(message: type[Message]) -> bytes:
    """JSON Schema of a message type, for the channels of a recording."""
    return msgspec.json.format(msgspec.json.encode(msgspec.json.schema(message)), indent=1)


def _unpack(data: bytes) -> object:
    # Each byte of a list of empty lists takes about 80 bytes of memory: negligible below SMALL_BYTES; above it,
    # containers are counted.  The unpacker itself limits nesting to 1024.
    hook = None if len(data) <= SMALL_BYTES else _container_counter()
    unpacked: object = msgpack.unpackb(
        data, object_hook=hook, list_hook=hook, ext_hook=_refuse_extension, strict_map_key=True, max_str_len=MAX_TEXT,
        max_bin_len=MAX_BINARY, max_array_len=MAX_LENGTH, max_map_len=MAX_LENGTH, max_ext_len=0,
    )  # fmt: skip
    return unpacked


def _refuse_extension(code: int, _: bytes) -> object:
    raise ValueError(f"extension type {code}")


def _container_counter() -> Callable[[object], object]:
    count = 0

    def counted(container: object) -> object:
        nonlocal count
        count += 1
        if count > MAX_CONTAINERS:
            raise ValueError(f"more than {MAX_CONTAINERS} lists and maps")
        return container

    return counted


def _leaves(kind: mi.Type, path: str) -> Iterator[tuple[str, mi.Type]]:
    match kind:
        case mi.Metadata(type=inner):
            yield from _leaves(inner, path)
        case mi.StructType(fields=fields):
            for field in fields:
                yield from _leaves(field.type, f"{path}.{field.name}")
        case mi.DictType(key_type=key, value_type=value):
            yield from _leaves(key, f"{path}[key]")
            yield from _leaves(value, f"{path}[...]")
        case mi.ListType(item_type=item) | mi.VarTupleType(item_type=item):
            yield from _leaves(item, f"{path}[...]")
        case mi.TupleType(item_types=items) | mi.UnionType(types=items):
            for index, item in enumerate(items):
                yield from _leaves(item, f"{path}[{index}]")
        case _:
            yield path, kind
