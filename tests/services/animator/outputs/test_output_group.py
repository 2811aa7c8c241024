"""All outputs of a rig: a failure is one line and does not affect the others."""

import json
import logging
import socket
from collections.abc import Mapping
from contextlib import closing
from unittest.mock import Mock

import numpy as np
import pytest

from tests.services.animator.outputs.test_vmc import Marionette
from tests.support.command_receivers import udp_receiver
from tests.support.virtual_actors import BODIES, at_the_ends, stretched
from zenocap.common.bus.protocol import Envelope
from zenocap.common.rig.animator import AnimatorTable, FoxgloveTable, LslTable, UdpTable, VmcTable, VrchatTable
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.animator.outputs import lsl
from zenocap.services.animator.outputs.output_group import OutputGroup, has_outputs, open_outputs
from zenocap.services.animator.states import ActorPose

CLOCK = ManualClock()


class Broken:
    title = "animator.broken nowhere"

    def receive(self, envelope: Envelope) -> None:
        raise RuntimeError("cannot receive")

    def send(self, actor: ActorPose, posture: str | None) -> None:
        raise RuntimeError("cannot send")

    def counts(self) -> Mapping[str, int]:
        return {"sent": 3}

    def close(self) -> None:
        raise OSError("cannot close")


def test_an_empty_table_opens_nothing() -> None:
    outputs = open_outputs(AnimatorTable(), "studio", CLOCK)
    outputs.send(stretched("ten-parts"), None)
    assert (outputs.failed, outputs.counts()) == ((), {})
    assert not has_outputs(AnimatorTable())


def test_a_disabled_output_is_not_opened() -> None:
    tables = {"vmc": VmcTable, "udp": UdpTable, "foxglove": FoxgloveTable}
    table = AnimatorTable(outputs={name: kind(enabled=False) for name, kind in tables.items()})
    outputs = open_outputs(table, "studio", CLOCK)
    outputs.send(stretched("ten-parts"), None)
    assert outputs.counts() == {}
    assert not has_outputs(table)
    assert has_outputs(AnimatorTable(outputs={"udp": UdpTable()}))


def test_outputs_that_cannot_be_opened_are_listed_and_the_others_send(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(lsl, "import_module", Mock(side_effect=ImportError("missing")))
    with socket.socket() as taken, udp_receiver() as listening:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        tables = {
            "vmc": VmcTable(host="no.such.host.invalid"), "udp": UdpTable(port=listening.getsockname()[1]),
            "foxglove": FoxgloveTable(port=taken.getsockname()[1]), "lsl": LslTable(),
        }  # fmt: skip
        outputs = open_outputs(AnimatorTable(outputs=tables), "studio", CLOCK)
        outputs.send(stretched("ten-parts", frame=4), "wave")
        assert json.loads(listening.recv(65536))["frame"] == 4
    assert [line.split()[0].rstrip(":") for line in outputs.failed] == [
        "animator.vmc.host", "animator.foxglove", "animator.lsl",
    ]  # fmt: skip
    errors = [record.getMessage() for record in caplog.records if record.levelname == "ERROR"]
    assert errors == [f"{line}; the other outputs are not affected" for line in outputs.failed]
    assert all("\n" not in line for line in errors)
    assert outputs.counts() == {"udp_sent": 1}
    outputs.close()


def test_an_output_that_fails_while_sending_does_not_affect_the_others(caplog: pytest.LogCaptureFixture) -> None:
    with udp_receiver() as listening:
        working = open_outputs(AnimatorTable(outputs={"udp": UdpTable(port=listening.getsockname()[1])}), "studio", CLOCK)
        outputs = OutputGroup([Broken(), *working._outputs])
        for frame in range(5):
            outputs.send(stretched("ten-parts", frame=frame), None)
        outputs.close()
    assert outputs.counts() == {"broken_sent": 3, "broken_errors": 6, "udp_sent": 5}
    warned = [record.getMessage().split(":")[0] for record in caplog.records if record.levelno > logging.INFO]
    assert warned == ["animator.broken nowhere"] * 2


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("size", [0.0, 10.0])
@pytest.mark.parametrize("place", [1e3, -1e3])
@pytest.mark.parametrize("angle", [0.0, 50.0, -50.0])
def test_values_at_the_ends_of_the_bus_ranges_reach_receivers_as_numbers(
    name: str, size: float, place: float, angle: float
) -> None:
    """A stranger on an open network can send such bodies and poses."""
    actor = at_the_ends(name, size, place, angle)
    with closing(Marionette()) as receiver, udp_receiver() as listening:
        tables = {
            "vmc": VmcTable(port=receiver.port), "vrchat": VrchatTable(port=receiver.port),
            "udp": UdpTable(port=listening.getsockname()[1]),
        }  # fmt: skip
        with closing(open_outputs(AnimatorTable(outputs=tables), "studio", CLOCK)) as outputs:
            outputs.send(actor, None)
            receiver.listen()
            found = [np.array([one for one in row if not isinstance(one, str)]) for row in receiver.values.values()]
            assert len(receiver.bones) > 9
            assert all(np.isfinite(row.astype(float)).all() for row in [*found, *receiver.bones.values()])
            numbers = json.loads(listening.recv(65536), parse_constant=lambda text: pytest.fail(text))["joints"].values()
            assert np.isfinite(np.array(list(numbers))).all()
            assert not any("error" in count for count in outputs.counts())
