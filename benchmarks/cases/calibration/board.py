"""Calibration with a board: errors on simulated views, and the claimed error beside them.

Rooms of 1280 x 720 cameras at 3 to 4 m, and a board of 7 x 9 squares of 60 mm that is carried about, 10 detections a
second.  Errors are of places within 0.8 m of the middle of the room, after the best motion.
"""

import numpy as np

from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from tests.support.board_views import BOARD, board_views, places, rig_error_m, room, with_fisheye
from zenocap.tools.setup.calibration.board_calibration import calibrated_rig


def run(one: Case) -> Figures:
    """One room.  Options: cameras, noise (px), delays (s, by camera), fisheye, seconds."""
    cameras = room(one.option("cameras", 4), one.seed)
    if one.option("fisheye", False):
        cameras = tuple(with_fisheye(camera) for camera in cameras)
    delays = np.array(one.option("delays", (0.0,) * len(cameras)))
    seconds, noise_px = one.option("seconds", 40.0), one.option("noise", 0.2)
    views, _ = board_views(cameras, seed=one.seed, seconds=seconds, noise_px=noise_px, delays_s=tuple(delays.tolist()))
    found = calibrated_rig(BOARD, views)
    late = np.array([each.delay_s for each in found.cameras])
    return {
        "error": 1e3 * rig_error_m([each.camera for each in found.cameras], cameras, places()),
        "claimed": 1e3 * found.error_m,
        "focal length": 100 * max(each.focal_error for each in found.cameras),
        "delay": 1e3 * float(np.abs(late - (delays - delays[0])).max()),
    }


BOARD_KIND = Kind(
    "board",
    "Simulated views of a board, five rooms: error of places in the middle of the room, the claimed error, the stated "
    "standard deviation of the focal length, and the largest error of a delay.",
    run,
    (
        Quantity("error", "mm", 2),
        Quantity("claimed", "mm", 2, ""),
        Quantity("focal length", "%", 2),
        Quantity("delay", "ms", 1),
    ),
    {f"{count} cameras": case("room", cameras=count) for count in (2, 4, 8)}
    | {f"4 cameras, noise {noise:g} px": case("room", noise=noise) for noise in (0.05, 0.5, 1.0)}
    | {"4 cameras, out of step by +30, −80, +100 ms": case("room", delays=(0.0, 0.03, -0.08, 0.1))}
    | {"4 cameras, fisheye lenses": case("room", fisheye=True)}
    | {f"4 cameras, {seconds:g} s": case("room", seconds=seconds) for seconds in (10.0, 20.0, 80.0)},
    case("room", cameras=2, seconds=10.0),
    seeds=5,
    rows="room",
)
