"""Scene points of the visual hull against the actor's true surface, by number of views: error, normals, time.

    python -m tests.evaluation.hull [--people N] [--points N] [--plot FOLDER]

Exact silhouettes, 640 x 480, cameras in a ring 4.6 m away.  Two stand at a right angle; of an even number some face each
other and see nearly the same outline, so that 4 and 6 are little better than 3 and 5.  Of the scene points:
off      distance from the true surface to the line between near and far (mm): what is left once the point has slid;
middle   distance from the true surface to the interval's middle (mm): what it would be without sliding;
holds    share of the intervals that the place where the line touches the person is in, within 2 cm (%);
length   of the interval (mm);  normal: angle to the true normal at that place (degrees);
kept     share of the lines that survive (%);  time: of `scene_points`, one core (ms).  Budget: 2.5 ms at 7 views.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from common.actor.person import Person, person
from common.actor.pose import ActorPose, Placement
from common.actor.render import ActorCamera
from common.actor.script import stretched
from common.actor.skeleton import pose_bones
from common.actor.surface import posed, rest_surface
from common.actor.walking import walk
from common.camera.pinhole import Camera
from common.vision.background import Mask
from services.tracker.hull import scene_points
from services.tracker.scene import Scene
from tests.actor_cameras import look
from tests.evaluation.table import table

Floats = NDArray[np.float64]

VIEWS = (2, 3, 4, 5, 6, 7)
DISTANCE_M, HEIGHT_M = 4.6, 1.6
TOUCHES_M = 0.02  # how far beside an interval the touching place may be
ALONG = 40  # places looked at on an interval
ROUNDS = 5
COLUMNS = (
    "views", "off mm", "90 %", "99 %", "middle mm", "holds %", "length mm", "normal deg", "90 %", "kept %", "time ms"
)  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """Places (n, 3) a few mm apart all over the true surface, with their normals (n, 3)."""

    places: Floats
    normals: Floats


def surface_of(somebody: Person, pose: ActorPose) -> Surface:
    rest = rest_surface(somebody)
    points, normals = posed(rest, somebody, pose_bones(somebody, pose))
    corner = [part[rest.triangles] for part in (points, normals)]
    steps = 6
    shares = [(a / steps, b / steps) for a in range(steps + 1) for b in range(steps + 1 - a)]
    places, directions = (
        np.concatenate([a * c[:, 0] + b * c[:, 1] + (1 - a - b) * c[:, 2] for a, b in shares]) for c in corner
    )
    directions /= np.maximum(np.linalg.norm(directions, axis=1), 1e-9)[:, None]
    return Surface(places, directions)


def ring(count: int, turn: float) -> list[Camera]:
    """Cameras around the person, the first at `turn` radians."""
    apart = np.pi / 2 if count == 2 else 2 * np.pi / count
    cameras = []
    for k in range(count):
        angle = turn + k * apart
        place = np.array([DISTANCE_M * np.sin(angle), HEIGHT_M + 0.25 * (k % 2), DISTANCE_M * np.cos(angle)])
        cameras.append(look(f"cam{k + 1:02d}", place, np.array([0.0, 0.95, 0.0])))
    return cameras


def poses(somebody: Person) -> list[ActorPose]:
    motion = walk(somebody, [Placement(0.0, 0.45 * k, 0.0) for k in range(1, 4)], 0.6)
    return [stretched(somebody), *(motion.pose_at(time_s) for time_s in (0.75, 1.3))]


def errors(scene: Scene, truth: Surface) -> dict[str, Floats]:
    """Of the scene points, in metres and radians; `holds` 0 or 1, which and `normal` are of every third."""
    tree = cKDTree(truth.places)
    middle, _ = tree.query(scene.points)
    off = np.full(len(scene.view), np.inf)
    for share in np.linspace(0.0, 1.0, ALONG):
        depth = scene.near + share * (scene.far - scene.near)
        off = np.minimum(off, tree.query(scene.origin + depth[:, None] * scene.direction)[0])
    looked_at = range(0, len(off), 3)  # enough for a share and an angle
    holds, angle = [], []
    for k in looked_at:
        offset = truth.places - scene.origin[k]
        depth = offset @ scene.direction[k]
        beside = np.linalg.norm(offset - depth[:, None] * scene.direction[k], axis=1)
        touching = beside < beside.min() + 0.002  # where two limbs touch the line, either is right
        inside = (depth >= scene.near[k] - TOUCHES_M) & (depth <= scene.far[k] + TOUCHES_M)
        holds.append(float(np.any(touching & inside)))
        angle.append(float(np.arccos(np.clip(np.max(truth.normals[touching] @ scene.normal[k]), -1.0, 1.0))))
    length = scene.far - scene.near
    return {"off": off, "middle": middle, "holds": np.array(holds), "length": length, "normal": np.array(angle)}


def measure(views: int, people: int, points: int) -> tuple[float, ...]:
    """The figures of COLUMNS."""
    found: dict[str, list[Floats]] = {}
    kept, seconds = [], []
    for seed in range(people):
        somebody = person(seed)
        cameras = ring(views, 0.37 * seed)
        films = [ActorCamera(camera, somebody, 0) for camera in cameras]
        for pose in poses(somebody):
            masks: list[Mask | None] = [film.silhouette(pose) for film in films]
            scene = scene_points(masks, cameras, points)
            for _ in range(ROUNDS):
                started = perf_counter()
                scene_points(masks, cameras, points)
                seconds.append(perf_counter() - started)
            kept.append(len(scene.view) / points)
            for name, values in errors(scene, surface_of(somebody, pose)).items():
                found.setdefault(name, []).append(values)
    every = {name: np.concatenate(values) for name, values in found.items()}
    off, angle = 1000 * every["off"], np.degrees(every["normal"])
    return (
        float(np.median(off)), float(np.percentile(off, 90)), float(np.percentile(off, 99)),
        1000 * float(np.median(every["middle"])), 100 * float(np.mean(every["holds"])),
        1000 * float(np.median(every["length"])), float(np.median(angle)), float(np.percentile(angle, 90)),
        100 * float(np.mean(kept)), 1000 * float(np.median(seconds)),
    )  # fmt: skip


def plot(folder: Path, rows: list[tuple[int | float, ...]]) -> Path:
    """hull.png in a folder that is there."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    FigureCanvasAgg(figure)
    views = [int(row[0]) for row in rows]
    shown = (
        ("Distance from the true surface (mm)", (("median", 1), ("90 %", 2), ("99 %", 3), ("middle, median", 4))),
        ("Share of the points (%)", (("interval holds the touching place", 5), ("line survives", 9))),
        ("Angle between normals (degrees)", (("median", 7), ("90 %", 8))),
        ("Time of scene_points (ms)", (("median, one core", 10),)),
    )
    for axes, (title, lines) in zip(figure.subplots(2, 2).flat, shown, strict=True):
        for label, column in lines:
            axes.plot(views, [row[column] for row in rows], marker="o", label=label)
        axes.set(title=title, xlabel="views", xticks=views)
        if "%" not in title:
            axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        axes.legend()
    path = folder / "hull.png"
    figure.savefig(path, dpi=110)
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=5, help="seeds of the actor (default 5), three poses each")
    parser.add_argument("--points", type=int, default=400)
    parser.add_argument("--plot", type=Path, help="folder for hull.png")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows: list[tuple[int | float, ...]] = [(v, *measure(v, options.people, options.points)) for v in VIEWS]
    print(table(f"Scene points by views: {options.people} people, {options.points} points", COLUMNS, rows))
    if options.plot:
        print(f"\nPlot: {plot(options.plot, rows)}")


if __name__ == "__main__":
    main()
