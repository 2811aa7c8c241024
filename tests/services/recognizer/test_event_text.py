"""Placeholders in the texts of a command."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage

from zenocap.common.formats.osc import osc_message
from zenocap.common.rig.commands import HttpAction, OscAction, ProgramAction
from zenocap.services.recognizer.event_text import PostureEvent, filled, filled_action

EVENT = PostureEvent("studio", "raise {count}", 0.41234, 1_764_000_000_123_456_789, 1_764_000_002_456_000_000, 3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{posture} {count}", "raise {count} 3"),  # a label is not searched for placeholders
        ("{confidence} {duration}", "0.412 2.333"),
        ("{begin} {end}", "1764000000.123 1764000002.456"),
        ("{rig}/{other} {} {{count}}", "studio/{other} {} {3}"),
        ('{"next": 1}', '{"next": 1}'),
    ],
)
def test_placeholders_are_replaced_and_other_braces_stay(text: str, expected: str) -> None:
    assert filled(text, EVENT) == expected


def test_the_object_has_every_value() -> None:
    assert json.loads(filled("{json}", EVENT)) == EVENT.values()


@given(st.text(max_size=40).filter(lambda text: "{" not in text))
def test_a_text_without_placeholders_stays(text: str) -> None:
    assert filled(text, EVENT) == text


@given(st.text(min_size=1, max_size=64))
def test_the_object_is_json_for_every_label(label: str) -> None:
    event = PostureEvent("studio", label, 0.5, 0, 1, 1)
    assert json.loads(filled("{json}", event))["posture"] == label


def test_osc_arguments_are_numbers_where_osc_can_have_them() -> None:
    action = filled_action(
        OscAction(port=9000, address="/a", arguments=(7, "{count}", "{confidence}", "{begin}", "n {count}")), EVENT
    )
    params = OscMessage(osc_message(action.address, *action.arguments)).params
    assert params == [7, 3, pytest.approx(0.412), "1764000000.123", "n 3"]


def test_bodies_are_filled_and_programs_keep_their_arguments() -> None:
    request = filled_action(HttpAction(url="http://127.0.0.1/", method="POST", body="{count}"), EVENT)
    assert request.body == "3"
    program = ProgramAction(program="/bin/echo", arguments=("{count}",))
    assert filled_action(program, EVENT) is program
