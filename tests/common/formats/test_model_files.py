"""Files of learnt models: a header that does not fit its content, and their size."""

import struct
import zlib
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.errors import UserError
from zenocap.common.formats.model_files import MAX_BYTES, ModelFormat


class Thing(msgspec.Struct):
    values: list[int]


PATH = Path("some.thing")
FORMAT = ModelFormat(b"zenocap thing\n", 3, "thing", "zenocap things", "make it again")
WHOLE = FORMAT.encoded(PATH, {"values": [1, 2, 3]}, Thing)


def test_a_file_is_read_back(tmp_path: Path) -> None:
    (tmp_path / "a.thing").write_bytes(WHOLE)
    assert FORMAT.decoded(PATH, FORMAT.read(tmp_path / "a.thing"), Thing) == Thing([1, 2, 3])


def test_a_header_is_magic_version_checksum_and_length() -> None:
    found = struct.unpack_from("<14sHIQ", WHOLE)
    assert found == (b"zenocap thing\n", 3, zlib.crc32(WHOLE[28:]), len(WHOLE) - 28)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "begins with b'': allowed: b'zenocap thing\\\\n', a file of `zenocap things`"),
        (b"HIERARCHY\nROOT Hips\n{", r"begins with b'HIERARCHY\\nROOT': allowed: "),
        (WHOLE[:5], "cut: 5 bytes: allowed: 28 or more"),
        (WHOLE[:20], "cut: 20 bytes: allowed: 28 or more"),
        (WHOLE[:-1], r"cut: \d+ bytes after the header: allowed: \d+"),
        (WHOLE + b"x", "bytes after the thing: "),
        (WHOLE[:-1] + bytes([WHOLE[-1] ^ 1]), "damaged: checksum = "),
        (FORMAT.header.pack(FORMAT.magic, 9, 0, 0), "version = 9: allowed: 3; make it again with this version of zenocap"),
        (FORMAT.with_header(b"\xc1"), "MessagePack"),
        (FORMAT.with_header(b"\x90"), "Expected `object`, got `array`"),
        (FORMAT.with_header(b"\x91" * 10_000), ""),
        (FORMAT.with_header(b"\xdf\xff\xff\xff\xff"), ""),
    ],
)
def test_error_names_the_file_and_its_fault(data: bytes, words: str) -> None:
    with pytest.raises(UserError, match=f"^some.thing: {words}"):
        FORMAT.decoded(PATH, data, Thing)


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_every_changed_byte_and_every_cut_is_detected(at: int, change: int) -> None:
    for broken in (WHOLE[:at] + bytes([WHOLE[at] ^ change]) + WHOLE[at + 1 :], WHOLE[:at]):
        with pytest.raises(UserError, match=r"^some\.thing: "):
            FORMAT.decoded(PATH, broken, Thing)


def test_a_file_above_the_maximum_size_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "long.thing").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(UserError, match=f"long.thing: {MAX_BYTES + 1} bytes: allowed: at most {MAX_BYTES} of a thing"):
        FORMAT.read(tmp_path / "long.thing")
