"""The `[tracker]` table of a rig: how the tracker works, and which prior of motion it has.  [Hybrid]

What it refers to is looked up here too: a prior is a file beside the rig, or one of those that come with the project.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from common.body.anatomy import ANATOMIES, FOURTEEN_PARTS

# What a method has where nobody says otherwise: one particle is the image force alone.  [Hybrid Table II]
PARTICLES = {"hybrid": 40, "image-force": 1, "particle-filter": 1000}
REFINEMENTS = {"hybrid": "gauss-newton", "image-force": "force", "particle-filter": "gauss-newton"}
# Forces come to rest slowly: `tests.evaluation` shows how slowly.
ITERATIONS = {"gauss-newton": 4, "force": 40, "force-printed": 100}
PRIORS = Path(__file__).resolve().parents[2] / "deploy" / "priors"
SUFFIX = ".prior"

Particles = Annotated[int, Meta(ge=1, le=20_000)]
Points = Annotated[int, Meta(ge=20, le=10_000)]
Iterations = Annotated[int, Meta(ge=0, le=100)]
Seed = Annotated[int, Meta(ge=0, le=2**31 - 1)]


class TrackerTable(msgspec.Struct, frozen=True, kw_only=True):
    """prior: a file relative to the rig, or the name of one that comes with the project; none: dynamics alone.

    particles: default by method.  points: of the visual hull in every frame.  refinement: default by method.
    iterations: of the refinement, which decides the default.
    """

    prior: str | None = None
    particles: Particles | None = None
    points: Points = 400
    iterations: Iterations | None = None
    seed: Seed = 0
    anatomy: str = FOURTEEN_PARTS.name
    refinement: str | None = None


@dataclass(frozen=True)
class TrackerSpec:
    """A tracker's table with everything decided.  prior: file, None to go without."""

    prior: Path | None
    particles: int
    points: int
    iterations: int
    seed: int
    anatomy: str
    refinement: str


@dataclass(frozen=True)
class Wanted:
    """What the command line says instead of a rig's tracker table; None leaves it.  prior: relative to where it runs."""

    prior: str | None = None
    particles: int | None = None
    points: int | None = None
    iterations: int | None = None
    refinement: str | None = None
    seed: int | None = None


class TrackerError(ValueError):
    """The text is the key with its value, and what is allowed."""


def tracker_spec(table: TrackerTable, method: str, own: bool, base: Path, *, files: bool = True) -> TrackerSpec:
    """What a table in the folder `base` means for a method.  Raises TrackerError.

    own: the method is the rig's own; the number of particles in the table is for that one.  files: see `load_rig`.
    """
    if table.anatomy not in ANATOMIES:
        raise TrackerError(f"anatomy = {table.anatomy!r}: allowed: {', '.join(ANATOMIES)}")
    refinement = _known(REFINEMENTS[method] if table.refinement is None else table.refinement)
    iterations = ITERATIONS[refinement] if table.iterations is None else table.iterations
    prior = None if table.prior is None else find_prior(table.prior, base, must_be=files)
    particles = table.particles if own and table.particles is not None else PARTICLES[method]
    spec = TrackerSpec(prior, particles, table.points, iterations, table.seed, table.anatomy, refinement)
    return _checked(spec, method)


def find_prior(text: str, base: Path, *, must_be: bool = True) -> Path:
    """The prior that comes with the project under that name, or else the file in the folder `base`.

    must_be: raise TrackerError when there is neither.  A file that has the name of such a prior is meant by ./NAME.
    """
    shipped, own = PRIORS / f"{text}{SUFFIX}", base / text
    if "/" not in text and shipped.is_file():
        return shipped
    if must_be and not own.is_file():
        names = ", ".join(sorted(path.stem for path in PRIORS.glob(f"*{SUFFIX}"))) or "none come with this version"
        raise TrackerError(f"prior = {text!r}: no file {own}; allowed: a file, or a name of: {names}")
    return own


def chosen(spec: TrackerSpec, method: str, wanted: Wanted) -> TrackerSpec:
    """The spec with what is wanted instead.  Another refinement has its own default of iterations.  Raises TrackerError."""
    if wanted.refinement is not None:
        spec = replace(spec, iterations=ITERATIONS[_known(wanted.refinement)])
    prior = None if wanted.prior is None else find_prior(wanted.prior, Path())
    given = {name: value for name, value in vars(wanted).items() if value is not None and name != "prior"}
    return _checked(replace(spec, prior=prior or spec.prior, **given), method)


def _known(refinement: str) -> str:
    if refinement not in ITERATIONS:
        raise TrackerError(f"refinement = {refinement!r}: allowed: {', '.join(ITERATIONS)}")
    return refinement


def _checked(spec: TrackerSpec, method: str) -> TrackerSpec:
    if method == "image-force" and spec.particles != 1:
        raise TrackerError(f"particles = {spec.particles}: allowed: 1 for method 'image-force', which has no others")
    return spec
