"""The reconstruction error by number of regions, drawn.  [Hybrid Fig. 4]"""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from services.tracker.prior.model import Prior


def draw_errors(path: Path, prior: Prior) -> None:
    """Write a picture in the format of `path`'s suffix.  Raises OSError."""
    rows = prior.training.errors
    regions = [row.regions for row in rows]
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(regions, np.degrees([row.training for row in rows]), "o-", label="training")
    axes.plot(regions, np.degrees([row.held for row in rows]), "s--", label="held out")
    axes.axvline(prior.regions, color="grey", linewidth=0.8, label=f"this prior: {prior.regions}")
    axes.set(xlabel="regions M", ylabel="reconstruction error, RMS (degrees)", ylim=(0, None))
    axes.set_title(", ".join(prior.training.motions[:3]) + (" ..." if len(prior.training.motions) > 3 else ""))
    axes.legend()
    figure.savefig(path, dpi=150)
