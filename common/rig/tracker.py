"""The `[tracker]` table of a rig: settings of the tracker, and its motion prior.  [Hybrid]

A preset is a set of defaults: `default`, or `paper`, the method as printed but for what docs/papers.md calls corrected,
open or always.  Also finds the prior: a file relative to the rig, or one that is included in the package.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal, get_args

import msgspec
from msgspec import Meta

from zenocap.common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.rig.table_errors import TableError, shipped_or_own
from zenocap.data import PRIORS

# Default number of particles by method; one particle is the image force alone.  [Hybrid Table II]
PARTICLES = {"hybrid": 40, "image-force": 1, "particle-filter": 1000}
# Paper (replaced): the image force of [Hybrid VII] is that of its reference 11; here [Hybrid V-B] with one particle.
# Paper (replaced): the particle filter of [Hybrid VII] has the likelihood of Eq. 29; here the same costs as `hybrid`.
REFINEMENTS = {"hybrid": "gauss-newton", "image-force": "force", "particle-filter": "gauss-newton"}
# Forces converge slowly; chosen by hand, see the cases `4 × steps` of `python -m benchmarks replication`.
ITERATIONS = {"gauss-newton": 4, "force": 40, "force-printed": 100}
SUFFIX = ".prior"

Particles = Annotated[int, Meta(ge=1, le=20_000)]
Points = Annotated[int, Meta(ge=20, le=10_000)]
Iterations = Annotated[int, Meta(ge=0, le=100)]
Seed = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Distance = Literal["contact", "modulated"]
Association = Literal["modulated", "closest"]
ForceLaw = Literal["quadratic", "linear"]
Ends = Literal["round", "flat"]
Start = Literal["any-posture", "t-pose"]
Heading = Annotated[float, Meta(ge=-360, le=360)]
PriorShare = Annotated[float, Meta(ge=0, le=1)] | Literal["adaptive"]
CHOICES = {
    "distance": get_args(Distance),
    "association": get_args(Association),
    "force_law": get_args(ForceLaw),
    "ends": get_args(Ends),
    "start": get_args(Start),
}


class FilterOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options in which the default filter differs from [Hybrid V].

    distance: of a scene point in D: along the contour ray's normal, or |pp'| modulated by md as in Eq. 31.
    association: part of a scene point for the printed force and distance: least md |pp'|, or least |pp'|.
    force_law: rho of the printed force, Eq. 32: a truncated square, or linear and truncated.
    ends: of the body's parts, for the printed force and distance: half ellipsoids, or flat as those of cylinders.
    cost_terms: whether silhouettes, prediction and distance from the prior count besides D.
    prior_share: fraction of the proposals from the prior, all but the first particle's; or adapted to the motion.
    relocalization: whether misfits are searched for elsewhere, the feet are looked at, and the track can be lost.
    velocity_prediction: whether proposals start from the last motion continued, else from the last pose.
    shape_estimation: whether the body's sizes are improved during tracking.
    limb_search: whether a limb without rays is searched elsewhere; by method hybrid only.
    other_postures: whether common postures near the tracked one, exchanged legs and other headings are tried too; by method
    hybrid only.
    start: posture in which a track starts: any, with an average body until the T-pose is seen; or the T-pose.
    """

    distance: Distance = "contact"
    association: Association = "modulated"
    force_law: ForceLaw = "quadratic"
    ends: Ends = "round"
    cost_terms: bool = True
    prior_share: PriorShare = "adaptive"
    relocalization: bool = True
    velocity_prediction: bool = True
    shape_estimation: bool = True
    limb_search: bool = True
    other_postures: bool = True
    start: Start = "any-posture"


DEFAULT_FILTER = FilterOptions()


@dataclass(frozen=True)
class Preset:
    """Defaults of a tracker's options.  prior: of method hybrid.  refinements: by method."""

    anatomy: str = FOURTEEN_PARTS.name
    prior: str | None = None
    refinements: Mapping[str, str] = field(default_factory=lambda: REFINEMENTS)
    filter: FilterOptions = DEFAULT_FILTER


PRESETS = {
    "default": Preset(),
    "paper": Preset(
        anatomy=TEN_PARTS.name,
        # Paper (open): which motions a prior is for; general ones, unless the rig names another prior.
        prior="general-paper",
        refinements=dict.fromkeys(REFINEMENTS, "force-printed"),
        filter=FilterOptions(
            distance="modulated",
            association="closest",
            ends="flat",
            cost_terms=False,
            prior_share=1.0,
            relocalization=False,
            velocity_prediction=False,
            shape_estimation=False,
            limb_search=False,
            other_postures=False,
            start="t-pose",
        ),
    ),
}


class TrackerTable(msgspec.Struct, frozen=True, kw_only=True):
    """prior: a file relative to the rig, or the name of one included in the package; none: dynamics alone.

    preset: of `PRESETS`, gives the defaults of what is None here.  particles: default by method.
    points: of the visual hull, per frame.  refinement: default by preset and method.
    iterations: of the refinement; default by refinement.  front: camera or viewer that the person faces at the start, or
    heading: direction of the front then, degrees; None: as the feet show.  The others: see `FilterOptions`.
    """

    preset: str = "default"
    prior: str | None = None
    particles: Particles | None = None
    points: Points = 400
    iterations: Iterations | None = None
    seed: Seed = 0
    anatomy: str | None = None
    refinement: str | None = None
    distance: str | None = None
    association: str | None = None
    force_law: str | None = None
    ends: str | None = None
    cost_terms: bool | None = None
    prior_share: float | str | None = None
    relocalization: bool | None = None
    velocity_prediction: bool | None = None
    shape_estimation: bool | None = None
    limb_search: bool | None = None
    other_postures: bool | None = None
    start: str | None = None
    front: str | None = None
    heading: Heading | None = None

    def filter(self, defaults: FilterOptions) -> FilterOptions:
        """Options of the filter; defaults: where this table has none.  Raises TableError."""
        given = {name: getattr(self, name) for name in FilterOptions.__struct_fields__}
        given = {name: value for name, value in given.items() if value is not None}
        for name, allowed in CHOICES.items():
            if name in given:
                _require_one_of(name, given[name], allowed)
        share = self.prior_share
        if not (share is None or share == "adaptive" or (not isinstance(share, str) and 0 <= share <= 1)):
            raise TableError(f"prior_share = {share!r}: allowed: 0 to 1, adaptive")
        return msgspec.structs.replace(defaults, **given)


@dataclass(frozen=True)
class TrackerSpec:
    """Tracker settings with all defaults resolved.  prior: file, None for no prior.  front: id of a viewer, or heading, in
    degrees; at most one of them, see `TrackerTable`."""

    prior: Path | None
    particles: int
    points: int
    iterations: int
    seed: int
    anatomy: str
    refinement: str
    preset: str = "default"
    filter: FilterOptions = DEFAULT_FILTER
    front: str | None = None
    heading: float | None = None


@dataclass(frozen=True)
class TrackerOverrides:
    """Command line values that replace those of a rig's tracker table; None keeps a value.  prior: relative to the current
    folder.  preset: another one than the rig's replaces all options that presets have.  front replaces heading, and
    heading front."""

    prior: str | None = None
    particles: int | None = None
    points: int | None = None
    iterations: int | None = None
    refinement: str | None = None
    seed: int | None = None
    preset: str | None = None
    front: str | None = None
    heading: float | None = None


def tracker_spec(table: TrackerTable, method: str, own: bool, base: Path, *, files: bool = True) -> TrackerSpec:
    """Resolve a table of a rig in the folder `base` for a method.  Raises TableError.

    own: whether the method is the rig's own, to which the number of particles in the table applies.  files: see
    `load_rig`.
    """
    _require_one_of("preset", table.preset, PRESETS)
    preset = PRESETS[table.preset]
    anatomy = preset.anatomy if table.anatomy is None else table.anatomy
    _require_one_of("anatomy", anatomy, ANATOMIES)
    refinement = preset.refinements[method] if table.refinement is None else table.refinement
    _require_one_of("refinement", refinement, ITERATIONS)
    iterations = ITERATIONS[refinement] if table.iterations is None else table.iterations
    name = preset.prior if table.prior is None and method == "hybrid" else table.prior
    prior = None if name is None else find_prior(name, base, must_exist=files)
    particles = table.particles if own and table.particles is not None else PARTICLES[method]
    options = table.filter(preset.filter)
    spec = TrackerSpec(
        prior, particles, table.points, iterations, table.seed, anatomy, refinement, table.preset, options, table.front,
        table.heading,
    )  # fmt: skip
    return _checked(spec, method)


def with_front_of(spec: TrackerSpec, viewers: Mapping[str, str]) -> TrackerSpec:
    """`spec` with the id of the viewer that `front` names.  viewers: cameras by id of viewer.  Raises TableError."""
    if spec.front is None or spec.front in viewers:
        return spec
    for id, camera in viewers.items():
        if spec.front == camera:
            return replace(spec, front=id)
    raise TableError(f"front = {spec.front!r}: no such camera: allowed: {', '.join(viewers.values())}")


def find_prior(text: str, base: Path = Path(), *, must_exist: bool = True) -> Path:
    """Path of the included prior of that name, or else of the file relative to `base`; see `shipped_or_own`."""
    return shipped_or_own("prior", text, base, PRIORS, SUFFIX, must_exist=must_exist)


def with_overrides(spec: TrackerSpec, method: str, overrides: TrackerOverrides) -> TrackerSpec:
    """`spec` with the `overrides` values.  The default of iterations depends on the refinement.  Raises TableError."""
    if overrides.preset is not None and overrides.preset != spec.preset:
        spec = _with_preset(spec, method, overrides.preset, own_prior=overrides.prior is not None)
    if overrides.refinement is not None:
        _require_one_of("refinement", overrides.refinement, ITERATIONS)
        spec = replace(spec, iterations=ITERATIONS[overrides.refinement])
    prior = None if overrides.prior is None else find_prior(overrides.prior)
    given = {name: value for name, value in vars(overrides).items() if value is not None and name != "prior"}
    if overrides.front is not None or overrides.heading is not None:
        given = {"front": None, "heading": None} | given
    return _checked(replace(spec, prior=prior or spec.prior, **given), method)


def _with_preset(spec: TrackerSpec, method: str, name: str, *, own_prior: bool) -> TrackerSpec:
    """`spec` with all defaults of a preset.  own_prior: another prior than the preset's is used."""
    _require_one_of("preset", name, PRESETS)
    preset, refinement = PRESETS[name], PRESETS[name].refinements[method]
    wanted = preset.prior if method == "hybrid" and not own_prior else None
    return replace(
        spec, prior=None if wanted is None else find_prior(wanted), particles=PARTICLES[method],
        iterations=ITERATIONS[refinement], anatomy=preset.anatomy, refinement=refinement, preset=name, filter=preset.filter,
    )  # fmt: skip


def _require_one_of(key: str, value: object, allowed: Collection[str]) -> None:
    if value not in allowed:
        raise TableError(f"{key} = {value!r}: allowed: {', '.join(allowed)}")


def _checked(spec: TrackerSpec, method: str) -> TrackerSpec:
    if method == "image-force" and spec.particles != 1:
        raise TableError(f"particles = {spec.particles}: allowed: 1 for method 'image-force', which has no others")
    if method == "hybrid" and spec.prior is None and spec.filter.prior_share not in (0, "adaptive"):
        raise TableError(f"prior_share = {spec.filter.prior_share}: allowed without a prior: 0, 'adaptive'")
    if spec.front is not None and spec.heading is not None:
        raise TableError(f"heading = {spec.heading:g}: allowed: only without front, which is {spec.front!r}")
    if spec.heading is not None and not -360.0 <= spec.heading <= 360.0:
        raise TableError(f"heading = {spec.heading:g}: allowed: degrees from -360 to 360")
    return spec
