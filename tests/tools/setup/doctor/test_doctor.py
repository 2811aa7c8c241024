"""`zenocap doctor` on real faults: sockets, files, sources, and services with another rig file."""

import json
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.rig.test_security import demo_with
from tests.support.command import zenocap
from zenocap.common.bus.access import Member
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports, open_session
from zenocap.common.rig.rig import Rig, Viewer, demo_rig, load_rig
from zenocap.common.rig.services import SERVICES
from zenocap.common.rig.sources import Device, Images
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.service_info import service_info
from zenocap.tools.setup.certificates.folder import certify
from zenocap.tools.setup.doctor import machine_probe as probe


def doctor(*arguments: object) -> tuple[int, dict[str, list[tuple[str, str]]]]:
    """Exit status, and by check the verdict and text of its finding."""
    status, out, _ = zenocap("doctor", *arguments, "--json")
    found: dict[str, list[tuple[str, str]]] = {}
    for finding in json.loads(out)["findings"]:
        found.setdefault(finding["check"], []).append((finding["verdict"], finding["words"]))
    return status, found


@contextmanager
def listening() -> Iterator[int]:
    """A port of this machine that is in use."""
    with socket.create_server(("127.0.0.1", 0)) as one:
        yield one.getsockname()[1]


def test_unreadable_rig_file_is_reported(tmp_path: Path) -> None:
    status, found = doctor(tmp_path / "none.toml")
    assert status == 1
    assert [verdict for verdict, _ in found["rig file"]] == ["wrong"]


@pytest.mark.slow
def test_unknown_service_is_rejected_with_the_allowed_names(tmp_path: Path) -> None:
    status, out, err = zenocap("doctor", demo_with(tmp_path, ""), "--service", "viewer-9")
    assert (status, "allowed: viewer-1, viewer-2, integrator" in out + err) == (1, True)


def test_endpoint_probe_detects_a_refused_connection(tmp_path: Path) -> None:
    (free,) = free_ports(1)
    assert probe.probe_endpoint(f"tcp/127.0.0.1:{free}", None).problem == "Connection refused"
    with listening() as port:
        assert probe.probe_endpoint(f"tcp/127.0.0.1:{port}", None).problem is None
    assert probe.probe_endpoint("udp/127.0.0.1:1", None).problem is None  # UDP: unknown without a reply


def test_port_in_use_is_a_problem_unless_used_by_this_rig() -> None:
    with listening() as port:
        assert "in use" in (probe.look_at_port("page", "key", "127.0.0.1", port, ours=False).problem or "")
        assert probe.look_at_port("page", "key", "127.0.0.1", port, ours=True).ours
    assert probe.look_at_port("page", "key", "127.0.0.1", port, ours=False).problem is None
    assert probe.look_at_port("page", "key", "192.0.2.1", port, ours=True).problem is not None


def test_missing_folder_is_a_problem_only_if_it_cannot_be_created(tmp_path: Path) -> None:
    assert probe.look_at_disk(tmp_path / "a" / "b").problem is None
    (tmp_path / "file").write_text("")
    assert "cannot be written" in (probe.look_at_disk(tmp_path / "file" / "b").problem or "")


def test_source_probe_distinguishes_good_used_missing_and_differently_sized_sources(tmp_path: Path) -> None:
    viewer = demo_rig("two-view").viewers[0]
    images = replace(viewer, source=Images(tmp_path, "*.png"))

    def kind(viewer: Viewer, *, runs: bool = False) -> str:
        return probe.look_at_source(viewer, runs=runs, local=True).kind

    assert (kind(viewer), kind(viewer, runs=True), kind(replace(viewer, source=Device(98)))) == ("good", "used", "missing")
    assert kind(images) != "good"  # there is none
    width, height = viewer.calibrated_size
    for shown, expected in (((height, width, 3), "good"), ((height // 2, width, 3), "size")):
        cv2.imwrite(str(tmp_path / "a.png"), np.zeros(shown, np.uint8))
        assert kind(images) == expected


def test_certificate_files_permissions_and_keys_are_checked(tmp_path: Path) -> None:
    certify(tmp_path, "demo", {Member("router"): ("localhost",)}, datetime.now(UTC), 100)
    assert probe.certified(tmp_path) == ["router"]
    assert [one.problem for one in probe.look_at_certificates(tmp_path, ["router"])] == [None, None]
    assert "No such file" in (probe.look_at_certificates(tmp_path, ["reader"])[1].problem or "")
    secret = tmp_path / "router-key.pem"
    secret.chmod(secret.stat().st_mode | stat.S_IRGRP)
    assert probe.look_at_certificates(tmp_path, ["router"])[1].readable_by_others
    (tmp_path / "authority-key.pem").replace(secret)
    assert "is not the key of" in (probe.look_at_certificates(tmp_path, ["router"])[1].problem or "")


def test_files_of_a_service_are_checked(tmp_path: Path) -> None:
    files = [file for kind in SERVICES for file in kind.files(demo_rig("two-view"))]
    assert [title for title, _ in files] == ["postures"]
    assert [probe.look_at_file(path) for _, path in files] == [None]
    assert probe.look_at_file(tmp_path / "none") == f"{tmp_path / 'none'}: No such file or directory"


@pytest.mark.nightly
def test_services_with_another_rig_file_are_found_on_the_network(tmp_path: Path) -> None:
    (port,) = free_ports(1)
    place = f"tcp/127.0.0.1:{port}"
    path = demo_with(tmp_path, f'\n[zenoh]\nmode = "client"\nconnect = ["{place}"]\nmulticast_scouting = false\n')
    rig = load_rig(path)
    other: Rig = replace(rig, digest="another")
    options = ZenohOptions("client", (place,), multicast_scouting=False)
    status, found = doctor(path, "--service", "viewer-1")
    assert status == 1
    assert found["endpoint"] == [("wrong", f"{place}: Connection refused")]
    assert found["network"][0][0] == "wrong"
    with (
        open_session(ZenohOptions("router", listen=(place,), multicast_scouting=False)),
        ZenohBus.open(options, rig.name, RealClock()) as one,
        ZenohBus.open(options, rig.name, RealClock()) as two,
    ):
        for bus, id, loaded_rig in ((one, "1", rig), (two, "2", other)):
            bus.declare_alive("viewer", id)
            bus.serve_service_info(service_info(loaded_rig, "viewer", id, 0))
        status, found = doctor(path, "--service", "viewer-1")
    assert status == 1
    assert found["endpoint"] == [("ok", f"{place} accepts connections")]
    assert next(words for verdict, words in found["rig file"] if verdict == "wrong").startswith("viewer 2 on ")
    assert found["versions"][0][0] == "ok"
    assert found["integrator"][0][0] == "warning"
