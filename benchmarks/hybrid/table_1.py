"""Training and test frames of every motion, and the errors on the test frames.  [Hybrid Table I]"""

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import (
    MOTIONS,
    PAPER_RMSE_MM,
    PAPER_TEST_FRAMES,
    PAPER_TRAINING_FRAMES,
    PRESET_NAMES,
    case_of,
    errors_of,
    first_test_frame,
    frames_of,
    runs_of,
    shipped_prior,
    take_prior,
)
from benchmarks.hybrid.figures import with_worst
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Row, Section, Table
from zenocap.services.tracker.prior.file import read_prior

SAME_TAKE, SHIPPED = "same take", "shipped"


def table_1(bench: Bench) -> Section:
    wanted: dict[tuple[str, str, str], Case] = {}
    for clip in MOTIONS:
        training, _ = frames_of(bench.clip(clip))
        for preset in PRESET_NAMES:
            wanted[clip, preset, SAME_TAKE] = case_of(clip, preset, "hybrid", take_prior(clip, training, preset))
            wanted[clip, preset, SHIPPED] = case_of(clip, preset, "hybrid", shipped_prior(clip, preset))
    runs = runs_of(bench, list(wanted.values()))
    rows: list[Row] = []
    for (clip, preset, source), case in wanted.items():
        whole = bench.clip(clip)
        found = errors_of(whole.truth, first_test_frame(whole), runs[case])
        prior = read_prior(bench.priors.path(case.prior, case.anatomy), case.anatomy)
        training = prior.training.frames // (2 if prior.training.mirrored else 1)
        rows.append(
            (f"{MOTIONS[clip]} (`{clip}`)", preset, source, prior.regions, training, frames_of(whole)[1],
             with_worst(found.rmse), with_worst(found.shape), with_worst(found.lost), with_worst(found.angles))
        )  # fmt: skip
    paper: tuple[Row, ...] = tuple(
        (motion, PAPER_TRAINING_FRAMES, PAPER_TEST_FRAMES[clip], PAPER_RMSE_MM["hybrid"][k])
        for k, (clip, motion) in enumerate(MOTIONS.items())
    )
    return Section(
        "table-1",
        "Training and test sets (Table I)",
        (
            f"{bench.seeds} seeds, the worst in brackets; seven views, 40 particles.  Same take: the prior is trained on "
            f"the first {PAPER_TRAINING_FRAMES} frames of motion of the clip's truth, or on half of a shorter clip.  "
            "Shipped: trained on simulated people.  All errors are of the later frames of the clip, the test frames.  "
            "Training frames are doubled by mirroring.  Shape: RMSE without each joint's constant offset.  Lost: joints "
            "without an estimate, or more than 250 mm off.  Angles: RMSE of flexion and adduction of the hips, flexion of "
            "knees and elbows, elevation of the arms.",
        ),
        (
            Table(
                "Table I and the errors on the test frames",
                ("motion", "preset", "prior", "M", "training frames", "test frames", "RMSE mm", "shape mm", "lost %",
                 "angles °"),
                tuple(rows),
            ),
            Table("The paper (HumanEva)", ("motion", "training frames", "test frames", "RMSE mm"), paper),
        ),
    )  # fmt: skip
