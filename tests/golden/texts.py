"""Golden texts: readers' results on a golden take.

Each is a function of a take, without network or clock: the take's messages are given to the reader in the order and at the
times of the log, and its services appear with their first message.
"""

import hashlib
import json
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from unittest.mock import patch

from msgspec import json as msgspec_json
from msgspec import to_builtins

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope, RoundTrip, Tick
from zenocap.common.formats import tables
from zenocap.common.observe.spans import SpanReader
from zenocap.common.observe.view import RigView, observed, rows
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.services import ServiceKey, sort_key
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import service_at
from zenocap.services.animator.page.page_updates import Schedule, due_updates
from zenocap.services.animator.presence import Presence
from zenocap.services.animator.presence import observed as presence_after
from zenocap.services.animator.states import AnimatorSetup, AnimatorState
from zenocap.services.animator.step import step
from zenocap.tools.operate.metrics.observations import Observations
from zenocap.tools.operate.monitor.display import as_json
from zenocap.tools.takes.export import ExportOptions, export
from zenocap.tools.takes.info import info

SECOND_NS = 1_000_000_000
WRITTEN_BY = "0.2.0"  # version in the metadata of a table, not that of today
OWN = ("trc", "bvh", "csv", "mot", "npz")  # formats whose bytes depend on no library
PACKAGES = {"c3d": "ezc3d", "parquet": "pyarrow", "glb": "pygltflib", "usd": "pxr"}  # of the other formats without a model


def events(path: Path) -> Iterator[Envelope | Alive]:
    """Messages of a take, each service's presence before its first one."""
    present: set[ServiceKey] = set()
    for received in TakeReader(path).envelopes(invalid="raise"):
        service = service_at(received.key)
        if service is not None and service not in present:
            present.add(service)
            yield Alive(*service, True, received.received_ns)
        yield received


def services(path: Path) -> tuple[ServiceKey, ...]:
    return tuple(sorted({(event.service, event.id) for event in events(path) if isinstance(event, Alive)}, key=sort_key))


def seconds(path: Path) -> Iterator[tuple[Envelope | Alive, int | None]]:
    """Events, and after the last one before each full second and at the end the time of the log (ns), else None."""
    before: Envelope | Alive | None = None
    for event in events(path):
        if before is not None:
            passed = before.received_ns // SECOND_NS < event.received_ns // SECOND_NS
            yield before, before.received_ns if passed else None
        before = event
    if before is not None:
        yield before, before.received_ns


def info_text(path: Path) -> str:
    """Of `zenocap info --json`, without the path of the file."""
    with tempfile.TemporaryDirectory() as name:
        copy = Path(name) / path.name
        shutil.copy(path, copy)
        found = asdict(info(copy)) | {"path": path.name}
    return json.dumps(found, indent=1, default=to_builtins) + "\n"


def exports_text(path: Path) -> str:
    """SHA-256 of each format of `zenocap export` that this package writes by itself."""
    return _exports(path, OWN)


def library_exports_text(path: Path) -> str:
    """The same of those that libraries write, as far as they are installed."""
    return _exports(path, [to for to, package in PACKAGES.items() if find_spec(package)])


def _exports(path: Path, formats: Sequence[str]) -> str:
    lines = []
    with tempfile.TemporaryDirectory() as name, patch.object(tables, "version", lambda _: WRITTEN_BY):
        for to in formats:
            file = Path(name) / f"take.{to}"
            rows = export(path, file, ExportOptions(to)).rows
            lines.append(f"{to:8} {rows:5} rows  {hashlib.sha256(file.read_bytes()).hexdigest()}")
    return "\n".join([*lines, ""])


def top_text(path: Path) -> str:
    """Services of `zenocap top --json` at each second."""
    view = RigView(rig_of(path), services(path))
    lines: list[str] = []
    for event, now_ns in seconds(path):
        view = observed(view, event, event.received_ns)
        if now_ns is not None:
            lines += [str(now_ns), *map(json.dumps, as_json(rows(view, now_ns))["services"])]
    return "\n".join([*lines, ""])


def metrics_text(path: Path) -> str:
    """The answer to a scrape at the end of the take, without what is of this machine's programs."""
    from prometheus_client import CollectorRegistry, generate_latest

    from zenocap.tools.operate.metrics.families import RigCollector

    rig = rig_of(path)
    observations = Observations({rig: services(path)})
    now_ns = 0
    for event in events(path):
        now_ns = event.received_ns
        observations.rigs[rig].receive(RoundTrip(now_ns, now_ns, now_ns), now_ns)
        observations.rigs[rig].receive(event, now_ns)
    registry = CollectorRegistry()
    registry.register(RigCollector(observations, threading.Lock(), ManualClock(now_ns)))
    return "".join(line for line in generate_latest(registry).decode().splitlines(True) if "build_info{" not in line)


def spans_text(path: Path) -> str:
    """Spans of `zenocap traces` for every tenth pose, times in ns from the first capture."""
    reader = SpanReader(rig_of(path), 10)
    lines = []
    for event in events(path):
        reader.receive(RoundTrip(event.received_ns, event.received_ns, event.received_ns))
        spans = reader.receive(event)
        if spans is not None:
            begin_ns = spans.whole.begin_ns
            lines.append(" ".join(f"{key}={value}" for key, value in spans.whole.attributes.items()))
            lines += [
                f"  {part.service}: {part.name}: {part.begin_ns - begin_ns} to {part.end_ns - begin_ns}"
                for part in (spans.whole, *spans.parts)
            ]
    return "\n".join([*lines, ""])


def page_text(path: Path) -> str:
    """Of the updates of the live page by key: number and SHA-256."""
    expected = services(path)
    setup = AnimatorSetup(tuple(id for service, id in expected if service == "viewer"))
    presence, state, schedule = Presence(RigView(rig_of(path), expected)), AnimatorState(), Schedule()
    digests: dict[str, tuple[int, hashlib._Hash]] = {}
    for event in events(path):
        for one in (event, Tick(event.received_ns)):
            state, _ = step(setup, state, one)
        presence = presence_after(presence, event, event.received_ns)
        schedule, updates = due_updates(schedule, state, presence, 1, event.received_ns)
        for update in updates:
            count, digest = digests.get(update.key, (0, hashlib.sha256()))
            data = update.data if isinstance(update.data, bytes) else update.data.encode()
            digest.update(data)
            digests[update.key] = count + 1, digest
    return "\n".join([*(f"{key:24} {n:5}  {digest.hexdigest()}" for key, (n, digest) in sorted(digests.items())), ""])


def verdict_text(path: Path) -> str:
    """Verdicts in the take."""
    found = [
        event.message for event in events(path) if isinstance(event, Envelope) and isinstance(event.message, m.Verdict)
    ]
    return msgspec_json.format(msgspec_json.encode(found), indent=1).decode() + "\n"


def rig_of(path: Path) -> str:
    """Name of a take's rig."""
    return next(event.key.split("/")[1] for event in events(path) if isinstance(event, Envelope))


TEXTS: Mapping[str, Callable[[Path], str]] = {
    "info": info_text, "exports": exports_text, "top": top_text, "metrics": metrics_text, "spans": spans_text,
    "page": page_text, "verdict": verdict_text,
}  # fmt: skip
