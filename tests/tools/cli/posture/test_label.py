"""`zenocap posture label`: rows of a manifest from a motion, interactive or not; saved names."""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from tests.support.command import printed, refused, zenocap
from tests.support.posture_cases import quick_model
from tests.support.processes import ENVIRONMENT
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc
from zenocap.services.recognizer.model_file import write_model
from zenocap.services.recognizer.training.labelling import Candidate, add_rows, is_labelled
from zenocap.services.recognizer.training.manifest import ManifestRow, read_manifest
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.motion_corpus import chained
from zenocap.simulation.motion.postures import posture
from zenocap.tools.cli.posture import label_terminal
from zenocap.tools.teach.page.page import PosturePage

NAMES = ("raise-right-arm", "squat", "kick-left")
RATE = 30.0


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three postures of a simulated person with rests between them, as joint centres."""
    subject = person(7)
    performed = chained(subject, [posture(subject, name, 0) for name in NAMES], pause_s=1.0)
    frames = [landmarks(subject, performed.pose_at(k / RATE)) for k in range(int(performed.duration_s * RATE))]
    names = tuple(frames[0])
    points = np.array([[points[name] for name in names] for points in frames])
    path = tmp_path_factory.mktemp("motion") / "three.trc"
    write_trc(path, Trajectories(names, np.arange(len(frames)), np.arange(len(frames)) / RATE, points, RATE))
    return path


@pytest.fixture
def label(motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Function of options and answers: the motion is labelled in the terminal, with rows in m.csv; what is printed."""

    def run(*options: object, answers: Sequence[str | BaseException]) -> str:
        remaining = [*answers, EOFError()]
        monkeypatch.setattr("builtins.input", Mock(side_effect=remaining))
        return printed("posture", "label", motion, "-o", tmp_path / "m.csv", "--terminal", *options)

    return run


@pytest.mark.nightly
def test_candidates_are_listed_with_their_moving_limbs(motion: Path) -> None:
    found = json.loads(zenocap("posture", "label", motion, "--json")[1])["candidates"]
    assert [one["limbs"] for one in (found[0], found[2])] == [["right arm"], ["left leg"]]
    assert {"left leg", "right leg"} <= set(found[1]["limbs"])
    text = printed("posture", "label", motion, "--terminal")
    assert text.count("right arm") >= 1
    assert len([line for line in text.splitlines() if line[:3].strip().isdigit()]) == 3


@pytest.mark.nightly
def test_answers_become_rows_and_are_not_asked_again(motion: Path, label: Callable[..., str], tmp_path: Path) -> None:
    manifest, options = tmp_path / "m.csv", ("--person", "anna", "--no-play")
    output = label(*options, answers=("?", "raise", "s", "b -0.1", "b x", "kick"))
    assert "2 of 3 labelled, 2 rows" in output
    assert "allowed: seconds, such as b -0.2" in output
    rows = read_manifest(manifest)
    assert [(row.posture, row.person, row.repetition) for row in rows] == [("raise", "anna", "1"), ("kick", "anna", "1")]
    assert "1 of 1 labelled, 3 rows" in label(*options, answers=("squat",))
    assert [row.posture for row in read_manifest(manifest)] == ["raise", "kick", "squat"]
    result = json.loads(zenocap("posture", "label", motion, "-o", manifest, "--json")[1])
    assert result["candidates"] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "end", ["q", EOFError(), KeyboardInterrupt(), OSError(5, "Input/output error")],
    ids=["q", "end of the input", "Ctrl-C", "terminal gone"],
)  # fmt: skip
def test_labels_are_saved_when_the_user_quits(end: str | BaseException, label: Callable[..., str], tmp_path: Path) -> None:
    assert "1 of 3 labelled, 1 rows" in label("--no-play", answers=("raise", end))
    assert [row.posture for row in read_manifest(tmp_path / "m.csv")] == ["raise"]


@pytest.mark.slow
def test_labels_are_saved_when_ctrl_c_comes_between_two_answers(
    label: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that had been entered was lost."""
    monkeypatch.setattr(label_terminal, "_play", Mock(side_effect=[None, KeyboardInterrupt]))
    assert "1 of 3 labelled, 1 rows" in label(answers=("raise",))
    assert [row.posture for row in read_manifest(tmp_path / "m.csv")] == ["raise"]


@pytest.mark.nightly
@pytest.mark.parametrize("redirection", ["</dev/null", "<&-", "<bytes"])
def test_an_input_without_answers_ends_without_a_traceback(redirection: str, motion: Path, tmp_path: Path) -> None:
    (tmp_path / "bytes").write_bytes(b"caf\xe9\nraise\n")
    words = f"posture label {motion} -o m.csv --terminal --no-play"
    command = f'"{sys.executable}" -P -m zenocap {words} {redirection}'
    environment = ENVIRONMENT | {"PYTHONUTF8": "1"}
    found = subprocess.run(
        ["sh", "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    labelled = int(redirection == "<bytes")
    assert (found.returncode, found.stderr) == (0, "")
    assert f"{labelled} of 3 labelled, {labelled} rows" in found.stdout
    assert ("allowed: 1 to" in found.stdout) == bool(labelled)


@pytest.mark.slow
def test_candidate_is_played_and_repeated_on_request(label: Callable[..., str], tmp_path: Path) -> None:
    assert label("--speed", 20, answers=("r", "q")).count("from the front") >= 2
    assert not (tmp_path / "m.csv").exists()


@pytest.mark.nightly
def test_guess_of_a_model_is_shown_and_accepted_by_enter(motion: Path, label: Callable[..., str], tmp_path: Path) -> None:
    model = tmp_path / "mine.postures"
    write_model(model, quick_model())
    found = json.loads(zenocap("posture", "label", motion, "--json", "--model", model)[1])["candidates"]
    guesses = [one["guess"]["label"] for one in found]
    assert set(guesses) <= set(quick_model().labels)
    label("--model", model, "--no-play", answers=("",))
    assert [row.posture for row in read_manifest(tmp_path / "m.csv")] == guesses[:1]
    confident = sum(one["guess"]["known"] for one in found)
    zenocap("posture", "label", motion, "-o", tmp_path / "all.csv", "--model", model, "--accept")
    named = read_manifest(tmp_path / "all.csv") if confident else []
    assert len(named) == confident


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("missing.trc", "missing.trc"),
        ("three.wav", "allowed: .bvh, .trc, .c3d, .mcap"),
        ("three.trc --model none-such", "none-such"),
        ("three.trc -o nowhere/m.csv --terminal", "there is no folder"),
        ("three.trc -o three.wav", "allowed: a folder, or a manifest"),
        ("three.trc three.trc", "a take is given twice"),
        ("three.trc --ignore tail", "ignored = 'tail': allowed: arms, legs, head"),
        ("three.trc --ignore arms,legs", "ignored = arms, legs: allowed: each part once, arms or legs but not both"),
        ("three.trc --false-per-hour 0", "false_per_hour = 0.0: allowed: 0.001 to 3600"),
        ("three.trc --host 0.0.0.0", "--token"),
    ],
)
def test_unusable_input_is_a_one_line_error(
    arguments: str, words: str, motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "three.trc").write_bytes(motion.read_bytes())
    (tmp_path / "three.wav").touch()
    assert words in refused("posture", "label", *arguments.split())


@pytest.mark.parametrize("option", [("--ignore", "legs"), ("--false-per-hour", "6")])
def test_options_of_training_are_wrong_usage_without_the_page(option: tuple[str, str], motion: Path) -> None:
    error = printed("posture", "label", motion, "--list", *option, status=2)
    assert f"{option[0]}: allowed without --terminal, --list, --accept and --json" in error


@pytest.mark.slow
def test_options_of_training_reach_the_page(motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []

    def opened(page: PosturePage, stopped: object, on_open: object) -> None:
        lines.append(page.session.settings.line)

    monkeypatch.setattr("zenocap.tools.teach.page.page.run_page", opened)
    arguments = ("posture", "label", motion, "-o", tmp_path / "lessons", "--port", 0)
    printed(*arguments, "--ignore", "legs", "--false-per-hour", 6)
    printed(*arguments)
    assert lines == [
        "Settings of training: without legs, at most 6 false postures per hour.",
        "Settings of training: whole body, no limit of false postures.",
    ]


def test_candidate_with_half_of_it_in_a_row_is_labelled(tmp_path: Path) -> None:
    take, other = tmp_path / "a.mcap", tmp_path / "b.mcap"
    rows = [ManifestRow(2, take, 1.0, 2.0, "kick", "1", "1")]
    for start, end, named in ((1.2, 2.4, True), (1.6, 2.8, False), (0.0, 1.0, False), (0.9, 2.1, True)):
        assert is_labelled(rows, take, Candidate(start, end, 1.0, ("right leg",))) is named
    assert not is_labelled(rows, other, Candidate(1.0, 2.0, 1.0, ("right leg",)))
    assert is_labelled([ManifestRow(2, take, None, None, "kick", "1", "1")], take, Candidate(5.0, 6.0, 1.0, ("right leg",)))


def test_repetition_numbers_continue_by_person_and_posture(tmp_path: Path) -> None:
    take, one = tmp_path / "a.mcap", Candidate(1.0, 2.0, 1.0, ("right leg",))
    rows = add_rows([], take, "anna", [(one, "kick"), (one, "kick"), (one, "bow")])
    rows = add_rows(rows, take, "ben", [(one, "kick")])
    assert [row.repetition for row in rows] == ["1", "2", "1", "1"]
