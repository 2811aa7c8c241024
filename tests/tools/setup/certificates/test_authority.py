"""Certificates: signed, for their hosts, in their time, read back with errors."""

from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.errors import UserError
from zenocap.tools.setup.certificates import authority as ca

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
AUTHORITY = ca.new_authority("authority", NOW)
PAIR = ca.issue(AUTHORITY, "studio/viewer/1", ("localhost", "192.168.1.11", "[::1]"), NOW, 30)
CERTIFICATE = PAIR.certificate


def test_certificate_contains_name_hosts_and_validity_period() -> None:
    assert ca.common_name(CERTIFICATE) == "studio/viewer/1"
    assert ca.hosts_of(CERTIFICATE) == ("localhost", "192.168.1.11", "::1")
    assert CERTIFICATE.not_valid_before_utc == NOW - ca.BEFORE
    assert CERTIFICATE.not_valid_after_utc == NOW + timedelta(days=30)
    assert ca.belong_together(CERTIFICATE, PAIR.key)
    assert not ca.belong_together(CERTIFICATE, AUTHORITY.key)


def test_certificate_is_signed_only_by_its_authority() -> None:
    assert ca.signed_by(CERTIFICATE, AUTHORITY.certificate)
    assert not ca.signed_by(CERTIFICATE, ca.new_authority("authority", NOW).certificate)
    assert not ca.signed_by(CERTIFICATE, CERTIFICATE)


def test_only_the_authority_may_sign() -> None:
    for certificate, signs in ((AUTHORITY.certificate, True), (CERTIFICATE, False)):
        assert certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca is signs
        assert certificate.extensions.get_extension_for_class(x509.KeyUsage).value.key_cert_sign is signs


def test_certificate_expires_no_later_than_its_authority() -> None:
    late = NOW + timedelta(days=ca.AUTHORITY_DAYS - 10)
    pair = ca.issue(AUTHORITY, "studio/viewer/1", ("localhost",), late, 730)
    assert pair.certificate.not_valid_after_utc == AUTHORITY.certificate.not_valid_after_utc


def test_written_certificate_and_key_are_read_back() -> None:
    assert ca.read_certificate("a.pem", ca.pem(CERTIFICATE)) == CERTIFICATE
    assert ca.belong_together(CERTIFICATE, ca.read_key("a-key.pem", ca.key_pem(PAIR.key)))


@given(st.binary(max_size=200))
def test_invalid_certificate_or_key_file_is_named_in_the_error(data: bytes) -> None:
    with pytest.raises(UserError, match=r"^a\.pem: no certificate"):
        ca.read_certificate("a.pem", data)
    with pytest.raises(UserError, match=r"^a-key\.pem: no private key"):
        ca.read_key("a-key.pem", data)


def test_rsa_key_is_rejected() -> None:
    key = rsa.generate_private_key(65537, 2048).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    with pytest.raises(UserError, match="elliptic curve"):
        ca.read_key("a-key.pem", key)


@pytest.mark.parametrize("host", ["", "küche", "a" * 64, "a.b." * 70, "a b", "-a", "a/b", "*"])
def test_invalid_host_name_is_rejected(host: str) -> None:
    with pytest.raises(UserError, match=r"allowed: a name such as router\.lab, or a numeric address"):
        ca.issue(AUTHORITY, "a", (host,), NOW, 1)


@given(st.ip_addresses().map(str))
def test_plain_host_is_idempotent(address: str) -> None:
    assert ca.plain_host(ca.plain_host(address)) == ca.plain_host(address)
    assert ca.plain_host(f"[{address}]") == ca.plain_host(address)
