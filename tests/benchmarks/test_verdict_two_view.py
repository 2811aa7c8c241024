"""Two-view takes of the verdict's benchmark."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.cases.verdict.faults import FaultyScene
from benchmarks.cases.verdict.takes import two_view_messages
from benchmarks.people.simulated_clips import SIZE, cameras_of
from zenocap.common import messages as m
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import posture_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.verdict import verdict_of

FPS, FRAMES = 15.0, 80


@cache
def scene() -> FaultyScene:
    subject, cameras = person(4), cameras_of(2)
    timeline = posture_timeline(subject, "raise-both-arms", 1)
    poses = [timeline.pose_at(k / FPS) for k in range(FRAMES)]
    masks = {}
    for view, camera in cameras.items():
        film = SimulatedCamera(camera, subject, 4)
        masks[view] = [
            np.zeros(SIZE[::-1], np.uint8) if pose is None else (film.silhouette(pose) != 0).astype(np.uint8)
            for pose in poses
        ]
    return FaultyScene(cameras, masks, {}, FRAMES, FPS)


@pytest.mark.nightly
def test_two_view_tracks_the_silhouettes_of_a_scene() -> None:
    messages = two_view_messages(scene())
    assert any(isinstance(one, m.UniversalBdp) for one in messages)
    poses = [one for one in messages if isinstance(one, m.UniversalBap)]
    assert len(poses) > 20
    assert [one.frame for one in poses] == sorted(one.frame for one in poses)
    verdict = verdict_of(evidence_of(messages))
    assert verdict.evidence == "two-view"
    assert verdict.error < 0.2


@pytest.mark.nightly
def test_without_a_person_there_is_no_pose() -> None:
    empty = {view: [np.zeros_like(mask) for mask in masks] for view, masks in scene().masks.items()}
    messages = two_view_messages(replace(scene(), masks=empty))
    assert not any(isinstance(one, m.UniversalBap) for one in messages)
    assert verdict_of(evidence_of(messages)).rating == "unusable"
