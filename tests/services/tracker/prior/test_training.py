"""Number of regions, chosen on held-out motion.  [Hybrid Fig. 4]"""

import numpy as np
import pytest

from tests.support.prior_cases import COORDINATES, D, gait, reconstruction_error
from zenocap.common.errors import UserError
from zenocap.services.tracker.prior.model import Reconstruction
from zenocap.services.tracker.prior.training import TrainingMotion, TrainingPlan, choose_regions, prepare, train

SHORT = TrainingPlan(candidates=(3, 6, 12))
MOTIONS = [TrainingMotion(f"gait{k}", 60.0, gait(240, k)) for k in range(2)]


@pytest.mark.slow
def test_prior_of_a_gait_reconstructs_another_walk_of_it() -> None:
    prior = train(COORDINATES, MOTIONS, [], SHORT)
    assert prior.names == COORDINATES.names
    assert np.degrees(reconstruction_error(prior, gait(200, seed=9))) < 2.0
    assert prior.training.frames == 2 * 2 * 240
    assert prior.training.distances[0] < prior.training.distances[1] < prior.training.distances[2]
    assert np.allclose(prior.transitions.sum(axis=1), 1.0)
    assert prior.occupancy.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_held_out_files_are_not_used() -> None:
    held = [TrainingMotion("other", 60.0, gait(100, seed=5) + 0.3)]
    prior = train(COORDINATES, MOTIONS, held, SHORT)
    assert prior.training.held == ("other",)
    assert prior.training.frames == 2 * 2 * 240
    assert all(row.held > 3 * row.training for row in prior.training.errors)


def test_least_number_of_regions_within_the_tolerance_is_chosen() -> None:
    rows = [Reconstruction(5, 0.5, 0.6), Reconstruction(10, 0.3, 0.31), Reconstruction(20, 0.2, 0.3)]
    assert choose_regions(rows) == 10


def test_regions_are_limited_by_the_frames() -> None:
    prior = train(COORDINATES, [TrainingMotion("short", 60.0, gait(60))], [], TrainingPlan(mirror=False))
    assert max(row.regions for row in prior.training.errors) <= 48 // 5


@pytest.mark.nightly
def test_hundred_frames_allow_twenty_regions() -> None:
    prior = train(COORDINATES, [TrainingMotion("first", 60.0, gait(100))], [], TrainingPlan(regions=20))
    assert 15 <= prior.regions <= 20  # those without poses are left out


@pytest.mark.nightly
def test_same_seed_gives_the_same_prior_and_progress_is_reported_to_the_end() -> None:
    reports: list[tuple[int, int]] = []
    one, other = (train(COORDINATES, MOTIONS, [], SHORT, lambda done, of, _: reports.append((done, of))) for _ in range(2))
    assert one.centres.tobytes() == other.centres.tobytes()
    assert one.training == other.training
    assert reports[:5] == [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4)]


def test_frames_without_a_pose_split_the_motion_and_mirroring_doubles_it() -> None:
    poses = gait(100)
    poses[40] = np.nan
    runs = prepare(COORDINATES, [TrainingMotion("cut", 60.0, poses)], TrainingPlan())
    assert [len(run) for run in runs] == [40, 59, 40, 59]


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (TrainingMotion("flat", 60.0, np.zeros((9, D - 1))), f"flat: poses of shape .*: allowed: {D} coordinates of four"),
        (TrainingMotion("lost", 60.0, np.full((9, D), np.nan)), "lost: 9 frames, no two with poses: allowed: two or more"),
        (TrainingMotion("brief", 60.0, gait(8)), "training frames: allowed: 25 or more at 60/s, for 5 regions"),
    ],
)
def test_error_names_the_unusable_motion(motion: TrainingMotion, words: str) -> None:
    with pytest.raises(UserError, match=words):
        train(COORDINATES, [motion], [], TrainingPlan())


@pytest.mark.parametrize("wrong", [{"dims": 0}, {"dims": 11}, {"rate": 0.0}, {"rate": np.nan}, {"regions": 0}])
def test_plans_out_of_range_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(UserError, match=f"{next(iter(wrong))} = .*: allowed: 1 to"):
        TrainingPlan(**wrong)
