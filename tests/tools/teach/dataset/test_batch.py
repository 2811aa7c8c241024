"""Generation of a whole data set: takes, resumption, manifest."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from zenocap.common.formats.take_poses import read_poses
from zenocap.common.rig.rig import Rig
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.services.recognizer.training.train import no_report
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.takes.track import Tracked
from zenocap.tools.teach.dataset.batch import (
    MANIFEST,
    PEOPLE,
    PostureTake,
    generate_takes,
    people,
    posture_takes,
    take_path,
)
from zenocap.tools.teach.dataset.generate import Method, generate_take

TAKES = posture_takes([7], ("squat", "kick-left"), 1)


@pytest.mark.slow
def test_manifest_has_a_row_for_every_take_and_gives_valid_training_examples(tmp_path: Path) -> None:
    generate_takes(tmp_path, "truth", TAKES, 1, no_report)
    rows = read_manifest(tmp_path / MANIFEST)
    assert [(row.posture, row.person, row.repetition) for row in rows] == [
        (one.posture, str(one.person), str(one.repetition)) for one in TAKES
    ]
    for row in rows:
        times_s = read_poses(row.source).times_s
        assert times_s[0] < row.start < row.end == pytest.approx(times_s[-1], abs=2 / 15)
    examples = examples_of(tmp_path / MANIFEST, rows, DEFAULT)
    assert [example.label for example in examples] == [one.posture for one in TAKES]
    assert all(np.isfinite(example.features).all() for example in examples)


@pytest.mark.slow
def test_take_without_poses_is_reported_and_not_in_the_manifest(tmp_path: Path) -> None:
    def generate_without_poses(_rig: Rig, _method: Method, _script: MotionTimeline, _room: int, take: Path) -> Tracked:
        take.write_bytes(b"")
        return Tracked(60, 0, 2, (), {})

    with patch("zenocap.tools.teach.dataset.batch.generate_take", generate_without_poses):
        generated = generate_takes(tmp_path, "truth", TAKES[:1], 1, no_report)
    assert [one.poses for one in generated] == [0]
    again = generate_takes(tmp_path, "truth", TAKES, 1, no_report)
    assert [one.take for one in again] == TAKES[1:]
    assert [row.posture for row in read_manifest(tmp_path / MANIFEST)] == [TAKES[1].posture]


@pytest.mark.slow
def test_existing_takes_are_not_generated_again(tmp_path: Path) -> None:
    existing = take_path(tmp_path, "truth", TAKES[0])
    existing.write_bytes(b"existing take")
    progress: list[tuple[int, int, str]] = []
    generated = generate_takes(tmp_path, "truth", TAKES, 1, lambda *update: progress.append(update))
    assert [one.take for one in generated] == [TAKES[1]]
    assert existing.read_bytes() == b"existing take"
    assert progress == [(1, 2, ""), (2, 2, TAKES[1].name)]
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.slow
def test_two_processes_write_the_same_bytes_as_one(tmp_path: Path) -> None:
    generate_takes(tmp_path / "one", "truth", TAKES, 1, no_report)
    generated = generate_takes(tmp_path / "two", "truth", TAKES, 2, no_report)
    assert {one.take for one in generated} == set(TAKES)
    for one in (*(take_path(Path(), "truth", take) for take in TAKES), MANIFEST):
        assert (tmp_path / "one" / one).read_bytes() == (tmp_path / "two" / one).read_bytes()


@pytest.mark.slow
def test_processes_in_one_folder_use_different_temporary_files(tmp_path: Path) -> None:
    temporary_paths: list[Path] = []

    def recorded_generate_take(rig: Rig, method: Method, script: MotionTimeline, room: int, take: Path) -> Tracked:
        temporary_paths.append(take)
        return generate_take(rig, method, script, room, take)

    for process in (1, 2):
        with (
            patch("zenocap.tools.teach.dataset.batch.generate_take", recorded_generate_take),
            patch("zenocap.tools.teach.dataset.batch.os.getpid", return_value=process),
        ):
            generate_takes(tmp_path, "truth", TAKES[process - 1 : process], 1, no_report)
            take_path(tmp_path, "truth", TAKES[process - 1]).unlink()
            generate_takes(tmp_path, "truth", TAKES[:1], 1, no_report)
            take_path(tmp_path, "truth", TAKES[0]).unlink()
    assert len({part for part in temporary_paths if TAKES[0].name in part.name}) == 2


def test_every_person_performs_every_posture_equally_often_in_takes_and_rooms_of_their_own() -> None:
    found = posture_takes(people(3), POSTURES, 10)
    assert len({(one.person, one.posture, one.repetition) for one in found}) == PEOPLE * len(POSTURES) * 10 == len(found)
    assert len({one.name for one in found}) == len({one.room for one in found}) == len(found)
    assert not set(people(0)) & set(people(1))


def test_unknown_posture_is_rejected_with_the_allowed_names() -> None:
    with pytest.raises(ValueError, match=r"posture 'handstand': allowed: march, "):
        posture_takes([0], ["handstand"])


def test_posture_is_the_last_segment_of_its_timeline_and_in_the_name_of_its_take() -> None:
    assert take_path(Path("acted"), "hybrid", PostureTake(3, "squat", 1)) == Path("acted/hybrid-3-squat-1.mcap")
    script = PostureTake(4, "squat", 1).timeline()
    assert script.segments[-1].name == "squat"
    assert script.segments[-1].start_s == script.motion_from_s < script.duration_s
