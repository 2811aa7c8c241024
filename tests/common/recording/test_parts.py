"""A take in parts: every part is readable alone, together they have every message once."""

import resource
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.common.bus.test_inbox import bap, sighting
from tests.common.bus.test_local import bdp
from tests.common.recording.test_writer import START_NS, envelope
from tests.support.places import ROOT
from tests.support.small_disk import small_disk
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.recording.channel_limits import MAX_UNKNOWN_KEYS
from zenocap.common.recording.opening import new_parts
from zenocap.common.recording.parts import PartLimits, Parts, take_path
from zenocap.common.recording.reader import Recorded, TakeReader
from zenocap.common.recording.take_account import take_account
from zenocap.common.recording.writer import Attachment, Recording, RecordingError, Statistics
from zenocap.common.rig.rig import demo_rig_file, load_rig

S = 1_000_000_000


def opened(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
    files = (Attachment("rig.toml", "text/plain", b'name = "studio"'),)
    return Recording(path, rig="studio", start_ns=start_ns, metadata={"part": part} if part else {}, attachments=files)


def parts(folder: Path, limits: PartLimits, *, must_open: bool = True) -> Parts:
    name = lambda now_ns: take_path("studio", folder, now_ns)  # noqa: E731
    return Parts(opened, name(START_NS), START_NS, limits, name, must_open=must_open)


def envelopes(count: int, step_ns: int) -> list[Envelope]:
    """Two bodies, one of them measured twice, then poses."""
    start = [envelope(bdp("1", 0), START_NS), envelope(bdp("2", 0), START_NS), envelope(bdp("1", 1), START_NS + 1)]
    return start + [envelope(bap(frame), START_NS + frame * step_ns) for frame in range(count)]


def sightings(count: int) -> list[Envelope]:
    """Of 30 frames/s; they are badly compressed."""
    return [envelope(sighting("1", number * 7919 % 10007), START_NS + number * S // 30) for number in range(count)]


def recorded(recording: Parts, sent: Iterable[Envelope]) -> Statistics:
    """What is counted once all are recorded and the recording is closed."""
    for each in sent:
        recording.record(each)
    return recording.close()


def read(folder: Path) -> dict[str, tuple[TakeReader, list[Recorded]]]:
    """The parts by name, in the order of their numbers."""
    found = [(take, list(take.messages())) for take in map(TakeReader, folder.glob("*.mcap"))]
    found.sort(key=lambda each: int(each[0].metadata["part"]["number"]))
    return {take.path.name: (take, messages) for take, messages in found}


def test_invented_names_are_repeated_in_no_place_of_the_rigs_own(tmp_path: Path) -> None:
    """1,024 of them before the rig's own: later parts could not be read alone."""

    def own(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        return Recording(path, rig="studio", start_ns=start_ns, own=[("viewer", "1")], metadata={"part": part or {}})

    bodies = [envelope(bdp(name, 0), START_NS) for name in (*(f"a{number}" for number in range(1030)), "1")]
    recorded(Parts(own, tmp_path / "a.mcap", START_NS, PartLimits(ns=S)), [*bodies, envelope(bap(1), START_NS + S)])
    later = [one.topic for one in TakeReader(tmp_path / "a-2.mcap").messages()]
    assert bodies[-1].key in later
    assert len(later) == MAX_UNKNOWN_KEYS + 2


def test_each_part_is_self_contained(tmp_path: Path) -> None:
    limits = PartLimits(ns=60 * S)
    sent = envelopes(150, S)
    end = recorded(parts(tmp_path, limits), sent)
    found = read(tmp_path)
    names = [f"studio-{datetime.fromtimestamp(START_NS // S + at, UTC):%Y%m%dT%H%M%SZ}.mcap" for at in (0, 60, 120)]
    assert list(found) == names
    assert (end.messages, end.lost, end.failure) == (len(sent), 0, None)
    for number, (take, messages) in enumerate(found.values(), start=1):
        assert take.cut is None
        assert take.attachments == {"rig.toml": b'name = "studio"'}
        previous, repeated = (names[number - 2], "2") if number > 1 else ("", "0")
        expected = {"take": names[0], "number": str(number), "previous": previous, "repeated": repeated}
        assert take.metadata["part"] == expected
        if number > 1:
            first, second, third = messages[:3]
            assert (first.topic, first.sequence) == ("zenocap/studio/viewer/1/bdp", 1)
            assert (second.topic, second.sequence) == ("zenocap/studio/viewer/2/bdp", 0)
            assert first.log_ns == second.log_ns == third.log_ns


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 3 * S), min_size=1, max_size=60), st.integers(1, 5), st.sampled_from([0, 1, 3000, 6000]))
def test_all_parts_together_have_every_message_once(tmp_path_factory, steps, limit_s, limit_bytes):
    folder = tmp_path_factory.mktemp("parts")
    recording = parts(folder, PartLimits(limit_bytes, limit_s * S))
    now_ns, sent = START_NS, []
    for number, step in enumerate(steps):
        now_ns += step
        sent.append(envelope(bdp("1", number) if number % 7 == 0 else bap(number), now_ns))
        recording.record(sent[-1])
    end = recording.close()
    joined = [m.data for take, all in read(folder).values() for m in all[int(take.metadata["part"]["repeated"]) :]]
    assert joined == [each.data for each in sent]
    assert (end.messages, end.bytes) == (len(sent), sum(len(each.data) for each in sent))
    assert recording.number == len(list(folder.iterdir()))


@pytest.mark.slow
def test_a_part_ends_by_size(tmp_path: Path) -> None:
    recorded(parts(tmp_path, PartLimits(bytes=20_000)), sightings(3000))
    sizes = [path.stat().st_size for path in sorted(tmp_path.iterdir())]
    assert len(sizes) > 2
    assert all(20_000 <= size < 30_000 for size in sizes[:-1])


def test_without_limits_there_is_one_file_without_part_metadata(tmp_path: Path) -> None:
    recorded(parts(tmp_path, PartLimits()), envelopes(5, 3600 * S))
    (path,) = tmp_path.iterdir()
    take = TakeReader(path)
    assert len(list(take.messages())) == 8
    assert "part" not in take.metadata


def test_parts_that_begin_within_a_second_have_different_names(tmp_path: Path) -> None:
    recorded(parts(tmp_path, PartLimits(ns=S // 10)), envelopes(10, S // 10))
    assert len(read(tmp_path)) == 10


def test_a_clock_that_is_set_back_begins_a_part_and_small_disorder_does_not(tmp_path: Path) -> None:
    times_ns = (START_NS, START_NS - S, START_NS + S, START_NS - 7200 * S, START_NS - 7199 * S)
    recorded(parts(tmp_path, PartLimits(ns=3600 * S)), [envelope(bap(1), at_ns) for at_ns in times_ns])
    assert [len(messages) for _, messages in read(tmp_path).values()] == [3, 2]


def test_a_part_that_cannot_be_opened_ends_the_log_and_not_the_caller(tmp_path, caplog):
    folder = tmp_path / "takes"
    recording = parts(folder, PartLimits(ns=S))
    recording.record(envelope(bap(0), START_NS))
    folder.rename(tmp_path / "moved")
    folder.write_text("no folder any more")
    end = recorded(recording, [envelope(bap(frame), START_NS + frame * S) for frame in range(1, 4)])
    assert (end.messages, end.lost) == (1, 3)
    assert "cannot be written" in end.failure
    assert len(caplog.records) == 1
    (moved,) = (tmp_path / "moved").iterdir()
    assert TakeReader(moved).cut is None


def test_a_first_part_that_cannot_be_opened_is_an_error_only_with_must_open(tmp_path, caplog):
    folder = tmp_path / "takes"
    folder.write_text("no folder")
    with pytest.raises(RecordingError, match="is no folder"):
        parts(folder, PartLimits())
    recording = parts(folder, PartLimits(), must_open=False)
    recording.record(envelope(bap(0), START_NS))
    assert recording.failure is not None
    assert (recording.close().messages, recording.statistics.lost) == (0, 1)
    assert "the log stops" in caplog.text


def test_a_rig_file_sets_the_limits_of_parts(tmp_path: Path) -> None:
    text = demo_rig_file("two-view").read_text().replace("demo-cal", f"{demo_rig_file('two-view').parent}/demo-cal")
    path = tmp_path / "rig.toml"
    path.write_text(f"{text}[log]\npart_mb = 0.5\npart_minutes = 1\n")
    recording = new_parts(load_rig(path), take_path("demo", tmp_path, START_NS), START_NS, {}, iter(range(7, 10)).__next__)
    recorded(recording, envelopes(3, 60 * S))
    found = read(tmp_path)
    assert [take.metadata["part"]["number"] for take, _ in found.values()] == ["1", "2", "3"]
    assert [take_account(tmp_path / name).opened_ns for name in found] == [7, 8, 9]
    files = {"rig.toml", "demo-calibration.toml", "setup.json", "recognizer.postures"}
    assert all(take.attachments.keys() == files for take, _ in found.values())
    assert PartLimits.of(0.5, 1) == PartLimits(500_000, 60 * S)
    path.write_text(f"{text}[log]\npart_minutes = -1\n")
    with pytest.raises(UserError, match=r"log\.part_minutes = -1: allowed: float >= 0"):
        load_rig(path)


@pytest.mark.slow
def test_a_disk_that_is_full_ends_the_log_and_not_the_caller(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", 64) as folder:
        recording = parts(folder, PartLimits(bytes=20_000))
        end = recorded(recording, sightings(6000))
        assert "No space left on device" in end.failure
        assert (end.messages + end.lost, recording.number) == (6000, len(list(folder.iterdir())))
        found = [len(list(TakeReader(path).messages())) for path in folder.iterdir()]
        assert sum(found) >= end.messages > 1000


@pytest.mark.nightly
def test_a_file_size_limit_ends_the_log_and_is_reported_once(tmp_path: Path) -> None:
    """The operating system's limit on file sizes, in a separate process."""
    if not hasattr(resource, "RLIMIT_FSIZE"):
        pytest.skip("needs a limit on the size of files")
    script = """
        import logging, resource, signal, sys
        from pathlib import Path
        from tests.common.recording.test_parts import PartLimits, parts, recorded, sightings
        logging.basicConfig(level=logging.INFO)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
        end = recorded(parts(Path(sys.argv[1]), PartLimits()), sightings(3000))
        print(end.messages, end.lost, end.failure)
    """
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script), tmp_path], cwd=ROOT, capture_output=True, text=True, check=True
    )
    (path,) = tmp_path.iterdir()
    written, lost, failure = run.stdout.split(maxsplit=2)
    assert "recording stopped after" in failure
    assert run.stderr.count("recording stopped after") == 1
    assert "Traceback" not in run.stderr
    assert int(written) + int(lost) == 3000
    take = TakeReader(path)
    assert len(list(take.messages())) >= int(written) > 0
    assert take.cut is not None


@pytest.mark.parametrize("whole_folder", [True, False])
@pytest.mark.parametrize("limits", [PartLimits(), PartLimits(ns=3600 * S)])
def test_a_file_that_is_deleted_is_reported_and_the_take_continues_in_a_new_one(tmp_path, caplog, whole_folder, limits):
    folder = tmp_path / "takes"
    recording = parts(folder, limits)
    for each in envelopes(5, S // 10):
        recording.record(each)
    if whole_folder:
        shutil.rmtree(folder)
    else:
        recording.path.unlink()
    recording.flush()
    for frame in range(5, 9):
        recording.record(envelope(bap(frame), START_NS + frame * S // 10))
        recording.flush()
    end = recording.close()
    assert (end.messages, end.lost, end.removed, end.failure) == (4, 8, 1, None)
    ((_, messages),) = read(folder).values()
    assert [message.sequence for message in messages] == [1, 0, 5, 6, 7, 8]  # the latched bodies first
    assert "was deleted while it was written: 8 messages are lost; the take continues in" in caplog.text
    assert len(caplog.records) == 1


def test_a_file_that_is_moved_is_finished_and_the_take_continues_in_a_new_one(tmp_path, caplog):
    recording = parts(tmp_path, PartLimits())
    moved = recording.path.with_suffix(".moved")
    recording.record(envelope(bap(0), START_NS))
    recording.path.rename(moved)
    recording.flush()
    recording.record(envelope(bap(1), START_NS + S))
    end = recording.close()
    assert (end.messages, end.lost, end.removed, end.incomplete) == (2, 0, 1, True)
    assert TakeReader(moved).cut is None
    assert [len(list(TakeReader(path).messages())) for path in (moved, recording.path)] == [1, 1]
    assert "was moved while it was written; the take continues in" in caplog.text


def test_a_file_that_is_deleted_at_the_end_is_lost(tmp_path: Path) -> None:
    recording = parts(tmp_path, PartLimits())
    recording.record(envelope(bap(0), START_NS))
    recording.path.unlink()
    end = recording.close()
    assert (end.messages, end.lost, end.removed) == (0, 1, 1)
    assert list(tmp_path.iterdir()) == []
    assert recording.close() == end
