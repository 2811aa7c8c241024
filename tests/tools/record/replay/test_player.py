"""The player on a bus inside one process: bytes, times, order, keys, repetitions, flow control."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.built_messages import built
from tests.support.replay_network import TODAY_NS, ReplayNetwork, Timer
from tests.support.replay_takes import PERIOD_NS, RIG, START_NS, envelope, sample_messages, written
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.formats.pose_track import Bound
from zenocap.common.runtime.keyboard import Key, Keyboard
from zenocap.common.topics import ASSIGNMENT, PARTIAL_BDP, SIGHTING
from zenocap.tools.record.replay.consumers import Consumers
from zenocap.tools.record.replay.player import Command, Player, Status
from zenocap.tools.record.replay.remap import Remapping, parsed_remap
from zenocap.tools.record.replay.selection import ReplaySelection
from zenocap.tools.record.replay.shell import ReplayOptions, planned
from zenocap.tools.record.replay.timeline import Timeline


@pytest.fixture
def replay() -> ReplayNetwork:
    return ReplayNetwork()


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", RECORDED, flush_every=20)


RECORDED = sample_messages(50)


def frames(messages: list[m.Message]) -> list[int]:
    return [message.frame for message in messages]


def data(envelopes: list[Envelope]) -> list[bytes]:
    return [each.data for each in envelopes]


def at(place_ns: int) -> Callable[[Status], bool]:
    """When the replay has come to a place."""
    return lambda status: status.place_ns > place_ns


ALWAYS = at(-1)


def test_playback_has_the_recorded_bytes_and_intervals(replay: ReplayNetwork, take: Path) -> None:
    received, player = replay.play([take])
    assert [(each.key, each.data) for each in received.envelopes] == [(each.key, each.data) for each in RECORDED]
    assert (player.sent, player.late_ns, player.bad) == (len(RECORDED), 0, {})


@pytest.mark.parametrize("rate", [0.1, 1.0, 4.0, 1000.0])
def test_the_rate_scales_intervals(replay: ReplayNetwork, take: Path, rate: float) -> None:
    received, _ = replay.play([take], rate=rate)
    assert received.times_ns == [round((each.received_ns - RECORDED[0].received_ns) / rate) for each in RECORDED]


def test_playback_of_a_part_starts_with_the_earlier_latched_state(replay: ReplayNetwork, take: Path) -> None:
    received, _ = replay.play([take], first=Bound(0.2, True), last=Bound(0.299, True))
    assert received.messages[:2] == [each.message for each in RECORDED if each.topic is PARTIAL_BDP]
    assert received.times_ns[:2] == [0, 0]
    assert frames(received.of(m.Sighting, "1")) == list(range(20, 30))
    assert len(received.of(m.PartialBdp, "1")) == 1


def test_topics_are_selected_and_renames_apply_inside_messages(replay: ReplayNetwork, take: Path) -> None:
    remapping = Remapping((parsed_remap("viewer/1:=viewer/left"),), "lab")
    received, _ = replay.play([take], selection=ReplaySelection(("viewer/1/**",)), remapping=remapping)
    assert {each.key for each in received.envelopes} == {"zenocap/lab/viewer/left/sighting", "zenocap/lab/viewer/left/bdp"}
    assert len(received.of(m.Sighting, "left")) == 50
    assert received.envelopes[1].data != RECORDED[1].data


def test_new_rig_name_does_not_change_the_bytes(replay: ReplayNetwork, take: Path) -> None:
    received, _ = replay.play([take], remapping=Remapping(rig="lab"))
    assert data(received.envelopes) == data(RECORDED)
    assert all(each.key.startswith("zenocap/lab/") for each in received.envelopes)


def test_times_and_frames_increase_over_laps_and_the_first_lap_is_exact(replay: ReplayNetwork, take: Path) -> None:
    received, _ = replay.play([take], laps=3, loop=True)
    assert data(received.envelopes[: len(RECORDED)]) == data(RECORDED)
    for messages in (received.of(m.Sighting, "1"), received.of(m.Sighting, "2"), received.of(m.Assignment)):
        assert len(messages) >= 150
        assert all(before.frame < after.frame for before, after in pairwise(messages))
        assert all(0 < after.captured_ns - before.captured_ns < 3 * PERIOD_NS for before, after in pairwise(messages))
    answers = {message.captured_ns: message.frame for message in received.of(m.Assignment)}
    assert all(answers[s.captured_ns] == s.frame for s in received.of(m.Sighting, "1") if s.captured_ns in answers)
    assert received.times_ns == sorted(received.times_ns)
    assert received.times_ns[2 * len(RECORDED)] > 2 * 49 * PERIOD_NS


def test_current_times_differ_from_recorded_times_by_a_constant(replay: ReplayNetwork, take: Path) -> None:
    received, _ = replay.play([take], now=True)
    ages = {each.received_ns - each.message.captured_ns for each in received.envelopes if each.topic is SIGHTING}
    assert ages == {1_000_000, 2_000_000}
    assert frames(received.of(m.Sighting, "1")) == list(range(50))


def test_pause_key_pauses_and_resumes(replay: ReplayNetwork, take: Path) -> None:
    waited = []

    def waited_long_enough(status: Status) -> bool:
        waited.append(status)
        return len(waited) > 20

    received, _ = replay.play([take], keys=[(at(200_000_000), Key.PAUSE), (waited_long_enough, Key.PAUSE)])
    assert data(received.envelopes) == data(RECORDED)
    (pause,) = [after - before for before, after in pairwise(received.times_ns) if after - before > 2 * PERIOD_NS]
    assert pause > 500_000_000
    assert all(status.paused for status in waited)


def test_a_step_is_one_message_of_each_key(replay: ReplayNetwork, take: Path) -> None:
    keys = [(ALWAYS, Key.STEP)] * 3 + [(ALWAYS, Key.QUIT)]
    received, player = replay.play([take], keys=keys, paused=True)
    assert frames(received.of(m.Sighting, "1")) == [0, 1, 2]
    assert frames(received.of(m.Assignment)) == [0, 1, 2]
    assert player.status.paused


def test_a_program_that_moves_a_paused_replay_gets_the_messages_of_that_place(replay: ReplayNetwork, take: Path) -> None:
    commands = [Command(place_ns=200_000_000), Command(place_ns=100_000_000), Key.QUIT]
    received, player = replay.play([take], keys=[(ALWAYS, command) for command in commands], paused=True)
    first, second = received.of(m.Sighting, "1")
    assert first.frame == 20
    assert second.frame > first.frame  # frame numbers keep rising
    assert player.status.paused


@pytest.mark.slow
def test_times_and_frames_increase_after_seeking_back(replay: ReplayNetwork, tmp_path: Path) -> None:
    take = written(tmp_path / "long.mcap", sample_messages(800), flush_every=100)
    received, _ = replay.play([take], keys=[(at(6 * 10**9), Key.BACK)])
    sightings = received.of(m.Sighting, "1")
    assert 1290 <= len(sightings) <= 1310
    assert all(before.frame < after.frame for before, after in pairwise(sightings))
    assert all(before.captured_ns < after.captured_ns for before, after in pairwise(sightings))
    assert len(received.of(m.PartialBdp, "1")) == 2  # once more, for late joiners


@pytest.mark.slow
def test_seeking_ahead_skips_messages_and_changes_no_bytes(replay: ReplayNetwork, tmp_path: Path) -> None:
    recorded = sample_messages(800)
    take = written(tmp_path / "long.mcap", recorded, flush_every=100)
    received, player = replay.play([take], keys=[(at(10**9), Key.AHEAD)])
    assert set(data(received.envelopes)) < set(data(recorded))
    assert 290 <= len(received.of(m.Sighting, "1")) <= 310
    assert received.times_ns[-1] < 3.2e9
    assert player.status.place_ns == recorded[-1].received_ns - recorded[0].received_ns


def test_rate_can_change_during_playback(replay: ReplayNetwork, take: Path) -> None:
    received, _ = replay.play([take], keys=[(at(250_000_000), Key.FASTER)])
    assert data(received.envelopes) == data(RECORDED)
    assert 300_000_000 < received.times_ns[-1] < 450_000_000


def test_invalid_messages_are_skipped_and_counted(replay: ReplayNetwork, tmp_path: Path) -> None:
    envelopes = sample_messages(10)
    for number in (3, 8):
        envelopes[number] = replace(envelopes[number], data=b"\x91" * 9)
    received, player = replay.play([written(tmp_path / "a.mcap", envelopes)])
    assert len(received.envelopes) == len(envelopes) - 2
    assert sum(player.bad.values()) == 2
    assert set(player.bad) == {envelopes[3].key, envelopes[8].key}


def test_player_does_not_catch_up_after_a_stall(replay: ReplayNetwork, take: Path) -> None:
    stalled = [False]

    def stall(status: Status) -> bool:
        if status.place_ns > 200_000_000 and not stalled[0]:
            stalled[0] = True
            replay.clock.advance(60 * 10**9)
        return stalled[0] and status.place_ns > 400_000_000

    received, player = replay.play([take], keys=[(stall, Key.QUIT)])
    assert player.stalls == 1
    after = [time for time in received.times_ns if time > 60 * 10**9]
    assert after[-1] - after[0] > 100_000_000


def play_at_rate_zero(replay: ReplayNetwork, take: Path, network: LocalNetwork, kind: type[Consumers]) -> Consumers:
    """Play a take for the services of a network; they get their messages as fast as they handle them."""
    bus = network.bus()
    bus.watch_alive()
    consumers = kind(bus, frozenset())
    consumers.poll()
    plan = planned(Timeline([take]), ReplayOptions(ReplaySelection(), Remapping()))
    player = Player(bus, replay.clock, Timer(replay.clock), plan, consumers, Keyboard(None), lambda _: None, rate=0.0)
    player.run(lambda: False)
    return consumers


def test_messages_wait_until_the_previous_one_is_handled_at_rate_zero(replay: ReplayNetwork, take: Path) -> None:
    network = LocalNetwork(RIG, replay.clock)
    tracker = network.bus()
    tracker.subscribe(SIGHTING)
    tracker.subscribe(ASSIGNMENT)
    tracker.declare_alive("tracker", "main")
    handled: list[m.Message] = []

    class Working(Consumers):
        def keep_pace(self) -> None:
            while isinstance(event := tracker.receive(), Envelope):
                handled.append(event.message)
            super().keep_pace()

    consumers = play_at_rate_zero(replay, take, network, Working)
    assert handled == [each.message for each in RECORDED if each.topic is not PARTIAL_BDP]
    assert tracker.counters.dropped == {}
    assert consumers.given_up == set()
    assert replay.clock.now_ns() == TODAY_NS


def test_unresponsive_consumer_is_reported_and_given_up(replay, take, caplog):
    network = LocalNetwork(RIG, replay.clock)
    frozen = network.bus()
    frozen.subscribe(SIGHTING)
    frozen.declare_alive("tracker", "main")
    consumers = play_at_rate_zero(replay, take, network, Consumers)
    assert consumers.given_up == {("tracker", "main")}
    assert [record.getMessage().partition(" did")[0] for record in caplog.records] == ["tracker main"]


def test_a_replayed_health_does_not_say_how_much_another_process_sent(replay: ReplayNetwork, tmp_path: Path) -> None:
    """A log of the replay would count as lost what the replay leaves out.  At the old times, its time tells the log."""
    counts = {"sent.health": 7, "process": 5, "ended": 1, "frames": 3}
    health = built(m.Health, captured_ns=START_NS, counts=counts)
    take = written(tmp_path / "health.mcap", [*sample_messages(5), envelope(health, START_NS + 10)])
    received, _ = replay.play([take], now=True)
    assert [each.counts for each in received.messages if isinstance(each, m.Health)] == [{"frames": 3}]
