"""One picture: floor, shadows and lit surfaces."""

from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Image, Ints32
from zenocap.common.camera.pinhole import Camera
from zenocap.services.animator import parameters as p
from zenocap.tools.takes.render.floor import darken_floor, draw_floor
from zenocap.tools.takes.render.rasterizer import NEAR_M, develop, fill, light_body
from zenocap.tools.takes.render.surfaces import Surface
from zenocap.tools.takes.render.theme import GAMMA, Theme, linear

HEIGHT_OFFSET = 1.0  # added to heights, because `fill` takes 0 for nothing
LEVELS = 4096
SRGB_TABLE = np.rint(np.linspace(0.0, 1.0, LEVELS) ** (1 / GAMMA) * 255).astype(np.uint8)


@dataclass(frozen=True)
class Ground:
    """Lit part of the floor.

    middle: (2,) x and z of the lit area, metres.  radius: metres, at which the floor fades into the background.
    """

    middle: Floats
    radius: float


@dataclass(frozen=True)
class _HeightMap:
    """Map of heights above a plane.  values: (h, w).  world_to_map: (3, 4), to column, row and height."""

    values: Floats32
    world_to_map: Floats32

    @property
    def texel(self) -> float:
        """Side of one element, metres."""
        return 1.0 / float(np.linalg.norm(self.world_to_map[0, :3]))


class Scene:
    """Empty floor as one camera sees it, into which surfaces are drawn, picture by picture.

    sun: (3,) unit vector towards it.  samples: along either side of every pixel of a surface.  once: for one picture only,
    as of a camera that moves; otherwise only what a surface changes is drawn and converted to sRGB again.
    """

    def __init__(
        self, camera: Camera, ground: Ground, theme: Theme, sun: Floats, samples: int = 2, once: bool = False
    ) -> None:
        self._camera, self._theme, self._sun, self._samples = camera, theme, sun, samples
        matrix = camera.matrix
        lens = (matrix[0, 0], matrix[0, 2], matrix[1, 2])
        self._eye = np.array([*camera.rotation, camera.centre, lens], dtype=np.float32)
        colours = [linear(colour) for colour in (theme.floor, theme.fine, theme.bold, theme.low, theme.high)]
        self._floor = np.array([*colours, (*ground.middle, ground.radius), (p.GRID_M, 0.0, 0.0)], dtype=np.float32)
        self._empty = np.empty((camera.size[1], camera.size[0], 3), dtype=np.float32)
        draw_floor(self._empty, self._eye, self._floor)
        self._everything = np.array([0, 0, camera.size[0] - 1, camera.size[1] - 1], dtype=np.int32)
        self._developed = None if once else self._converted(self._empty)

    def picture(self, surface: Surface | None) -> Image:
        """Return the picture of a surface on the floor, or of the empty floor: (h, w, 3) blue, green, red."""
        if surface is None:
            return self._converted(self._empty)
        depths, contact = _depths(surface, self._sun), _contact_shadow(surface)
        shadows = ((_sun_shadow(depths), self._theme.shadow), (contact, self._theme.contact))
        covered = [self._covered(dark) for dark, _ in shadows]
        body = self._region(surface.points, behind=False)
        regions = [region for region in (*covered, body) if region is not None]
        if self._developed is None:
            out, changed, image = self._empty, self._everything, np.empty(self._empty.shape, dtype=np.uint8)
        elif regions:
            changed = np.concatenate([np.min(regions, axis=0)[:2], np.max(regions, axis=0)[2:]]).astype(np.int32)
            part = (slice(changed[1], changed[3] + 1), slice(changed[0], changed[2] + 1))
            out, image = np.empty_like(self._empty), self._developed.copy()
            out[part] = self._empty[part]
        else:
            return self._developed.copy()
        for (dark, share), region in zip(shadows, covered, strict=True):
            if region is not None:
                darken_floor(out, region, self._eye, self._floor, dark.values, dark.world_to_map, share)
        if body is not None:
            self._draw(out, surface, depths, body)
        develop(out, SRGB_TABLE, changed, image)
        return image

    def _converted(self, light: Floats32) -> Image:
        """Return a whole picture (h, w, 3) of linear light."""
        image = np.empty(light.shape, dtype=np.uint8)
        develop(light, SRGB_TABLE, self._everything, image)
        return image

    def _covered(self, dark: _HeightMap) -> Ints32 | None:
        """Return the region of the picture in which the floor is covered by a shadow map, see `_region`."""
        height, width = dark.values.shape
        corners = np.array([[0, 0], [width, 0], [width, height], [0, height]])
        turn = dark.world_to_map[:2, [0, 2]].astype(np.float64)  # from x and z of the floor
        x, z = np.linalg.solve(turn, (corners - dark.world_to_map[:2, 3]).T)
        return self._region(np.stack([x, np.zeros(4), z], axis=1), behind=True)

    def _draw(self, out: Floats32, surface: Surface, depths: _HeightMap, region: Ints32) -> None:
        camera, samples = self._camera, self._samples
        local = surface.points @ camera.rotation.T + camera.translation
        near = np.where(local[:, 2] > NEAR_M, 1.0 / np.maximum(local[:, 2], NEAR_M), 0.0)
        pixels = (local @ camera.matrix.T)[:, :2] * near[:, None]
        rows, columns = (region[3] - region[1] + 1) * samples, (region[2] - region[0] + 1) * samples
        buffer, row = np.zeros((rows, columns, 4), dtype=np.float32), np.zeros((rows, columns), dtype=np.uint8)
        fine = ((pixels - region[:2] + 0.5) * samples - 0.5).astype(np.float32)  # at the centres of the cells
        normals = surface.normals.astype(np.float32)
        fill(fine, near.astype(np.float32), normals, surface.shades, surface.triangles, buffer, row)
        lights, palette = self._theme.lights(self._sun), self._theme.palette()
        light_body(buffer, row, region, samples, self._eye, lights, palette, depths.values, depths.world_to_map, out)

    def _region(self, points: Floats, behind: bool) -> Ints32 | None:
        """Return the bounding box (4,) of points (n, 3) in the picture: left, top, right, bottom; None if it is empty.

        behind: a point behind the camera makes it the whole picture; otherwise such points are ignored.
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
    """Return the unit vector (3,) to a sun to the left of a camera at an azimuth, radians."""
    turn, up = azimuth - np.radians(p.SUN_AZIMUTH_DEG), np.radians(p.SUN_ELEVATION_DEG)
    return np.array([np.cos(up) * np.sin(turn), np.sin(up), np.cos(up) * np.cos(turn)])


def _height_map(surface: Surface, axes: Floats, texel: float, margin: float) -> _HeightMap:
    """Return the largest height of a surface along the third row of `axes` (3, 3), plus HEIGHT_OFFSET; 0 for nothing."""
    local = surface.points @ axes.T
    low, high = local.min(axis=0) - margin, local.max(axis=0) + margin
    texel = max(texel, float((high - low)[:2].max()) / p.MAX_TEXELS)
    width, height = (np.ceil((high - low)[:2] / texel).astype(int) + 1).tolist()
    out, row = np.zeros((height, width, 4), dtype=np.float32), np.zeros((height, width), dtype=np.uint8)
    pixels = ((local[:, :2] - low[:2]) / texel).astype(np.float32)
    heights = (local[:, 2] - low[2] + HEIGHT_OFFSET).astype(np.float32)
    fill(pixels, heights, surface.normals.astype(np.float32), surface.shades, surface.triangles, out, row)
    world_to_map = np.zeros((3, 4), dtype=np.float32)
    world_to_map[:2, :3], world_to_map[:2, 3] = axes[:2] / texel, -low[:2] / texel
    world_to_map[2, :3], world_to_map[2, 3] = axes[2], HEIGHT_OFFSET - low[2]
    return _HeightMap(np.ascontiguousarray(out[..., 0]), world_to_map)


def _depths(surface: Surface, sun: Floats) -> _HeightMap:
    """Return the height map of a surface as seen from the sun."""
    across = np.cross([0.0, 1.0, 0.0], sun)
    across = across / np.linalg.norm(across)
    return _height_map(surface, np.stack([across, np.cross(sun, across), sun]), p.SHADOW_TEXEL_M, p.SHADOW_MARGIN_M)


def _sun_shadow(depths: _HeightMap) -> _HeightMap:
    """Return the share of sunlight that is blocked from the floor, with a soft edge."""
    hidden = (depths.values > 0).astype(np.float32)
    soft = cv2.GaussianBlur(hidden, (0, 0), max(p.PENUMBRA_M / depths.texel, 0.5)).astype(np.float32)
    return _HeightMap(soft, depths.world_to_map)


def _contact_shadow(surface: Surface) -> _HeightMap:
    """Return approximately the share of sky light that low parts block from the floor below them."""
    axes = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    found = _height_map(surface, axes, p.CONTACT_TEXEL_M, p.CONTACT_MARGIN_M)
    lowest = found.world_to_map[2, 3] - found.values  # smallest world y
    hidden = np.where(found.values > 0, np.clip(1.0 - lowest / p.CONTACT_HEIGHT_M, 0.0, 1.0), 0.0).astype(np.float32)
    return _HeightMap(
        cv2.GaussianBlur(hidden, (0, 0), p.CONTACT_BLUR_M / found.texel).astype(np.float32), found.world_to_map
    )
