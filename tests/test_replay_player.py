"""The player on a bus inside one process: bytes, times, order, keys, laps, pace."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from common import messages as m
from common.bus.local import LocalNetwork
from common.bus.protocol import Envelope
from common.runtime.keys import Key, Keyboard
from common.topics import ASSIGNMENT, PARTIAL_BDP, SIGHTING
from services.takes.replay.consumers import Consumers
from services.takes.replay.player import Player, Status
from services.takes.replay.renaming import Renaming, parsed_rename
from services.takes.replay.selection import Selection
from services.takes.replay.shell import Wishes, planned
from services.takes.replay.timeline import Timeline
from tests.replay_stage import TODAY_NS, Stage, Waiting
from tests.replay_takes import PERIOD_NS, RIG, spoken, written


@pytest.fixture
def stage() -> Stage:
    return Stage()


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", spoken(50), flush_every=20)


def frames(messages: list[m.Message]) -> list[int]:
    return [message.frame for message in messages]


def test_the_bytes_are_those_recorded_at_the_recorded_intervals(stage: Stage, take: Path) -> None:
    heard, player = stage.play([take])
    recorded = spoken(50)
    assert [(each.key, each.data) for each in heard.envelopes] == [(each.key, each.data) for each in recorded]
    assert heard.times_ns == [each.received_ns - recorded[0].received_ns for each in recorded]
    assert (player.sent, player.late_ns, player.bad) == (len(recorded), 0, {})


@pytest.mark.parametrize("rate", [0.1, 4.0, 1000.0])
def test_the_rate_scales_intervals(stage: Stage, take: Path, rate: float) -> None:
    heard, _ = stage.play([take], rate=rate)
    recorded = spoken(50)
    due = [round((each.received_ns - recorded[0].received_ns) / rate) for each in recorded]
    assert heard.times_ns == due


def test_only_a_part_is_played_and_state_from_before_it_comes_first(stage: Stage, take: Path) -> None:
    heard, _ = stage.play([take], start_s=0.2, duration_s=0.1)
    assert heard.messages[:2] == [each.message for each in spoken(1) if each.topic is PARTIAL_BDP]
    assert heard.times_ns[:2] == [0, 0]
    assert frames(heard.of(m.Sighting, "1")) == list(range(20, 30))
    assert len(heard.of(m.PartialBdp, "1")) == 1


def test_topics_choose_and_a_rename_reaches_into_messages(stage: Stage, take: Path) -> None:
    renaming = Renaming((parsed_rename("viewer/1:=viewer/left"),), "lab")
    heard, _ = stage.play([take], selection=Selection(("viewer/1/**",)), renaming=renaming)
    assert {each.key for each in heard.envelopes} == {"zenocap/lab/viewer/left/sighting", "zenocap/lab/viewer/left/bdp"}
    assert len(heard.of(m.Sighting, "left")) == 50
    assert heard.envelopes[1].data != spoken(1)[1].data


def test_a_new_rig_name_leaves_the_bytes_alone(stage: Stage, take: Path) -> None:
    heard, _ = stage.play([take], renaming=Renaming(rig="lab"))
    assert [each.data for each in heard.envelopes] == [each.data for each in spoken(50)]
    assert all(each.key.startswith("zenocap/lab/") for each in heard.envelopes)


def test_laps_go_on_rising_in_time_and_frame_and_the_first_is_exact(stage: Stage, take: Path) -> None:
    heard, _ = stage.play([take], laps=3, loop=True)
    recorded = spoken(50)
    assert [each.data for each in heard.envelopes[: len(recorded)]] == [each.data for each in recorded]
    for messages in (heard.of(m.Sighting, "1"), heard.of(m.Sighting, "2"), heard.of(m.Assignment)):
        assert len(messages) >= 150
        assert all(before.frame < after.frame for before, after in pairwise(messages))
        assert all(0 < after.captured_ns - before.captured_ns < 3 * PERIOD_NS for before, after in pairwise(messages))
    answers = {message.captured_ns: message.frame for message in heard.of(m.Assignment)}
    assert all(answers[s.captured_ns] == s.frame for s in heard.of(m.Sighting, "1") if s.captured_ns in answers)
    assert heard.times_ns == sorted(heard.times_ns)
    assert heard.times_ns[2 * len(recorded)] > 2 * 49 * PERIOD_NS


def test_times_of_now_differ_from_the_recorded_ones_by_one_shift(stage: Stage, take: Path) -> None:
    heard, _ = stage.play([take], now=True)
    ages = {each.received_ns - each.message.captured_ns for each in heard.envelopes if each.topic is SIGHTING}
    assert ages == {1_000_000, 2_000_000}
    assert frames(heard.of(m.Sighting, "1")) == list(range(50))


def test_space_pauses_and_goes_on(stage: Stage, take: Path) -> None:
    def at(place_ns: int) -> Callable[[Status], bool]:
        return lambda status: status.place_ns >= place_ns

    waited = []

    def long_enough(status: Status) -> bool:
        waited.append(status)
        return len(waited) > 20

    heard, _ = stage.play([take], keys=[(at(200_000_000), Key.PAUSE), (long_enough, Key.PAUSE)])
    assert [each.data for each in heard.envelopes] == [each.data for each in spoken(50)]
    pauses = [after - before for before, after in pairwise(heard.times_ns) if after - before > 2 * PERIOD_NS]
    assert len(pauses) == 1
    assert pauses[0] > 500_000_000
    assert all(status.paused for status in waited)


def test_a_step_is_one_message_of_each_key(stage: Stage, take: Path) -> None:
    keys = [(lambda status: True, Key.STEP)] * 3 + [(lambda status: True, Key.QUIT)]
    heard, player = stage.play([take], keys=keys, paused=True)
    assert frames(heard.of(m.Sighting, "1")) == [0, 1, 2]
    assert frames(heard.of(m.Assignment)) == [0, 1, 2]
    assert player.status.paused


def test_seeking_back_goes_on_rising(stage: Stage, tmp_path: Path) -> None:
    take = written(tmp_path / "long.mcap", spoken(800), flush_every=100)
    heard, _ = stage.play([take], keys=[(lambda status: status.place_ns > 6 * 10**9, Key.BACK)])
    sightings = heard.of(m.Sighting, "1")
    assert 1290 <= len(sightings) <= 1310
    assert all(before.frame < after.frame for before, after in pairwise(sightings))
    assert all(before.captured_ns < after.captured_ns for before, after in pairwise(sightings))
    assert len(heard.of(m.PartialBdp, "1")) == 2  # once more, for those who came late


def test_seeking_ahead_leaves_out_and_changes_no_byte(stage: Stage, tmp_path: Path) -> None:
    recorded = spoken(800)
    take = written(tmp_path / "long.mcap", recorded, flush_every=100)
    heard, player = stage.play([take], keys=[(lambda status: status.place_ns > 10**9, Key.AHEAD)])
    assert {each.data for each in heard.envelopes} < {each.data for each in recorded}
    assert 290 <= len(heard.of(m.Sighting, "1")) <= 310
    assert heard.times_ns[-1] < 3.2e9
    assert player.status.place_ns == recorded[-1].received_ns - recorded[0].received_ns


def test_the_rate_changes_on_the_way(stage: Stage, take: Path) -> None:
    heard, _ = stage.play([take], keys=[(lambda status: status.place_ns > 250_000_000, Key.FASTER)])
    assert [each.data for each in heard.envelopes] == [each.data for each in spoken(50)]
    assert 300_000_000 < heard.times_ns[-1] < 450_000_000


def test_what_is_not_valid_is_left_out_and_counted(stage: Stage, tmp_path: Path) -> None:
    envelopes = spoken(10)
    broken = [
        type(each)(each.key, each.topic, each.message, each.received_ns, b"\x91" * 9) if number in (3, 8) else each
        for number, each in enumerate(envelopes)
    ]
    assert {broken[3].topic, broken[8].topic} == {SIGHTING}
    heard, player = stage.play([written(tmp_path / "a.mcap", broken)])
    assert len(heard.envelopes) == len(envelopes) - 2
    assert sum(player.bad.values()) == 2
    assert set(player.bad) <= {SIGHTING.at(RIG, viewer=viewer) for viewer in ("1", "2")}


def test_a_player_that_was_held_up_does_not_rush(stage: Stage, take: Path) -> None:
    asleep = [False]

    def sleep(status: Status) -> bool:
        if status.place_ns > 200_000_000 and not asleep[0]:
            asleep[0] = True
            stage.clock.advance(60 * 10**9)
        return asleep[0] and status.place_ns > 400_000_000

    heard, player = stage.play([take], keys=[(sleep, Key.QUIT)])
    assert player.held_up == 1
    after = [time for time in heard.times_ns if time > 60 * 10**9]
    assert after[-1] - after[0] > 100_000_000


def test_without_a_clock_no_message_is_sent_before_the_one_before_it_is_handled(stage: Stage, take: Path) -> None:
    plan = planned(Timeline([take]), Wishes(Selection(), Renaming()))
    network = LocalNetwork(RIG, stage.clock)
    bus, tracker = network.bus(), network.bus()
    tracker.subscribe(SIGHTING)
    tracker.subscribe(ASSIGNMENT)
    tracker.declare_alive("tracker", "main")
    handled: list[m.Message] = []

    class Working(Consumers):
        def keep_pace(self) -> None:
            while isinstance(event := tracker.receive(), Envelope):
                handled.append(event.message)
            super().keep_pace()

    bus.watch_alive()
    consumers = Working(bus, frozenset())
    consumers.hear()
    Player(bus, stage.clock, Waiting(stage.clock), plan, consumers, Keyboard(None), lambda _: None, rate=0.0).run(
        lambda: False
    )
    assert handled == [each.message for each in spoken(50) if each.topic is not PARTIAL_BDP]
    assert tracker.counters.dropped == {}
    assert consumers.given_up == set()
    assert stage.clock.now_ns() == TODAY_NS


def test_who_does_not_keep_up_is_named_and_left_behind(stage: Stage, take: Path, caplog: pytest.LogCaptureFixture) -> None:
    plan = planned(Timeline([take]), Wishes(Selection(), Renaming()))
    network = LocalNetwork(RIG, stage.clock)
    bus, frozen = network.bus(), network.bus()
    frozen.subscribe(SIGHTING)
    frozen.declare_alive("tracker", "main")
    bus.watch_alive()
    consumers = Consumers(bus, frozenset())
    consumers.hear()
    Player(bus, stage.clock, Waiting(stage.clock), plan, consumers, Keyboard(None), lambda _: None, rate=0.0).run(
        lambda: False
    )
    assert consumers.given_up == {("tracker", "main")}
    assert [record.getMessage().partition(" did")[0] for record in caplog.records] == ["tracker main"]
