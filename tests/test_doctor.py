"""`zenocap doctor` on real machines' faults: sockets, files, sources, and a network of services that differ."""

import json
import socket
import stat
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from common.bus.access import Member
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions, open_session
from common.runtime.about import about
from common.runtime.clock import RealClock
from common.runtime.rig import Rig, demo_rig, load_rig
from common.runtime.specs import Device, Images
from services.certificates.folder import certify
from services.cli import app
from services.doctor.machine_look import (
    certified,
    look_at_certificates,
    look_at_disk,
    look_at_files,
    look_at_port,
    look_at_source,
)
from services.doctor.network_look import call
from services.launcher.mesh import free_ports
from tests.test_security import demo_with


def doctor(*arguments: object) -> tuple[int, dict[str, list[tuple[str, str]]]]:
    """Exit status; what was found, as verdict and words by check."""
    result = CliRunner().invoke(app, ["doctor", *map(str, arguments), "--json"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    found: dict[str, list[tuple[str, str]]] = {}
    for finding in json.loads(result.stdout)["findings"]:
        found.setdefault(finding["check"], []).append((finding["verdict"], finding["words"]))
    return result.exit_code, found


def test_a_rig_that_cannot_be_read_is_the_first_thing(tmp_path: Path) -> None:
    status, found = doctor(tmp_path / "none.toml")
    assert status == 1
    assert [verdict for verdict, _ in found["rig file"]] == ["wrong"]


def test_an_unknown_service_is_told(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["doctor", str(demo_with(tmp_path, "")), "--service", "viewer-9"])
    assert result.exit_code == 1
    assert "allowed: viewer-1, viewer-2, integrator" in result.output


def test_endpoints(tmp_path: Path) -> None:
    (free,) = free_ports(1)
    assert call(f"tcp/127.0.0.1:{free}", None).problem == "Connection refused"
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        one.listen()
        assert call(f"tcp/127.0.0.1:{one.getsockname()[1]}", None).problem is None
    assert call("udp/127.0.0.1:1", None).problem is None  # cannot be told


def test_a_port_in_use_is_told_unless_it_is_ours() -> None:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        one.listen()
        port = one.getsockname()[1]
        assert "in use" in (look_at_port("page", "key", "127.0.0.1", port, ours=False).problem or "")
        assert look_at_port("page", "key", "127.0.0.1", port, ours=True).ours
    assert look_at_port("page", "key", "127.0.0.1", port, ours=False).problem is None
    assert look_at_port("page", "key", "192.0.2.1", port, ours=True).problem is not None


def test_a_folder_that_will_be_made_is_well_and_one_that_cannot_be_is_not(tmp_path: Path) -> None:
    assert look_at_disk(tmp_path / "a" / "b").problem is None
    (tmp_path / "file").write_text("")
    assert "cannot be written" in (look_at_disk(tmp_path / "file" / "b").problem or "")


def test_sources(tmp_path: Path) -> None:
    viewer = demo_rig().viewers[0]
    assert look_at_source(viewer, runs=False, local=True).kind == "good"
    assert look_at_source(viewer, runs=True, local=True).kind == "used"
    camera = replace(viewer, source=Device(98))
    assert look_at_source(camera, runs=False, local=True).kind == "missing"
    assert look_at_source(replace(viewer, source=Images(tmp_path, "*.png")), runs=False, local=True).kind != "good"


def test_a_source_of_another_size_is_told(tmp_path: Path) -> None:
    import cv2
    import numpy as np

    viewer = demo_rig().viewers[0]
    width, height = viewer.calibrated_size
    for size, kind in (((width, height), "good"), ((width, height // 2), "size")):
        cv2.imwrite(str(tmp_path / "a.png"), np.zeros((size[1], size[0], 3), np.uint8))
        look = look_at_source(replace(viewer, source=Images(tmp_path, "*.png")), runs=False, local=True)
        assert look.kind == kind, look


def test_certificates_are_looked_into(tmp_path: Path) -> None:
    certify(tmp_path, "demo", {Member("router"): ("localhost",)}, datetime.now(UTC), 100)
    assert certified(tmp_path) == ["router"]
    assert [one.problem for one in look_at_certificates(tmp_path, ["router"])] == [None, None]
    assert "No such file" in (look_at_certificates(tmp_path, ["reader"])[1].problem or "")
    secret = tmp_path / "router-key.pem"
    secret.chmod(secret.stat().st_mode | stat.S_IRGRP)
    assert look_at_certificates(tmp_path, ["router"])[1].readable_by_others
    (tmp_path / "authority-key.pem").replace(secret)
    assert "is not the key of" in (look_at_certificates(tmp_path, ["router"])[1].problem or "")


def test_files_of_the_recogniser_are_looked_for(tmp_path: Path) -> None:
    rig = demo_rig()
    assert rig.recognizer is not None
    assert [file.problem for file in look_at_files(rig, ("recognizer",))] == [None]
    gone = replace(rig, recognizer=replace(rig.recognizer, model=tmp_path / "none"))
    assert [file.what for file in look_at_files(gone, ("recognizer",)) if file.problem] == ["postures"]
    assert look_at_files(gone, ("viewer",)) == []


@pytest.mark.system
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
        for bus, id, its in ((one, "1", rig), (two, "2", other)):
            bus.declare_alive("viewer", id)
            bus.introduce(about(its, "viewer", id, 0))
        status, found = doctor(path, "--service", "viewer-1")
    assert status == 1
    assert found["endpoint"] == [("ok", f"{place} answers")]
    assert next(words for verdict, words in found["rig file"] if verdict == "wrong").startswith("viewer 2 on ")
    assert found["versions"][0][0] == "ok"
    assert found["integrator"][0][0] == "warning"
