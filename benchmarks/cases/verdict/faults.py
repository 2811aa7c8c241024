"""Faults of a recording, injected into silhouettes or into the calibration.

A fault whose effect on silhouettes is exactly known is injected there: a camera that is turned is a homography, a late
video is a shift.  Low contrast, shadows and clutter are imitated by what they do to a silhouette.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera

Masks = Mapping[str, list[Mask]]  # by view, one per frame, (height, width) of 0 and 1
MIDDLE = np.array([0.0, 1.0, 0.0])  # m, of the scene


@dataclass(frozen=True)
class FaultyScene:
    """What the tracker gets.  cameras: the calibration.  other: silhouettes of a second person.

    motion_from: first frame of the motion.  first: first frame that the tracker gets.
    """

    cameras: Mapping[str, Camera]
    masks: Masks
    other: Masks
    motion_from: int
    fps: float
    first: int = 0


Fault = Callable[[FaultyScene, np.random.Generator], FaultyScene]


def _view(scene: FaultyScene, rng: np.random.Generator) -> str:
    return str(rng.choice(sorted(scene.cameras)))


def _calibrated(scene: FaultyScene, view: str, camera: Camera) -> FaultyScene:
    return replace(scene, cameras={**scene.cameras, view: camera})


def _seen(scene: FaultyScene, change: Callable[[str, int, Mask], Mask]) -> FaultyScene:
    """The scene with every silhouette changed; change: of view, frame and mask."""
    masks = {view: [change(view, k, mask) for k, mask in enumerate(film)] for view, film in scene.masks.items()}
    return replace(scene, masks=masks)


def focal_length(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """The focal length of one camera is 4 to 25 % off."""
    view = _view(scene, rng)
    factor = 1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(0.04, 0.25)
    matrix = scene.cameras[view].matrix.copy()
    matrix[0, 0] *= factor
    matrix[1, 1] *= factor
    return _calibrated(scene, view, replace(scene.cameras[view], matrix=matrix))


def turned(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One camera was turned by 1 to 12 degrees after its calibration."""
    view = _view(scene, rng)
    camera = scene.cameras[view]
    rotation = _small_turn(rng, 1.0, 12.0) @ camera.rotation
    return _calibrated(scene, view, replace(camera, rotation=rotation, translation=-rotation @ camera.centre))


def another_rig(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One camera has the calibration of another rig: it stands 0.2 to 2 m elsewhere and looks at the same place."""
    view = _view(scene, rng)
    camera = scene.cameras[view]
    step = rng.normal(size=3)
    centre = camera.centre + step / np.linalg.norm(step) * rng.uniform(0.2, 2.0)
    return _calibrated(scene, view, replace(look(view, centre, MIDDLE).resized(camera.size), name=camera.name))


def swapped(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """The videos of two cameras are exchanged."""
    one, other = (str(name) for name in rng.choice(sorted(scene.cameras), 2, replace=False))
    return replace(scene, masks={**scene.masks, one: scene.masks[other], other: scene.masks[one]})


def moved(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One camera is turned by 1 to 10 degrees in the middle of the motion."""
    view = _view(scene, rng)
    camera, turn = scene.cameras[view], _small_turn(rng, 1.0, 10.0)
    count = len(scene.masks[view])
    since = scene.motion_from + (count - scene.motion_from) // 3
    warp = camera.matrix @ turn @ np.linalg.inv(camera.matrix)
    return _seen(scene, lambda name, k, mask: _warped(mask, warp) if name == view and k >= since else mask)


def late(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One video begins 0.1 to 1 s late, and nothing says so."""
    view, lag = _view(scene, rng), max(1, round(scene.fps * rng.uniform(0.1, 1.0)))
    film = scene.masks[view]
    return replace(scene, masks={**scene.masks, view: [film[min(k + lag, len(film) - 1)] for k in range(len(film))]})


def grey(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """Low contrast: 10 to 70 % of the person looks like the background, in all views."""
    share = rng.uniform(0.1, 0.7)
    fields = {view: _noise(scene.cameras[view].size, rng) for view in scene.cameras}

    def change(view: str, k: int, mask: Mask) -> Mask:
        hidden = np.roll(fields[view], 3 * k, axis=1) < share  # the person moves against the background
        return np.where(hidden, 0, mask).astype(np.uint8)

    return _seen(scene, change)


def holes(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """Bad segmentation: in each frame 1 to 5 pieces of a silhouette are missing, in one view or all."""
    views = [_view(scene, rng)] if rng.random() < 0.5 else sorted(scene.masks)
    count, size = int(rng.integers(1, 6)), rng.uniform(0.08, 0.2)

    def change(view: str, k: int, mask: Mask) -> Mask:
        return _punched(mask, count, size, rng) if view in views else mask

    return _seen(scene, change)


def no_legs(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """The lower 15 to 50 % of the person are missing, in one view or all."""
    views = [_view(scene, rng)] if rng.random() < 0.5 else sorted(scene.masks)
    share = rng.uniform(0.15, 0.5)

    def change(view: str, k: int, mask: Mask) -> Mask:
        _left, top, _width, height = cv2.boundingRect(mask)
        cut = mask.copy()
        cut[top + round((1.0 - share) * height) :] = 0
        return cut if view in views and height else mask

    return _seen(scene, change)


def shadow(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """A shadow on the floor beside the feet, in all views."""
    side, length, thick = rng.choice((-1.0, 1.0)), rng.uniform(0.15, 0.7), rng.uniform(0.03, 0.09)

    def change(view: str, k: int, mask: Mask) -> Mask:
        left, top, width, height = cv2.boundingRect(mask)
        if not height:
            return mask
        centre = (round(left + 0.5 * width + side * 0.5 * length * height), round(top + 0.96 * height))
        axes = (max(1, round(0.5 * length * height)), max(1, round(thick * height)))
        return np.asarray(cv2.ellipse(mask.copy(), centre, axes, 0.0, 0.0, 360.0, (1,), -1), dtype=np.uint8)

    return _seen(scene, change)


def clutter(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """Something else than the person differs from the background, in one view or all."""
    views = [_view(scene, rng)] if rng.random() < 0.5 else sorted(scene.masks)
    spots = {}
    for view in views:
        width, height = scene.cameras[view].size
        size = rng.uniform(0.04, 0.2) * height
        x, y = (int(rng.uniform(0.1, 0.9) * side) for side in (width, height))
        spots[view] = ((x, y), (max(1, round(size)), max(1, round(size * rng.uniform(0.3, 1.0)))))

    def change(view: str, k: int, mask: Mask) -> Mask:
        if view not in spots:
            return mask
        return np.asarray(cv2.ellipse(mask.copy(), *spots[view], 0.0, 0.0, 360.0, (1,), -1), dtype=np.uint8)

    return _seen(scene, change)


def no_t_pose(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """The recording begins when the person already moves."""
    return replace(scene, first=scene.motion_from)


def second_person(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """Another person stands or moves 0.5 to 1.2 m beside."""
    return _seen(scene, lambda view, k, mask: mask | scene.other[view][k % len(scene.other[view])])


def cropped(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """All cameras or one are zoomed in so far, and calibrated so, that the person is partly outside of the images."""
    views = [_view(scene, rng)] if rng.random() < 0.5 else sorted(scene.masks)
    zoom = rng.uniform(1.2, 2.2)
    cameras, warps = dict(scene.cameras), {}
    for view in views:
        width, height = scene.cameras[view].size
        shift = rng.uniform(-0.15, 0.15) * height
        warps[view] = np.array(
            [[zoom, 0.0, 0.5 * width * (1 - zoom)], [0.0, zoom, 0.5 * height * (1 - zoom) + shift], [0, 0, 1]]
        )
        cameras[view] = replace(scene.cameras[view], matrix=warps[view] @ scene.cameras[view].matrix)
    found = _seen(scene, lambda view, k, mask: _warped(mask, warps[view]) if view in warps else mask)
    return replace(found, cameras=cameras)


def frozen(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One video shows the same frame from the first third of the motion on."""
    view = _view(scene, rng)
    since = scene.motion_from + (len(scene.masks[view]) - scene.motion_from) // 3
    return _seen(scene, lambda name, k, mask: scene.masks[view][min(k, since)] if name == view else mask)


def repeated(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One video repeats a frame for 0.5 to 2 s, somewhere in the motion."""
    view, count = _view(scene, rng), max(1, round(scene.fps * rng.uniform(0.5, 2.0)))
    since = int(rng.integers(scene.motion_from, max(scene.motion_from, len(scene.masks[view]) - count) + 1))
    masks = [scene.masks[view][since if since <= k < since + count else k] for k in range(len(scene.masks[view]))]
    return replace(scene, masks={**scene.masks, view: masks})


def empty(scene: FaultyScene, rng: np.random.Generator) -> FaultyScene:
    """One view loses the person from the first third of the motion on."""
    view = _view(scene, rng)
    since = scene.motion_from + (len(scene.masks[view]) - scene.motion_from) // 3
    return _seen(scene, lambda name, k, mask: np.zeros_like(mask) if name == view and k >= since else mask)


LATE = "one video 0.1-1 s late"
FAULTS: Mapping[str, Fault] = {
    "none": lambda scene, rng: scene,
    "focal length 4-25 % off": focal_length,
    "camera turned by 1-12°": turned,
    "another rig's calibration": another_rig,
    "cameras swapped": swapped,
    "camera moved midway by 1-10°": moved,
    LATE: late,
    "grey: 10-70 % missing": grey,
    "holes": holes,
    "legs missing": no_legs,
    "shadow": shadow,
    "clutter": clutter,
    "no T-pose": no_t_pose,
    "second person": second_person,
    "person cut by the image": cropped,
    "one view frozen": frozen,
    "one view empty": empty,
    "one view repeats 0.5-2 s": repeated,
}


def _small_turn(rng: np.random.Generator, least_deg: float, most_deg: float) -> Floats:
    axis = rng.normal(size=3) * [1.0, 1.0, 0.5]
    angle = np.radians(rng.uniform(least_deg, most_deg))
    turn: Floats = np.asarray(Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix(), dtype=np.float64)
    return turn


def _warped(mask: Mask, homography: Floats) -> Mask:
    height, width = mask.shape
    return np.asarray(cv2.warpPerspective(mask, homography, (width, height), flags=cv2.INTER_NEAREST), dtype=np.uint8)


def _noise(size: tuple[int, int], rng: np.random.Generator) -> Floats:
    """(height, width) smooth noise, uniform in 0 to 1: its value is the share of pixels that have less."""
    smooth = cv2.GaussianBlur(rng.normal(size=size[::-1]), (0, 0), 8.0)
    order = np.argsort(smooth, axis=None).argsort().reshape(smooth.shape)
    found: Floats = order / order.size
    return found


def _punched(mask: Mask, count: int, size: float, rng: np.random.Generator) -> Mask:
    """The mask with `count` discs removed.  size: their radius, as a share of the person's height."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return mask
    height = int(rows.max() - rows.min()) + 1
    out = mask.copy()
    for at in rng.integers(len(rows), size=count):
        cv2.circle(out, (int(columns[at]), int(rows[at])), max(1, round(size * height)), (0,), -1)
    return out
