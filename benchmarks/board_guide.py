"""When the live guide of the board calls it enough, and how good the calibration then is, in simulated rooms.

    python -m benchmarks.board_guide [--seeds 5] [--cameras 2,4]

Cameras of 1280 x 720 at 3 to 4 m; a board of 7 x 9 squares of 60 mm is carried about as in `benchmarks.board_calibration`,
without following the guide.  As the live page does it, stretches of 0.4 s in every second are searched.  Printed are the
seconds until the guide is ready, and error, claimed error and verdict of the calibration from the views up to then; the
board is not on the floor, which the verdict here leaves out.
"""

import argparse
from dataclasses import replace

from tests.support.board_views import BOARD, board_views, places, rig_error_m, room
from zenocap.tools.calibration.board_calibration import calibrated_rig
from zenocap.tools.calibration.board_report import verdict
from zenocap.tools.calibration.board_views import CameraViews
from zenocap.tools.calibration.parameters import BURST_S
from zenocap.tools.live.board_guide import BoardGuide, CameraProgress
from zenocap.tools.live.parameters import BURST_PERIOD_S

FPS, SECONDS = 15.0, 180.0


def cut(seen: CameraViews, end_s: float) -> CameraViews:
    """The views of the stretches up to a time."""
    kept = tuple(view for view in seen.views if view.time_s < end_s and view.time_s % BURST_PERIOD_S < BURST_S)
    return replace(seen, views=kept, looks=int(end_s * FPS * BURST_S / BURST_PERIOD_S))


def ready_s(seen: list[CameraViews]) -> float | None:
    """Seconds until the guide is ready; None for never."""
    guide = BoardGuide(BOARD.corners, [CameraProgress(one.name, one.size) for one in seen])
    for second in range(int(SECONDS)):
        views = {}
        for number, one in enumerate(seen):
            burst = [view for view in one.views if 0 <= view.time_s - second * BURST_PERIOD_S < BURST_S]
            for view in burst:
                guide.add_cells(number, view)
            middle = [view for view in burst if abs(view.time_s - second - BURST_S / 2) < 0.6 / FPS]
            if middle:
                views[number] = middle[0]
        guide.add(views)
        if guide.ready:
            return float(second + 1)
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--cameras", default="2,4")
    options = parser.parse_args()
    print("cameras  seed  ready s   error mm   claimed mm   focal length %   verdict")
    for count in (int(text) for text in options.cameras.split(",")):
        for seed in range(options.seeds):
            cameras = room(count, seed)
            seen, _ = board_views(cameras, fps=FPS, seconds=SECONDS, seed=seed)
            end_s = ready_s(seen)
            if end_s is None:
                print(f"{count:7} {seed:5}    never within {SECONDS:.0f} s", flush=True)
                continue
            found = calibrated_rig(BOARD, [cut(one, end_s) for one in seen])
            error_m = rig_error_m([one.camera for one in found.cameras], cameras, places())
            kept = [text for text in verdict(found)[1] if text not in found.world.remarks]
            focal = 100 * max(one.focal_error for one in found.cameras)
            print(
                f"{count:7} {seed:5} {end_s:8.0f} {1000 * error_m:10.2f} {1000 * found.error_m:12.2f} {focal:16.2f}   "
                f"{'poor: ' + '; '.join(kept) if kept else 'good'}",
                flush=True,
            )


if __name__ == "__main__":
    main()
