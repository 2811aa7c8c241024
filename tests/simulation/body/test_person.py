"""People by seed: repeatable, different, and within human proportions."""

import numpy as np
import pytest

from zenocap.simulation.body.person import person
from zenocap.simulation.body.skeleton import FOREARM, HEAD, PELVIS, SHANK, THIGH, UPPER_ARM, rest_bones
from zenocap.simulation.body.surface import rest_surface

SEEDS = range(60)
each_person = pytest.mark.parametrize("seed", SEEDS[::7])


def test_equal_seeds_give_equal_people() -> None:
    assert person(5) == person(5)
    assert person(5) != person(6)


def test_people_differ_in_age_height_proportions_girth_and_colour() -> None:
    people = [person(s) for s in SEEDS]
    heights = np.array([p.height for p in people])
    assert heights.min() < 1.40
    assert heights.max() > 1.85
    assert {p.age is None for p in people} == {True, False}
    for ratios in (
        [p.lengths.torso / p.height for p in people],
        [p.lengths.upper_arm / p.height for p in people],
        [p.lengths.shoulder_half / p.lengths.hip_half for p in people],
        [p.girths.waist[0] / p.height for p in people],
    ):
        assert np.std(ratios) / np.mean(ratios) > 0.03
    assert len({p.clothing.shirt_bgr for p in people}) == len(people)
    assert {p.clothing.skirt > 0 for p in people} == {True, False}


@each_person
def test_proportions_are_human_and_add_up_to_the_height(seed: int) -> None:
    subject = person(seed)
    size, height = subject.lengths, subject.height
    leg = size.ankle_height + size.shank + size.thigh
    assert leg + size.torso + size.head_top == pytest.approx(height)
    heights = rest_surface(subject).points[:, 1]
    assert (heights.min(), heights.max()) == (pytest.approx(0.0, abs=0.002), pytest.approx(height, abs=0.002))
    assert 0.44 < leg / height < 0.60
    assert 0.28 < (size.upper_arm + size.forearm) / height < 0.37
    assert 1.4 < size.shoulder_half / size.hip_half < 2.6
    assert subject.girths.chest[0] < size.shoulder_half + 0.02
    assert size.hip_half + 0.3 * subject.girths.thigh < subject.girths.hips[0]


@each_person
def test_skinning_weights_of_every_point_sum_to_one(seed: int) -> None:
    surface = rest_surface(person(seed))
    assert np.allclose(surface.weights.sum(axis=1), 1.0)
    assert surface.weights.min() >= 0.0
    assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1.0)


def test_normals_point_outwards_on_both_arms() -> None:
    subject = person(3)
    surface, bones = rest_surface(subject), rest_bones(subject)
    for side in (0, 1):
        on_arm = surface.weights[:, UPPER_ARM[side]] > 0.99
        radial = (surface.points - bones.origin[UPPER_ARM[side]])[on_arm] * [1.0, 0.0, 1.0]
        assert np.all(np.einsum("ij,ij->i", radial, surface.normals[on_arm]) > 0.0)


def test_rest_joints_are_mirrored() -> None:
    bones = rest_bones(person(1))
    for right, left in (UPPER_ARM, FOREARM, THIGH, SHANK):
        assert np.allclose(bones.origin[right] * [-1.0, 1.0, 1.0], bones.origin[left])
    assert bones.origin[HEAD, 1] > bones.origin[PELVIS, 1]
