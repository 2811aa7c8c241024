"""The command `recognizer`: model and commands of its rigs."""

from zenocap.common.rig.rig import demo_rig
from zenocap.tools.cli.services import with_recognizer


def test_the_commands_of_a_rig_are_kept_unless_they_are_switched_off() -> None:
    rig = demo_rig("two-view")
    assert rig.recognizer is not None
    for model in (None, "fifteen"):
        kept, without = with_recognizer(rig, model), with_recognizer(rig, model, commands=False)
        assert kept.recognizer == rig.recognizer
        assert without.recognizer is not None
        assert without.recognizer.commands == ()


def test_the_demo_steers_the_slide_show() -> None:
    rig = demo_rig("two-view")
    assert rig.recognizer is not None
    assert {one.posture: one.action.target for one in rig.recognizer.commands} == {
        "raise-right-arm": "demo/slides/next",
        "raise-left-arm": "demo/slides/previous",
        "raise-both-arms": "demo/slides/first",
    }
