"""The table of losses: each count once, numbers and totals as a user reads them."""

from zenocap.common.observe.losses import EXPORTED, LOSSES, SUMMED, described, lost


def test_each_count_has_one_row() -> None:
    names = [one.name for one in LOSSES]
    assert len(set(names)) == len(names)


def test_what_is_normal_or_unknown_is_no_loss() -> None:
    assert lost({"dropped_superseded": 7, "late_answers": 2, "frames": 90, "dropped_frames": 3, "log_lost": 1}) == 4
    assert set(SUMMED) < set(EXPORTED)


def test_losses_are_described_with_their_totals() -> None:
    counts = {"frames": 90, "dropped_frames": 4, "skipped_frames": 6, "step_errors": 1, "rejected_invalid": 0, "other": 3}
    assert described(counts) == [
        ("dropped_frames", "camera frames dropped", 4, 100),
        ("skipped_frames", "camera frames skipped under overload", 6, 100),
        ("step_errors", "steps failed", 1, 0),
    ]
