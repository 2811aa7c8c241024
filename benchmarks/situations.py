"""Limb searches of the running tracker, recorded so that other searches can be measured on them."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.loop import track_film
from benchmarks.takes import Take, film
from zenocap.common.arrays import Floats
from zenocap.services.viewer.body_fit import BodyModel
from zenocap.services.viewer.limb_fit import LimbFit
from zenocap.services.viewer.limb_search import CoverImage, LimbBody, full_search, tri_tree

SearchResult = tuple[float, float, int]  # best turn in radians, its score, matchings


@dataclass(frozen=True)
class Situation:
    """Input of one search of limb `limb`; the image's cover is without that limb.

    directions: (4, 2, 3) of all limbs.  axis: (3,) and region, radians: of the search.  what: see `limb_search`.
    """

    model: BodyModel
    position: Floats
    torso_to_world: Floats
    directions: Floats
    limb: int
    body: LimbBody
    axis: Floats
    what: int
    region: float
    image: CoverImage

    def tri_tree(self) -> SearchResult:
        return tri_tree(self.directions[self.limb], self.axis, self.what, self.region, self.body, self.image)

    def full_search(self, step: float) -> SearchResult:
        start = self.directions[self.limb]
        return full_search(start, self.axis, self.what, self.region, step, self.body, self.image)


@contextmanager
def recording(every: int) -> Iterator[list[Situation]]:
    """Context whose list receives every `every`-th tri-tree search."""
    situations: list[Situation] = []
    original, count = LimbFit.search, 0

    def recorded_search(search: LimbFit, what: int, region: float, axis: Floats | None = None) -> None:
        nonlocal count
        if count % every == 0:
            situations.append(_situation(search, what, region, search.axis if axis is None else axis))
        count += 1
        original(search, what, region, axis)

    with patch.object(LimbFit, "search", recorded_search):
        yield situations


def _situation(search: LimbFit, what: int, region: float, axis: Floats) -> Situation:
    fit, cover_image = search.fit, search.fit.image
    directions = fit.directions.copy()
    directions[search.k] = search.directions
    image = CoverImage(
        cover_image.torso_to_world.copy(),
        cover_image.camera,
        cover_image.mask.copy(),
        cover_image.cover.copy(),
        cover_image.totals.copy(),
    )
    body = LimbBody(search.body.origin.copy(), search.body.sizes, search.body.is_leg)
    return Situation(
        model=fit.model,
        position=fit.position.copy(),
        torso_to_world=fit.torso_to_world.copy(),
        directions=directions,
        limb=search.k,
        body=body,
        axis=np.array(axis),
        what=what,
        region=region,
        image=image,
    )


def record(chosen: Iterable[Take], folder: Path | None, every: int) -> list[Situation]:
    """Every `every`-th search of tracking these takes."""
    with recording(every) as situations:
        for take in chosen:
            track_film(film(take, folder), take.fps)
    return situations
