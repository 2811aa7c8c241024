"""The drift check: one camera turned about a random axis, and unmoved ones, on simulated walks."""

import cv2
import numpy as np

from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.simulated_clips import cycle_clip
from zenocap.common.lags.tangents import outline_of
from zenocap.tools.setup.calibration.drift import drift_of, moved_camera

TURNS_DEG = (0.0, 0.5, 1.0, 2.0)
EVERY = 15  # frames of 60 a second


def run(one: Case) -> Figures:
    """One person.  Options: views, turn (degrees)."""
    clip, turn_deg = cycle_clip(f"walking-{one.seed}", one.option("views", 4)), one.option("turn", 0.0)
    cameras = dict(clip.cameras)
    turned = list(cameras)[one.seed % len(cameras)]
    axis = np.random.default_rng(one.seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    wrong = cameras | {turned: moved_camera(cameras[turned], np.concatenate([np.radians(turn_deg) * axis, np.zeros(3)]))}
    instants = []
    for instant in clip.instants[clip.motion_from :: EVERY]:
        masks = clip.masks(instant, cameras)
        outlines = {view: outline_of(wrong[view], masks[view], 0.0) for view in cameras}
        instants.append({view: outline for view, outline in outlines.items() if outline is not None})
    moved = {each.name: each for each in drift_of(wrong, instants).moved}
    right = {turned} if turn_deg else set()
    found: dict[str, float] = {"named": len(moved.keys() & right), "named wrongly": len(moved.keys() - right)}
    if right & moved.keys():
        off = moved[turned].camera.rotation @ cameras[turned].rotation.T
        found["error"] = float(np.degrees(np.linalg.norm(cv2.Rodrigues(off)[0])))
        found["motion"] = moved[turned].apart_px
    return found


DRIFT = Kind(
    "drift",
    "Simulated people who walk, 320×240, eight of them; one camera of a ring turned about a random axis: how often it is "
    "named, others that are named, the error of its new orientation, and by how much the person appears beside the old "
    "place.",
    run,
    (
        Quantity("named", "of 8", 0, joined="sum"),
        Quantity("named wrongly", "", 0, joined="sum"),
        Quantity("error", "°", 2),
        Quantity("motion", "px", 1, "low"),
    ),
    {f"{views} views, {turn:g}°": case("walk", views=views, turn=turn) for views in (4, 3) for turn in TURNS_DEG},
    case("walk", views=3, turn=2.0),
    seeds=8,
    rows="cameras, turned by",
)
