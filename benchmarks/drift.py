"""The drift check: cameras turned by 0.5, 1 and 2 degrees, and unmoved ones, on simulated people who walk.

    python -m benchmarks.drift [--views 4] [--seeds 8]

Silhouettes of 320 x 240 with ragged edges, a ring of cameras at 4.6 m, 4 instants a second.  One camera is turned about a
random axis; whether it is named, the error of its new orientation, and what was named wrongly.
"""

import argparse

import cv2
import numpy as np
from benchmarks.simulated_clip import cycle_clip

from zenocap.common.lags.tangents import outline_of
from zenocap.tools.calibration.drift import drift_of, moved_camera

TURNS_DEG = (0.0, 0.5, 1.0, 2.0)
EVERY = 15  # frames of 60 a second


def trial(views: int, seed: int, turn_deg: float) -> tuple[str, list[str], float, float]:
    """The camera that was turned, those that were named, the error of the first one's orientation, degrees, and by how many
    px the person appears beside the old place.
    """
    clip = cycle_clip(f"walking-{seed}", views)
    cameras = dict(clip.cameras)
    turned = list(cameras)[seed % len(cameras)]
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    wrong = cameras | {turned: moved_camera(cameras[turned], np.concatenate([np.radians(turn_deg) * axis, np.zeros(3)]))}
    instants = []
    for instant in clip.instants[clip.motion_from :: EVERY]:
        masks = clip.masks(instant, cameras)
        outlines = {view: outline_of(wrong[view], masks[view], 0.0) for view in cameras}
        instants.append({view: outline for view, outline in outlines.items() if outline is not None})
    found = drift_of(wrong, instants)
    error_deg = float("nan")
    if found.moved:
        first = found.moved[0]
        off = first.camera.rotation @ cameras[first.name].rotation.T
        error_deg = float(np.degrees(np.linalg.norm(cv2.Rodrigues(off)[0])))
    return turned, [one.name for one in found.moved], error_deg, found.moved[0].apart_px if found.moved else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, default=4, choices=(3, 4, 7))
    parser.add_argument("--seeds", type=int, default=8)
    options = parser.parse_args()
    print("turned by   named   named wrongly   error of the orientation, mean (worst)   smallest motion named, px")
    for turn_deg in TURNS_DEG:
        trials = [trial(options.views, seed, turn_deg) for seed in range(options.seeds)]
        named = [one for one in trials if turn_deg and one[0] in one[1]]
        wrongly = sum(any(name != one[0] or not turn_deg for name in one[1]) for one in trials)
        errors = [one[2] for one in named]
        text = f"{np.mean(errors):.2f} ({max(errors):.2f}) degrees   {min(one[3] for one in named):.1f}" if named else ""
        print(f"{turn_deg:3.1f} degrees {len(named):3} of {len(trials)} {wrongly:6}   {text}", flush=True)


if __name__ == "__main__":
    main()
