"""What the load's viewers look at: cameras around the actor, filmed once beforehand, and the rigs' files."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from common.actor.person import person
from common.actor.render import ActorCamera
from common.actor.script import motion_script
from common.body.anatomy import Floats
from common.camera.files import write_calibration
from common.camera.pinhole import Camera
from services.load.plan import Plan

FILM_FPS = 60.0
LONGEST, SHORTEST, MOST_BYTES = 120, 30, 1.5e9  # pictures of a film; bytes of all films together
DISTANCE, HEIGHT = 5.2, 1.0  # of the cameras from the middle of the action region and from the ground, metres
FOCAL = 600.0 / 640.0  # of the image's width
SEED = 0
BEFORE_S = 1.2  # of the film before the walk: the initial posture, and the arms going down


def cameras(count: int, size: tuple[int, int]) -> tuple[Camera, ...]:
    """The paper's two at right angles, or any other number around, no two of them opposite; the first is on +Z."""
    halfway = [0.5 / count if 2 * k >= count and count % 2 == 0 else 0.0 for k in range(count)]
    turns = [0.0, -0.25] if count == 2 else [k / count + more for k, more in enumerate(halfway)]
    return tuple(_camera(f"cam{k + 1:02d}", 2 * np.pi * turn, size) for k, turn in enumerate(turns))


def _camera(name: str, azimuth: float, size: tuple[int, int]) -> Camera:
    """Looks horizontally at the middle from `azimuth` radians, counted from +Z towards +X."""
    width, height = size
    centre = np.array([DISTANCE * np.sin(azimuth), HEIGHT, DISTANCE * np.cos(azimuth)])
    forward = np.array([-np.sin(azimuth), 0.0, -np.cos(azimuth)])
    right = np.cross(forward, [0.0, 1.0, 0.0])
    rotation: Floats = np.stack([right, np.cross(forward, right), forward])
    matrix = np.array([[FOCAL * width, 0.0, (width - 1) / 2], [0.0, FOCAL * width, (height - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera(name, size, matrix, np.zeros(5), rotation, -rotation @ centre)


def pictures(count: int, size: tuple[int, int]) -> int:
    """How many pictures each of `count` films has."""
    return int(np.clip(MOST_BYTES / (count * size[0] * size[1] * 3), SHORTEST, LONGEST))


def calibration(folder: Path, plan: Plan) -> tuple[Camera, ...]:
    """The plan's cameras, and their file in `folder`, which is all that those need who see no picture.  Raises OSError."""
    around = cameras(plan.viewers, plan.size)
    folder.mkdir(parents=True, exist_ok=True)
    write_calibration(folder / "calibration.toml", {camera.name: camera for camera in around})
    return around


def film(folder: Path, plan: Plan, watch: Callable[[int, int], None] = lambda done, of: None) -> None:
    """Write calibration, films and background pictures of a plan's cameras into `folder`, unless they are there.

    watch: how many pictures are done, and of how many.  Raises OSError.
    """
    if (folder / "calibration.toml").exists():
        return
    somebody = person(SEED)
    script = motion_script(somebody, "walking", SEED)
    count = pictures(plan.viewers, plan.size)
    width, height = plan.size
    around = cameras(plan.viewers, plan.size)
    folder.mkdir(parents=True, exist_ok=True)
    for number, camera in enumerate(around):
        filming = ActorCamera(camera, somebody, SEED)
        cv2.imwrite(str(folder / f"{camera.name}.png"), filming.background())
        film = np.lib.format.open_memmap(
            folder / f"{camera.name}.npy", "w+", dtype=np.uint8, shape=(count, height, width, 3)
        )
        for k in range(count):
            film[k] = filming.render(script.pose_at(script.motion_from_s - BEFORE_S + k / FILM_FPS), k)
            watch(number * count + k + 1, len(around) * count)
        film.flush()
    calibration(folder, plan)  # last: it says that all is there


def rig_files(folder: Path, plan: Plan) -> tuple[Path, ...]:
    """Write the plan's rig files beside its films; their paths.  Raises OSError."""
    # Stand-ins measure no body: the integrator takes one of average proportions.
    given = person(SEED).height if plan.stand_ins and plan.method == "two-view" else None
    return tuple(_written(folder / f"{name}.toml", name, plan, plan.rate, given) for name in plan.rig_names)


def rehearsal_file(folder: Path, plan: Plan) -> Path:
    """Write the rig file by which the films are tracked beforehand, every picture of them.  Raises OSError."""
    return _written(folder / "rehearsal.toml", "rehearsal", plan, FILM_FPS, None)


def _written(path: Path, name: str, plan: Plan, fps: float, height: float | None) -> Path:
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
