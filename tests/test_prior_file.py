"""Prior files: whole, damaged, cut, foreign, of another version, of another body, with values that cannot be."""

import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from services.tracker.prior.file import HEADER, MAGIC, VERSION, PriorError, parse_prior, read_prior, write_prior
from services.tracker.prior.model import Prior
from tests.prior_cases import known_prior

HERE = Path("walk.prior")


def bytes_of(folder: Path, prior: Prior) -> bytes:
    write_prior(folder / "some.prior", prior)
    return (folder / "some.prior").read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bytes_of(tmp_path_factory.mktemp("priors"), known_prior())


def body_of(data: bytes) -> dict[str, dict[str, object]]:
    body: dict[str, dict[str, object]] = msgspec.msgpack.decode(data[HEADER.size :])
    return body


def with_body(body: object) -> bytes:
    packed = msgspec.msgpack.encode(body)
    return HEADER.pack(MAGIC, VERSION, zlib.crc32(packed), len(packed)) + packed


def test_what_is_written_is_read(tmp_path: Path) -> None:
    prior = known_prior()
    write_prior(tmp_path / "some.prior", prior)
    found = read_prior(tmp_path / "some.prior", FOURTEEN_PARTS)
    for name in ("centres", "bases", "variances", "residuals", "transitions", "occupancy", "speeds"):
        assert np.array_equal(getattr(found, name), getattr(prior, name))
    assert (found.anatomy, found.names, found.rate, found.training) == (
        prior.anatomy,
        prior.names,
        prior.rate,
        prior.training,
    )


def test_the_same_prior_gives_the_same_bytes(tmp_path: Path, whole: bytes) -> None:
    assert bytes_of(tmp_path, known_prior()) == whole


def test_a_file_of_another_body_is_refused(tmp_path: Path) -> None:
    write_prior(tmp_path / "some.prior", known_prior())
    with pytest.raises(PriorError, match=r"some\.prior: anatomy = 'fourteen-parts': allowed: 'ten-parts'"):
        read_prior(tmp_path / "some.prior", TEN_PARTS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data[:-1], r"walk\.prior: cut: \d+ bytes behind the header: allowed: \d+"),
        (lambda data: data[:20], r"walk\.prior: cut: 20 bytes"),
        (lambda data: data[:5], r"walk\.prior: cut: 5 bytes"),
        (lambda data: data + b"x", "something follows the prior"),
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "damaged: checksum = "),
        (lambda data: b"", r"walk\.prior: begins with b'': allowed"),
        (lambda data: b"HIERARCHY\nROOT Hips\n{", r"begins with b'HIERARCHY\\nROOT': allowed: b'zenocap prior"),
        (lambda data: data[: len(MAGIC)] + b"\x09" + data[len(MAGIC) + 1 :], f"version = 9: allowed: {VERSION}; train"),
    ],
    ids=["cut", "in the header", "in the magic", "longer", "damaged", "empty", "foreign", "version"],
)
def test_a_file_that_is_not_whole_is_refused(whole: bytes, change: Callable[[bytes], bytes], words: str) -> None:
    with pytest.raises(PriorError, match=words):
        parse_prior(HERE, change(whole))


@given(st.data())
@settings(max_examples=100)
def test_no_changed_byte_and_no_cut_goes_unnoticed(whole: bytes, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(whole) - 1))
    flipped = whole[:at] + bytes([whole[at] ^ data.draw(st.integers(1, 255))]) + whole[at + 1 :]
    for broken in (flipped, whole[:at]):
        with pytest.raises(PriorError, match=r"^walk\.prior: "):
            parse_prior(HERE, broken)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("anatomy", "spider", "anatomy = 'spider': allowed: ten-parts, fourteen-parts"),
        ("names", ["knee"] * 24, r"names = .*: allowed: those of fourteen-parts: \['waist.1'"),
        ("rate", -1.0, r"rate"),
        ("rate", "fast", r"rate"),
        ("more", 1, "more"),
        ("centres", {"shape": [4, 23], "data": b""}, r"centres\.shape = \[4, 23\]: allowed: \[4, 24\]"),
        ("centres", {"shape": [4, 24], "data": b"12"}, r"centres\.data = 2 bytes: allowed: 768 bytes"),
        ("bases", {"shape": [], "data": b""}, r"bases = 4 regions of 0 dimensions"),
        ("centres", {"shape": [10_000, 24], "data": b""}, r"centres\.data = 0 bytes: allowed"),
        ("transitions", {"shape": [1 << 40, 1 << 40], "data": b""}, "transitions"),
    ],
)
def test_a_field_that_cannot_be_is_named(whole: bytes, field: str, value: dict[str, object], words: str) -> None:
    body = body_of(whole)
    body[field] = value
    with pytest.raises(PriorError, match=words):
        parse_prior(HERE, with_body(body))


def test_a_missing_field_is_named(whole: bytes) -> None:
    body = body_of(whole)
    del body["occupancy"]
    with pytest.raises(PriorError, match="occupancy"):
        parse_prior(HERE, with_body(body))


@pytest.mark.parametrize("body", [[], 7, None, {"x": {}}])
def test_another_kind_of_content_is_refused(body: object) -> None:
    with pytest.raises(PriorError, match=r"^walk\.prior: "):
        parse_prior(HERE, with_body(body))


@pytest.mark.parametrize(
    ("name", "factor", "added", "words"),
    [
        ("centres", 1.0, np.nan, "centres = nan: allowed: finite"),
        ("centres", 1.0, 100.0, "centres = .*: allowed: radians within two turns"),
        ("bases", 1.1, 0.0, "bases = columns .* off from orthonormal"),
        ("variances", -1.0, 0.0, "variances = -.*: allowed: 1e-12 or more"),
        ("residuals", -1.0, 0.0, "residuals = -.*: allowed: 0 or more"),
        ("transitions", 1.01, 0.0, "transitions = a sum .* off from 1"),
        ("occupancy", 0.5, 0.0, "occupancy = a sum .* off from 1"),
        ("speeds", 1.0, -5.0, "speeds = -.*: allowed: 0 or more"),
    ],
)
def test_values_that_no_prior_has_are_neither_written_nor_leave_a_file(
    tmp_path: Path, name: str, factor: float, added: float, words: str
) -> None:
    prior = known_prior()
    broken = replace(prior, **{name: getattr(prior, name) * factor + added})
    with pytest.raises(PriorError, match=words):
        write_prior(tmp_path / "some.prior", broken)
    assert list(tmp_path.iterdir()) == []
