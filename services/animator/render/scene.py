"""One picture: floor, shadows, and bodies in the light."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from common.camera.pinhole import Camera
from services.animator.render.floor import darken_floor, draw_floor
from services.animator.render.lighting import light_body
from services.animator.render.look import GAMMA, Look, linear
from services.animator.render.raster import NEAR_M, Ints, Singles, develop, fill
from services.animator.render.solids import Surface

Image = NDArray[np.uint8]

SUN_DEG = (48.0, 52.0)  # to the camera's left, and above the horizontal
SUN_TEXEL_M, SUN_MARGIN_M, PENUMBRA_M = 0.008, 0.12, 0.022
CONTACT_TEXEL_M, CONTACT_MARGIN_M, CONTACT_BLUR_M, CONTACT_HIGH_M = 0.02, 0.3, 0.055, 0.35
MOST_TEXELS = 2048  # along either side of a map
LINES_M = 1.0  # between bold lines; a fine one each quarter
ABOVE = 1.0  # added to heights, so that all count as near
LEVELS = 4096
TABLE = np.rint(np.linspace(0.0, 1.0, LEVELS) ** (1 / GAMMA) * 255).astype(np.uint8)


@dataclass(frozen=True)
class Ground:
    """middle: (2,) x and z of what is lit, metres.  radius: metres, beyond which the floor fades."""

    middle: Floats
    radius: float


@dataclass(frozen=True)
class _Map:
    """values: (h, w).  place: (3, 4) from the world to column, row and height."""

    values: Singles
    place: Singles

    @property
    def texel(self) -> float:
        """Metres."""
        return 1.0 / float(np.linalg.norm(self.place[0, :3]))


class Stage:
    """An empty floor as one camera sees it, on which bodies are put, picture by picture.

    sun: (3,) unit vector towards it.  samples: along either side of each pixel of a body.
    """

    def __init__(self, camera: Camera, ground: Ground, look: Look, sun: Floats, samples: int = 2) -> None:
        self._camera, self._look, self._sun, self._samples = camera, look, sun, samples
        matrix = camera.matrix
        lens = (matrix[0, 0], matrix[0, 2], matrix[1, 2])
        self._eye = np.array([*camera.rotation, camera.centre, lens], dtype=np.float32)
        colours = [linear(colour) for colour in (look.floor, look.fine, look.bold, look.low, look.high)]
        self._floor = np.array([*colours, (*ground.middle, ground.radius), (LINES_M, 0.0, 0.0)], dtype=np.float32)
        self._empty = np.empty((camera.size[1], camera.size[0], 3), dtype=np.float32)
        draw_floor(self._empty, self._eye, self._floor)

    def picture(self, surface: Surface | None) -> Image:
        """(h, w, 3) blue, green, red: the surface on the floor, or the empty floor."""
        out = self._empty.copy()
        if surface is not None:
            depths = _depths(surface, self._sun)
            self._darken(out, _hidden(depths), self._look.shadow)
            self._darken(out, _contact(surface), self._look.contact)
            self._draw(out, surface, depths)
        image = np.empty(out.shape, dtype=np.uint8)
        develop(out, TABLE, image)
        return image

    def _darken(self, out: Singles, dark: _Map, share: float) -> None:
        """By a map, in that part of the picture where the floor has it."""
        height, width = dark.values.shape
        corners = np.array([[0, 0], [width, 0], [width, height], [0, height]])
        turn = dark.place[:2, [0, 2]].astype(np.float64)  # of the floor's x and z
        x, z = np.linalg.solve(turn, (corners - dark.place[:2, 3]).T)
        region = self._region(np.stack([x, np.zeros(4), z], axis=1), behind=True)
        if region is not None:
            darken_floor(out, region, self._eye, self._floor, dark.values, dark.place, share)

    def _draw(self, out: Singles, surface: Surface, depths: _Map) -> None:
        camera, samples = self._camera, self._samples
        region = self._region(surface.points, behind=False)
        if region is None:
            return
        local = surface.points @ camera.rotation.T + camera.translation
        near = np.where(local[:, 2] > NEAR_M, 1.0 / np.maximum(local[:, 2], NEAR_M), 0.0)
        pixels = (local @ camera.matrix.T)[:, :2] * near[:, None]
        rows, columns = (region[3] - region[1] + 1) * samples, (region[2] - region[0] + 1) * samples
        buffer, row = np.zeros((rows, columns, 4), dtype=np.float32), np.zeros((rows, columns), dtype=np.uint8)
        fine = ((pixels - region[:2] + 0.5) * samples - 0.5).astype(np.float32)  # in the middles of a pixel's cells
        normals = surface.normals.astype(np.float32)
        fill(fine, near.astype(np.float32), normals, surface.shades, surface.triangles, buffer, row)
        lights, palette = self._look.lights(self._sun), self._look.palette()
        light_body(
            buffer, row, region, samples, self._eye, lights, palette, depths.values, depths.place, out
        )  # fmt: skip

    def _region(self, points: Floats, behind: bool) -> Ints | None:
        """(4,) left, top, right, bottom of the picture that points (n, 3) fill; None where none is in it.

        behind: with a point behind the camera it is the whole picture; otherwise such points do not count.
        """
        camera = self._camera
        local = points @ camera.rotation.T + camera.translation
        ahead = local[:, 2] > NEAR_M
        last = np.array(camera.size) - 1
        if behind and not ahead.all():
            return np.array([0, 0, *last], dtype=np.int32)
        if not ahead.any():
            return None
        homogeneous = local[ahead] @ camera.matrix.T
        pixels = homogeneous[:, :2] / homogeneous[:, 2:]
        low = np.clip(np.floor(pixels.min(axis=0)) - 1, 0, last + 1)
        high = np.clip(np.ceil(pixels.max(axis=0)) + 1, -1, last)
        return None if (high < low).any() else np.array([*low, *high], dtype=np.int32)


def sun_of(azimuth: float) -> Floats:
    """(3,) unit vector to a sun that stands to the left of a camera at that azimuth, radians."""
    turn, up = azimuth - np.radians(SUN_DEG[0]), np.radians(SUN_DEG[1])
    return np.array([np.cos(up) * np.sin(turn), np.sin(up), np.cos(up) * np.cos(turn)])


def _map(surface: Surface, axes: Floats, texel: float, margin: float) -> _Map:
    """The surface along the third of `axes` (3, 3), rows: heights of what is highest there, plus ABOVE; 0 for nothing."""
    local = surface.points @ axes.T
    low, high = local.min(axis=0) - margin, local.max(axis=0) + margin
    texel = max(texel, float((high - low)[:2].max()) / MOST_TEXELS)
    width, height = (np.ceil((high - low)[:2] / texel).astype(int) + 1).tolist()
    out, row = np.zeros((height, width, 4), dtype=np.float32), np.zeros((height, width), dtype=np.uint8)
    pixels = ((local[:, :2] - low[:2]) / texel).astype(np.float32)
    heights = (local[:, 2] - low[2] + ABOVE).astype(np.float32)
    fill(pixels, heights, surface.normals.astype(np.float32), surface.shades, surface.triangles, out, row)
    place = np.zeros((3, 4), dtype=np.float32)
    place[:2, :3], place[:2, 3] = axes[:2] / texel, -low[:2] / texel
    place[2, :3], place[2, 3] = axes[2], ABOVE - low[2]
    return _Map(np.ascontiguousarray(out[..., 0]), place)


def _depths(surface: Surface, sun: Floats) -> _Map:
    """What the sun sees."""
    across = np.cross([0.0, 1.0, 0.0], sun)
    across = across / np.linalg.norm(across)
    return _map(surface, np.stack([across, np.cross(sun, across), sun]), SUN_TEXEL_M, SUN_MARGIN_M)


def _hidden(depths: _Map) -> _Map:
    """Share of the sun that is hidden from the floor, with a soft edge."""
    hidden = (depths.values > 0).astype(np.float32)
    soft = cv2.GaussianBlur(hidden, (0, 0), max(PENUMBRA_M / depths.texel, 0.5)).astype(np.float32)
    return _Map(soft, depths.place)


def _contact(surface: Surface) -> _Map:
    """Share of the sky that low parts hide from the floor below them, about."""
    axes = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    found = _map(surface, axes, CONTACT_TEXEL_M, CONTACT_MARGIN_M)
    lowest = found.place[2, 3] - found.values  # the world's y of what is lowest
    hidden = np.where(found.values > 0, np.clip(1.0 - lowest / CONTACT_HIGH_M, 0.0, 1.0), 0.0).astype(np.float32)
    return _Map(cv2.GaussianBlur(hidden, (0, 0), CONTACT_BLUR_M / found.texel).astype(np.float32), found.place)
