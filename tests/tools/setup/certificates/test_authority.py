"""Certificates: signed, for their hosts, in their time, read back with errors."""

from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.errors import UserError
from zenocap.tools.setup.certificates.authority import (
    AUTHORITY_DAYS,
    BEFORE,
    belong_together,
    common_name,
    hosts_of,
    issue,
    key_pem,
    new_authority,
    pem,
    plain_host,
    read_certificate,
    read_key,
    signed_by,
)

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
AUTHORITY = new_authority("authority", NOW)


def test_certificate_contains_name_hosts_and_validity_period() -> None:
    pair = issue(AUTHORITY, "studio/viewer/1", ("localhost", "192.168.1.11", "[::1]"), NOW, 30)
    assert common_name(pair.certificate) == "studio/viewer/1"
    assert hosts_of(pair.certificate) == ("localhost", "192.168.1.11", "::1")
    assert pair.certificate.not_valid_before_utc == NOW - BEFORE
    assert pair.certificate.not_valid_after_utc == NOW + timedelta(days=30)
    assert belong_together(pair.certificate, pair.key)
    assert not belong_together(pair.certificate, AUTHORITY.key)


def test_certificate_is_signed_only_by_its_authority() -> None:
    pair = issue(AUTHORITY, "studio/viewer/1", ("localhost",), NOW, 30)
    assert signed_by(pair.certificate, AUTHORITY.certificate)
    assert not signed_by(pair.certificate, new_authority("authority", NOW).certificate)
    assert not signed_by(pair.certificate, pair.certificate)


def test_only_the_authority_may_sign() -> None:
    pair = issue(AUTHORITY, "studio/viewer/1", ("localhost",), NOW, 30)
    for certificate, signs in ((AUTHORITY.certificate, True), (pair.certificate, False)):
        assert certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca is signs
        assert certificate.extensions.get_extension_for_class(x509.KeyUsage).value.key_cert_sign is signs


def test_certificate_expires_no_later_than_its_authority() -> None:
    late = NOW + timedelta(days=AUTHORITY_DAYS - 10)
    pair = issue(AUTHORITY, "studio/viewer/1", ("localhost",), late, 730)
    assert pair.certificate.not_valid_after_utc == AUTHORITY.certificate.not_valid_after_utc


def test_written_certificate_and_key_are_read_back() -> None:
    pair = issue(AUTHORITY, "studio/viewer/1", ("localhost",), NOW, 30)
    assert read_certificate("a.pem", pem(pair.certificate)) == pair.certificate
    assert belong_together(pair.certificate, read_key("a-key.pem", key_pem(pair.key)))


@given(st.binary(max_size=200))
def test_invalid_certificate_or_key_file_is_named_in_the_error(data: bytes) -> None:
    with pytest.raises(UserError, match=r"^a\.pem: no certificate"):
        read_certificate("a.pem", data)
    with pytest.raises(UserError, match=r"^a-key\.pem: no private key"):
        read_key("a-key.pem", data)


def test_rsa_key_is_rejected() -> None:
    key = rsa.generate_private_key(65537, 2048).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    with pytest.raises(UserError, match="elliptic curve"):
        read_key("a-key.pem", key)


@pytest.mark.parametrize("host", ["", "küche", "a" * 64, "a.b." * 70, "a b", "-a", "a/b", "*"])
def test_invalid_host_name_is_rejected(host: str) -> None:
    with pytest.raises(UserError, match=r"allowed: a name such as router\.lab, or a numeric address"):
        issue(AUTHORITY, "a", (host,), NOW, 1)


@given(st.ip_addresses().map(str))
def test_plain_host_is_idempotent(address: str) -> None:
    assert plain_host(plain_host(address)) == plain_host(address)
    assert plain_host(f"[{address}]") == plain_host(address)
