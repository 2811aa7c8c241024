"""Lags that the verdict states, on takes without a fault whose silhouettes of one view are stamped late or early."""

from collections.abc import Sequence

import msgspec
import numpy as np

from benchmarks.table import Cell
from benchmarks.verdict.takes import FPS, FaultyTake
from zenocap.common import messages as m
from zenocap.tools.verdict.evidence import TakeEvidence, evidence_of
from zenocap.tools.verdict.view_lag import view_lags

SHIFTS_S = (0.0, 0.2, -0.5, 1.0)
COLUMNS = ("lag s", "takes", "right", "median error ms", "worst ms", "wrong", "not stated")
RIGHT_S = 0.5 / FPS


def shifted(take: FaultyTake, view: str, shift_s: float) -> TakeEvidence:
    """Evidence of a take in which one view's video began `shift_s` later than its times say."""
    shift_ns = round(1e9 * shift_s)
    return evidence_of(
        msgspec.structs.replace(one, captured_ns=one.captured_ns - shift_ns)
        if isinstance(one, m.Silhouette) and one.viewer == view
        else one
        for one in take.messages
    )


def lag_rows(takes: Sequence[FaultyTake]) -> list[list[Cell]]:
    """One row for each shift; every take has another late view."""
    rows: list[list[Cell]] = []
    for shift_s in SHIFTS_S:
        errors: list[float] = []
        wrong = silent = 0
        for k, take in enumerate(takes):
            views = sorted({one.viewer for one in take.messages if isinstance(one, m.CameraInfo)})
            view = views[1 + k % (len(views) - 1)]
            found = view_lags(shifted(take, view, shift_s))
            if found is None:
                silent += 1
            elif list(found.views) == [view] and abs(found.views[view] - shift_s) <= RIGHT_S and shift_s:
                errors.append(1000 * abs(found.views[view] - shift_s))
            else:
                wrong += 1
        known: list[Cell] = [round(float(np.median(errors)), 1), round(max(errors), 1)] if errors else ["-", "-"]
        rows.append([f"{shift_s:+.1f}", len(takes), len(errors), *known, wrong, silent])
    return rows
