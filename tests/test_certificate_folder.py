"""The folder of certificates: secrets are secret, what is there stays, and what does not fit is refused."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from common.bus.access import Member
from services.certificates.authority import CertificateError, read_certificate, signed_by
from services.certificates.folder import certify, ready_authority

NOW = datetime(2026, 1, 2, tzinfo=UTC)
HERE = ("localhost", "127.0.0.1")
ONE, TWO = Member("viewer", "1"), Member("viewer", "2")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_keys_are_for_their_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    certify(folder, "studio", {ONE: HERE}, NOW, 30)
    modes = {path.name: path.stat().st_mode & 0o777 for path in folder.iterdir()}
    assert modes == {"authority.pem": 0o644, "authority-key.pem": 0o600, "viewer-1.pem": 0o644, "viewer-1-key.pem": 0o600}
    assert folder.stat().st_mode & 0o777 == 0o700


def test_what_is_there_stays_and_what_is_new_comes_beside(tmp_path: Path) -> None:
    assert [one.done for one in certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)] == ["made"]
    before = contents(tmp_path)
    assert [one.done for one in certify(tmp_path, "studio", {ONE: HERE, TWO: HERE}, NOW, 30)] == ["kept", "made"]
    after = contents(tmp_path)
    assert {name: after[name] for name in before} == before


def test_renewed_ones_are_of_the_same_authority(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    before = contents(tmp_path)
    later = NOW + timedelta(days=20)
    (made,) = certify(tmp_path, "studio", {ONE: HERE}, later, 30, renew=True)
    after = contents(tmp_path)
    assert (made.done, made.ends) == ("renewed", later + timedelta(days=30))
    assert {name for name in after if after[name] != before[name]} == {"viewer-1.pem", "viewer-1-key.pem"}
    authority = read_certificate("", after["authority.pem"])
    assert signed_by(read_certificate("", after["viewer-1.pem"]), authority)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda folder: (folder / "authority-key.pem").unlink(), r"authority-key\.pem: missing beside the other half"),
        (lambda folder: (folder / "authority.pem").unlink(), r"authority\.pem: missing beside the other half"),
        (lambda folder: (folder / "authority.pem").write_text("x"), r"authority\.pem: no certificate"),
        (lambda folder: (folder / "viewer-1.pem").unlink(), r"viewer-1\.pem: missing beside its key"),
        (lambda folder: (folder / "viewer-1.pem").write_text("x"), r"viewer-1\.pem: no certificate"),
    ],
)
def test_what_is_incomplete_or_damaged_is_named(tmp_path: Path, change: object, message: str) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    change(tmp_path)  # type: ignore[operator]
    with pytest.raises(CertificateError, match=message):
        certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)


def test_one_that_does_not_fit_is_named_and_left_alone(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    before = contents(tmp_path)
    with pytest.raises(CertificateError, match=r"not for 192\.168\.1\.11: --renew"):
        certify(tmp_path, "studio", {ONE: (*HERE, "192.168.1.11")}, NOW, 30)
    with pytest.raises(CertificateError, match="is there already, of 'studio/viewer/1'"):
        certify(tmp_path, "lab", {ONE: HERE}, NOW, 30)
    assert contents(tmp_path) == before


def test_one_of_another_authority_is_named(tmp_path: Path) -> None:
    certify(tmp_path / "a", "studio", {ONE: HERE}, NOW, 30)
    certify(tmp_path / "b", "studio", {ONE: HERE}, NOW, 30)
    for name in ("authority.pem", "authority-key.pem"):
        (tmp_path / "a" / name).replace(tmp_path / "b" / name)
    with pytest.raises(CertificateError, match="signed by another authority"):
        certify(tmp_path / "b", "studio", {ONE: HERE}, NOW, 30)


def test_an_expired_authority_is_named(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    with pytest.raises(CertificateError, match="expired on 2035"):
        ready_authority(tmp_path, "studio", NOW + timedelta(days=3651))
