"""`zenocap info`: channels, gaps, missing frames, pairs, health; of complete and truncated takes."""

import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from tests.common.bus.test_inbox import bap, sighting
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode
from zenocap.common.observe.account import METADATA
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.take_account import take_account
from zenocap.common.recording.writer import Attachment, Channel, Recording
from zenocap.common.topics import topic_of
from zenocap.tools.takes.info import info, utc
from zenocap.tools.takes.info_text import lines_of
from zenocap.tools.takes.take_health import RateTally
from zenocap.tools.takes.take_statistics import FrameTally

START_NS = 1_700_000_000_000_000_000
FRAME_NS = 40_000_000


def assignment(frame: int, **stale: bool) -> m.Assignment:
    views = {id: m.ViewAssignment(frame=frame, view="facade", scale=1.0, stale=old) for id, old in stale.items()}
    return built(m.Assignment, frame=frame, views=views)


def health(frame: int, state: str = "tracking", offset_ns: int = 0, **counts: int) -> m.Health:
    return built(m.Health, frame=frame, state=state, rate=15, counts=counts, clock_offset_ns=offset_ns)


def take_of(path: Path, *messages: tuple[int, m.Message]) -> Path:
    """A take of messages, each with its frame offset from the start."""
    rig_file = Attachment("rig.toml", "application/toml", b"name")
    recording = Recording(path, rig="studio", start_ns=START_NS, metadata={"versions": {"a": "1"}}, attachments=(rig_file,))
    for at, message in messages:
        topic = topic_of(type(message))
        key = topic.at("studio", **topic.names_of(message))
        recording.record(Envelope(key, topic, message, START_NS + at * FRAME_NS, encode(message)))
    recording.close()
    return path


def test_channels_have_counts_rates_and_their_longest_gap(tmp_path: Path) -> None:
    frames = [0, 1, 2, 7, 8]
    found = info(take_of(tmp_path / "a.mcap", *((k, sighting("1", k)) for k in frames), (9, bap(9))))
    by_key = {channel.key: channel for channel in found.channels}
    assert list(by_key) == ["zenocap/studio/integrator/bap", "zenocap/studio/viewer/1/sighting"]
    one = by_key["zenocap/studio/viewer/1/sighting"]
    assert (one.messages, one.schema, one.encoding) == (5, "zenocap.Sighting", "msgpack")
    assert one.bytes == sum(len(encode(sighting("1", k))) for k in frames)
    assert one.rate == pytest.approx(4 / (8 * 0.04))
    assert (one.gap_s, one.gap_at_s) == (pytest.approx(0.2), pytest.approx(0.08))
    assert by_key["zenocap/studio/integrator/bap"].rate == 0
    assert (found.messages, found.rig, found.cut) == (6, "studio", None)
    assert found.duration_s == pytest.approx(0.36)
    assert (found.start, found.end) == ("2023-11-14T22:13:20.000Z", "2023-11-14T22:13:20.360Z")
    assert found.attachments == {"rig.toml": 4}
    assert sum(found.chunks.values()) > 0


def test_missing_frames_are_listed(tmp_path: Path) -> None:
    messages: list[tuple[int, m.Message]] = [(k, sighting("1", k)) for k in (3, 4, 7, 8, 6, 12)] + [(20, sighting("2", 5))]
    one, two = info(take_of(tmp_path / "a.mcap", *messages)).frames
    assert (one.viewer, one.topic, one.first, one.last, one.seen) == ("1", "sighting", 3, 12, 6)
    assert (one.missing, one.holes, one.restarts) == (4, ((5, 5), (9, 11)), 0)
    assert (two.missing, two.holes) == (0, ())


def tally_of(frames: Iterable[int]) -> FrameTally:
    tally = FrameTally()
    for frame in frames:
        tally.add(frame)
    return tally


@given(st.permutations(range(12)), st.sets(st.integers(0, 11), max_size=6))
def test_slightly_reordered_frames_do_not_count_as_missing(order: list[int], lost: set[int]) -> None:
    """Frames slightly out of order, after the first: only absent frames count as missing."""
    reordered = sorted(range(1, 13), key=lambda frame: frame + 2 * (order[frame - 1] % 2))
    tally = tally_of([0, *(frame for frame in reordered if frame - 1 not in lost)])
    missing = {frame + 1 for frame in lost if frame + 1 < tally.last}
    holes = tally.frames("1", "sighting").holes
    assert {frame for first, last in holes for frame in range(first, last + 1)} == missing
    assert (tally.missing, tally.restarts) == (len(missing), 0)


def test_restarted_frame_numbers_do_not_count_as_missing() -> None:
    tally = tally_of((100, 101, 0, 1, 1, 3))
    assert (tally.restarts, tally.missing, tally.seen) == (1, 1, 6)


def test_number_of_stored_gaps_is_bounded() -> None:
    tally = tally_of(range(0, 10_000, 2))
    assert (tally.missing, len(tally.holes), len(tally.frames("1", "sighting").holes)) == (4999, 1000, 20)


def test_frame_sets_are_counted_as_complete_one_viewer_or_stale(tmp_path: Path) -> None:
    stale = [{"a": False, "b": False}] * 3 + [{"a": False, "b": True}, {"a": False}, {"a": False, "b": False, "c": True}]
    pairs = info(take_of(tmp_path / "a.mcap", *((k, assignment(k, **one)) for k, one in enumerate(stale)))).pairs
    assert pairs is not None
    assert (pairs.instants, pairs.complete, pairs.one_viewer, pairs.stale) == (6, 3, 2, 2)


def decision(at_s: float, keep: int, of: int) -> m.FrameRate:
    at_ns = round(at_s * 1e9)
    return m.FrameRate(
        frame=0, captured_ns=START_NS + at_ns, keep=keep, of=of, from_ns=START_NS + at_ns, phase_ns=0, fps=30.0,
        limit="" if keep == of else "viewers", viewers=[] if keep == of else ["2"],
    )  # fmt: skip


def test_the_time_at_a_reduced_rate_is_summed_up_with_the_lowest_rate(tmp_path: Path) -> None:
    decisions = [decision(0, 1, 1), decision(2, 1, 2), decision(3, 2, 5), decision(5, 1, 1), decision(9, 5, 6)]
    details = [m.TrackerDetail(frame=k, captured_ns=START_NS + k * 10**9, share=1 - 0.5 * (k == 4)) for k in (1, 4, 6)]
    tally = RateTally()
    for message in sorted([*decisions, *details], key=lambda message: message.captured_ns):
        tally.add(message)
    reduced = tally.reduced(START_NS + 10 * 10**9)
    assert reduced is not None
    assert (reduced.seconds, reduced.fps, reduced.lowest_fps, reduced.thinned_s) == (4.0, 30.0, 12.0, 2.0)
    assert reduced.reason == "reduced to 12 of 30 frames/s: processor of viewer 2"
    assert RateTally().reduced(START_NS) is None
    numbered = [(k, one) for k, one in enumerate(decisions)]
    text = "\n".join(lines_of(info(take_of(tmp_path / "a.mcap", *numbered))))
    assert "reduced to 12 of 30 frames/s: processor of viewer 2, the lowest rate" in text


def test_the_last_delays_of_the_cameras_are_listed(tmp_path: Path) -> None:
    delays = [
        m.CameraDelays(
            frame=k, captured_ns=START_NS + k, found_ms={"1": 0.0, "2": late} if late else {}, errors_ms={}, uncertain=[],
            applied_ms=applied,
        )
        for k, (late, applied) in enumerate([(20.0, {}), (41.4, {"1": 0.0, "2": 33.3}), (0.0, {})])
    ]  # fmt: skip
    text = "\n".join(lines_of(info(take_of(tmp_path / "a.mcap", *enumerate(delays)))))
    assert "2 41 ms (corrected by 33)" in text


def test_height_ratio_is_that_of_the_last_body(tmp_path: Path) -> None:
    bodies = [
        m.UniversalBdp(frame=k, captured_ns=k, body=m.Body(anatomy="ten-parts", sizes={}, offsets={}), ratio=ratio)
        for k, ratio in enumerate((1.2, 0.98))
    ]
    found = info(take_of(tmp_path / "a.mcap", *enumerate(bodies)))
    assert found.height_ratio == 0.98
    assert "-2.0% in the side view" in "\n".join(lines_of(found))


def test_health_summary_has_worst_clock_last_state_and_total_counts(tmp_path: Path) -> None:
    messages = [
        health(0, "waiting", 100_000, dropped_frames=2),
        health(1, "tracking", -4_000_000, dropped_frames=5, late=0, queued=7),
        health(2, "tracking", 0, dropped_frames=5, queued=3),
        health(0, "tracking again", 10, dropped_frames=1, step_errors=1, queued=4),  # was restarted
    ]
    (one,) = info(take_of(tmp_path / "a.mcap", *enumerate(messages))).health
    assert (one.service, one.id, one.reports, one.state) == ("viewer", "1", 4, "tracking again")
    assert one.clock_offset_ms == -4.0
    assert one.counts == {"dropped_frames": 6, "step_errors": 1, "queued": 4}


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_intact_messages_of_a_truncated_take_are_counted(share: float, tmp_path: Path) -> None:
    whole = take_of(tmp_path / "a.mcap", *((k, sighting("1", k)) for k in range(300)))
    data = whole.read_bytes()
    (tmp_path / "b.mcap").write_bytes(data[: int(len(data) * share)])
    found = info(tmp_path / "b.mcap")
    assert found.cut is not None
    assert found.messages in range(25, 301, 25)  # a chunk has a second's
    assert found.messages == sum(channel.messages for channel in found.channels)
    assert any("cut, damaged or out of order" in line for line in lines_of(found))


def test_mcap_file_of_another_program_is_counted(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/imu", "json", 0)
        for k in range(3):
            writer.add_message(channel, k, b"{}", k)
        writer.finish()
    found = info(tmp_path / "a.mcap")
    assert [(one.key, one.encoding, one.schema, one.messages) for one in found.channels] == [("/imu", "json", "", 3)]
    assert (found.rig, found.frames, found.pairs, found.health) == ("", (), None, ())
    assert any(line.split()[:2] == ["/imu", "3"] for line in lines_of(found))


def test_an_empty_take_has_no_times(tmp_path: Path) -> None:
    found = info(take_of(tmp_path / "a.mcap"))
    assert (found.messages, found.duration_s, found.channels) == (0, 0.0, ())
    assert not any(line.startswith("time") for line in lines_of(found))


def test_unreadable_messages_are_counted(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", rig="studio", start_ns=0)
    recording.write(
        Channel("zenocap/studio/viewer/1/health", "msgpack", "zenocap.Health", "jsonschema", b"{}"), b"\x01", 5, 5
    )
    recording.close()
    found = info(tmp_path / "a.mcap")
    assert (found.unreadable, found.messages, found.health) == (1, 1, ())


def test_json_is_complete_and_text_lines_fit_the_width(tmp_path: Path) -> None:
    messages = [(k, sighting("1", 2 * k)) for k in range(40)]
    messages += [(k, each) for k in range(40) for each in (assignment(k, a=False), health(k, offset_ns=k, late=1))]
    found = info(take_of(tmp_path / "a.mcap", *messages))
    decoded = json.loads(json.dumps(asdict(found)))
    assert decoded == msgspec.json.decode(msgspec.json.encode(found))
    lines = list(lines_of(replace(found, path="a.mcap")))
    assert max(map(len, lines)) <= 100
    assert not any(line != line.rstrip() or "\x1b" in line for line in lines)
    assert any("1, 3, 5, 7, 9, ..." in line for line in lines)


def test_any_timestamp_is_formatted_as_utc() -> None:
    assert utc(0) == "1970-01-01T00:00:00.000Z"
    assert utc(2**63 - 1).startswith("2262-04-11T23:47:16.854")
    assert utc(2**64 - 1).startswith("2554-07-21")


def test_commands_have_counts_and_latencies(tmp_path: Path) -> None:
    def command(number: int, latency_ms: int, outcome: str = "done", target: str = "lab/next") -> m.CommandResult:
        latency_ns = latency_ms * 1_000_000
        fields = {
            "type": "command_result", "frame": number, "captured_ns": START_NS, "posture": "squat", "action": "zenoh",
            "target": target, "confidence": 0.4, "latency_ns": latency_ns, "since_end_ns": latency_ns + 300_000_000,
            "since_start_ns": latency_ns + 2_300_000_000, "outcome": outcome,
        }  # fmt: skip
        return msgspec.convert(fields, m.CommandResult)

    results = [command(0, 10), command(1, 30), command(2, 20, target="lab/first"), command(3, 2000, "failed")]
    found = info(take_of(tmp_path / "a.mcap", *((k, result) for k, result in enumerate(results))))
    assert found.commands is not None
    assert (found.commands.done, found.commands.failed, found.commands.dropped) == (3, 1, 0)
    assert found.commands.targets == {"zenoh lab/first": 1, "zenoh lab/next": 2}
    assert (found.commands.latency_ms, found.commands.since_end_ms) == ((20.0, 30.0), (320.0, 330.0))
    text = " ".join(" ".join(lines_of(found)).split())
    assert "commands 3 done, 1 failed, zenoh lab/first 1, zenoh lab/next 2, " in text
    assert "pose to action: median 20.0 ms, largest 30.0 ms" in text
    assert info(take_of(tmp_path / "b.mcap", (0, sighting("1", 0)))).commands is None


def reported(at: int, *, ended: bool = False, **sent: int) -> tuple[int, m.Health]:
    counts = {"process": 7, **({"ended": 1} if ended else {}), **{f"sent.{topic}": count for topic, count in sent.items()}}
    return at, msgspec.structs.replace(health(at, **counts), captured_ns=START_NS + at * FRAME_NS)


@pytest.mark.parametrize("stored", [False, True])
def test_what_was_sent_and_what_became_of_it(tmp_path: Path, stored: bool) -> None:
    """From the account at the end of the take, or from its messages."""
    poses: list[tuple[int, m.Message]] = [(k, sighting("1", k)) for k in (1, 2, 3, 7)]
    path = take_of(tmp_path / "a.mcap", reported(0, sighting=40), *poses, reported(25, sighting=46, health=1))
    if stored:
        account = take_account(path).account
        account.add_message("zenocap/studio/viewer/1/sighting", START_NS + 26 * FRAME_NS)  # it is not written
        again = Recording(
            path, rig="studio", start_ns=START_NS, overwrite=True, closing=lambda: {METADATA: account.metadata()}
        )
        for one in TakeReader(take_of(tmp_path / "b.mcap", reported(0, sighting=40), *poses)).messages():
            again.write(Channel(one.topic, "msgpack", one.schema, "", b""), one.data, one.log_ns, one.publish_ns)
        again.close()
    found = info(path)
    by_topic = {one.topic: one for one in found.account}
    one = by_topic["sighting"]
    assert (one.sent, one.recorded, one.refused, one.missing, one.unlogged) == (46 + stored, 4, int(stored), 2, 40)
    assert METADATA not in found.metadata
    text = "\n".join(lines_of(found))
    assert f"sent        {48 + stored} messages, " in text
    assert f"viewer 1  sighting    {46 + stored}     {2 + stored}" in text
    assert "process" not in text


def test_a_take_of_an_earlier_version_has_no_account(tmp_path: Path) -> None:
    found = info(take_of(tmp_path / "a.mcap", (0, health(0, sent=4)), (25, health(1, sent=9))))
    assert found.account == ()
    assert "never arrived" not in "\n".join(lines_of(found))
