"""Knowledge of a body's sizes: what postures add to it, against the one big solve with all poses free."""

from dataclasses import replace

import numpy as np
import pytest

from common.body.anatomy import FOURTEEN_PARTS, Floats
from common.body.definition import Bdp
from services.tracker.closest import Singles
from services.tracker.knowledge import CHANGED, MOST, NEW, POSE, Knowledge, beginning, improved, is_new, learnt
from services.tracker.linkage import ROOT
from services.tracker.measuring import equations
from services.tracker.model import model_of
from services.tracker.posed import Posed
from services.tracker.sizes import COUNT, SPREADS, entries_of, scaled, values_of
from services.tracker.stature import average_body
from tests.tracker_scenes import moved, tangent_rays, upright

ANATOMY = FOURTEEN_PARTS
AVERAGE = average_body(ANATOMY, 1.75)
LOGS = np.random.default_rng(3).normal(scale=0.3 * SPREADS)
BODY = scaled(ANATOMY, AVERAGE, LOGS)
EFFECTIVE = 80.0


def postures(body: Bdp, many: int) -> list[tuple[Posed, Singles]]:
    """Where the tracker found a body of these sizes, and what it saw."""
    model = model_of(ANATOMY, body)
    poses = [upright(ANATOMY, seed, spread=0.6) for seed in range(many)]
    rng = np.random.default_rng(1)
    return [(moved(pose, rng, 0.003, 0.01), tangent_rays(model, pose, 300, n)) for n, pose in enumerate(poses)]


def normal(knowledge: Knowledge, pose: Posed, rays: Singles) -> tuple[Floats, Floats]:
    """Normal equations of one posture in sizes and pose, the pose's own spread included."""
    body = scaled(ANATOMY, knowledge.average, knowledge.logs)
    dof = ROOT + len(pose.values)
    a, b = np.zeros((COUNT + dof, COUNT + dof)), np.zeros(COUNT + dof)
    equations(
        model_of(ANATOMY, body), entries_of(ANATOMY), values_of(ANATOMY, body),
        pose.position, pose.rotation, pose.values, rays, a, b,
    )  # fmt: skip
    a, b = a * EFFECTIVE / rays.shape[1], b * EFFECTIVE / rays.shape[1]
    held = np.repeat(POSE, [3, 3, dof - ROOT])
    a[COUNT:, COUNT:] += np.diag(1.0 / held**2)
    return a, b


def test_postures_learnt_one_by_one_say_what_one_solve_with_all_poses_says() -> None:
    """Schur complements: marginalising every pose when it comes changes nothing."""
    seen = postures(BODY, 3)
    knowledge = beginning(AVERAGE, 0.5 * LOGS)
    for pose, rays in seen:
        knowledge = learnt(ANATOMY, knowledge, rays, pose, EFFECTIVE)
    dof = ROOT + len(seen[0][0].values)
    whole, pull = np.zeros((COUNT + 3 * dof, COUNT + 3 * dof)), np.zeros(COUNT + 3 * dof)
    whole[:COUNT, :COUNT] = np.diag(1.0 / SPREADS**2)
    pull[:COUNT] = -knowledge.logs / SPREADS**2  # towards the average, from the body in use
    for n, (pose, rays) in enumerate(seen):
        a, b = normal(knowledge, pose, rays)
        rows = np.r_[0:COUNT, COUNT + n * dof : COUNT + (n + 1) * dof]
        whole[np.ix_(rows, rows)] += a
        pull[rows] += b
    step = np.linalg.solve(whole, pull)[:COUNT]
    assert np.linalg.solve(knowledge.information, knowledge.pull) == pytest.approx(knowledge.logs + step, abs=1e-7)
    certain = np.linalg.inv(whole)[:COUNT, :COUNT]
    assert np.linalg.inv(knowledge.information) == pytest.approx(certain, abs=1e-9)


def test_every_posture_makes_the_sizes_more_certain() -> None:
    knowledge = beginning(AVERAGE, np.zeros(COUNT))
    for pose, rays in postures(BODY, 4):
        more = learnt(ANATOMY, knowledge, rays, pose)
        assert np.linalg.eigvalsh(more.information - knowledge.information).min() > -1e-6
        knowledge = more
    spread = np.sqrt(np.diag(np.linalg.inv(knowledge.information)))
    assert np.all(spread <= SPREADS * (1 + 1e-9))
    assert spread[0] < 0.2 * SPREADS[0]
    assert np.array_equal(knowledge.logs, np.zeros(COUNT))


def test_the_sizes_come_nearer_to_the_persons() -> None:
    knowledge = beginning(AVERAGE, np.zeros(COUNT))
    for pose, rays in postures(BODY, 8):
        knowledge = learnt(ANATOMY, knowledge, rays, pose)
    better = improved(ANATOMY, knowledge)
    assert better is not None
    known, body = better
    assert np.array_equal(body.sizes, scaled(ANATOMY, AVERAGE, known.logs).sizes)
    before, after = np.abs(AVERAGE.offsets - BODY.offsets).sum(), np.abs(body.offsets - BODY.offsets).sum()
    assert after < 0.6 * before


def test_the_body_does_not_move_when_nothing_new_is_seen() -> None:
    knowledge = beginning(AVERAGE, np.zeros(COUNT))
    assert improved(ANATOMY, knowledge) is None
    pose, rays = postures(AVERAGE, 1)[0]
    true = upright(ANATOMY, 0, spread=0.6)
    knowledge = learnt(ANATOMY, knowledge, rays, true)
    assert improved(ANATOMY, knowledge) is None  # it is as it was thought to be
    assert not is_new(knowledge, true)
    assert not is_new(knowledge, pose)


def test_a_posture_is_new_when_one_joint_is_far_from_all_known_ones() -> None:
    pose = upright(ANATOMY, 0)
    knowledge = replace(beginning(AVERAGE, LOGS), postures=(pose.values,))
    assert is_new(beginning(AVERAGE, LOGS), pose)
    for by, new in ((0.9 * NEW, False), (1.1 * NEW, True)):
        there = pose.copy()
        there.values[4] += by
        assert is_new(knowledge, there) is new
    full = replace(knowledge, postures=(pose.values,) * MOST)
    assert not is_new(full, upright(ANATOMY, 5, spread=1.0))


def test_a_change_too_small_is_no_change() -> None:
    knowledge = beginning(AVERAGE, np.zeros(COUNT))
    for size, changes in ((0.5 * CHANGED, False), (2.0 * CHANGED, True)):
        pulled = replace(knowledge, pull=knowledge.information @ np.full(COUNT, size))
        assert (improved(ANATOMY, pulled) is not None) is changes
