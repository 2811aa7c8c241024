"""The codec passes valid messages unchanged and raises only BadMessage for everything else."""

import json
import math
import tracemalloc
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.support.built_messages import built
from tests.support.hostile import plain
from tests.support.message_strategies import MESSAGE_TYPES, MESSAGES
from zenocap.common import messages as m
from zenocap.common.codec import MAX_BINARY, SMALL_BYTES, BadMessage, OtherVersion, decode, encode, json_schema, size_limit

CAMERA = built(m.CameraInfo, distortions=[0.1, 0.0])


def floats_in(value: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Paths of all floats in nested dicts and lists."""
    if isinstance(value, float):
        return [path]
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    return [found for key, item in items for found in floats_in(item, (*path, key))]


def with_value(value: Any, path: tuple[Any, ...], new: object) -> Any:
    """A copy of nested dicts and lists with one leaf replaced."""
    if not path:
        return new
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[path[0]] = with_value(value[path[0]], path[1:], new)
    return copy


@pytest.mark.nightly
@given(MESSAGES)
def test_an_encoded_message_decodes_to_an_equal_message_of_equal_bytes(message: m.Message) -> None:
    again = decode(encode(message), type(message))
    assert again == message
    assert encode(again) == encode(message)


@pytest.mark.nightly
@given(MESSAGES, st.sampled_from([math.nan, math.inf, -math.inf]), st.data())
def test_nan_and_infinity_are_refused_in_every_field(message: m.Message, bad: float, data: st.DataObject) -> None:
    paths = floats_in(plain(message))
    assume(paths)
    broken = with_value(plain(message), data.draw(st.sampled_from(paths)), bad)
    with pytest.raises(BadMessage):
        decode(msgpack.packb(broken), type(message))


def test_encoding_an_invalid_value_raises_an_error() -> None:
    with pytest.raises(BadMessage, match=r"\$\.translation"):
        encode(msgspec.structs.replace(CAMERA, translation=[math.nan, 0.0, 0.0]))


@pytest.mark.parametrize("kind", MESSAGE_TYPES)
def test_every_message_type_has_a_size_limit(kind: type[m.Message]) -> None:
    assert SMALL_BYTES <= size_limit(kind) <= SMALL_BYTES + MAX_BINARY


@pytest.mark.parametrize(("kind", "missing"), [(list[float], "range"), (bytes, "max_length")])
def test_a_type_with_an_unbounded_field_is_refused(kind: type, missing: str) -> None:
    unbounded = msgspec.defstruct("Unbounded", [("field", kind)], bases=(m.Message,), frozen=True, tag="unbounded")
    with pytest.raises(TypeError, match=rf"Unbounded\.field.*{missing}"):
        size_limit(unbounded)


@pytest.mark.nightly
@given(MESSAGES, st.text(min_size=1, max_size=10))
def test_an_unknown_field_is_refused(message: m.Message, name: str) -> None:
    assume(name not in plain(message))
    with pytest.raises(BadMessage):
        decode(msgpack.packb(plain(message) | {name: 1}), type(message))


@pytest.mark.nightly
@given(MESSAGES, st.sampled_from(MESSAGE_TYPES))
def test_a_message_of_another_type_is_refused(message: m.Message, other: type[m.Message]) -> None:
    assume(other is not type(message))
    with pytest.raises(BadMessage):
        decode(encode(message), other)


NO_NUMBERS, NO_NAMES = (math.nan, math.inf, -math.inf), ("", "a b", "a/b", "*", "a\n", "ä", "x" * 65)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        *(((field, 1), bad, rf"CameraInfo.*\$\.{field}")
          for field in ("matrix", "distortions", "rotation", "translation") for bad in NO_NUMBERS),
        (("size", 1), -1, r"^CameraInfo: Expected `int` >= 0 - at `\$\.size\[1\]`$"),
        *((("version",), bad, r"\$\.version") for bad in ("1", 1.5, None, [1])),
        *((("viewer",), bad, r"\$\.viewer") for bad in NO_NAMES),
    ],
    ids=str,
)  # fmt: skip
def test_an_error_names_message_field_and_reason(path: tuple[str | int, ...], value: object, words: str) -> None:
    with pytest.raises(BadMessage, match=words):
        decode(msgpack.packb(with_value(plain(CAMERA), path, value)), m.CameraInfo)


def test_a_message_without_type_is_refused() -> None:
    untyped = {key: value for key, value in plain(CAMERA).items() if key != "type"}
    with pytest.raises(BadMessage, match="'type'"):
        decode(msgpack.packb(untyped), m.CameraInfo)


@pytest.mark.parametrize("version", [0, 2, 10**30])
def test_a_message_of_another_wire_version_says_what_to_do(version: int) -> None:
    """Also when its fields are others, as those of a later version may be."""
    version %= 2**64
    data = msgpack.packb({"type": "camera", "version": version, "fields": "of another version"})
    with pytest.raises(OtherVersion, match=rf"wire version {version}, this program 1: install the same zenocap on every"):
        decode(data, m.CameraInfo)


@given(st.binary(max_size=300), st.sampled_from(MESSAGE_TYPES))
def test_random_bytes_raise_bad_message(data: bytes, kind: type[m.Message]) -> None:
    with pytest.raises(BadMessage):
        decode(data, kind)


@pytest.mark.nightly
@settings(max_examples=300)
@given(MESSAGES, st.data())
def test_mutated_messages_are_valid_or_raise_bad_message(message: m.Message, data: st.DataObject) -> None:
    valid = encode(message)
    start = data.draw(st.integers(0, len(valid)))
    end = data.draw(st.integers(start, min(len(valid), start + 9)))
    mutated = valid[:start] + data.draw(st.binary(max_size=9)) + valid[end:]
    try:
        decoded = decode(mutated, type(message))
    except BadMessage:
        return
    assert decode(encode(decoded), type(message)) == decoded


@pytest.mark.nightly
@given(MESSAGES, st.data())
def test_a_truncated_message_raises_bad_message(message: m.Message, data: st.DataObject) -> None:
    valid = encode(message)
    with pytest.raises(BadMessage):
        decode(valid[: data.draw(st.integers(0, len(valid) - 1))], type(message))


HOSTILE = {
    "deep lists": b"\x91" * 60_000,
    "deep maps": b"\x81\xa1a" * 20_000,
    "declared length of a list": b"\xdd\xff\xff\xff\xff",
    "declared length of a map": b"\xdf\xff\xff\xff\xff",
    "declared length of a text": b"\xdb\xff\xff\xff\xff",
    "declared length of bytes": b"\xc6\xff\xff\xff\xff",
    "extension": b"\x81\xa4type\xc7\x00\x05",
    "time stamp": b"\x81\xa4type\xd6\xff\x00\x00\x00\x00",
    "list as key": b"\x81\x90\x90",
    "number as key": b"\x81\x01\x01",
    "invalid UTF-8": b"\x81\xa4type\xa1\xff",
    "unused type byte": b"\xc1",
    "two messages": encode(CAMERA) * 2,
    "empty": b"",
    "too long": bytes(6 << 20),
    "nested declared lengths": b"\xdc\x01\x00" * 20_000,
    "many lists": b"\xdc\x01\x00" + (b"\xdc\x01\x00" + b"\x90" * 256) * 256,
    "very many lists": b"\xdc\x01\x00" + (b"\xdc\x01\x00" + (b"\xdc\x00\x3f" + b"\x90" * 63) * 256) * 250,
}


@pytest.mark.parametrize("kind", [m.Silhouette, m.CameraInfo])
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_bytes_raise_bad_message_and_need_little_memory(name: str, kind: type[m.Message]) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(BadMessage):
            decode(HOSTILE[name], kind)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 16 << 20


def test_a_silhouette_of_maximum_size_is_accepted() -> None:
    mask = m.Silhouette(frame=0, captured_ns=0, viewer="1", size=(1, 1), region=(0, 0, 1, 1), data=bytes(MAX_BINARY))
    assert decode(encode(mask), m.Silhouette) == mask


@pytest.mark.parametrize("kind", MESSAGE_TYPES)
def test_the_schema_has_every_field(kind: type[m.Message]) -> None:
    schema = json.loads(json_schema(kind))
    assert set(kind.__struct_fields__) | {"type"} == set(schema["$defs"][kind.__name__]["properties"])


def test_health_without_phase_is_read_as_phase_unknown() -> None:
    earlier = msgpack.unpackb(encode(built(m.Health, phase=m.Phase.RUNNING)))
    del earlier["phase"]
    assert decode(msgpack.packb(earlier), m.Health).phase is m.Phase.UNKNOWN


def test_removed_fields_of_earlier_versions_are_ignored_and_other_unknown_ones_refused() -> None:
    body = m.PartialBdp(frame=1, captured_ns=2, viewer="1", side="front", lengths={"height": 1.7})
    earlier = plain(body) | {"height_px": 90.0, "score": 0.0}
    assert decode(msgpack.packb(earlier), m.PartialBdp) == body
    with pytest.raises(BadMessage, match="unknown field"):
        decode(msgpack.packb(earlier | {"height_mm": 1.0}), m.PartialBdp)
