"""Rolling shutter named by the calibration with a board: right and false names, and the error of the time of readout.

    python -m benchmarks.rolling_shutter [--seeds 6] [--first-seed 0] [--fps 15] [--seconds 20] [--own-lenses]

Rooms of two cameras of 1280 x 720, views of a board as in `benchmarks.board_calibration`, whose corners are of the
instant of their row.  Three rigs of each seed: in step, read out in 0 and 20 ms; out of step by up to 0.1 s, in 10 and
30 ms; out of step, without rolling shutter.  Lenses are given, or estimated (--own-lenses).  The last column is the error
of places within 0.8 m of the middle of the room.
"""

import argparse

import numpy as np

from tests.support.board_views import BOARD, board_views, places, rig_error_m, room
from zenocap.common.camera.lens import Lens
from zenocap.tools.calibration.board_calibration import calibrated_rig

RIGS_MS = ((0.0, 20.0), (10.0, 30.0), (0.0, 0.0))  # time of readout of both cameras


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--fps", type=float, default=15.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--own-lenses", action="store_true")
    options = parser.parse_args()
    errors: dict[float, list[float]] = {}
    named: dict[float, list[bool]] = {}
    print("seed   late ms   readout ms: true, found ± standard error, * named   error mm")
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        late_s = float(np.random.default_rng(seed).uniform(-0.1, 0.1))
        for number, readouts_ms in enumerate(RIGS_MS):
            cameras = room(2, seed)
            delays_s = (0.0, late_s if number else 0.0)
            readouts_s = tuple(value / 1000 for value in readouts_ms)
            views, _ = board_views(
                cameras, seed=seed, fps=options.fps, seconds=options.seconds, delays_s=delays_s, readouts_s=readouts_s
            )
            lenses = None if options.own_lenses else {one.name: Lens.of(one) for one in cameras}
            found = calibrated_rig(BOARD, views, lenses)
            parts = []
            for one, true_ms in zip(found.cameras, readouts_ms, strict=True):
                errors.setdefault(true_ms, []).append(1000 * one.readout_s - true_ms)
                named.setdefault(true_ms, []).append(one.rolling_shutter)
                sign = "*" if one.rolling_shutter else " "
                parts.append(f"{true_ms:3.0f} {1000 * one.readout_s:5.1f} ± {1000 * one.readout_error_s:.1f}{sign}")
            error_mm = 1000 * rig_error_m([one.camera for one in found.cameras], cameras, places())
            print(f"{seed:4} {1000 * delays_s[1]:9.0f}   {'   '.join(parts)}   {error_mm:6.2f}", flush=True)
        for value, each in sorted(errors.items()):
            worst, mean = max(np.abs(each)), np.mean(np.abs(each))
            print(
                f"  {value:3.0f} ms: named {sum(named[value])} of {len(each)}; off {mean:.2f} ms, at worst {worst:.2f} ms"
            )


if __name__ == "__main__":
    main()
