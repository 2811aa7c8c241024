"""ONVIF cameras: probe, streams, a simulated device on the loopback interface."""

import json
import threading

import pytest

from tests.support.command import app, zenocap
from tests.support.command_receivers import dripping_server
from tests.support.onvif_device import LOOPBACK, SimulatedOnvif
from tests.tools.cli.test_main import runner
from zenocap.common.errors import UserError
from zenocap.tools.setup.cameras import onvif_http
from zenocap.tools.setup.cameras.onvif_device import OnvifStream, asked_devices, device_address, streams_of, with_user
from zenocap.tools.setup.cameras.onvif_discovery import OnvifDevice, devices_of, found_devices
from zenocap.tools.setup.cameras.onvif_http import User

STREAMS = {"main": "rtsp://127.0.0.1:1/live?a=1&b=2", "sub": "rtsp://127.0.0.1:1/sub"}


@pytest.mark.slow
def test_a_device_is_found_by_its_answer_with_name_and_the_address_at_its_own_host():
    with SimulatedOnvif(STREAMS) as device:
        assert found_devices(LOOPBACK, 0.6) == [OnvifDevice(device.address, "Hall camera", "X1")]


@pytest.mark.slow
def test_there_is_one_device_at_a_time_on_the_machine():
    """Workers of pytest and clones beside this one, whose probes all devices would answer."""
    ends = []

    def second() -> None:
        with SimulatedOnvif({}):
            ends.append("second")

    other = threading.Thread(target=second)
    with SimulatedOnvif({}):
        other.start()
        other.join(0.1)
        ends.append("first")
    other.join()
    assert ends == ["first", "second"]


@pytest.mark.slow
def test_streams_have_profile_encoding_size_and_address():
    with SimulatedOnvif(STREAMS) as device:
        main, sub = streams_of(device.address, None)
    assert main == OnvifStream("main stream", "H264", (1280, 720), STREAMS["main"])
    assert sub.address == STREAMS["sub"]
    assert device.requests == ["GetCapabilities", "GetProfiles", "GetStreamUri", "GetStreamUri"]


@pytest.mark.slow
@pytest.mark.parametrize("uri", ["file:///etc/passwd", "http://127.0.0.1/x", "rtsp://", "rtsp://host:99999/", "nothing"])
def test_addresses_that_are_not_of_rtsp_are_left_out(uri):
    with SimulatedOnvif({"main": uri}) as device:
        (asked,) = asked_devices([OnvifDevice(device.address)], None)
    assert (asked.streams, asked.problem) == ((), "it has no video stream")


def test_the_password_goes_to_the_device_only():
    device, user = OnvifDevice("http://10.0.0.5/onvif/device_service"), User("me", "a:b@c")
    own, other, known = (
        OnvifStream("p", "H264", (0, 0), address)
        for address in ("rtsp://10.0.0.5:554/live", "rtsp://10.0.0.6/live", "rtsp://x:y@10.0.0.5/live")
    )
    assert with_user(device, own, user) == "rtsp://me:a%3Ab%40c@10.0.0.5:554/live"
    assert with_user(device, other, user) == other.address
    assert with_user(device, known, user) == known.address
    assert with_user(device, own, None) == own.address


BOMB = b'<!DOCTYPE x [<!ENTITY a "aaaa">]><x>&a;</x>'


@pytest.mark.parametrize("answer", [b"", b"\xff\xfe", b"<a>", BOMB, BOMB.decode().encode("utf-16"), b"<x/>"])
def test_answers_that_are_none_are_ignored(answer):
    assert list(devices_of(answer, LOOPBACK)) == []


@pytest.mark.slow
def test_an_answer_that_leads_to_another_host_is_ignored():
    match = "<d:ProbeMatch><d:XAddrs>http://10.0.0.9/ ftp://127.0.0.1/ http://[::</d:XAddrs></d:ProbeMatch>"
    with SimulatedOnvif({}, matches=match):
        assert found_devices(LOOPBACK, 0.4) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("replies", "problem"),
    [
        ({"GetCapabilities": "<tds:Nothing/>"}, "it has no media service, so no stream"),
        ({"GetProfiles": "<e:Fault><e:Reason><e:Text>out of order</e:Text></e:Reason></e:Fault>"}, "out of order"),
        ({"GetProfiles": "<unclosed>"}, "is not that of an ONVIF device"),
        ({"GetProfiles": "x" * (1 << 20)}, "is not that of an ONVIF device"),
    ],
)
def test_a_device_without_streams_has_the_reason(replies, problem):
    with SimulatedOnvif(STREAMS, replies=replies) as device:
        (asked,) = asked_devices([OnvifDevice(device.address)], None)
    assert problem in asked.problem


def test_no_device_at_an_address():
    (asked,) = asked_devices([OnvifDevice("http://127.0.0.1:9/onvif/device_service")], None)
    assert "no answer" in asked.problem


@pytest.mark.slow
@pytest.mark.parametrize("limit", ["TIMEOUT_S", "DEVICE_S"])
def test_a_device_that_answers_in_single_bytes_keeps_nobody(monkeypatch: pytest.MonkeyPatch, limit: str) -> None:
    """A byte each 4 s kept the command for days: the time-out was that of each read."""
    monkeypatch.setattr(onvif_http, limit, 0.3)
    with dripping_server() as place:
        (asked,) = asked_devices([OnvifDevice(f"http://{place}/onvif/device_service")], None)
    assert asked.problem == "no answer: timed out"


@pytest.mark.parametrize("text", ["http://", "ftp://camera", "http://camera:0", "http://[::"])
def test_wrong_addresses_name_what_is_allowed(text):
    with pytest.raises(UserError, match="allowed: HOST, HOST:PORT, or http://HOST/"):
        device_address(text)


@pytest.mark.nightly
def test_the_command_lists_tries_and_never_prints_the_password():
    with SimulatedOnvif(STREAMS, user=("admin", "secret")) as device:
        arguments = ["cameras", "--onvif", "--interface", LOOPBACK, "--user", "admin"]
        found = runner.invoke(app, arguments, input="secret\n", env={"COLUMNS": "200"})
        assert found.exit_code == 1  # nothing answers at the stream's port
        assert f"{device.address}: Hall camera X1" in found.stdout
        assert f'source = "{STREAMS["main"]}"' in found.stdout
        assert "main stream: 1280 x 720, H264" in found.stdout
        assert "no image: " in found.stdout
        assert "secret" not in found.stdout + found.stderr
        status, text, _ = zenocap("cameras", "--onvif", device.host, "--json")
        assert status == 1
        (row,) = json.loads(text)
        assert (row["address"], row["streams"]) == (device.address, [])
        assert row["problem"] == "it wants a user: --user NAME"


CAPABILITIES = "<tds:GetCapabilitiesResponse><tt:Media><tt:XAddr>{}</tt:XAddr></tt:Media></tds:GetCapabilitiesResponse>"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "words"),
    [("http://[x", "cannot be read"), ("http://127.0.0.1/\u00f6", "cannot be read"), ("http://127.0.0.1/a b", "no answer")],
)
def test_a_device_with_an_odd_answer_is_named_and_the_others_are_asked(address, words):
    with SimulatedOnvif(STREAMS, replies={"GetCapabilities": CAPABILITIES.format(address)}) as device:
        odd, away = asked_devices([OnvifDevice(device.address), OnvifDevice("http://127.0.0.1:1/x")], None)
    assert odd.streams == ()
    assert words in odd.problem
    assert "no answer" in away.problem
