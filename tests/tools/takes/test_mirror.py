"""Take tracked again on its silhouettes, with front and back exchanged."""

from pathlib import Path

import numpy as np
import pytest

import zenocap
from tests.support.arms_takes import reversed_take
from tests.support.command import zenocap as command
from tests.support.places import GOLDEN
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.observe.account import METADATA, Account
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, read_setup
from zenocap.tools.takes.info import info
from zenocap.tools.takes.mirror import mirror
from zenocap.tools.takes.retrack import retrack, take_like
from zenocap.tools.takes.verify.recompute import verify


def away(path: Path, right: Path, *, raw: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Times, and whether the take faces away from where the right one does."""
    one, other = read_poses(path, raw=raw).track(), read_poses(right).track()
    turned_rad = one.angles[:, 0] - other.angles[:, 0]
    return one.times_s, np.cos(turned_rad) < 0.0


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tracked both ways from the wrong heading."""
    return reversed_take(tmp_path_factory.mktemp("wrong") / "take")


def test_a_take_like_another_one_has_not_the_account_of_its_log(tmp_path: Path) -> None:
    source = TakeReader(GOLDEN / "force.mcap")
    first_ns = min(recorded.log_ns for recorded in source.messages())
    source.metadata |= {METADATA: Account().metadata(), "note": {"kept": "1"}}
    rig = read_setup(source.path, source.attachments[SETUP_FILE])
    take_like(source, rig, tmp_path / "like.mcap", first_ns, {}).close()
    like = TakeReader(tmp_path / "like.mcap")
    list(like.messages())
    assert like.metadata["note"] == {"kept": "1"}
    assert METADATA not in like.metadata


@pytest.mark.nightly
def test_a_take_becomes_itself_again(takes: tuple[Path, Path], tmp_path: Path) -> None:
    source = TakeReader(takes[0])
    first_ns = min(recorded.log_ns for recorded in source.messages())
    recorded = read_setup(takes[0], source.attachments[SETUP_FILE])
    again = tmp_path / "again.mcap"
    retrack(takes[0], recorded, lambda: take_like(source, recorded, again, first_ns, {}))
    assert again.read_bytes() == takes[0].read_bytes()


@pytest.mark.nightly
def test_mirrored_take_is_right_from_there_on_and_is_recomputed(
    takes: tuple[Path, Path], wrong: Path, tmp_path: Path
) -> None:
    before = wrong.read_bytes()
    times_s, was_away = away(wrong, takes[1])
    from_s = float(times_s[0] + 2.0)
    calls: list[tuple[str, int, int]] = []
    found = mirror(wrong, tmp_path / "a.mcap", from_s, watch=lambda *one: calls.append(one))
    assert (found.both_ways, found.turned_back_s, found.poses) == (True, None, len(times_s))
    assert found.from_s == pytest.approx(from_s, abs=1e-3)
    assert all(done <= total for _, done, total in calls)
    _, is_away = away(tmp_path / "a.mcap", takes[1])
    assert was_away[times_s < times_s[0] + 4.9].all()  # the decision at the start holds in both passes
    assert verify([wrong]).complete
    assert is_away[times_s < from_s - 0.15].all()
    assert not is_away[times_s > from_s + 0.15].any()
    verified = verify([tmp_path / "a.mcap"])
    assert verified.complete
    assert not verified.failed
    mirror(wrong, tmp_path / "b.mcap", from_s, jobs=2)
    assert (tmp_path / "b.mcap").read_bytes() == (tmp_path / "a.mcap").read_bytes()
    assert wrong.read_bytes() == before
    metadata = info(tmp_path / "a.mcap").metadata["mirrored"]
    assert (metadata["from_s"], metadata["until_s"]) == (f"{found.from_s:.3f}", "end")
    assert zenocap.open_take(tmp_path / "a.mcap").both_ways


@pytest.mark.nightly
def test_until_a_time_and_again_from_the_same_one(takes: tuple[Path, Path], wrong: Path, tmp_path: Path) -> None:
    times_s, _ = away(wrong, takes[1])
    first, last = float(times_s[0] + 1.5), float(times_s[0] + 3.0)
    mirror(wrong, tmp_path / "a.mcap", first, last)
    _, raw_away = away(tmp_path / "a.mcap", takes[1], raw=True)
    early = times_s < last + 1e-3  # then the feet turn it round at once
    np.testing.assert_array_equal(raw_away[early], ((times_s < first) | (times_s >= last - 1e-3))[early])
    mirror(tmp_path / "a.mcap", tmp_path / "b.mcap", last)
    again = TakeReader(tmp_path / "b.mcap")
    assert list(again.messages())
    assert len(read_setup(again.path, again.attachments[SETUP_FILE]).tracker.turns) == 2  # not three
    _, raw_away = away(tmp_path / "b.mcap", takes[1], raw=True)
    assert not raw_away[times_s > first + 0.1].any()


@pytest.mark.nightly
def test_the_command_says_that_the_silhouettes_turn_the_track_back(
    takes: tuple[Path, Path], wrong: Path, tmp_path: Path
) -> None:
    path = tmp_path / "right.mcap"
    path.write_bytes(takes[1].read_bytes())
    status, out, err = command("mirror", path, "--from", f"{read_poses(path).track().times_s[0] + 1.0:.3f}s")
    assert "right-mirrored.mcap: " in out + err
    assert (status, "turned back: at " in out + err) == (3, True)
    path.write_bytes(wrong.read_bytes())
    status, out, err = command("mirror", path, "--from", f"{read_poses(path).track().times_s[0] + 1.0:.3f}", "-o", path)
    assert (status, "is the take itself: allowed: another file" in out + err) == (1, True)


@pytest.mark.slow
def test_takes_and_times_that_cannot_be_mirrored_are_refused(takes: tuple[Path, Path], tmp_path: Path) -> None:
    output = tmp_path / "a.mcap"
    with pytest.raises(UserError, match=r"--from 999: no tracked pose from there on: allowed: \d+\.\d+ to \d+\."):
        mirror(takes[0], output, 999.0)
    with pytest.raises(UserError, match="--to 3: allowed: after --from 5"):
        mirror(takes[0], output, 5.0, 3.0)
    with pytest.raises(UserError, match="method 'two-view': allowed for mirror: hybrid, image-force, particle-filter"):
        mirror(GOLDEN / "arms.mcap", output, 1.0)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(takes[0].read_bytes()[: takes[0].stat().st_size * 3 // 4])
    with pytest.raises(UserError, match="`zenocap recover` writes a copy that can be read"):
        mirror(cut, output, 3.0)
    assert not output.exists()
    status, _, err = command("mirror", takes[0], "--from", "x")
    assert (status, "allowed: seconds since frame 0, such as 12.4" in err) == (2, True)
