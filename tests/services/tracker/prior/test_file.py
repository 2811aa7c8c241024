"""Prior files: complete, damaged, of another body, with invalid values."""

import struct
import zlib
from dataclasses import fields, replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tests.support.prior_cases import known_prior, reconstruction_error
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.errors import UserError
from zenocap.common.rig.tracker import SUFFIX, find_prior
from zenocap.data import PRIORS
from zenocap.services.tracker.prior.file import parse_prior, read_prior, write_prior
from zenocap.services.tracker.prior.model import Prior
from zenocap.tools.teach.dataset.build_priors import HELD_PERSON, KINDS, NAMES, PEOPLE, RATE, recording

MAGIC, VERSION = b"zenocap prior\n", 1
HEADER = struct.Struct(f"<{len(MAGIC)}sHIQ")  # magic, version, CRC-32, length of the rest
HERE = Path("walk.prior")


def bytes_of(folder: Path, prior: Prior) -> bytes:
    write_prior(folder / "some.prior", prior)
    return (folder / "some.prior").read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bytes_of(tmp_path_factory.mktemp("priors"), known_prior())


def with_body(body: object) -> bytes:
    packed = msgspec.msgpack.encode(body)
    return HEADER.pack(MAGIC, VERSION, zlib.crc32(packed), len(packed)) + packed


def test_written_prior_is_read_back_for_its_body(tmp_path: Path) -> None:
    prior = known_prior()
    write_prior(tmp_path / "some.prior", prior)
    found = read_prior(tmp_path / "some.prior", FOURTEEN_PARTS)
    for field in fields(Prior):
        assert np.array_equal(getattr(found, field.name), getattr(prior, field.name))
    with pytest.raises(UserError, match=r"some\.prior: anatomy = 'fourteen-parts': allowed: 'ten-parts'"):
        read_prior(tmp_path / "some.prior", TEN_PARTS)


def test_same_prior_gives_the_same_bytes(tmp_path: Path, whole: bytes) -> None:
    assert bytes_of(tmp_path, known_prior()) == whole


def test_a_damaged_file_is_refused(whole: bytes) -> None:
    with pytest.raises(UserError, match=r"^walk\.prior: damaged: checksum = "):
        parse_prior(HERE, whole[:-1] + bytes([whole[-1] ^ 1]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"anatomy": "spider"}, "anatomy = 'spider': allowed: ten-parts, fourteen-parts"),
        ({"names": ["knee"] * 24}, r"names = .*: allowed: those of fourteen-parts: \['waist.1'"),
        ({"rate": -1.0}, r"rate"),
        ({"rate": "fast"}, r"rate"),
        ({"more": 1}, "more"),
        ({"centres": {"shape": [4, 23], "data": b""}}, r"centres\.shape = \[4, 23\]: allowed: \[4, 24\]"),
        ({"centres": {"shape": [4, 24], "data": b"12"}}, r"centres\.data = 2 bytes: allowed: 768 bytes"),
        ({"bases": {"shape": [], "data": b""}}, r"bases = 4 regions of 0 dimensions"),
        ({"centres": {"shape": [10_000, 24], "data": b""}}, r"centres\.data = 0 bytes: allowed"),
        ({"transitions": {"shape": [1 << 40, 1 << 40], "data": b""}}, "transitions"),
        ({"occupancy": msgspec.UNSET}, "occupancy"),
    ],
)
def test_error_names_the_invalid_or_missing_field(whole: bytes, change: dict[str, object], words: str) -> None:
    body = msgspec.msgpack.decode(whole[HEADER.size :]) | change
    with pytest.raises(UserError, match=words):
        parse_prior(HERE, with_body({name: value for name, value in body.items() if value is not msgspec.UNSET}))


@pytest.mark.parametrize("body", [[], 7, None, {"x": {}}])
def test_another_kind_of_content_is_refused(body: object) -> None:
    with pytest.raises(UserError, match=r"^walk\.prior: "):
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
def test_invalid_values_are_refused_without_leaving_a_file(
    tmp_path: Path, name: str, factor: float, added: float, words: str
) -> None:
    prior = known_prior()
    broken = replace(prior, **{name: getattr(prior, name) * factor + added})
    with pytest.raises(UserError, match=words):
        write_prior(tmp_path / "some.prior", broken)
    assert list(tmp_path.iterdir()) == []


def test_shipped_priors_are_the_known_kinds() -> None:
    assert {path.stem for path in PRIORS.glob(f"*{SUFFIX}")} == set(NAMES)


@pytest.mark.parametrize("kind", KINDS)
def test_shipped_prior_has_current_version_and_training(kind: str) -> None:
    path = find_prior(kind)
    prior = read_prior(path, FOURTEEN_PARTS)
    assert path.stat().st_size < 300_000
    assert prior.rate == RATE
    assert len(prior.training.motions) == len(PEOPLE)
    assert prior.training.held == (f"actor-{kind}-{HELD_PERSON}-{HELD_PERSON}",)
    assert prior.dimensions == 3


@pytest.mark.nightly
def test_shipped_prior_reconstructs_held_out_motion_as_recorded() -> None:
    """Fails when the simulated person has changed since `make priors`."""
    prior = read_prior(find_prior("walking"))
    recorded = next(row.held for row in prior.training.errors if row.regions >= prior.regions)
    found = reconstruction_error(prior, recording("walking", HELD_PERSON).coordinates)
    assert found == pytest.approx(recorded, rel=0.05)
    assert np.degrees(found) < 3.0


def test_path_is_used_as_given(tmp_path: Path) -> None:
    (tmp_path / "own.prior").touch()
    assert find_prior(str(tmp_path / "own.prior")) == tmp_path / "own.prior"


@pytest.mark.parametrize("text", ["swimming", "", "walking.prior", "/nowhere/own.prior"])
def test_unknown_name_is_refused_with_the_known_ones(text: str) -> None:
    known = "boxing, boxing-paper, general, general-paper, running, running-paper, walking"
    with pytest.raises(UserError, match=rf"prior = '.*': no file .*; allowed: .*{known}"):
        find_prior(text)
