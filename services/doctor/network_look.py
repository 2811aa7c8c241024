"""A few seconds on the network, as anybody who reads: who is there, and what they say."""

import socket
import ssl
import time
from contextlib import suppress
from pathlib import Path

from common.bus.protocol import Alive, BusError, Envelope, RoundTrip
from common.bus.security import Security
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Health
from common.runtime.clock import ClockFilter, RealClock, observe, offset_at
from common.runtime.security import host_of
from common.topics import HEALTH
from services.doctor.machine_checks import Endpoint
from services.doctor.network_checks import Name, Network

OPEN_S, CALL_S = 4.0, 2.0
LISTEN_S = 2.5  # health comes once a second
TRIPS = 5
MOST = 1024  # names that are remembered


def look_at_network(options: ZenohOptions, rig: str) -> Network:
    """Everybody's liveliness, health and answer, and this machine's clock against the integrator's."""
    clock = RealClock()
    patience_s = time.monotonic() + OPEN_S
    try:
        with ZenohBus.open(options, rig, clock, lambda: time.monotonic() > patience_s) as bus:
            bus.watch_alive()
            bus.subscribe(HEALTH)
            alive: set[Name] = set()
            health: dict[Name, Health] = {}
            trips, asked = ClockFilter(), 0
            started_s = time.monotonic()
            while (passed_s := time.monotonic() - started_s) < LISTEN_S:
                if passed_s > (1 + asked) * LISTEN_S / (TRIPS + 1):
                    bus.ask_clock()
                    asked += 1
                match bus.receive(0.1):
                    case Alive(service=service, id=id, alive=there) if len(alive) < MOST:
                        (alive.add if there else alive.discard)((service, id))
                    case Envelope(message=Health() as said) if len(health) < MOST:
                        health[(said.service, said.id)] = said
                    case RoundTrip() as trip:
                        trips = observe(trips, trip)
            about = bus.ask_about(1.0)
            return Network(None, frozenset(alive), about, health, offset_at(trips, clock.now_ns()))
    except BusError as error:
        return Network(str(error))


def call(address: str, security: Security | None) -> Endpoint:
    """Whether somebody answers at a Zenoh endpoint, and with TLS whether both certificates are accepted."""
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
    """Raises ssl.SSLError and OSError."""
    context = ssl.create_default_context(cafile=_there(security.authority))
    context.load_cert_chain(_there(security.certificate), _there(security.key))
    with context.wrap_socket(plain, server_hostname=host) as link:
        link.settimeout(0.3)
        with suppress(TimeoutError):
            link.recv(1)  # a refusal of our certificate comes after the handshake


def _there(path: Path) -> str:
    """Raises OSError, whose text names the file."""
    if not path.is_file():
        raise OSError(f"no file {path}")
    return str(path)
