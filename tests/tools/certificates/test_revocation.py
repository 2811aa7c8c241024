"""Revoking in the folder of certificates."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from zenocap.common.bus.access import ROUTER, Member
from zenocap.common.errors import UserError
from zenocap.common.rig.security import generations_in
from zenocap.tools.certificates.authority import common_name, read_certificate
from zenocap.tools.certificates.folder import certify, known, renew_expiring, renewed, revoke
from zenocap.tools.doctor.machine_probe import look_at_certificates

NOW = datetime(2026, 1, 2, tzinfo=UTC)
ONE, TWO = Member("viewer", "1"), Member("viewer", "2")
HERE = ("localhost", "192.168.1.7")


def name_of(folder: Path, member: Member) -> str:
    return common_name(read_certificate("", (folder / f"{member.name}.pem").read_bytes()))


def test_a_new_certificate_of_a_revoked_member_has_the_next_generation_and_the_same_hosts(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE, TWO: HERE}, NOW, 30)
    assert known(tmp_path).number == 0
    for number in (1, 2):
        assert revoke(tmp_path, "studio", [ONE], NOW).number == number
        assert generations_in(tmp_path) == {"studio/viewer/1": number}
        (made,) = renewed(tmp_path, "studio", [ONE], NOW, 30)
        assert name_of(tmp_path, ONE) == f"studio/viewer/1@{number}"
        assert set(made.hosts) == set(HERE)
    assert name_of(tmp_path, TWO) == "studio/viewer/2"
    assert [one.done for one in certify(tmp_path, "studio", {ONE: HERE, TWO: HERE}, NOW, 30)] == ["kept", "kept"]


def test_a_revoked_certificate_is_not_kept_and_doctor_names_it(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    revoke(tmp_path, "studio", [ONE], NOW)
    with pytest.raises(UserError, match=r"viewer-1\.pem: is revoked: --renew replaces it"):
        certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    *_, found = look_at_certificates(tmp_path, ["viewer-1"])
    assert found.problem == f"{tmp_path / 'viewer-1.pem'} is revoked"
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30, renew=True)
    *_, found = look_at_certificates(tmp_path, ["viewer-1"])
    assert found.problem is None


def test_routers_cannot_be_revoked(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {Member(ROUTER): HERE}, NOW, 30)
    with pytest.raises(UserError, match=r"--revoke router: .*create a new authority in an empty folder"):
        revoke(tmp_path, "studio", [Member(ROUTER)], NOW)
    assert known(tmp_path).number == 0


def test_revoking_needs_the_key_of_the_authority(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"authority\.pem: missing: run this where the authority was made"):
        revoke(tmp_path, "studio", [ONE], NOW)
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    (tmp_path / "authority-key.pem").unlink()
    with pytest.raises(UserError, match=r"authority-key\.pem: missing"):
        revoke(tmp_path, "studio", [ONE], NOW)


def test_where_the_key_of_the_authority_is_certificates_that_expire_are_renewed_for_their_hosts(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 40)
    certify(tmp_path, "studio", {TWO: HERE}, NOW, 300)
    members = [ONE, TWO, Member("reader")]  # the last has no certificate here
    assert renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=5)) == []
    (made,) = renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=10))
    assert (made.member, made.done, set(made.hosts)) == (ONE, "renewed", set(HERE))
    (made,) = renew_expiring(tmp_path, "studio", [TWO], NOW + timedelta(days=301))  # expired already
    assert made.member == TWO
    (tmp_path / "authority-key.pem").unlink()
    assert renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=3000)) == []


def test_only_certificates_that_expire_soon_are_renewed_on_a_schedule(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    certify(tmp_path, "studio", {TWO: HERE}, NOW, 300)
    later, month = NOW + timedelta(days=10), timedelta(days=30)
    made = certify(tmp_path, "studio", {ONE: HERE[:1], TWO: HERE}, later, 365, renew_within=month)
    assert [(one.member, one.done) for one in made] == [(ONE, "renewed"), (TWO, "kept")]
    assert made[0].ends == later + timedelta(days=365)
    assert set(made[0].hosts) == set(HERE)  # also those that were given when it was made
