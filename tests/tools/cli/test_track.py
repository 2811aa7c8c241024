"""Output of `zenocap track` for takes without T-pose, without a pose or of two people."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import zenocap
from tests.support.video_file import write_video
from tests.support.walkers import Walker, walker
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import demo_rig, demo_rig_file, load_rig
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import Placement, place
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.cli.progress import WorkProgress
from zenocap.tools.cli.track import _print_losses
from zenocap.tools.takes.track import Tracked, track
from zenocap.tools.takes.track_job import TrackJob, overlay
from zenocap.tools.takes.verify.recompute import verify


def tracked(poses: int = 0, estimated: float | None = None) -> Tracked:
    """A result without a measured body."""
    return Tracked(60, poses, 100, (), {"tracker": "waiting for a person"}, measured=False, estimated=estimated)


def printed(capsys: pytest.CaptureFixture[str], result: Tracked, method: str, height: float | None = None) -> str:
    _print_losses(result, replace(demo_rig(method), person_height=height))
    return capsys.readouterr().err


def test_the_height_is_advised_where_the_method_needs_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert "cannot be estimated from the silhouettes: give --height METRES" in printed(capsys, tracked(), "two-view")
    for method, height in (("auto", None), ("two-view", 1.75)):
        text = printed(capsys, tracked(), method, height)
        assert "--height" not in text
        assert "tracker: waiting for a person" in text


def test_the_estimated_height_of_a_body_without_t_pose_is_stated(capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, tracked(40, 1.743), "auto")
    assert "of 1.74 m from the floor to the top of the head" in text
    assert "--height METRES" in text
    assert "adapted" in text
    assert "adapted" not in printed(capsys, tracked(40, 1.743), "two-view")
    assert printed(capsys, tracked(40), "auto", 1.75) == (
        "note: height 1.75 m: the body has average proportions; no T-pose has measured it\n"
    )


def test_a_take_is_replaced_only_where_it_is_named_and_with_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("demo.mcap").touch()
    status, _, text = zenocap("track", demo_rig_file())
    assert (status, Path("demo.mcap").stat().st_size) == (2, 0)
    assert "demo.mcap is there already: allowed: -o FILE, which may replace it" in " ".join(text.split())
    assert "note: demo.mcap is there and will be replaced\n" in zenocap("track", "none", "-o", "demo.mcap")[2]
    assert "will be replaced" not in zenocap("track", "none", "-o", "other.mcap")[2]


@pytest.mark.parametrize(("height", "words"), [(1.69, ""), (1.60, "is 1.60 m tall, not 1.75 m as given: ")])
def test_a_given_height_that_the_t_pose_contradicts_is_noted(
    capsys: pytest.CaptureFixture[str], height: float, words: str
) -> None:
    text = printed(capsys, replace(tracked(40), measured=True, height=height), "auto", 1.75)
    assert words in text
    assert bool(words) == bool(text)


def filmed(
    folder: Path, rates: Sequence[int], steps: int = 6, until_s: float = 3.4, other: Placement | None = None
) -> Walker:
    """A folder of films of a person who walks after a second of the empty scene.  other: where a second person walks."""
    scene, second = walker(1, len(rates), (160, 120), steps), person(3)
    for (name, camera), fps in zip(scene.cameras.items(), rates, strict=True):
        film, images = SimulatedCamera(camera, scene.person, 0), []
        beside = SimulatedCamera(camera, second, 0)
        for k in range(round(until_s * fps)):
            pose = None if k < fps else scene.motion.pose_at(k / fps - 1.0)
            others = [] if pose is None or other is None else [(beside, place(pose, other))]
            images.append(film.render(pose, k, beside=others))
        write_video(folder / "videos" / f"{name}.mp4", images, fps=fps)
    write_calibration(folder / "calibration.toml", dict(scene.cameras))
    return scene


@pytest.mark.slow
@pytest.mark.parametrize(("method", "views"), [("hybrid", 3), ("two-view", 2)])
def test_without_t_pose_the_frames_are_tracked_again_with_the_height_over_the_floor(
    method: str, views: int, tmp_path: Path
) -> None:
    scene, take = filmed(tmp_path, [15] * views), tmp_path / "a.mcap"
    rig = load_rig(tmp_path, method, background="first:1s")
    drawing, shown = overlay(rig, tmp_path / "pictures", 10), WorkProgress("tracking")
    result = TrackJob(rig, drawing, two_passes=method == "hybrid", jobs=1).run(take, shown)
    assert result.both_ways == (method == "hybrid")
    assert result.poses >= result.frame_sets - 20  # the empty scene has 15
    assert not result.measured
    assert result.estimated == pytest.approx(scene.person.height, abs=0.1)
    assert drawing.finish() == -(-result.frame_sets // 10)  # of the second time alone
    assert shown.done == result.frame_sets
    assert verify([take]).failed is False
    read = TakeReader(take)
    list(read.messages())
    assert read.metadata["rig"]["person_height"] == f"{result.estimated:.2f} m, estimated"


@pytest.mark.nightly
def test_two_people_in_films_are_the_first_reason_that_is_printed(tmp_path: Path) -> None:
    filmed(tmp_path, [15] * 3, steps=14, until_s=8.0, other=Placement(0.9, 0.0, 0.0))
    status, _, text = zenocap("track", tmp_path, "-o", tmp_path / "a.mcap", "--empty-seconds", "1", "--no-both-ways")
    first = re.search(r"^verdict: (\w+).*\n  camera ([\w, ]+): (a second person, [^:]*)", text, re.MULTILINE)
    assert first is not None, text
    assert (first[1], status) in (("doubtful", 3), ("unusable", 4))


@pytest.mark.nightly
@pytest.mark.parametrize("slowest", [30, 25])
def test_a_fifth_more_empty_frames_than_there_are_lose_no_poses_or_are_named_first(slowest: int, tmp_path: Path) -> None:
    """30 frames are empty; 36 of a camera of 25/s beside the others of 30/s are 1.44 s."""
    filmed(tmp_path, [slowest, 30, 30], steps=14, until_s=8.0)
    found = []
    for background in ("first:1s", "first:36"):
        verdict = track(load_rig(tmp_path, "hybrid", background=background), tmp_path / "a.mcap").verdict
        assert verdict is not None
        lost = float(np.mean([one.lost for one in verdict.stretches] or [1.0]))
        found.append((lost, verdict.rating, [one.kind for one in verdict.reasons]))
    (before, rating, _), (after, its_rating, kinds) = found
    assert (after <= before + 0.05 and its_rating == rating) or kinds[:1] == ["not-empty"], found
