"""Calibration with an AprilGrid beside a ChArUco board and a chessboard of the same size, from rendered images with truth.

    python -m benchmarks.board_kinds [--seeds 3] [--pictures 40] [--kinds charuco,aprilgrid] [--spacing-off 0]

Two cameras of 960 x 540 at 3 to 4 m, boards of about 1 x 1.4 m at 40 places and once on the floor, as
`tests/support/board_films.py` draws them.  Printed per seed: places found by both cameras, corners that are off, error of
places within 0.8 m of the middle of the room after the best motion, error of the angle between the cameras, claimed error.
--spacing-off: by which the AprilGrid is described wrongly, of the side of a tag.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.support.board_films import board_pictures
from tests.support.board_views import places, rig_error_m
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.tools.calibration.board import checked_board
from zenocap.tools.calibration.board_calibration import calibrated_rig
from zenocap.tools.calibration.board_films import board_films, board_views

BOARDS = {
    "charuco": checked_board("charuco", 5, 7, 200.0),
    "chessboard": checked_board("chessboard", 5, 8, 180.0),
    "aprilgrid": checked_board("aprilgrid", 4, 6, 185.0),
}


def angle_error_deg(found: list[Camera], true: tuple[Camera, ...]) -> float:
    """Error of the rotation from the first camera to the second."""
    turns = [cameras[1].rotation @ cameras[0].rotation.T for cameras in (found, true)]
    return float(np.degrees(np.arccos(np.clip((np.trace(turns[0] @ turns[1].T) - 1) / 2, -1, 1))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--pictures", type=int, default=40)
    parser.add_argument("--kinds", default="charuco,aprilgrid")
    parser.add_argument("--spacing-off", type=float, default=0.0)
    options = parser.parse_args()
    print("kind        seed   shared   corners px   error mm   angle degrees   claimed mm")
    for seed in range(options.seeds):
        for kind in options.kinds.split(","):
            with tempfile.TemporaryDirectory() as name:
                true = board_pictures(Path(name), options.pictures, BOARDS[kind], seed)
                told = BOARDS[kind]
                if kind == "aprilgrid":
                    told = replace(told, spacing=told.spacing + options.spacing_off)
                films, _ = board_films([Path(name)])
                board, seen = board_views(told, films)
                try:
                    found = calibrated_rig(board, seen)
                except UserError as error:
                    print(f"{kind:11} {seed:4}   refused: {error}", flush=True)
                    continue
            cameras = [one.camera for one in found.cameras]
            off = max(one.residual_px for one in found.cameras)
            shared = sum(found.shared.values())
            error_mm = 1000 * rig_error_m(cameras, true, places())
            angle = angle_error_deg(cameras, true)
            claim_mm = 1000 * found.error_m
            print(f"{kind:11} {seed:4} {shared:8} {off:12.2f} {error_mm:10.2f} {angle:15.3f} {claim_mm:12.2f}", flush=True)


if __name__ == "__main__":
    main()
