"""Observe the network for a few seconds as a reader."""

import socket
import ssl
import time
from contextlib import suppress
from pathlib import Path

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.security import Security
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.observe.view import RigView, observed
from zenocap.common.rig.security import host_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.clock_offset import offset_at
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.doctor.machine_checks import Endpoint
from zenocap.tools.doctor.network_checks import NetworkState

OPEN_S, CALL_S = 4.0, 2.0
LISTEN_S = 2.5  # health is published once a second
TRIPS = 5


def look_at_network(options: ZenohOptions, rig: str) -> NetworkState:
    """Liveliness, health and information of all services, and this machine's clock offset to the integrator."""
    clock = RealClock()
    deadline_s = time.monotonic() + OPEN_S
    try:
        with ZenohBus.open(options, rig, clock, lambda: time.monotonic() > deadline_s) as bus:
            bus.watch_alive()
            bus.subscribe(HEALTH)
            bus.subscribe(CAMERA_ADVICE)
            view, sent_queries = RigView(rig), 0
            started_s = time.monotonic()
            while (elapsed_s := time.monotonic() - started_s) < LISTEN_S:
                if elapsed_s > (1 + sent_queries) * LISTEN_S / (TRIPS + 1):
                    bus.query_clock()
                    sent_queries += 1
                if (event := bus.receive(0.1)) is not None:
                    view = observed(view, event, clock.elapsed_ns())
            about = bus.query_service_info(1.0)
            advice = {id: one.advice for (_, id), one in view.services.items() if one.advice is not None}
            return NetworkState(None, view.alive, about, view.health, offset_at(view.trips, clock.now_ns()), advice)
    except BusError as error:
        return NetworkState(str(error))


def probe_endpoint(address: str, security: Security | None) -> Endpoint:
    """Whether a Zenoh endpoint accepts connections and, with TLS, whether both certificates are accepted."""
    protocol, _, place = address.partition("/")
    port = place.rpartition(":")[2]
    if protocol not in ("tcp", "tls") or not port.isdecimal():
        return Endpoint(address)
    host = host_of(address)
    try:
        with socket.create_connection((host, int(port)), CALL_S) as plain:
            if protocol == "tls" and security is not None:
                _shake_hands(plain, host, security)
    except ssl.SSLCertVerificationError as error:
        return Endpoint(address, f"its certificate is not accepted: {error.verify_message}", trusted=False)
    except ssl.SSLError as error:
        return Endpoint(address, f"TLS fails: {(error.reason or str(error)).replace('_', ' ').lower()}", trusted=False)
    except OSError as error:
        return Endpoint(address, error.strerror or str(error) or "no answer")
    return Endpoint(address)


def _shake_hands(plain: socket.socket, host: str, security: Security) -> None:
    """TLS handshake with both certificates.  Raises ssl.SSLError and OSError."""
    context = ssl.create_default_context(cafile=_existing(security.authority))
    context.load_cert_chain(_existing(security.certificate), _existing(security.key))
    with context.wrap_socket(plain, server_hostname=host) as link:
        link.settimeout(0.3)
        with suppress(TimeoutError):
            link.recv(1)  # a rejection of our certificate arrives after the handshake


def _existing(path: Path) -> str:
    """Path of a file that exists.  Raises OSError, whose text names the file."""
    if not path.is_file():
        raise OSError(f"no file {path}")
    return str(path)
