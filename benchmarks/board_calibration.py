"""Calibration with a board: errors on simulated views with known truth, and the claimed error beside them.

    python -m benchmarks.board_calibration [--seeds 5] [--only cameras,noise,delays,fisheye,length]
    python -m benchmarks.board_calibration --films FOLDER --square MM --columns N --rows N --dictionary D [--reference FILE]

Without films: rooms of 1280 x 720 cameras at 3 to 4 m, and a board of 7 x 9 squares of 60 mm that is carried about for
40 s, 10 detections a second.  Errors are of places within 0.8 m of the middle of the room, after the best motion; per case
the mean and the worst of the seeds.  With films: relative poses against another program's calibration.
"""

import argparse
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.board_views import BOARD, board_views, places, rig_error_m, room, with_fisheye
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.calibration import board_films
from zenocap.tools.calibration.board import checked_board
from zenocap.tools.calibration.board_calibration import BoardCalibration, calibrated_rig

CASES: dict[str, list[tuple[int, dict[str, Any]]]] = {
    "cameras": [(2, {}), (4, {}), (8, {})],
    "noise": [(4, {"noise_px": 0.05}), (4, {"noise_px": 0.5}), (4, {"noise_px": 1.0})],
    "delays": [(4, {"delays_s": (0.0, 0.03, -0.08, 0.1)})],
    "fisheye": [(4, {"fisheye": True})],
    "length": [(4, {"seconds": 10.0}), (4, {"seconds": 20.0}), (4, {"seconds": 80.0})],
}


def simulated(count: int, options: Mapping[str, Any], seed: int) -> tuple[BoardCalibration, float, float]:
    """The calibration, its true error (m), and the largest error of a delay (s)."""
    options = dict(options)
    cameras = room(count, seed)
    if options.pop("fisheye", False):
        cameras = tuple(with_fisheye(camera) for camera in cameras)
    views, _ = board_views(cameras, seed=seed, **options)
    found = calibrated_rig(BOARD, views)
    delays = np.asarray(options.get("delays_s", np.zeros(count)), dtype=np.float64)
    late = np.array([one.delay_s for one in found.cameras])
    error_m = rig_error_m([one.camera for one in found.cameras], cameras, places())
    return found, error_m, float(np.abs(late - (delays - delays[0])).max())


def relative(cameras: Mapping[str, Camera], reference: Mapping[str, Camera]) -> list[str]:
    """Rotation and place of each camera from the first one, against another calibration."""
    first, lines = next(iter(reference)), []
    for name in list(reference)[1:]:
        poses = []
        for source in (cameras, reference):
            one, other = source[first], source[name]
            rotation = other.rotation @ one.rotation.T
            poses.append((rotation, -rotation.T @ (other.translation - rotation @ one.translation)))
        (one_turn, one_place), (other_turn, other_place) = poses
        angle = np.degrees(np.arccos(np.clip((np.trace(one_turn @ other_turn.T) - 1) / 2, -1, 1)))
        apart_mm = 1000 * np.linalg.norm(one_place - other_place)
        lines.append(f"  {name}: {angle:.2f} degrees, {apart_mm:.1f} mm from the reference")
    return lines


def measure_simulated(only: list[str], seeds: int) -> None:
    print("case                                        error mm (worst)   claimed mm   focal length %   delay ms   s")
    for case in only:
        for count, options in CASES[case]:
            errors, claims, focals, delays, spent = [], [], [], [], []
            for seed in range(seeds):
                begin_s = time.perf_counter()
                found, error_m, delay_s = simulated(count, options, seed)
                spent.append(time.perf_counter() - begin_s)
                errors.append(1000 * error_m)
                claims.append(1000 * found.error_m)
                delays.append(1000 * delay_s)
                focals.append(100 * max(one.focal_error for one in found.cameras))
            text = f"{count} cameras {' '.join(f'{key}={value}' for key, value in options.items())}"
            print(
                f"{text:42} {np.mean(errors):8.2f} ({max(errors):.2f}) {np.mean(claims):12.2f} {np.mean(focals):16.2f} "
                f"{max(delays):10.2f} {np.mean(spent):5.1f}",
                flush=True,
            )


def measure_films(options: argparse.Namespace) -> None:
    board = checked_board("charuco", options.columns, options.rows, options.square, None, options.dictionary)
    films, _ = board_films.board_films([options.films])
    board, seen = board_films.board_views(board, films)
    reference = None if options.reference is None else read_calibration(options.reference)
    given = None if reference is None else {name: Lens.of(camera) for name, camera in reference.items()}
    for title, lenses, delays in (
        ("own lenses", None, True),
        ("lenses of the reference", given, True),
        ("lenses of the reference, no delays", given, False),
    ):
        if title != "own lenses" and given is None:
            continue
        found = calibrated_rig(board, seen, lenses, delays=delays)
        print(f"{title}: claimed error {1000 * found.error_m:.2f} mm")
        for one in found.cameras:
            late_ms = 1000 * one.delay_s
            print(f"  {one.camera.name}: {one.views} views, corners {one.residual_px:.2f} px off, {late_ms:+.0f} ms")
        if reference is not None:
            print("\n".join(relative({one.camera.name: one.camera for one in found.cameras}, reference)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--films", type=Path)
    parser.add_argument("--square", type=float, default=54.0)
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--rows", type=int, default=5)
    parser.add_argument("--dictionary", default="4x4_1000")
    parser.add_argument("--reference", type=Path)
    options = parser.parse_args()
    if options.films is not None:
        measure_films(options)
    else:
        measure_simulated(options.only.split(","), options.seeds)


if __name__ == "__main__":
    main()
