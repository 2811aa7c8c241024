"""The command `recognizer`: model and commands of its rigs; the port of the demo."""

import socket

import pytest

from zenocap.common.rig.rig import demo_rig
from zenocap.tools.cli import up
from zenocap.tools.cli.services import with_recognizer


@pytest.mark.parametrize("model", [None, "fifteen"])
def test_the_commands_of_a_rig_are_kept_unless_they_are_switched_off(model: str | None) -> None:
    rig = demo_rig("two-view")
    kept, without = (with_recognizer(rig, model, commands=commands).recognizer for commands in (True, False))
    assert kept == rig.recognizer
    assert without is not None
    assert without.commands == ()
    assert {one.posture: one.action.target for one in kept.commands} == {
        "raise-right-arm": "demo/slides/next",
        "raise-left-arm": "demo/slides/previous",
        "raise-both-arms": "demo/slides/first",
    }


def test_the_demo_takes_a_free_port_where_the_usual_one_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[up.RunArguments] = []
    monkeypatch.setattr(up, "_run", lambda _, arguments, __: given.append(arguments))
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        monkeypatch.setattr(up, "DEMO_PORT", other.getsockname()[1])
        up.demo(given=up.RunArguments())
        up.demo(given=up.RunArguments(port=8090))
    assert [one.port for one in given] == [0, 8090]
