"""Two-view, its variants, and the tracker: colour videos of people before the paper's two cameras."""

from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from benchmarks.people.errors import film_errors, summary
from benchmarks.people.films import MOTIONS, PEOPLE, TAKES, Film, captured_film, motion_file, posture_film, size_of
from benchmarks.people.mesh_joints import in_mesh_convention
from benchmarks.people.session import Track, last_body, tracked, tracked_clip, tracker_of
from benchmarks.people.shared_clips import motion_from
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import read_trc
from zenocap.common.messages import PartialBap
from zenocap.common.rig.tracker import DEFAULT_FILTER
from zenocap.common.rig.two_view import ADDITIONS, IMPROVED, PAPER, Additions
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy

SWITCHES = tuple(name for name, value in msgspec.structs.asdict(DEFAULT_FILTER).items() if value is True)
HYBRID = "hybrid"
MEASURED_BY = "raise-right-arm"  # posture of the takes of `bodies`; any: only the T-pose counts
SIZES = {  # of the body, one side: part or joint, and axis of its size or offset
    "head and neck": ("head", 0), "torso": ("torso", 0), "upper arm": ("left_upper_arm", 0),
    "forearm": ("left_lower_arm", 0), "thigh": ("left_upper_leg", 0), "shank": ("left_lower_leg", 0),
}  # fmt: skip
BREADTHS = {"shoulders": "left_shoulder", "hips": "left_hip"}


def additions_of(name: str) -> Additions:
    """Additions of a variant: `paper`, `improved`, `+ADDITION` (paper with it) or `-ADDITION`.  Raises UserError."""
    if name in ("paper", "improved"):
        return PAPER if name == "paper" else IMPROVED
    named = frozenset(name[1:].split(name[:1])) if name[:1] in ("+", "-") else frozenset({name})
    if unknown := named - set(ADDITIONS):
        raise UserError(f"{name}: {', '.join(sorted(unknown))}: allowed: paper, improved, + or - {', '.join(ADDITIONS)}")
    return PAPER | named if name[0] == "+" else IMPROVED - named


def tracked_by(name: str, film: Film) -> Track:
    """The track of a film by a variant of two-view, or by the tracker, `hybrid` or `hybrid-SWITCH` without a part."""
    if not name.startswith(HYBRID):
        return tracked(film, "two-view", additions_of(name))
    off = {part: False for part in name.removeprefix(HYBRID).split("-") if part}
    return tracked(film, tracker=tracker_of(filter=msgspec.structs.replace(DEFAULT_FILTER, **off)))


def films(one: Case) -> Iterator[Film]:
    """Films of a set of people: two takes of every posture, or of one, or one of each motion capture file."""
    size = size_of(one.option("size", "160x120"))
    count = one.option("people", PEOPLE)
    for k in range(PEOPLE * one.seed, PEOPLE * one.seed + count):
        if one.film == "motions":
            yield from (captured_film(k, motion, size) for motion in MOTIONS)
        else:
            postures = POSTURES if one.film == "postures" else (one.film,)
            yield from (posture_film(k, posture, take, size) for posture in postures for take in range(TAKES))


def run(one: Case) -> Figures:
    """Errors of a set of people, and matchings of the searches.  Options: variant, people, size."""
    errors, partials = [], list[PartialBap]()
    for film in films(one):
        track = tracked_by(one.option("variant", "improved"), film)
        errors += film_errors(film, track.estimates)
        partials += track.of(PartialBap)
    return summary(errors) | matchings(partials)


def matchings(partials: Sequence[PartialBap]) -> dict[str, float]:
    """Mean number of matchings of an arm, a leg, and of a view and frame; none without searches."""
    if not partials:
        return {}
    arms = [sum(bap.limbs[limb].matchings) for bap in partials for limb in bap.limbs if "arm" in limb]
    legs = [sum(bap.limbs[limb].matchings) for bap in partials for limb in bap.limbs if "leg" in limb]
    frames = [sum(sum(limb.matchings) for limb in bap.limbs.values()) for bap in partials]
    named = {"arm": arms, "leg": legs, "view and frame": frames}
    return {name: float(np.mean(counts)) for name, counts in named.items() if counts}


def run_bodies(one: Case) -> Figures:
    """Mean absolute error of the measured body over a set of people, mm."""
    pairs: list[tuple[Bdp, Bdp]] = []
    for k in range(PEOPLE * one.seed, PEOPLE * one.seed + one.option("people", PEOPLE)):
        for take in range(TAKES):
            body = last_body(tracked(posture_film(k, MEASURED_BY, take), "two-view"))
            if body is not None:
                pairs.append((body, true_bdp(person(k))))
    errors = [np.abs(np.array(list(_sizes(body))) - list(_sizes(true))) for body, true in pairs]
    named = dict(zip((*SIZES, *BREADTHS), np.mean(errors, axis=0), strict=True)) if errors else {}
    return {name: float(value) for name, value in named.items()} | {
        "not measured": one.option("people", PEOPLE) * TAKES - len(pairs)
    }


def _sizes(body: Bdp) -> Iterator[float]:
    yield from (1e3 * float(body.sizes[TEN_PARTS.index[part], axis]) for part, axis in SIZES.values())
    yield from (1e3 * float(body.offsets[TEN_PARTS.index[joint], 0]) for joint in BREADTHS.values())


def run_clip(one: Case) -> Figures:
    """Errors of two-view on a shared clip, mm and %.  Options: size, variant."""
    folder = SHARED / "clips" / one.film
    size = size_of(one.option("size", "640x480"))
    track = tracked_clip(folder, size, additions_of(one.option("variant", "improved")))
    if not track.estimates:
        return {"lost": 100.0}
    truth = read_trc(folder / "truth.trc")
    frames = np.array(sorted(track.estimates), dtype=np.int64)
    points = np.array([track.estimates[int(frame)].joints for frame in frames])
    names = tuple(marker.name for marker in TEN_PARTS.markers)
    found = Trajectories(names, frames, frames / truth.rate, points, truth.rate)
    chosen = ScoredFrames(first=Bound(motion_from(one.film)))
    own, mesh = accuracy(found, truth, chosen), accuracy(in_mesh_convention(found), truth, chosen)
    return {"mean": own.mpjpe_mm, "mesh": mesh.mpjpe_mm, "shape": own.shape_mm, "lost": own.lost_pct}


def inputs(one: Case) -> tuple[str, ...]:
    return tuple(map(motion_file, MOTIONS)) if one.film == "motions" else ()


_NAMES = ("paper", *(f"+{name}" for name in ADDITIONS), *(f"-{name}" for name in ADDITIONS), "improved", HYBRID)
VARIANTS = Kind(
    "variants",
    "Sets of four simulated people with body measures of ANSUR II, one in five a child, in colour by the paper's two "
    "cameras at 160×120. Postures: fifteen, two takes each, 15 frames/s; motions: motion capture at 30 frames/s. "
    "Lost: no pose, or a mean joint error above 250 mm. Matchings are those of the tri-tree searches.",
    run,
    (
        Quantity("segments", "°"),
        Quantity("median", "°"),
        Quantity("joints", "mm", 0),
        Quantity("yaw", "°"),
        Quantity("lost", "%"),
        *(Quantity(name, "matchings", 0, "") for name in ("arm", "leg", "view and frame")),
    ),
    {f"{name}, postures": case("postures", variant=name, people=4) for name in _NAMES}
    | {f"{name}, motions": case("motions", variant=name, people=4) for name in _NAMES}
    | {
        f"hybrid without {name}, {film}": case(film, variant=f"{HYBRID}-{name}", people=4)
        for name in SWITCHES
        for film in ("postures", "motions")
    }
    | {f"{name}, postures, 640×480": case("postures", variant=name, people=4, size="640x480") for name in _NAMES}
    | {f"improved, {posture}": case(posture, people=4) for posture in POSTURES},
    case("squat", people=1),
    rows="variant",
    inputs=inputs,
)
BODIES = Kind(
    "bodies",
    "Mean absolute error of the body that two-view measures in the T-pose, sets of twelve simulated people, two takes "
    "each.",
    run_bodies,
    (*(Quantity(name, "mm", 0) for name in (*SIZES, *BREADTHS)), Quantity("not measured", "takes", 0, joined="sum")),
    {"two-view": case("T-pose")},
    case("T-pose", people=1),
    rows="method",
)
TWO_VIEW_CLIPS = Kind(
    "two-view-clips",
    "Method `two-view` on the shared clips of two cameras, people of another kind than the simulated ones. Several of its "
    "constants were tried on these clips. Nothing in it is random.",
    run_clip,
    (Quantity("mean", "mm", 0), Quantity("mesh", "mm", 0), Quantity("shape", "mm", 0), Quantity("lost", "%", 0)),
    {
        f"{clip}, {size}, {variant}": case(clip, size=size, variant=variant)
        for variant in ("improved", "paper")
        for clip in ("walk2", "bend2", "kick2", "turned2")
        for size in ("160x120", "640x480")
    },
    case("walk2", size="160x120"),
    seeds=1,
    rows="clip, size, variant",
    inputs=lambda one: (f"clips/{one.film}",),
)
