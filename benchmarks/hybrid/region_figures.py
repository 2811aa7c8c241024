"""The paper's figures by number of regions: reconstruction error of the prior, error of the tracker.  [Hybrid Fig. 4, 8]"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import (
    MOTIONS,
    PAPER_REGIONS,
    PRESET_NAMES,
    ProtocolErrors,
    case_of,
    errors_of,
    first_test_frame,
    frames_of,
    of_regions,
    runs_of,
    shipped_prior,
    take_prior,
)
from benchmarks.hybrid.paper_plots import Curve, CurvePanel, curve_panels
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import Run
from benchmarks.sections import Cell, Row, Table
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.prior.file import read_prior

COUNTS = (5, 10, 20, 40, 80)
REGION_VARIANTS = {"default": "preset default", "paper": "preset paper, least squares"}
MOTION_COLOURS = dict(zip(MOTIONS, ("tab:blue", "tab:orange", "tab:green"), strict=True))


def figure_4(bench: Bench, path: Path) -> Table:
    """Reconstruction error by number of regions."""
    rows: list[Row] = []
    panels = []
    for clip, motion in MOTIONS.items():
        curves = []
        training, _ = frames_of(bench.clip(clip))
        sources = {
            "first frames of the take": (take_prior(clip, training, "default"), "tab:blue"),
            "simulated people": (shipped_prior(clip, "default"), "tab:orange"),
        }
        for source, (name, colour) in sources.items():
            prior = read_prior(bench.priors.path(name), FOURTEEN_PARTS)
            counts = np.array([row.regions for row in prior.training.errors], dtype=np.float64)
            for part, style in (("training", "o-"), ("held out", "s--")):
                values = np.degrees([row.training if part == "training" else row.held for row in prior.training.errors])
                curves.append(Curve(f"{source}: {part}", counts, values, colour, style))
            rows += [
                (motion, source, row.regions, float(np.degrees(row.training)), float(np.degrees(row.held)))
                for row in prior.training.errors
            ]
        panels.append(
            CurvePanel(
                f"{motion}: {training} frames of the take", "error, RMS (°)", tuple(curves), last_label(clip, "regions M"),
                (5, 10, PAPER_REGIONS, 40, 80),
            )
        )  # fmt: skip
    curve_panels(path, "[Hybrid] Fig. 4: reconstruction error by regions", panels)
    return Table(
        "Fig. 4: reconstruction error, RMS, degrees", ("motion", "trained on", "M", "training", "held out"), tuple(rows)
    )


def figure_8(bench: Bench, path: Path) -> Table:
    """RMSE by number of regions."""
    cases = {
        (preset, clip, count): of_regions(
            case_of(clip, preset, "hybrid", KINDS[clip], "gauss-newton"), clip, count
        )
        for preset in PRESET_NAMES for clip in MOTIONS for count in COUNTS
    }  # fmt: skip
    runs = runs_of(bench, list(cases.values()))
    found = {key: clip_errors(bench, key[1], runs[case]).rmse for key, case in cases.items()}
    x = np.array(COUNTS, dtype=np.float64)
    means = {
        (preset, clip): np.array([found[preset, clip, count].mean for count in COUNTS])
        for preset in PRESET_NAMES for clip in MOTIONS
    }  # fmt: skip
    curve_panels(
        path,
        "[Hybrid] Fig. 8: RMSE by number of regions",
        [
            CurvePanel(
                title, "RMSE (mm)",
                tuple(
                    Curve(motion, x, means[preset, clip], MOTION_COLOURS[clip], "o-")
                    for clip, motion in MOTIONS.items()
                ),
                "regions M" if preset == PRESET_NAMES[-1] else "", COUNTS,
            )
            for preset, title in REGION_VARIANTS.items()
        ],
    )  # fmt: skip
    rows = []
    for preset in PRESET_NAMES:
        for clip, motion in MOTIONS.items():
            cells: tuple[Cell, ...] = tuple(
                cell for count in COUNTS for cell in (found[preset, clip, count].mean, found[preset, clip, count].worst)
            )
            rows.append((f"{motion}, {REGION_VARIANTS[preset]}", *cells))
    columns = tuple(cell for count in COUNTS for cell in (f"M = {count}", "worst"))
    return Table("Fig. 8: RMSE by number of regions, mm", ("motion", *columns), tuple(rows))


def clip_errors(bench: Bench, clip: str, runs: Sequence[Run]) -> ProtocolErrors:
    """Errors of runs on a clip's test frames."""
    whole = bench.clip(clip)
    return errors_of(whole.truth, first_test_frame(whole), runs)


def last_label(clip: str, label: str) -> str:
    """Label of the x axis, below the last panel only."""
    return label if clip == list(MOTIONS)[-1] else ""
