"""Machine that has the camera of a viewer, and names of films."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from zenocap.common import codec
from zenocap.common.messages import CameraHost, FilmQuery, HostCamera
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.common.rig.rig import Viewer, demo_rig
from zenocap.common.rig.sources import Device
from zenocap.services.camera.feeds import settings_in
from zenocap.tools.record.film.places import camera_settings, matching
from zenocap.tools.record.film.remote_film import film_name

LINK = "/dev/v4l/by-id/usb-A-video-index0"


def host(machine: str, *cameras: HostCamera) -> CameraHost:
    return CameraHost(frame=0, captured_ns=0, machine=machine, host=machine, cameras=list(cameras))


def viewer(source: Device) -> Viewer:
    return replace(demo_rig().viewers[0], source=source)


def test_a_camera_is_found_by_its_stable_name_or_by_the_name_in_the_rig() -> None:
    usb = HostCamera(id="usb-A-video-index0", source=LINK, stable=True)
    named = HostCamera(id="cam01", source="rtsp://1.2.3.4/s")
    unstable = HostCamera(id="video0", source="/dev/video0")
    one = viewer(Device(None, Path(LINK)))
    hosts = [host("lab1", usb, unstable), host("lab2", named)]
    assert one.camera.name == "cam01"
    assert set(matching(one, hosts[:1], lambda _: False).values()) == {"lab1"}
    assert set(matching(one, hosts, lambda _: False).values()) == {"lab1", "lab2"}
    assert set(matching(one, hosts[:1], lambda _: True).values()) == set()  # this machine has it
    assert set(matching(viewer(Device(0)), hosts[:1], lambda _: False).values()) == set()  # /dev/video0 is anybody's


def test_settings_of_a_camera_reach_the_machine_that_has_it() -> None:
    settings = CameraSettings("YUYV", 250, "auto", -3)
    given = camera_settings(viewer(Device(0, None, settings)))
    query = FilmQuery(frame=0, captured_ns=0, what="open", sender="a", settings=given)
    assert settings_in(codec.decode(codec.encode(query), FilmQuery)) == settings


@pytest.mark.parametrize("folder", ["monday", "..", ".hidden", "Übung 1", "a" * 200, "film."])
def test_names_of_films_are_allowed(folder: str) -> None:
    name = film_name(folder, datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    assert name.endswith("-20260102T030405Z")
    query = FilmQuery(frame=0, captured_ns=0, what="state", sender="a", film=name)
    assert msgspec.structs.asdict(codec.decode(codec.encode(query), FilmQuery))["film"] == name
