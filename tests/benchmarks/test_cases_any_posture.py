"""Starts without a T-pose: films of people on the floor, and how far tracks are apart."""

import numpy as np
import pytest

from benchmarks.cases.any_posture import film_poses, spread
from tests.support.floor_people import FLOOR
from zenocap.simulation.body.person import person
from zenocap.simulation.body.surface import rest_surface, skin
from zenocap.simulation.ground_truth import truth


@pytest.mark.parametrize("name", FLOOR)
def test_person_is_on_the_floor_then_stands_in_the_heading(name: str) -> None:
    subject = person(3)
    low, *_, up = film_poses(subject, name, 0.7)
    lying, standing = (skin(rest_surface(subject), subject, pose)[0][:, 1] for pose in (low, up))
    assert lying.min() == pytest.approx(0.0, abs=1e-9)
    assert lying.max() < 0.78 * standing.max()
    assert truth(subject, up).yaw == pytest.approx(0.7, abs=0.05)


def test_tracks_are_as_far_apart_as_from_their_mean_in_frames_that_all_have() -> None:
    found = np.zeros((2, 3, 15, 3))
    found[1, :2, :, 0] = 0.02
    assert spread(found) == pytest.approx(20.0 / 3.0)
    found[0, 2] = np.nan
    assert spread(found) == pytest.approx(10.0)
    found[1] = np.nan
    assert np.isnan(spread(found))
