"""Scene of the load test: cameras, rendered films, rig files."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import motion_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.measure.load_plan import Plan

FILM_FPS = 60.0
LONGEST, SHORTEST, MAX_BYTES = 120, 30, 1.5e9  # images of a film; bytes of all films together
DISTANCE, HEIGHT = 5.2, 1.0  # of the cameras from the middle of the action region and from the ground, metres
FOCAL = 600.0 / 640.0  # of the image's width
# Of person and room.  The hair of person 0 is as grey as the walls.  In two of seven silhouettes the head is missing, the
# visual hull is too low for a T-pose, and at 640x480 no track starts.  Adult 4 is tracked after 4 images of 2 to 16 views.
SEED = 4
BEFORE_S = 1.2  # seconds of the film before the walk: T-pose, and lowering the arms


def cameras(count: int, size: tuple[int, int]) -> tuple[Camera, ...]:
    """The paper's two orthogonal cameras, or any other number on a circle, no two opposite; the first is on +Z."""
    halfway = [0.5 / count if 2 * k >= count and count % 2 == 0 else 0.0 for k in range(count)]
    turns = [0.0, -0.25] if count == 2 else [k / count + more for k, more in enumerate(halfway)]
    return tuple(_camera(f"cam{k + 1:02d}", 2 * np.pi * turn, size) for k, turn in enumerate(turns))


def _camera(name: str, azimuth: float, size: tuple[int, int]) -> Camera:
    """Camera that looks horizontally at the centre from `azimuth` radians, counted from +Z towards +X."""
    width, height = size
    centre = np.array([DISTANCE * np.sin(azimuth), HEIGHT, DISTANCE * np.cos(azimuth)])
    forward = np.array([-np.sin(azimuth), 0.0, -np.cos(azimuth)])
    right = np.cross(forward, [0.0, 1.0, 0.0])
    rotation: Floats = np.stack([right, np.cross(forward, right), forward])
    matrix = np.array([[FOCAL * width, 0.0, (width - 1) / 2], [0.0, FOCAL * width, (height - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera(name, size, matrix, np.zeros(5), rotation, -rotation @ centre)


def pictures(count: int, size: tuple[int, int]) -> int:
    """Number of images of each of `count` films."""
    return int(np.clip(MAX_BYTES / (count * size[0] * size[1] * 3), SHORTEST, LONGEST))


def calibration(folder: Path, plan: Plan) -> tuple[Camera, ...]:
    """Write the calibration into `folder`, enough for services without images; return its cameras.  Raises OSError."""
    all_cameras = cameras(plan.viewers, plan.size)
    folder.mkdir(parents=True, exist_ok=True)
    write_calibration(folder / "calibration.toml", {camera.name: camera for camera in all_cameras})
    return all_cameras


def film(folder: Path, plan: Plan, watch: Callable[[int, int], None] = lambda done, of: None) -> None:
    """Write calibration, films and background pictures of a plan's cameras into `folder`, unless they exist.

    watch: is called with the number of images done, and of all.  Raises OSError.
    """
    if (folder / "calibration.toml").exists():
        return
    subject = person(SEED)
    script = motion_timeline(subject, "walking", SEED)
    count = pictures(plan.viewers, plan.size)
    width, height = plan.size
    all_cameras = cameras(plan.viewers, plan.size)
    folder.mkdir(parents=True, exist_ok=True)
    for number, camera in enumerate(all_cameras):
        filming = SimulatedCamera(camera, subject, SEED)
        cv2.imwrite(str(folder / f"{camera.name}.png"), filming.background())
        film = np.lib.format.open_memmap(
            folder / f"{camera.name}.npy", "w+", dtype=np.uint8, shape=(count, height, width, 3)
        )
        for k in range(count):
            film[k] = filming.render(script.pose_at(script.motion_from_s - BEFORE_S + k / FILM_FPS), k)
            watch(number * count + k + 1, len(all_cameras) * count)
        film.flush()
    calibration(folder, plan)  # last: it marks the folder as complete


def rig_files(folder: Path, plan: Plan) -> tuple[Path, ...]:
    """Write the plan's rig files to the folder of its films; return their paths.  Raises OSError."""
    # Stand-ins measure no body: the integrator uses average proportions.
    given = person(SEED).height if plan.stand_ins and plan.method == "two-view" else None
    return tuple(_write_rig(folder / f"{name}.toml", name, plan, plan.rate, given) for name in plan.rig_names)


def recording_rig_file(folder: Path, plan: Plan) -> Path:
    """Write the rig file with which the films are tracked beforehand, every image of them.  Raises OSError."""
    return _write_rig(folder / "recording.toml", "recording", plan, FILM_FPS, None)


def _write_rig(path: Path, name: str, plan: Plan, fps: float, height: float | None) -> Path:
    tables = [f'name = "{name}"\ncalibration = "calibration.toml"\nmethod = "{plan.method}"\n']
    tables += [] if height is None else [f"person_height = {height:.3f}\n"]
    tables += ["[log]\nfoxglove = false\n"]
    tables += [
        f'[[viewer]]\nid = "{id}"\ncamera = "cam{int(id):02d}"\nsource = "rendered:cam{int(id):02d}.npy?fps={FILM_FPS:g}"\n'
        f'background = "image:cam{int(id):02d}.png"\nsize = [{plan.size[0]}, {plan.size[1]}]\nfps = {fps}\n'
        for id in plan.views
    ]
    path.write_text("\n".join(tables), encoding="utf-8")
    return path
