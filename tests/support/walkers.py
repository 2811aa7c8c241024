"""Simulated walkers in a ring of cameras, for the calibration from a walk."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.motion.footsteps import Placement, walk
from zenocap.simulation.motion.gait import Motion
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE = (320, 240)
STEPS, STEP_S = 44, 0.5
STRIDE = 0.3  # of the stature
RAGGED = 0.15  # share of the pixels at the edge of a silhouette that are wrong


@dataclass(frozen=True)
class Walker:
    """cameras: with true poses; the person walks from the origin along `motion`."""

    person: Person
    motion: Motion
    cameras: Mapping[str, Camera]
    seed: int

    def instants(self, per_s: float) -> Iterator[dict[str, Mask]]:
        """Silhouettes (height, width) of 0 and 1 by camera, ragged at the edges."""
        rng = np.random.default_rng(self.seed)
        films = {name: SimulatedCamera(camera, self.person, self.seed) for name, camera in self.cameras.items()}
        for k in range(int(self.motion.duration_s * per_s)):
            pose = self.motion.pose_at(k / per_s)
            yield {name: ragged(film.silhouette(pose), rng) for name, film in films.items()}

    def film(self, name: str, times: Sequence[float] | Floats) -> Iterator[Mask]:
        """Silhouettes of one camera at any times, as those of `instants`."""
        rng = np.random.default_rng([self.seed, int(name[3:])])
        camera = SimulatedCamera(self.cameras[name], self.person, self.seed)
        for time_s in times:
            yield ragged(camera.silhouette(self.motion.pose_at(float(time_s))), rng)


def ragged(silhouette: Mask, rng: np.random.Generator) -> Mask:
    """A silhouette of 0 and 1 with wrong pixels at its edge."""
    mask = np.asarray(silhouette != 0, dtype=np.uint8)
    edge = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) != 0
    return np.where(edge & (rng.random(mask.shape) < RAGGED), 1 - mask, mask).astype(np.uint8)


def figure_of_eight(stature: float, rng: np.random.Generator, steps: int = STEPS) -> list[Placement]:
    """A path of random size and direction that starts at the origin towards +Z; stature in m."""
    width, length = rng.uniform(0.9, 1.5, size=2)
    phase = np.linspace(0.0, 6.0 * np.pi, 20_000)
    phase = phase + 0.3 * np.sin(0.37 * phase)
    x, z = width * np.sin(phase), 0.8 * length * np.sin(2.0 * phase)
    yaw = np.unwrap(np.arctan2(np.gradient(x), np.gradient(z)))
    c, s = np.cos(yaw[0]), np.sin(yaw[0])
    x, z = c * x - s * z, s * x + c * z
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    at = STRIDE * stature * np.arange(1, steps + 1)
    places = np.column_stack([np.interp(at, ways, values) for values in (x, z, yaw - yaw[0])])
    return [Placement(*map(float, row)) for row in places]


def walker(seed: int, views: int, size: tuple[int, int] = SIZE, steps: int = STEPS) -> Walker:
    """An adult and cameras at random places about the walk, 0.9 to 2.6 m high, rolled by up to 4 degrees."""
    rng = np.random.default_rng(seed)
    subject = next(one for k in range(100) if (one := person(100 + seed + 1000 * k)).height >= 1.45)
    path = figure_of_eight(subject.height, rng, steps)
    middle = np.mean([[place.x, place.z] for place in path], axis=0)
    first, cameras = rng.uniform(0.0, 2.0 * np.pi), {}
    for k in range(views):
        angle = first + (2.0 * np.pi * k / views if views > 2 else np.radians(80.0) * k) + rng.uniform(-0.25, 0.25)
        away = rng.uniform(4.2, 6.0)
        place = np.array([middle[0] + away * np.sin(angle), rng.uniform(0.9, 2.6), middle[1] + away * np.cos(angle)])
        target = np.array([middle[0] + rng.uniform(-0.3, 0.3), 0.9, middle[1] + rng.uniform(-0.3, 0.3)])
        camera = look(f"cam{k + 1:02}", place, target, np.radians(rng.uniform(-4.0, 4.0)))
        matrix = camera.matrix.copy()
        matrix[0, 0] = matrix[1, 1] = rng.uniform(450.0, 600.0)
        cameras[camera.name] = replace(camera, matrix=matrix).resized(size)
    return Walker(subject, walk(subject, path, STEP_S / subject.manner.tempo), cameras, seed)
