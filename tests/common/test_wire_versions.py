"""Rigs of two versions: messages of the previous release are understood, other wire versions refused."""

import json
import logging
import re
from base64 import b64decode
from dataclasses import replace

import msgpack
import pytest

from tests.support.built_messages import built
from tests.support.hostile import plain, valid_messages
from tests.support.places import ROOT
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.inbox import Inbox
from zenocap.common.bus.protocol import Envelope
from zenocap.common.topics import SIGHTING
from zenocap.tools.setup.doctor.network_checks import NetworkState, check_messages, check_versions

PREVIOUS = json.loads((ROOT / "tests" / "support" / "wire_0_2.json").read_text())  # made by the code of 0.2, by type
DOCUMENT = (ROOT / "docs" / "wire.md").read_text()


@pytest.mark.parametrize("name", PREVIOUS)
def test_messages_of_the_previous_release_are_understood(name: str) -> None:
    message = codec.decode(b64decode(PREVIOUS[name]), getattr(m, name))
    assert codec.decode(codec.encode(message), type(message)) == message


def test_a_viewer_of_another_wire_version_is_refused_with_what_to_do(caplog: pytest.LogCaptureFixture) -> None:
    """As of a later release, with other fields; the integrator logs one line and goes on with the other viewers."""
    inbox = Inbox(logging.getLogger("test.versions"))
    key = SIGHTING.at("studio", viewer="1")
    later = msgpack.packb({"type": "sighting", "version": m.SCHEMA_VERSION + 1, "viewer": "1", "rays": []})
    (present,) = valid_messages(SIGHTING, 1, 3)
    now = msgpack.packb(plain(present) | {"viewer": "2"})
    for _ in range(3):
        inbox.put(key, SIGHTING, later, 0, every=True)
    inbox.put(SIGHTING.at("studio", viewer="2"), SIGHTING, now, 0, every=True)
    assert isinstance(inbox.take(0.0), Envelope)
    assert inbox.counters.rejected == {"version": 3}
    (line,) = caplog.messages
    words = "the sender has wire version 2, this program 1: install the same zenocap on every"
    assert line.startswith(f"{key}: Sighting: {words}")


def test_doctor_names_services_that_reject_another_version_and_those_that_have_it() -> None:
    counts = {"rejected_version": 7, "rejected_invalid": 2}
    health = built(m.Health, service="integrator", id="main", counts=counts)
    other, invalid = check_messages(NetworkState(health={("integrator", "main"): health}))
    assert (other.verdict, other.words) == ("wrong", "integrator has rejected 7 messages of another wire version")
    assert (invalid.verdict, invalid.words) == ("warning", "integrator has rejected 2 invalid messages")
    info = m.ServiceInfo(
        frame=0, captured_ns=0, service="viewer", id="1", host="pc1", digest="d", versions={"zenocap": "0.2.0", "wire": "2"}
    )
    network = NetworkState(about={("viewer", "1"): info})
    found = check_versions({"zenocap": "0.2.0", "wire": "1"}, network)
    assert [(one.verdict, one.words) for one in found] == [("wrong", "wire 2 at viewer 1 on pc1, 1 here")]
    assert check_versions({"zenocap": "0.2.0", "wire": "1"}, replace(network, about={})) == []


def test_the_page_on_the_wire_has_every_message_and_the_present_version() -> None:
    assert f"now {m.SCHEMA_VERSION}" in DOCUMENT
    new = set(re.findall(r"[A-Z]\w+", DOCUMENT.split("What changed on the wire")[1]))
    kinds = {name for name, kind in vars(m).items() if isinstance(kind, type) and issubclass(kind, m.Message)}
    assert kinds - {"Message", "PaceQuery", "ClockQuery"} - set(PREVIOUS) <= new
