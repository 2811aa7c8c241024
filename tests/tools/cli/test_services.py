"""The command `recognizer`: model and commands of its rigs."""

import pytest

from zenocap.common.rig.rig import demo_rig
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
