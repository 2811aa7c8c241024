"""Expiry of certificates, against the library cryptography."""

import logging
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from zenocap.common.bus.certificate import Expiry, days_left, valid_until
from zenocap.tools.setup.certificates.authority import issue, new_authority, pem

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


@pytest.mark.parametrize("now", [NOW, datetime(2049, 6, 1, tzinfo=UTC)], ids=["UTCTime", "GeneralizedTime"])
def test_the_expiry_is_that_of_the_certificate(tmp_path: Path, now: datetime) -> None:
    authority = new_authority("authority", now)
    for number, certificate in enumerate((authority.certificate, issue(authority, "a/b/1", ["h"], now, 500).certificate)):
        path = tmp_path / f"{number}.pem"
        path.write_bytes(b"a comment\n" + pem(certificate))
        assert valid_until(path) == certificate.not_valid_after_utc


def test_files_without_a_certificate_have_no_expiry(tmp_path: Path) -> None:
    whole = pem(new_authority("authority", NOW).certificate)
    lines = whole.splitlines()
    damaged = (b"", b"text", whole[:200], b"\n".join([lines[0], b"AAAA", lines[-1]]), b"\n".join([*lines[:3], lines[-1]]))
    for content in damaged:
        (tmp_path / "one.pem").write_bytes(content)
        assert valid_until(tmp_path / "one.pem") is None
    assert valid_until(tmp_path / "missing.pem") is None


def test_days_left_are_whole_days() -> None:
    assert days_left(NOW + timedelta(days=3, hours=23), NOW) == 3
    assert days_left(NOW + timedelta(hours=1), NOW) == 0
    assert days_left(NOW - timedelta(hours=1), NOW) == -1


def test_a_warning_is_logged_once_a_day_and_ends_with_the_renewal(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    authority, path = new_authority("authority", NOW), tmp_path / "viewer-1.pem"
    path.write_bytes(pem(issue(authority, "a/b/1", ["h"], NOW, 40).certificate))
    expiry = Expiry(path, logging.getLogger("test"))

    def days_at(day: float) -> int | None:
        return expiry.days_left(int((NOW + timedelta(days=day)).timestamp() * 1e9))

    assert [days_at(day) for day in (0, 9, 10.5, 10.6, 11.5, 41)] == [40, 31, 29, 29, 28, -1]
    words = [record.getMessage().split(": ")[1] for record in caplog.records]
    assert words == [f"certificate expires in {days} days" for days in (29, 28)] + ["certificate has expired"]
    path.write_bytes(pem(issue(authority, "a/b/1", ["h"], NOW, 400).certificate))
    assert days_at(41) == 359
    assert len(caplog.records) == 3
