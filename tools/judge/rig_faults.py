"""Causes of lost poses in the rig: swapped, turned and moved cameras, wrong calibrations.

Each hypothesis changes videos or calibration.  It holds in a frame set where the views then agree on a person who stands on
the floor, see `lower_ends`.  It is stated where it holds in most sets, and the rig as it is in few.  Changes of the whole
world leave the views in agreement: there a silhouette may end below the floor, as one with a shadow does.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations

import cv2
import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Z_UP_TO_Y_UP
from zenocap.common.conversion import camera_of, silhouette_mask
from zenocap.common.lags.tangents import Outline, outline_of
from zenocap.tools.judge import parameters as p
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.overlap import reduced, reduced_mask
from zenocap.tools.judge.seen import LEFT_OUT, half_person, lower_ends, no_legs, scene_reasons, unsteady
from zenocap.tools.judge.view_lag import ViewLags

TURNS = {1: "90° clockwise", 2: "180°", 3: "90° anticlockwise"}  # of pictures, by the quarter turns back
ONE = "one-view"  # kind of the fault of a camera without which the others agree
WORLD = "calibration"  # kind of a fault of the unit or the axis, the same in all views


@dataclass(frozen=True)
class Hypothesis:
    """films: by view, the one whose video it gets; those that are not here are left out.  turns: by view, quarter turns.

    world_to_world: rotation (3, 3) of the calibration.  unit: of its lengths, m.
    """

    kind: str
    viewers: tuple[str, ...]
    text: str
    films: Mapping[str, str]
    turns: Mapping[str, int] = field(default_factory=dict)
    world_to_world: Floats = field(default_factory=lambda: np.eye(3))
    unit: float = 1.0


@dataclass(frozen=True)
class SeenRig:
    """cameras: reduced, by view.  sets: capture time, and reduced silhouettes by view."""

    cameras: Mapping[str, Camera]
    sets: Sequence[tuple[int, Mapping[str, Mask]]]
    _outlines: dict[tuple[int, str, str, int], Outline | None] = field(default_factory=dict)

    def held(self, one: Hypothesis) -> Bools:
        """(sets,) whether a hypothesis holds."""
        cameras, lowest_m = {}, -np.inf if one.kind == WORLD else -p.LEGS_ABOVE_M
        for view in one.films:
            own = self.cameras[view]
            cameras[view] = replace(own, rotation=own.rotation @ one.world_to_world, translation=one.unit * own.translation)
        found = np.zeros(len(self.sets), dtype=np.bool_)
        for k in range(len(self.sets)):
            seen = {view: self._outline(k, view, film, one.turns.get(view, 0)) for view, film in one.films.items()}
            outlines = {view: replace(each, rays=each.rays @ one.world_to_world) for view, each in seen.items() if each}
            ends = lower_ends(cameras, outlines) if len(outlines) > 1 else {}
            found[k] = bool(ends) and all(lowest_m <= height <= p.LEGS_ABOVE_M for height in ends.values())
        return found

    def likeliest(self, every: Iterable[Hypothesis]) -> Hypothesis | None:
        """The one that holds in most sets; None where it holds in few, or one of another kind in about as many.

        Without a camera whose pictures are turned the others agree too: that is no other fault.  Two views may agree by
        chance: of faults of one view, all that hold about as often are named, of orders of the videos two.
        """
        found = sorted(((float(self.held(one).mean()), one) for one in every), key=lambda each: -each[0])
        near = [one for share, one in found if share >= max(p.HOLDS, found[0][0] - p.HOLDS_MORE)]
        back = [one.viewers for one in near if one.kind == "turned"]
        near = [one for one in near if one.kind != ONE or one.viewers not in back]
        kinds, most = {one.kind for one in near}, {ONE: len(self.cameras) - 1, "swapped": 2}
        if len(kinds) != 1 or len(near) > most.get(near[0].kind, len(near)):
            return None
        near = near[: most.get(near[0].kind, 1)]
        viewers = tuple(dict.fromkeys(view for one in near for view in one.viewers))
        return replace(near[0], viewers=viewers, text="; or ".join(one.text for one in near if one.text))

    def _outline(self, k: int, view: str, film: str, turns: int) -> Outline | None:
        """Outline in set k of a video, turned, as that of a view; None without a silhouette."""
        key, masks = (k, view, film, turns), self.sets[k][1]
        if key not in self._outlines:
            camera = self.cameras[view]
            mask = turned(masks[film], camera.size, turns) if film in masks else None
            self._outlines[key] = None if mask is None else outline_of(camera, mask, 0.0)
        return self._outlines[key]


def turned(mask: Mask, size: tuple[int, int], turns: int) -> Mask:
    """A silhouette of any size, as one of a camera of this size, after quarter turns."""
    before = size[::-1] if turns % 2 else size
    if mask.shape[::-1] != before:
        mask = np.asarray(cv2.resize(mask, before, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    return np.ascontiguousarray(np.rot90(mask, turns))


def rig_fault(evidence: TakeEvidence) -> m.VerdictReason | None:
    """The likely fault of the rig; None where the silhouettes do not show it, or none."""
    cameras = {viewer: reduced(camera_of(info)) for viewer, info in sorted(evidence.cameras.items())}
    rig, alike = SeenRig(cameras, frame_sets(evidence, cameras)), {viewer: viewer for viewer in cameras}
    now = rig.held(Hypothesis("", (), "", alike))
    since = _since(now)
    if len(now) < p.FEWEST_SETS or now[since:].mean() > p.HOLDS_NOT:
        return None
    stands = rig.held(Hypothesis(WORLD, (), "", alike)).mean() > p.HOLDS_NOT
    every = [one for one in ([] if since else _changes(alike)) if one.kind != WORLD or not stands]
    found = SeenRig(cameras, rig.sets[since:]).likeliest([*every, *_without_one(alike)])
    if found is not None and found.kind == ONE:
        found = _one_view(found, since and rig.sets[since][0] - min(one.captured_ns for one in evidence.cameras.values()))
    return None if found is None else m.VerdictReason(kind=found.kind, viewers=list(found.viewers), text=found.text)


def _since(now: Bools) -> int:
    """First set from which on the views no longer agree, from 1/4 to 3/4 of a long take on; 0 for none.  now: (sets,)."""
    k = int(np.argmax([now[:k].sum() + (~now[k:]).sum() for k in range(len(now) + 1)]))
    sure = p.FEWEST_SETS <= k <= len(now) - p.FEWEST_SETS and now[:k].mean() >= p.HOLDS and now[k:].mean() <= p.HOLDS_NOT
    return k if sure else 0


def frame_sets(evidence: TakeEvidence, cameras: Mapping[str, Camera]) -> list[tuple[int, Mapping[str, Mask]]]:
    """Silhouettes of two views or more, MOST_SETS where there are as many.  cameras: reduced."""
    seen = [
        (number * p.SAMPLE_NS, {view: one for view, one in sample.silhouettes.items() if view in cameras and one.data})
        for number, sample in sorted(evidence.samples.items())
    ]
    seen = [one for one in seen if len(one[1]) > 1]
    found: list[tuple[int, Mapping[str, Mask]]] = []
    count = min(p.MOST_SETS, len(seen))
    for captured_ns, silhouettes in [seen[k * len(seen) // count] for k in range(count)]:
        masks = {}
        for viewer, one in silhouettes.items():
            with suppress(ValueError):  # damaged
                masks[viewer] = reduced_mask(silhouette_mask(one), cameras[viewer])
        found.append((captured_ns, masks))
    return found


def _one_view(found: Hypothesis, since_ns: int) -> Hypothesis:
    """A camera that contradicts the others, or does from a time after the begin of the take on; 0 for none."""
    why = (
        ", which agree: it was moved after its calibration, has that of another camera, zoom or mode, is late, or its "
        "silhouettes are wrong: look at them (--overlay), calibrate again, or leave it out (--cameras)"
    )
    if since_ns:
        why = (
            f" from about {since_ns / 1e9:.0f} s on, not before: it was moved, or its picture froze: trim the take with "
            "--until of other commands, or leave the camera out (--cameras)"
        )
    text = f"camera {' or '.join(found.viewers)} contradicts the others{why}"
    return replace(found, kind="moved" if since_ns else ONE, text=text)


def _changes(alike: Mapping[str, str]) -> Iterator[Hypothesis]:
    """Changes with which all views agree.  alike: each view with its own video."""
    views = tuple(alike)
    orders = list(permutations(views)) if len(views) <= p.MOST_PERMUTED else []
    for one, other in combinations(views, 2) if p.MOST_PERMUTED < len(views) <= p.MOST_EXCHANGED else ():
        orders.append(tuple({one: other, other: one}.get(view, view) for view in views))
    for order in orders:
        if wrong := [(film, view) for film, view in zip(order, views, strict=True) if film != view]:
            pairs = ", ".join(f"that of {film} is of {view}" for film, view in wrong)
            text = f"the videos are swapped: {pairs}: so the silhouettes agree; exchange them"
            yield Hypothesis("swapped", tuple(view for _, view in wrong), text, dict(zip(views, order, strict=True)))
    for turns in TURNS:
        for some in (*((view,) for view in views), views):
            text = f"the pictures of camera {', '.join(some)} are turned by {TURNS[turns]}"
            text += ": turned back, the silhouettes agree; turn the videos, or calibrate with cameras that stand so"
            yield Hypothesis("turned", some, text, alike, dict.fromkeys(some, turns))
    for name, unit in p.UNITS_M.items():
        text = f"the calibration is in {name}, not in metres: so the silhouettes show a person; convert it"
        yield Hypothesis(WORLD, (), text, alike, unit=unit)
    for axis, other, world_to_world in ("Z", "Y", Z_UP_TO_Y_UP.T), ("Y", "Z", Z_UP_TO_Y_UP):
        text = f"the calibration's vertical axis is {axis}, not {other}: so the silhouettes show a person who stands; "
        text += f'up_axis = "{axis.lower()}" in clip.toml or the rig file, or --up-axis with --calibration'
        yield Hypothesis(WORLD, (), text, alike, world_to_world=world_to_world)
    text = "the calibration's vertical axis points down: turned up, the silhouettes show a person; calibrate again"
    yield Hypothesis(WORLD, (), text, alike, world_to_world=np.diag([1.0, -1.0, -1.0]))


def _without_one(alike: Mapping[str, str]) -> Iterator[Hypothesis]:
    for view in alike if len(alike) > 2 else ():
        yield Hypothesis(ONE, (view,), "", {one: film for one, film in alike.items() if one != view})


def no_pose(evidence: TakeEvidence, lags: ViewLags | None) -> list[m.VerdictReason]:
    """Reasons of a take without poses, the causes first.  lags: of views, with which no rig is judged."""
    half = half_person(evidence)
    found = None if half else unsteady(evidence) or no_legs(evidence)
    late = None if lags is None else lags.reason
    causes = [one for one in (late, half, *scene_reasons(evidence), found) if one is not None]
    shown = [any(one.data for one in sample.silhouettes.values()) for sample in evidence.samples.values()]
    seen_s, text = p.SAMPLE_NS / 1e9 * sum(shown), "no pose"
    if evidence.body is None and 0.0 < seen_s <= p.START_NS / 1e9:
        text = (
            f"no pose: a person is in view for some {seen_s:.1f} s only, and tracking starts after 1.2 s, or in the "
            "T-pose: a longer recording, with the person in view of two cameras or more"
        )
    elif evidence.body is None and evidence.cameras and not causes:
        text = (
            "no pose: no person was found that two cameras or more see at a time, and the silhouettes do not show why: the "
            "empty scene (empty_seconds), the calibration of other cameras, cameras that were moved, swapped videos, and "
            "for two-view the T-pose"
        )
        if (fault := rig_fault(evidence)) is not None:
            causes, text = [fault], "no pose"
    return [*causes, *scene_reasons(evidence, LEFT_OUT), m.VerdictReason(kind="no-pose", viewers=[], text=text)]
