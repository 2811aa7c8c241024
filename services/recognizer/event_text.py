"""Placeholders in the texts of a command: the recognized posture, its confidence, times and number.

`{rig}`, `{posture}`, `{confidence}` (0 to 1), `{begin}` and `{end}` (seconds since 1970 on the integrator's clock),
`{duration}` (seconds), `{count}` (of this posture since the recognizer started, from 1) and `{json}`, an object with all of
them.  Numbers have three decimals.  Other braces stay as they are, so that a payload may be JSON itself.
"""

import json
import re
from dataclasses import dataclass

import msgspec

from zenocap.common.rig.commands import Action, HttpAction, OscAction, UdpAction, ZenohAction

PLACEHOLDER = re.compile(r"\{(rig|posture|confidence|begin|end|duration|count|json)\}")
NUMBERS = ("confidence", "duration", "count")  # numbers in OSC, too; its numbers are too short for begin and end


@dataclass(frozen=True)
class PostureEvent:
    """A recognized posture.  begin_ns, end_ns: on the integrator's clock.  count: of this posture, from 1."""

    rig: str
    posture: str
    confidence: float
    begin_ns: int
    end_ns: int
    count: int

    def values(self) -> dict[str, str | float | int]:
        """Value of every placeholder except `{json}`."""
        return {
            "rig": self.rig, "posture": self.posture, "confidence": round(self.confidence, 3),
            "begin": round(self.begin_ns / 1e9, 3), "end": round(self.end_ns / 1e9, 3),
            "duration": round((self.end_ns - self.begin_ns) / 1e9, 3), "count": self.count,
        }  # fmt: skip


def filled(text: str, event: PostureEvent) -> str:
    """The text with every placeholder replaced; what replaces one is not searched for further placeholders."""
    values = event.values()

    def value(found: re.Match[str]) -> str:
        name = found[1]
        if name == "json":
            return json.dumps(values, ensure_ascii=False)
        one = values[name]
        return f"{one:.3f}" if isinstance(one, float) else str(one)

    return PLACEHOLDER.sub(value, text)


def filled_action(action: Action, event: PostureEvent) -> Action:
    """The action with the placeholders of its payload, body or arguments replaced; programs have variables instead."""
    match action:
        case ZenohAction() | UdpAction():
            return msgspec.structs.replace(action, payload=filled(action.payload, event))
        case HttpAction():
            return msgspec.structs.replace(action, body=filled(action.body, event))
        case OscAction():
            return msgspec.structs.replace(action, arguments=tuple(_osc(one, event) for one in action.arguments))
        case _:
            return action


def _osc(argument: str | int | float, event: PostureEvent) -> str | int | float:
    """An argument that is one placeholder of NUMBERS becomes a number, others texts."""
    if not isinstance(argument, str):
        return argument
    whole = PLACEHOLDER.fullmatch(argument)
    if whole is not None and whole[1] in NUMBERS:
        return event.values()[whole[1]]
    return filled(argument, event)
