"""Decision which commands of the rig a published posture triggers.  Pure: time is an argument."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from zenocap.common.messages import Posture
from zenocap.common.rig.commands import EVERY, PostureCommand
from zenocap.services.recognizer.parameters import MAX_COMMAND_AGE_S


@dataclass(frozen=True)
class CommandState:
    """State of the commands.

    triggered_ns: capture time at which each command, by its number in the rig, was triggered last by each posture.
    counts: of postures that did not trigger a command because they were `old`, `unsure` or in its `cooldown`.
    seen: number of live postures by label.
    """

    triggered_ns: Mapping[tuple[int, str], int] = field(default_factory=lambda: MappingProxyType({}))
    counts: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    seen: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Trigger:
    """A command to be performed.  number: of the command in the rig.  posture: which triggers it, with a label.

    label: of the posture.  count: of live postures with this label so far, from 1.
    """

    number: int
    command: PostureCommand
    posture: Posture
    label: str
    confidence: float
    count: int


def confidence_of(score: float, margin: float, models: int) -> float:
    """Confidence of a posture in [0, 1): 1 - exp(-m), m the smaller of its score and, with two or more models, its margin.

    exp(-m) is the likelihood per frame of the best alternative, another posture or none, relative to this posture's: 0 for
    an equally good alternative, 0.5 for one that is half as likely per frame.
    """
    return 1.0 - math.exp(-max(min(score, margin) if models > 1 else score, 0.0))


def triggered(
    commands: Sequence[PostureCommand], state: CommandState, posture: Posture, now_ns: int
) -> tuple[CommandState, list[Trigger]]:
    """Commands that a posture triggers, in the order of the rig, and the state after them.

    now_ns: on the clock of captured_ns.  A posture whose pose is more than MAX_COMMAND_AGE_S before or after it triggers
    nothing: it is not live.  A movement without a label triggers nothing.
    """
    label = posture.label
    due = [(number, command) for number, command in enumerate(commands) if command.posture in (label, EVERY)]
    if label is None or not due:
        return state, []
    if abs(now_ns - posture.captured_ns) > MAX_COMMAND_AGE_S * 1e9:
        return replace(state, counts=_counted(state.counts, "old", len(due))), []
    seen = _counted(state.seen, label, 1)
    confidence = confidence_of(posture.score, posture.margin, len(posture.log_likelihoods))
    triggered_ns, counts = dict(state.triggered_ns), state.counts
    triggers: list[Trigger] = []
    for number, command in due:
        before_ns = triggered_ns.get((number, label))
        if confidence < command.action.min_confidence:
            counts = _counted(counts, "unsure", 1)
        elif before_ns is not None and 0 <= posture.captured_ns - before_ns < command.action.cooldown * 1e9:
            counts = _counted(counts, "cooldown", 1)
        else:  # also where the clock has been set back
            triggered_ns[number, label] = posture.captured_ns
            triggers.append(Trigger(number, command, posture, label, confidence, seen[label]))
    return CommandState(triggered_ns, counts, seen), triggers


def _counted(counts: Mapping[str, int], name: str, by: int) -> Mapping[str, int]:
    return {**counts, name: counts.get(name, 0) + by}
