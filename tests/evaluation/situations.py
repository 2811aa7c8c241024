"""The limb searches of the running tracker, kept as they were so that others can be measured on them."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

from common.body.anatomy import Floats
from services.viewer.body_fit import BodyModel
from services.viewer.limb_fit import FREE, LimbFit
from services.viewer.limb_search import LimbBody, Picture, full_search, tri_tree
from tests.evaluation.loop import track_film
from tests.evaluation.takes import Take, film

Found = tuple[float, float, int]  # best turn in radians, its score, matchings


@dataclass(frozen=True)
class Situation:
    """One search of limb `limb` about to begin; the picture's cover is without that limb.

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
    picture: Picture

    def tri_tree(self) -> Found:
        return tri_tree(self.directions[self.limb], self.axis, self.what, self.region, -FREE, FREE, self.body, self.picture)

    def full_search(self, step: float) -> Found:
        start = self.directions[self.limb]
        return full_search(start, self.axis, self.what, self.region, -FREE, FREE, step, self.body, self.picture)


@contextmanager
def recording(every: int) -> Iterator[list[Situation]]:
    """A list that grows by every `every`-th tri-tree search made while it is open."""
    kept: list[Situation] = []
    turn, count = LimbFit.turn, 0

    def noted(search: LimbFit, what: int, region: float, axis: Floats | None = None) -> None:
        nonlocal count
        if count % every == 0:
            kept.append(_situation(search, what, region, search.axis if axis is None else axis))
        count += 1
        turn(search, what, region, axis)

    with patch.object(LimbFit, "turn", noted):
        yield kept


def _situation(search: LimbFit, what: int, region: float, axis: Floats) -> Situation:
    fit, seen = search.fit, search.fit.picture
    directions = fit.directions.copy()
    directions[search.k] = search.directions
    picture = Picture(seen.torso_to_world.copy(), seen.camera, seen.mask.copy(), seen.cover.copy(), seen.totals.copy())
    body = LimbBody(search.body.origin.copy(), search.body.sizes, search.body.is_leg, search.body.expected.copy())
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
        picture=picture,
    )


def record(chosen: Iterable[Take], folder: Path | None, every: int) -> list[Situation]:
    """Every `every`-th search while these takes are tracked."""
    with recording(every) as kept:
        for take in chosen:
            track_film(film(take, folder), take.fps)
    return kept
