"""Tables I and II on simulated people, with the paper's numbers of training and test frames.  [Hybrid VI, VII]"""

from itertools import product

import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import (
    METHODS,
    PAPER_RMSE_MM,
    PRESET_NAMES,
    ProtocolErrors,
    case_of,
    errors_of,
    take_prior,
)
from benchmarks.hybrid.figures import figure, with_worst
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Cell, Row, Section, Table
from benchmarks.simulated_clip import CYCLES, TEST_FRAMES, TRAINING_FRAMES
from zenocap.services.tracker.states import Method

PEOPLE = (120, 121, 122)  # random seeds; no shipped prior was trained with them


def people(bench: Bench) -> Section:
    wanted = {
        (preset, method, motion, person): _case(preset, method, f"{motion}-{person}")
        for preset in PRESET_NAMES
        for method in METHODS
        for motion in CYCLES
        for person in PEOPLE[: bench.seeds]
    }
    runs = bench.runs(list(wanted.values()), seeds=1)
    found: dict[Case, ProtocolErrors] = {}
    for motion, person in product(CYCLES, PEOPLE[: bench.seeds]):
        film = bench.film(f"{motion}-{person}")
        for case in wanted.values():
            if case.clip == f"{motion}-{person}":
                found[case] = errors_of(film.truth, film.motion_from + TRAINING_FRAMES, runs[case])
    rows: list[Row] = []
    for preset, method in dict.fromkeys(key[:2] for key in wanted):
        cells: list[Cell] = []
        lost: list[str] = []
        for k, motion in enumerate(CYCLES):
            each = [found[case] for key, case in wanted.items() if key[:3] == (preset, method, motion)]
            rmse = figure([one.rmse.mean for one in each])
            angles = figure([one.angles.mean for one in each])
            cells += [with_worst(rmse), with_worst(angles), f"{PAPER_RMSE_MM[method][k]:.1f}"]
            lost.append(f"{np.mean([one.lost.mean for one in each]):.1f}")
        rows.append((preset, method, *cells, ", ".join(lost)))
    columns = tuple(cell for motion in CYCLES for cell in (f"{motion}, mm", "angles °", "paper, mm"))
    frames = ", ".join(f"{TEST_FRAMES[motion]} ({motion})" for motion in CYCLES)
    return Section(
        "people",
        "Tables I and II on simulated people",
        (
            f"{len(PEOPLE[: bench.seeds])} people, the worst in brackets; seven views of 320x240 at 60 frames/s, exact "
            f"silhouettes with ragged edges.  As in the paper the first {TRAINING_FRAMES} frames of a film train the prior "
            f"and the others are the test: {frames}.  The people's joint centres are not those of the model's body.",
        ),
        (Table("RMSE on the test frames", ("preset", "method", *columns, "lost %: w, r, b"), tuple(rows)),),
    )


def _case(preset: str, method: Method, clip: str) -> Case:
    return case_of(clip, preset, method, take_prior(clip, TRAINING_FRAMES, preset))
