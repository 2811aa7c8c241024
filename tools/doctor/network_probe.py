"""Observe the network for a few seconds as a reader."""

import socket
import ssl
import time
from contextlib import suppress
from pathlib import Path

from zenocap.common.bus.protocol import Alive, BusError, Envelope, RoundTrip
from zenocap.common.bus.security import Security
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import CameraAdvice, Health
from zenocap.common.rig.security import host_of
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.clock_offset import ClockFilter, observe, offset_at
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.doctor.machine_checks import Endpoint
from zenocap.tools.doctor.network_checks import Network

OPEN_S, CALL_S = 4.0, 2.0
LISTEN_S = 2.5  # health is published once a second
TRIPS = 5
MAX_SERVICES = 1024  # largest number of services stored


def look_at_network(options: ZenohOptions, rig: str) -> Network:
    """Liveliness, health and information of all services, and this machine's clock offset to the integrator."""
    clock = RealClock()
    deadline_s = time.monotonic() + OPEN_S
    try:
        with ZenohBus.open(options, rig, clock, lambda: time.monotonic() > deadline_s) as bus:
            bus.watch_alive()
            bus.subscribe(HEALTH)
            bus.subscribe(CAMERA_ADVICE)
            alive: set[ServiceKey] = set()
            health: dict[ServiceKey, Health] = {}
            advice: dict[str, CameraAdvice] = {}
            trips, sent_queries = ClockFilter(), 0
            started_s = time.monotonic()
            while (elapsed_s := time.monotonic() - started_s) < LISTEN_S:
                if elapsed_s > (1 + sent_queries) * LISTEN_S / (TRIPS + 1):
                    bus.query_clock()
                    sent_queries += 1
                match bus.receive(0.1):
                    case Alive(service=service, id=id, alive=is_alive) if len(alive) < MAX_SERVICES:
                        (alive.add if is_alive else alive.discard)((service, id))
                    case Envelope(message=Health() as report) if len(health) < MAX_SERVICES:
                        health[(report.service, report.id)] = report
                    case Envelope(message=CameraAdvice() as one) if len(advice) < MAX_SERVICES:
                        advice[one.viewer] = one
                    case RoundTrip() as trip:
                        trips = observe(trips, trip)
            about = bus.query_service_info(1.0)
            return Network(None, frozenset(alive), about, health, offset_at(trips, clock.now_ns()), advice)
    except BusError as error:
        return Network(str(error))


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
