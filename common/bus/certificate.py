"""Expiry of a certificate, read without a library for certificates: using them needs no extra package.

The part of RFC 5280 that is read: Certificate, TBSCertificate and its validity, in DER within PEM.
"""

import ssl
from datetime import UTC, datetime
from logging import Logger
from pathlib import Path

SEQUENCE, VERSION, UTC_TIME = 0x30, 0xA0, 0x17
WARNED_DAYS = 30  # before the expiry; chosen by hand


def valid_until(path: Path) -> datetime | None:
    """Expiry of the first certificate in a PEM file; None when the file cannot be read or has none."""
    try:
        text = path.read_bytes().decode("ascii", "replace")
        begin, end = text.index(ssl.PEM_HEADER), text.index(ssl.PEM_FOOTER) + len(ssl.PEM_FOOTER)
        return _not_after(ssl.PEM_cert_to_DER_cert(text[begin:end]))
    except (OSError, ValueError, IndexError):
        return None


def days_left(ends: datetime, now: datetime) -> int:
    """Whole days until the expiry; negative after it."""
    return (ends - now).days


class Expiry:
    """Days left of one certificate; from WARNED_DAYS on a warning is logged once a day."""

    def __init__(self, path: Path, logger: Logger) -> None:
        self._path, self._logger = path, logger
        self._logged: int | None = None

    def days_left(self, now_ns: int) -> int | None:
        """Whole days until the expiry of the file as it is now; None when it cannot be read."""
        ends = valid_until(self._path)
        if ends is None:
            return None
        days = days_left(ends, datetime.fromtimestamp(now_ns / 1e9, UTC))
        if days <= WARNED_DAYS and days != self._logged:
            self._logged = days
            self._logger.warning("%s: %s: zenocap certs RIG --renew", self._path, expiry_text(days))
        return days


def expiry_text(days: int) -> str:
    return f"certificate expires in {days} day{'s' * (days != 1)}" if days >= 0 else "certificate has expired"


def _not_after(data: bytes) -> datetime:
    tag, certificate, _ = _element(data)
    _, fields, _ = _element(certificate)
    if tag != SEQUENCE:
        raise ValueError("no certificate")
    tag, _, rest = _element(fields)
    skipped = 3 if tag == VERSION else 2  # serial number, algorithm, issuer; without a version the first is skipped already
    for _ in range(skipped):
        _, _, rest = _element(rest)
    _, validity, _ = _element(rest)
    _, _, after = _element(validity)
    tag, text, _ = _element(after)
    form = "%y%m%d%H%M%SZ" if tag == UTC_TIME else "%Y%m%d%H%M%SZ"
    return datetime.strptime(text.decode("ascii"), form).replace(tzinfo=UTC)


def _element(data: bytes) -> tuple[int, bytes, bytes]:
    """Tag and content of the first element of DER, and what follows it."""
    tag, length, begin = data[0], data[1], 2
    if length & 0x80:
        begin += length & 0x7F
        length = int.from_bytes(data[2:begin], "big")
    if len(data) < begin + length:
        raise ValueError("cut")
    return tag, data[begin : begin + length], data[begin + length :]
