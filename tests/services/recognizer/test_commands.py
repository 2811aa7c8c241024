"""Commands of a posture: label, confidence, cooldown, age."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.messages import Posture
from zenocap.common.rig.commands import PostureCommand, ZenohAction
from zenocap.services.recognizer.commands import CommandState, confidence_of, triggered
from zenocap.services.recognizer.parameters import MAX_COMMAND_AGE_S

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def posture(label: str | None, time_s: float = 0.0, score: float = 1.0, margin: float = 1.0, models: int = 2) -> Posture:
    captured_ns = START + round(time_s * SECOND)
    return Posture(
        frame=0, captured_ns=captured_ns, label=label, start_ns=captured_ns - 3 * SECOND, end_ns=captured_ns - SECOND // 3,
        log_likelihoods={name: 0.0 for name in ("squat", "kick")[:models]}, score=score, margin=margin,
    )  # fmt: skip


def command(label: str, key: str = "a", min_confidence: float = 0.0, cooldown: float = 1.0) -> PostureCommand:
    action = ZenohAction(key=key, min_confidence=min_confidence, cooldown=cooldown)
    return PostureCommand(label, action, f"commands.{label}")


def run(commands: list[PostureCommand], *postures: Posture) -> tuple[CommandState, list[str]]:
    """State, and targets of the triggered commands of each posture, separated by blanks, all of them live."""
    state, found = CommandState(), []
    for one in postures:
        state, triggers = triggered(commands, state, one, one.captured_ns)
        found.append(" ".join(trigger.command.action.target for trigger in triggers))
    return state, found


SQUAT, FIRST, KICK, OTHER = command("squat"), command("squat", "first"), command("kick", "kick"), command("squat", "second")


@pytest.mark.parametrize(
    ("commands", "postures", "expected"),
    [
        ([FIRST, KICK, OTHER], [("squat", 0.0)], ["first second"]),  # in the order of the rig
        ([FIRST, KICK, OTHER], [("march", 0.0)], [""]),
        ([], [("squat", 0.0)], [""]),
        (
            [command("squat", "slow", cooldown=10.0), command("squat", "fast", cooldown=0.0), KICK],  # a cooldown each
            [("squat", 0.0), ("kick", 0.1), ("squat", 0.2)], ["slow fast", "kick", "fast"],
        ),
        (
            [command("*", "any", cooldown=1.0), KICK],  # a cooldown for each posture
            [("squat", 0.0), ("kick", 0.2), ("squat", 0.4), (None, 2.0)], ["any", "any kick", "", ""],
        ),
        ([command("squat", cooldown=60.0)], [("squat", 0.0), ("squat", -100.0)], ["a", "a"]),  # the clock was set back
    ],
    ids=["order", "another posture", "no commands", "own cooldowns", "every posture", "clock set back"],
)  # fmt: skip
def test_triggered_commands(
    commands: list[PostureCommand], postures: list[tuple[str | None, float]], expected: list[str]
) -> None:
    assert run(commands, *(posture(label, time_s) for label, time_s in postures))[1] == expected


def test_a_movement_without_a_label_triggers_nothing() -> None:
    assert run([SQUAT, command("None")], posture(None)) == (CommandState(), [""])


def test_within_the_cooldown_a_command_is_triggered_once() -> None:
    times = (0.0, 0.4, 1.9, 2.0, 2.5, 4.1)
    state, found = run([command("squat", cooldown=2.0)], *(posture("squat", time_s) for time_s in times))
    assert found == ["a", "", "", "a", "", "a"]
    assert state.counts == {"cooldown": 3}


def test_postures_are_counted_by_label_also_without_a_trigger() -> None:
    """`count` says how often the posture was seen, not how often the command was performed."""
    state, counts = CommandState(), []
    for label, time_s in (("squat", 0.0), ("kick", 0.1), ("squat", 0.5), ("squat", 5.0)):
        one = posture(label, time_s)
        state, triggers = triggered([SQUAT], state, one, one.captured_ns)
        counts += [trigger.count for trigger in triggers]
    assert counts == [1, 3]


def test_an_unsure_posture_triggers_nothing_and_starts_no_cooldown() -> None:
    commands = [command("squat", min_confidence=0.5, cooldown=10.0)]
    state, found = run(commands, posture("squat", 0.0, margin=0.3), posture("squat", 0.5, margin=0.8))
    assert found == ["", "a"]
    assert state.counts == {"unsure": 1}


@pytest.mark.parametrize("age_s", [MAX_COMMAND_AGE_S + 0.1, 3600.0, -MAX_COMMAND_AGE_S - 0.1])
def test_a_posture_that_is_not_live_triggers_nothing(age_s: float) -> None:
    """As from a replayed take."""
    one = posture("squat")
    state, triggers = triggered([SQUAT], CommandState(), one, one.captured_ns + round(age_s * SECOND))
    assert (triggers, state.counts, state.triggered_ns) == ([], {"old": 1}, {})


def test_confidence_is_one_minus_the_likelihood_ratio_of_the_best_alternative() -> None:
    half = math.log(2.0)
    assert confidence_of(5.0, half, 2) == confidence_of(half, 5.0, 2) == pytest.approx(0.5)
    assert confidence_of(half, 0.0, 1) == pytest.approx(0.5)
    assert confidence_of(-1.0, 5.0, 2) == 0.0


@given(st.floats(-1e9, 1e9), st.floats(0, 1e9))
def test_confidence_is_a_share(score: float, margin: float) -> None:
    assert 0.0 <= confidence_of(score, margin, 2) <= 1.0


@given(st.lists(st.floats(0, 20), max_size=20), st.floats(0.1, 5))
def test_two_triggers_are_at_least_the_cooldown_apart(times: list[float], cooldown: float) -> None:
    ordered = sorted(times)
    _, found = run([command("squat", cooldown=cooldown)], *(posture("squat", time_s) for time_s in ordered))
    fired = [time_s for time_s, keys in zip(ordered, found, strict=True) if keys]
    assert all(second - first >= cooldown - 1e-6 for first, second in pairwise(fired))
    assert bool(fired) is bool(times)
