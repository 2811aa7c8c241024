"""Confusion of postures, drawn."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from services.recognizer.protocols import Outcome

TITLES = {"paper": "the paper's protocol", "subjects": "leave-subjects-out"}


def draw_confusion(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Write a picture in the format of `path`'s suffix: a matrix for each outcome, rows true.  Raises OSError."""
    count = len(outcomes[0].labels)
    side = 2.5 + 0.32 * count
    figure = Figure(figsize=(len(outcomes) * side, side), layout="constrained")
    FigureCanvasAgg(figure)
    for at, outcome in enumerate(outcomes):
        axes = figure.add_subplot(1, len(outcomes), at + 1)
        confusion, tested = outcome.confusion, outcome.tested
        axes.imshow(confusion / np.maximum(tested, 1)[:, None], cmap="Blues", vmin=0.0, vmax=1.0)
        for true, given in zip(*np.nonzero(confusion), strict=True):
            dark = 2 * confusion[true, given] > tested[true]
            axes.text(
                given,
                true,
                str(confusion[true, given]),
                ha="center",
                va="center",
                color="white" if dark else "black",
                size=8,
            )
        axes.set_xticks(range(count), outcome.labels, rotation=90, size=8)
        axes.set_yticks(range(count), outcome.labels if at == 0 else [""] * count, size=8)
        axes.set(xlabel="recognised as", ylabel="posture" if at == 0 else "")
        axes.set_title(f"{TITLES[outcome.protocol]}: {outcome.right} of {outcome.total}", size=10)
    figure.savefig(path, dpi=150)
