"""Camera that renders the simulated person: room, soft shadow, shading, flicker and sensor noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from zlib import crc32

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Image
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.body.skeleton import Bones
from zenocap.simulation.body.surface import rest_surface, skin
from zenocap.simulation.rendering.rasterizer import (
    NEAR_M,
    apply_shadow,
    composite,
    downsample,
    fill_triangles,
    sensor_image,
)
from zenocap.simulation.rendering.scene import room, view

SHADOW = 0.25  # fraction of the light removed by the person's shadow
SHADOW_STEP = 0.5  # shadow samples per pixel; few suffice for a soft shadow
PENUMBRA_M = 0.07
SAMPLES = 1.2e6  # samples per image, which determines the samples per pixel


@dataclass(frozen=True)
class Region:
    """Columns left..left + width and rows top..top + height of an image."""

    left: int
    top: int
    width: int
    height: int

    @property
    def pixels(self) -> tuple[slice, slice]:
        """Index of its pixels in an image."""
        return slice(self.top, self.top + self.height), slice(self.left, self.left + self.width)


class SimulatedCamera:
    """Renders one person in the room of a seed.

    camera: any pose and lens.  seed: of room, light and noise; cameras with equal seeds are in the same room.
    """

    def __init__(self, camera: Camera, person: Person, seed: int) -> None:
        self.camera = camera
        self.person = person
        self._surface = rest_surface(person)
        place = room(camera, seed)
        self._light = place.light
        self._view = view(place, camera)
        width, height = camera.size
        self._samples = int(np.clip(round((SAMPLES / (width * height)) ** 0.5), 1, 4))
        self._key = crc32(f"{seed} {camera.name}".encode())
        draw = np.random.default_rng([0x13, seed, crc32(camera.name.encode())])
        self._sigma = float(draw.uniform(2.0, 3.0))

    def background(self) -> Image:
        """Image of the empty room without noise, (height, width, 3) BGR."""
        image: Image = np.rint(self._view.bgr).astype(np.uint8)
        return image

    def empty(self) -> Floats32:
        """The empty room without noise, (height, width, 3) grey levels; a copy."""
        return self._view.bgr.copy()

    def render(
        self,
        pose: PersonPose | Bones | None,
        frame: int,
        room: Floats32 | None = None,
        beside: "Sequence[tuple[SimulatedCamera, PersonPose]]" = (),
        gloss: float = 0.0,
    ) -> Image:
        """Image number `frame` with the person in `pose`, None for the empty room; (height, width, 3) BGR.

        room: (height, width, 3) grey levels, drawn instead of the empty room; furniture in it is behind all people.
        beside: further people in the room, each with an equal camera of their own.
        gloss: share of the people's light that the floor mirrors, 0 to 1.
        """
        scene = self._view.bgr.copy() if room is None else np.ascontiguousarray(room, dtype=np.float32).copy()
        figures = [*beside] if pose is None else [(self, pose), *beside]
        posed = [(one, *one._posed(at)) for one, at in figures]
        for one, points, normals in posed:
            one._cast_shadow(scene, points)
            if gloss > 0.0:
                one._mirror(scene, points, normals, gloss)
        for one, points, normals in sorted(posed, key=lambda figure: -self._distance(figure[1])):
            layer, region = one._draw(points, one._lit(normals), self._samples)
            if region is not None:
                composite(scene, layer, region.left, region.top)
        key = crc32(f"{self._key} {frame}".encode())
        gain = 1.0 + 0.006 * (2.0 * (key % 4096) / 4095.0 - 1.0)
        out = np.empty(scene.shape, dtype=np.uint8)
        sensor_image(scene, gain, self._sigma, key, out)
        return out

    def distance(self, pose: PersonPose | Bones) -> float:
        """Distance of the person from the camera along the optical axis, metres."""
        return self._distance(self._posed(pose)[0])

    def _posed(self, pose: PersonPose | Bones) -> tuple[Floats, Floats]:
        return skin(self._surface, self.person, pose)

    def _distance(self, points: Floats) -> float:
        return float(np.median(points @ self.camera.rotation[2]) + self.camera.translation[2])

    def silhouette(self, pose: PersonPose | Bones | None) -> Image:
        """The person's exact mask (height, width): 255 where at least half of the pixel is covered, else 0."""
        mask = np.zeros(self.camera.size[::-1], dtype=np.uint8)
        if pose is not None:
            points, normals = self._posed(pose)
            layer, region = self._draw(points, self._lit(normals), 4)
            if region is not None:
                mask[region.pixels] = np.where(layer[..., 3] >= 0.5, 255, 0)
        return mask

    def _lit(self, normals: Floats) -> Floats:
        light = self._light
        direct = np.clip(normals @ light.towards, 0.0, None) ** 0.8
        ambient = light.ambient * (0.85 + 0.15 * normals[:, 1])
        lit: Floats = np.minimum(self._surface.bgr * (ambient + light.direct * direct)[:, None], 250.0)
        return lit

    def _draw(self, points: Floats, bgr: Floats, samples: int) -> tuple[Floats32, Region | None]:
        """Layer (h, w, 4) of the person, premultiplied colour and coverage, and its region; None outside the image."""
        pixels, depth = self._project(points)
        region = self._region(pixels[depth > NEAR_M], 1)
        if region is None:
            return np.zeros((0, 0, 4), dtype=np.float32), None
        shape = (region.height * samples, region.width * samples)
        nearness, colour = np.zeros(shape, dtype=np.float32), np.empty((*shape, 3), dtype=np.float32)
        # A pixel extends half a pixel around its centre; samples are at the centres of its samples x samples cells.
        corner = np.array([region.left - 0.5, region.top - 0.5])
        fine = ((pixels - corner) * samples - 0.5).astype(np.float32)
        fill_triangles(fine, depth.astype(np.float32), bgr.astype(np.float32), self._surface.triangles, nearness, colour)
        layer = np.empty((region.height, region.width, 4), dtype=np.float32)
        downsample(nearness, colour, samples, layer)
        return layer, region

    def _mirror(self, scene: Floats32, points: Floats, normals: Floats, gloss: float) -> None:
        """Draw the mirror image of the person in the floor."""
        below = points * np.array([1.0, -1.0, 1.0])
        layer, region = self._draw(below, self._lit(normals), self._samples)
        if region is not None:
            faint = layer * np.float32(gloss) * self._view.floor[region.pixels][..., None]
            composite(scene, np.ascontiguousarray(faint), region.left, region.top)

    def _cast_shadow(self, scene: Floats32, points: Floats) -> None:
        ground = points + points[:, 1:2] * self._light.fall  # `fall` drops one metre
        pixels, depth = self._project(ground)
        ahead = depth > NEAR_M
        if not ahead.any():
            return
        focal = float(self.camera.matrix[0, 0])
        blur = PENUMBRA_M * focal / max(float(np.median(depth[ahead])), 0.5)
        region = self._region(pixels[ahead], int(3 * blur) + 2)
        if region is None:
            return
        size = (max(int(region.width * SHADOW_STEP), 1), max(int(region.height * SHADOW_STEP), 1))
        scale = np.array([size[0] / region.width, size[1] / region.height])
        coarse = ((pixels - [region.left - 0.5, region.top - 0.5]) * scale - 0.5).astype(np.float32)
        dark, colour = np.zeros(size[::-1], dtype=np.float32), np.empty((size[1], size[0], 3), dtype=np.float32)
        fill_triangles(
            coarse, depth.astype(np.float32), np.zeros_like(ground, dtype=np.float32), self._surface.triangles, dark, colour
        )
        covered = (dark > 0).astype(np.float32)
        # The width of a penumbra follows the image scale sideways, and is foreshortened along the ground.
        soft = cv2.GaussianBlur(covered, (0, 0), max(blur * SHADOW_STEP, 0.4), sigmaY=max(0.45 * blur * SHADOW_STEP, 0.4))
        soft = cv2.resize(soft, (region.width, region.height), interpolation=cv2.INTER_LINEAR)
        light = np.float32(1.0) - np.float32(SHADOW) * soft * self._view.floor[region.pixels]
        apply_shadow(scene, np.ascontiguousarray(light, dtype=np.float32), region.left, region.top)

    def _project(self, points: Floats) -> tuple[Floats, Floats]:
        """Pixels (n, 2) and depth (n,), metres along the optical axis; depth 0 for points that cannot be in the image."""
        camera = self.camera
        local = points @ camera.rotation.T + camera.translation
        depth = local[:, 2].copy()
        if not np.any(camera.distortions):
            with np.errstate(divide="ignore", invalid="ignore"):
                homogeneous = local @ camera.matrix.T
                pixels: Floats = homogeneous[:, :2] / homogeneous[:, 2:]
            depth[depth <= NEAR_M] = 0.0
            return np.nan_to_num(pixels), depth
        flat = np.hypot(local[:, 0], local[:, 1]) / np.maximum(depth, 1e-6)
        reach = 1.5 * float(np.hypot(*camera.size)) / float(camera.matrix[0, 0])
        depth[flat > reach] = 0.0  # a distortion polynomial is not monotonic far outside the image
        return np.nan_to_num(camera.project(points)), depth

    def _region(self, pixels: Floats, margin: int) -> Region | None:
        if len(pixels) == 0:
            return None
        low, high = np.floor(pixels.min(axis=0)) - margin, np.ceil(pixels.max(axis=0)) + margin
        left, top = max(int(low[0]), 0), max(int(low[1]), 0)
        right, bottom = min(int(high[0]), self.camera.size[0] - 1), min(int(high[1]), self.camera.size[1] - 1)
        if left > right or top > bottom:
            return None
        return Region(left, top, right - left + 1, bottom - top + 1)
