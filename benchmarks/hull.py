"""Scene points of the visual hull against the simulated person's true surface, by number of views: error, normals, time.

    python -m benchmarks.hull [--people N] [--points N] [--plot FOLDER]

Exact silhouettes, 640 x 480, cameras in a ring 4.6 m away.  Two are at a right angle; of an even number some face each
other and see nearly the same contour, so that 4 and 6 are little better than 3 and 5.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from benchmarks.table import table
from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.hull.contour_rays import Scene, scene_points
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement
from zenocap.simulation.body.skeleton import pose_bones
from zenocap.simulation.body.surface import rest_surface, skin
from zenocap.simulation.motion.footsteps import walk
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

VIEWS = (2, 3, 4, 5, 6, 7)
DISTANCE_M, HEIGHT_M = 4.6, 1.6
TOUCHES_M = 0.02  # tolerance of the tangent point beside an interval
ALONG = 40  # samples per interval
ROUNDS = 5
COLUMNS = (
    "views", "distance mm", "90 %", "99 %", "midpoint mm", "contained %", "length mm", "normal deg", "90 %", "kept %",
    "time ms",
)  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """Points (n, 3) a few mm apart over the true surface, with their normals (n, 3)."""

    places: Floats
    normals: Floats


def surface_of(subject: Person, pose: PersonPose) -> Surface:
    rest = rest_surface(subject)
    points, normals = skin(rest, subject, pose_bones(subject, pose))
    corner = [part[rest.triangles] for part in (points, normals)]
    steps = 6
    fractions = [(a / steps, b / steps) for a in range(steps + 1) for b in range(steps + 1 - a)]
    places, directions = (
        np.concatenate([a * c[:, 0] + b * c[:, 1] + (1 - a - b) * c[:, 2] for a, b in fractions]) for c in corner
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


def poses(subject: Person) -> list[PersonPose]:
    motion = walk(subject, [Placement(0.0, 0.45 * k, 0.0) for k in range(1, 4)], 0.6)
    return [t_pose(subject), *(motion.pose_at(time_s) for time_s in (0.75, 1.3))]


def errors(scene: Scene, truth: Surface) -> dict[str, Floats]:
    """Errors of the scene points, metres and radians; `contained` 0 or 1; `normal` of every third point."""
    tree = cKDTree(truth.places)
    midpoint, _ = tree.query(scene.points)
    distance = np.full(len(scene.view), np.inf)
    for fraction in np.linspace(0.0, 1.0, ALONG):
        depth = scene.near + fraction * (scene.far - scene.near)
        distance = np.minimum(distance, tree.query(scene.origin + depth[:, None] * scene.direction)[0])
    checked = range(0, len(distance), 3)  # enough for a fraction and an angle
    contained, angle = [], []
    for k in checked:
        offset = truth.places - scene.origin[k]
        depth = offset @ scene.direction[k]
        distance_to_line = np.linalg.norm(offset - depth[:, None] * scene.direction[k], axis=1)
        touching = distance_to_line < distance_to_line.min() + 0.002  # where two limbs touch the line, either is correct
        inside = (depth >= scene.near[k] - TOUCHES_M) & (depth <= scene.far[k] + TOUCHES_M)
        contained.append(float(np.any(touching & inside)))
        angle.append(float(np.arccos(np.clip(np.max(truth.normals[touching] @ scene.normal[k]), -1.0, 1.0))))
    length = scene.far - scene.near
    return {
        "distance": distance,
        "midpoint": midpoint,
        "contained": np.array(contained),
        "length": length,
        "normal": np.array(angle),
    }


def measure(views: int, people: int, points: int) -> tuple[float, ...]:
    """Figures of COLUMNS."""
    found: dict[str, list[Floats]] = {}
    kept, seconds = [], []
    for seed in range(people):
        subject = person(seed)
        cameras = ring(views, 0.37 * seed)
        films = [SimulatedCamera(camera, subject, 0) for camera in cameras]
        for pose in poses(subject):
            masks: list[Mask | None] = [film.silhouette(pose) for film in films]
            scene = scene_points(masks, cameras, points)
            for _ in range(ROUNDS):
                started = perf_counter()
                scene_points(masks, cameras, points)
                seconds.append(perf_counter() - started)
            kept.append(len(scene.view) / points)
            for name, values in errors(scene, surface_of(subject, pose)).items():
                found.setdefault(name, []).append(values)
    every = {name: np.concatenate(values) for name, values in found.items()}
    distance, angle = 1000 * every["distance"], np.degrees(every["normal"])
    return (
        float(np.median(distance)), float(np.percentile(distance, 90)), float(np.percentile(distance, 99)),
        1000 * float(np.median(every["midpoint"])), 100 * float(np.mean(every["contained"])),
        1000 * float(np.median(every["length"])), float(np.median(angle)), float(np.percentile(angle, 90)),
        100 * float(np.mean(kept)), 1000 * float(np.median(seconds)),
    )  # fmt: skip


def plot(folder: Path, rows: list[tuple[int | float, ...]]) -> Path:
    """Write hull.png to an existing folder."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    FigureCanvasAgg(figure)
    views = [int(row[0]) for row in rows]
    shown = (
        ("Distance from the true surface (mm)", (("median", 1), ("90 %", 2), ("99 %", 3), ("midpoint, median", 4))),
        ("Share of the points (%)", (("interval contains the tangent point", 5), ("rays kept", 9))),
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
