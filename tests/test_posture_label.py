"""`zenocap posture label`: from a motion to the rows of a manifest, asked or not; and how names are kept."""

import json
from pathlib import Path

import numpy as np
import pytest

from common.actor.person import person
from common.actor.postures import posture
from common.actor.repertoire import chained
from common.actor.truth import landmarks
from common.formats.trc import Trajectories, write_trc
from services.recognizer.candidates import Candidate
from services.recognizer.file import write_model
from services.recognizer.manifest import Row, read_manifest
from services.recognizer.naming import is_named, with_named
from tests.posture_cases import quick_model
from tests.test_cli import zenocap

NAMES = ("raise-right-arm", "squat", "kick-left")
RATE = 30.0


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three postures of a synthetic person, standing still between, as joint centres."""
    somebody = person(7)
    acted = chained(somebody, [posture(somebody, name, 0) for name in NAMES], pause_s=1.0)
    frames = [landmarks(somebody, acted.pose_at(k / RATE)) for k in range(int(acted.duration_s * RATE))]
    names = tuple(frames[0])
    points = np.array([[points[name] for name in names] for points in frames])
    path = tmp_path_factory.mktemp("motion") / "three.trc"
    write_trc(path, Trajectories(names, np.arange(len(frames)), np.arange(len(frames)) / RATE, points, RATE))
    return path


def answers(monkeypatch: pytest.MonkeyPatch, *said: str) -> None:
    left = list(said)

    def answer(_: str) -> str:
        if not left:
            raise EOFError
        return left.pop(0)

    monkeypatch.setattr("builtins.input", answer)


def test_candidates_are_listed_with_what_moves(motion: Path) -> None:
    status, told, _ = zenocap("posture", "label", motion, "--json")
    found = json.loads(told)["candidates"]
    assert status == 0
    assert [one["limbs"] for one in (found[0], found[2])] == [["right arm"], ["left leg"]]
    assert {"left leg", "right leg"} <= set(found[1]["limbs"])
    status, text, _ = zenocap("posture", "label", motion)
    assert status == 0
    assert text.count("right arm") >= 1
    assert len([line for line in text.splitlines() if line[:3].strip().isdigit()]) == 3


def test_what_is_said_becomes_rows_and_is_not_asked_again(
    motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = tmp_path / "m.csv"
    answers(monkeypatch, "?", "raise", "s", "b -0.1", "b x", "kick")
    status, told, _ = zenocap("posture", "label", motion, "-o", manifest, "--person", "anna", "--no-play")
    assert status == 0
    assert "2 of 3 named, 2 rows" in told
    assert "allowed: seconds, such as b -0.2" in told
    rows = read_manifest(manifest)
    assert [(row.posture, row.person, row.repetition) for row in rows] == [("raise", "anna", "1"), ("kick", "anna", "1")]
    answers(monkeypatch, "squat")
    status, told, _ = zenocap("posture", "label", motion, "-o", manifest, "--person", "anna", "--no-play")
    assert "1 of 1 named, 3 rows" in told
    assert [row.posture for row in read_manifest(manifest)] == ["raise", "kick", "squat"]
    shown = json.loads(zenocap("posture", "label", motion, "-o", manifest, "--json")[1])
    assert shown["candidates"] == []


@pytest.mark.parametrize("leave", ["q", None])
def test_what_was_named_stays_when_somebody_leaves(
    leave: str | None, motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = tmp_path / "m.csv"
    answers(monkeypatch, "raise", *([leave] if leave else []))
    status, told, _ = zenocap("posture", "label", motion, "-o", manifest, "--no-play")
    assert status == 0
    assert "1 of 3 named, 1 rows" in told
    assert [row.posture for row in read_manifest(manifest)] == ["raise"]


def test_every_candidate_is_played_and_again_when_asked(
    motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers(monkeypatch, "r", "q")
    status, told, _ = zenocap("posture", "label", motion, "-o", tmp_path / "m.csv", "--speed", 20)
    assert status == 0
    assert told.count("from the front") >= 2
    assert not (tmp_path / "m.csv").exists()


def test_a_models_guess_is_shown_and_taken_by_enter(motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = tmp_path / "mine.postures"
    write_model(model, quick_model())
    found = json.loads(zenocap("posture", "label", motion, "--json", "--model", model)[1])["candidates"]
    guesses = [one["guess"]["label"] for one in found]
    assert set(guesses) <= set(quick_model().labels)
    answers(monkeypatch, "")
    zenocap("posture", "label", motion, "-o", tmp_path / "m.csv", "--model", model, "--no-play")
    assert [row.posture for row in read_manifest(tmp_path / "m.csv")] == guesses[:1]
    sure = sum(one["guess"]["known"] for one in found)
    zenocap("posture", "label", motion, "-o", tmp_path / "all.csv", "--model", model, "--accept")
    named = read_manifest(tmp_path / "all.csv") if sure else []
    assert len(named) == sure


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.trc"], "missing.trc"),
        (["three.wav"], "allowed: .bvh, .trc, .mcap"),
        (["three.trc", "--model", "none-such"], "none-such"),
        (["three.trc", "-o", "nowhere/m.csv"], "there is no folder"),
    ],
)
def test_what_cannot_be_used_is_one_line(
    arguments: list[str], words: str, motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "three.trc").write_bytes(motion.read_bytes())
    (tmp_path / "three.wav").touch()
    status, _, error = zenocap("posture", "label", *arguments)
    assert status == 1
    assert words in error
    assert len(error.strip().splitlines()) == 1


def test_more_than_half_in_a_row_is_named_already(tmp_path: Path) -> None:
    take, other = tmp_path / "a.mcap", tmp_path / "b.mcap"
    rows = [Row(2, take, 1.0, 2.0, "kick", "1", "1")]
    for start, end, named in ((1.2, 2.4, True), (1.6, 2.8, False), (0.0, 1.0, False), (0.9, 2.1, True)):
        assert is_named(rows, take, Candidate(start, end, 1.0, ("right leg",))) is named
    assert not is_named(rows, other, Candidate(1.0, 2.0, 1.0, ("right leg",)))
    assert is_named([Row(2, take, None, None, "kick", "1", "1")], take, Candidate(5.0, 6.0, 1.0, ("right leg",)))


def test_repetitions_are_counted_on_by_person_and_posture(tmp_path: Path) -> None:
    take, one = tmp_path / "a.mcap", Candidate(1.0, 2.0, 1.0, ("right leg",))
    rows = with_named([], take, "anna", [(one, "kick"), (one, "kick"), (one, "bow")])
    rows = with_named(rows, take, "ben", [(one, "kick")])
    assert [row.repetition for row in rows] == ["1", "2", "1", "1"]
