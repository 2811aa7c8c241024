"""ONVIF over HTTPS and with HTTP digest, against a simulated device with a certificate of its own."""

import ssl
from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.support.command import zenocap
from tests.support.onvif_device import LOOPBACK, SimulatedOnvif
from zenocap.common.errors import UserError
from zenocap.tools.setup.cameras.onvif_device import streams_of
from zenocap.tools.setup.cameras.onvif_http import User, trusted
from zenocap.tools.setup.certificates.authority import issue, key_pem, new_authority, pem

pytestmark = pytest.mark.slow
STREAMS = {"main": "rtsp://127.0.0.1:1/live"}
ADMIN = User("admin", "p&<ß")


def certified(folder: Path, host: str) -> tuple[ssl.SSLContext, Path]:
    """TLS settings of a device with this name, and the file of the authority of its certificate."""
    now = datetime.now(UTC)
    authority = new_authority("cameras", now)
    own = issue(authority, "camera", [host], now, 30)
    (folder / "camera.pem").write_bytes(pem(own.certificate) + key_pem(own.key))
    (folder / "authority.pem").write_bytes(pem(authority.certificate))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "camera.pem")
    return context, folder / "authority.pem"


def test_a_trusted_certificate_is_taken_and_another_one_refused(tmp_path):
    tls, authority = certified(tmp_path, LOOPBACK)
    with SimulatedOnvif(STREAMS, ("admin", ADMIN.password), tls=tls) as device:
        assert device.address.startswith("https://")
        assert [one.address for one in streams_of(device.address, ADMIN, trusted(authority))] == list(STREAMS.values())
        seen = len(device.requests)
        with pytest.raises(UserError, match=r"its certificate is not trusted: .*; --certificates FILE .*--any-certificate"):
            streams_of(device.address, ADMIN)
        assert len(device.requests) == seen
        assert len(streams_of(device.address, ADMIN, trusted(any_certificate=True))) == 1


def test_a_certificate_of_another_host_is_refused(tmp_path):
    tls, authority = certified(tmp_path, "10.0.0.9")
    with (
        SimulatedOnvif(STREAMS, tls=tls) as device,
        pytest.raises(UserError, match=r"certificate is not trusted: .*127\.0\.0\.1"),
    ):
        streams_of(device.address, None, trusted(authority))


@pytest.mark.parametrize("algorithms", [(), ("MD5",), ("SHA-256",), ("MD5", "SHA-256"), ("SHA-512-256", "MD5")])
def test_streams_with_the_password_and_not_with_another(algorithms):
    """With HTTP digest; without one as ONVIF's own digest, with the time of the device."""
    with SimulatedOnvif(STREAMS, ("admin", ADMIN.password), digest=algorithms) as device:
        assert len(streams_of(device.address, ADMIN)) == 1
        with pytest.raises(UserError, match="user or password is wrong"):
            streams_of(device.address, User("admin", "other"))
        with pytest.raises(UserError, match="it wants a user: --user NAME"):
            streams_of(device.address, None)


def test_a_nonce_that_expires_is_followed():
    class Forgetful(SimulatedOnvif):
        def answer(self, body: bytes) -> str:
            self.nonces += 1
            return super().answer(body)

    with Forgetful(STREAMS, ("admin", ADMIN.password), digest=("MD5",)) as device:
        assert len(streams_of(device.address, ADMIN)) == 1


@pytest.mark.parametrize("algorithms", [("SHA-512-256",), ("MD5-sess",)])
def test_other_authentications_are_named(algorithms):
    class Basic(SimulatedOnvif):
        def knows(self, authorization: str, path: str) -> bool:
            return False

    device = Basic(STREAMS, ("admin", ADMIN.password), digest=algorithms)
    with device, pytest.raises(UserError, match="allowed: ONVIF's own, and HTTP digest with SHA-256 or MD5"):
        streams_of(device.address, ADMIN)


@pytest.mark.nightly
def test_the_command_takes_the_certificate(tmp_path):
    tls, authority = certified(tmp_path, LOOPBACK)
    with SimulatedOnvif(STREAMS, tls=tls) as device:
        status, text, _ = zenocap("cameras", "--onvif", device.address, "--json")
        assert (status, "its certificate is not trusted" in text) == (1, True)
        for option in (("--certificates", str(authority)), ("--any-certificate",)):
            status, text, _ = zenocap("cameras", "--onvif", device.address, "--json", *option)
            assert (status, STREAMS["main"] in text) == (0, True)


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (("--any-certificate",), 2, "allowed with --onvif"),
        (("--onvif", "--any-certificate", "--certificates", "a.pem"), 2, "allowed without --certificates"),
        (("--onvif", "camera", "--certificates", "missing.pem"), 1, "--certificates missing.pem: "),
        (("--user", "me"), 2, "allowed with --onvif"),
        (("--onvif", "--interface", "127.0.0.1", "camera"), 2, "--interface: allowed without HOST"),
        (("--onvif", "--live"), 2, "--onvif: allowed without"),
        (("--onvif", "--interface", "999.1.1.1"), 1, "no probe can be sent"),
        (("--onvif", "ftp://camera"), 1, "allowed: HOST, HOST:PORT"),
    ],
)
def test_options_that_do_not_fit(arguments, status, text):
    code, _, errors = zenocap("cameras", *arguments)
    assert (code, text in " ".join(errors.split())) == (status, True)
