"""What crosses the connection of two routers, measured: rigs of stand-ins around one router, readers at the other.

    python -m benchmarks.router_link [--rigs 4] [--rate 30] [--seconds 10] [--ready 40]

Needs root and `ip` (iproute2): each router has a network namespace of its own, with a virtual cable between them whose
bytes the kernel counts.  The first has the rigs: two viewers that publish recorded messages, an integrator; no images, no
log.  Readers at the second router: none, of health, of health and poses, of everything.  Beside each what the plan says of
the same load, for rigs without a tracker.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from zenocap.tools.measure.installation import flows
from zenocap.tools.measure.installation_plan import installation_of
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.unit_costs import COSTS

RIGS, READERS = "zc-rigs", "zc-readers"  # the namespaces
ADDRESSES = {RIGS: "10.99.0.1", READERS: "10.99.0.2"}
PORT = 7447
READY_S, SETTLE_S, END_S = 40.0, 3.0, 20.0
EXPRESSIONS: dict[str, tuple[str, ...]] = {
    "no reader": (),
    "health": ("zenocap/**/health",),
    "health and poses": ("zenocap/**/health", "zenocap/*/integrator/bap"),
    "everything": ("zenocap/**",),
}
READER = """
import sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
session = zenoh.open(config)
kept = [session.declare_subscriber(one, lambda _: None) for one in sys.argv[1:]]
time.sleep(3600)
"""


def _run(*words: str) -> None:
    subprocess.run(words, check=True)


@contextmanager
def two_networks() -> Iterator[None]:
    """Namespaces RIGS and READERS with a cable between them."""
    try:
        for name in ADDRESSES:
            _run("ip", "netns", "add", name)
            _run("ip", "-n", name, "link", "set", "lo", "up")
        _run("ip", "link", "add", "zc0", "netns", RIGS, "type", "veth", "peer", "name", "zc0", "netns", READERS)
        for name, address in ADDRESSES.items():
            _run("ip", "-n", name, "address", "add", f"{address}/24", "dev", "zc0")
            _run("ip", "-n", name, "link", "set", "zc0", "up")
        yield
    finally:
        for name in ADDRESSES:
            subprocess.run(["ip", "netns", "delete", name], check=False, stderr=subprocess.DEVNULL)


@contextmanager
def started(network: str, *words: str) -> Iterator[None]:
    """A program in a namespace, ended with SIGTERM."""
    command = ["ip", "netns", "exec", network, sys.executable, *words]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ.copy())
    try:
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def received_bytes() -> int:
    """Bytes that the readers' end of the cable has received."""
    path = "/sys/class/net/zc0/statistics/rx_bytes"
    text = subprocess.run(
        ["ip", "netns", "exec", READERS, "cat", path], check=True, capture_output=True, text=True
    ).stdout  # fmt: skip
    return int(text)


def rate_of(seconds: float, expressions: Sequence[str]) -> float:
    """Bytes per second that cross the cable with a reader of these keys."""
    if not expressions:
        return _counted(seconds)
    with started(READERS, "-c", READER, *expressions):
        return _counted(seconds)


def _counted(seconds: float) -> float:
    time.sleep(SETTLE_S)
    before, start_s = received_bytes(), time.monotonic()
    time.sleep(seconds)
    return (received_bytes() - before) / (time.monotonic() - start_s)


def planned(plan: Plan) -> dict[str, float]:
    """Bytes per second by the plan, for the readers of EXPRESSIONS."""
    found = dict.fromkeys(EXPRESSIONS, 0.0)
    for flow in flows(installation_of(plan), COSTS):
        rate = plan.rigs * flow.each * flow.hz * flow.bytes
        found["everything"] += rate
        found["health"] += rate if flow.name == "health" else 0.0
        found["health and poses"] += rate if flow.name in ("health", "pose") else 0.0
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", type=int, default=4)
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--ready", type=float, default=READY_S, help="wait for the rigs, s")
    options = parser.parse_args()
    if os.geteuid() != 0 or shutil.which("ip") is None:
        print("not measured: needs root and ip (iproute2)")
        return 0
    plan = Plan(rigs=options.rigs, rate=options.rate)
    figures = planned(plan)
    whole_s = options.ready + 4 * (options.seconds + 2 * SETTLE_S) + END_S
    load = ["-m", "zenocap", "load", "--silhouettes", "--rigs", str(options.rigs), "--rate", f"{options.rate:g}"]
    load += ["--seconds", f"{whole_s:g}", "-e", f"tcp/127.0.0.1:{PORT}", "-o", "build/router-link"]
    with (
        two_networks(),
        started(RIGS, "-m", "zenocap", "router", "--listen", f"tcp/0.0.0.0:{PORT}"),
        started(
            READERS, "-m", "zenocap", "router", "--listen", f"tcp/0.0.0.0:{PORT}", "-e", f"tcp/{ADDRESSES[RIGS]}:{PORT}"
        ),
        started(RIGS, *load),
    ):
        time.sleep(options.ready)
        print(f"{options.rigs} rigs of two stand-ins, {options.rate:g} frames/s")
        print("reader at the other router   measured, MB/s   planned")
        for name, expressions in EXPRESSIONS.items():
            rate = rate_of(options.seconds, expressions)
            print(f"{name:28} {rate / 1e6:14.3f} {figures[name] / 1e6:9.3f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
