"""Room of the simulated person: textured floor and walls with pictures, and a lamp."""

from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.rotation import unit

CEILING_M = 3.2


@dataclass(frozen=True)
class Lamp:
    """towards: (3,) unit vector to the lamp.  fall: (3,) direction of its light, scaled to a descent of 1 m.

    ambient, direct: intensities; a surface that faces the lamp has ambient + direct.
    """

    towards: Floats
    fall: Floats
    ambient: float
    direct: float


@dataclass(frozen=True)
class Room:
    """half: half extents of the room in metres.  light: its lamp.  seed: of textures and pictures."""

    half: float
    light: Lamp
    seed: int


@dataclass(frozen=True)
class RoomView:
    """Rendered view of the empty room.

    bgr: (h, w, 3) float32 in [0, 255].  floor: (h, w) float32, 1 on the floor and 0 elsewhere, antialiased.
    """

    bgr: Floats32
    floor: Floats32


def room(camera: Camera, seed: int) -> Room:
    """The room of a seed, large enough to contain the camera."""
    rng = np.random.default_rng([0x11, seed])
    furthest = float(np.abs(camera.centre[[0, 2]]).max())
    half = max(float(rng.uniform(5.8, 7.0)), furthest + 0.8)
    fall = np.array([rng.uniform(-0.30, 0.30), -1.0, rng.uniform(-0.45, 0.1)])
    towards = unit(np.array([-1.6 * fall[0] + rng.normal(0.0, 0.1), 1.0, 0.9]))
    return Room(half, Lamp(towards, fall, float(rng.uniform(0.58, 0.68)), float(rng.uniform(0.38, 0.48))), seed)


def view(place: Room, camera: Camera) -> RoomView:
    """Render the empty room without noise, averaged over 2 x 2 rays per pixel."""
    width, height = camera.size
    fine = camera.resized((2 * width, 2 * height))
    direction = _rays(fine)
    surface, points = _hits(place, camera.centre, direction)
    bgr = np.zeros((len(points), 3))
    rng = np.random.default_rng([0x12, place.seed])
    for number in range(6):
        seen = surface == number
        paint = _Paint.of(rng, number)  # sampled for every surface, so that no picture depends on the visible surfaces
        if seen.any():
            bgr[seen] = _painted(paint, place, number, points[seen])
    shape = (2 * height, 2 * width)
    image = cv2.resize(bgr.reshape(*shape, 3).astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    floor = cv2.resize((surface == 0).reshape(shape).astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    return RoomView(np.ascontiguousarray(np.clip(image, 0, 255)), np.ascontiguousarray(floor))


def _rays(camera: Camera) -> Floats:
    width, height = camera.size
    x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    pixels = np.stack([x.ravel(), y.ravel()], axis=1).reshape(-1, 1, 2)
    flat = cv2.undistortPoints(pixels, camera.matrix, camera.distortions).reshape(-1, 2)
    world: Floats = np.column_stack([flat, np.ones(len(flat))]) @ camera.rotation
    return world


def _hits(place: Room, start: Floats, direction: Floats) -> tuple[Ints, Floats]:
    """Intersection of rays with the room: surface (n,) 0 floor, 1 ceiling, 2 -X, 3 +X, 4 -Z, 5 +Z, and point (n, 3)."""
    low = np.array([-place.half, 0.0, -place.half])
    high = np.array([place.half, max(CEILING_M, float(start[1]) + 0.5), place.half])
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(direction < 0, (low - start) / direction, (high - start) / direction)
    far[~np.isfinite(far) | (direction == 0)] = np.inf
    axis = np.argmin(far, axis=1)
    points: Floats = start + direction * far[np.arange(len(far)), axis][:, None]
    positive = direction[np.arange(len(far)), axis] > 0
    surface = np.choose(axis, [2, 0, 4]) + positive
    return surface.astype(np.int64), points


@dataclass(frozen=True)
class _Paint:
    """base: colour.  grain: sizes (m) and amplitudes (grey levels) of mottling.

    pictures: (n, 7) centre and size along the surface's axes in metres, then BGR.
    """

    base: Floats
    grain: tuple[tuple[float, float], ...]
    pictures: Floats
    seed: int

    @staticmethod
    def of(rng: np.random.Generator, number: int) -> "_Paint":
        brightness = (rng.uniform(95, 125), rng.uniform(185, 215))[number] if number < 2 else rng.uniform(125, 165)
        base = np.full(3, brightness) + rng.normal(0.0, 5.0, 3)
        count = 0 if number < 2 else int(rng.integers(3, 8))
        pictures = np.column_stack(
            [
                rng.uniform(-4.5, 4.5, count),
                rng.uniform(0.7, 2.4, count),
                rng.uniform(0.25, 0.9, count),
                rng.uniform(0.25, 0.8, count),
                rng.uniform(30, 220, (count, 3)),
            ],
        )
        coarse, fine = (11.0, 6.0) if number < 2 else (12.0, 8.0)
        return _Paint(base, ((0.30, coarse), (0.08, fine), (0.03, 4.0)), pictures, int(rng.integers(2**31)))


def _painted(paint: _Paint, place: Room, number: int, points: Floats) -> Floats:
    """Colours (n, 3) of points on one surface."""
    u, v = {0: (0, 2), 1: (0, 2), 2: (2, 1), 3: (2, 1), 4: (0, 1), 5: (0, 1)}[number]
    place_uv = points[:, [u, v]]
    grey = np.zeros(len(points))
    for k, (size, strength) in enumerate(paint.grain):
        grey += strength * _mottle(place_uv / size, paint.seed + k)
    if number == 0:
        tile = np.floor(place_uv / 0.6).astype(np.int64)
        grey += 5.0 * (_hash(tile[:, 0], tile[:, 1], paint.seed + 9) - 0.5)
        joint = np.abs(place_uv / 0.6 - np.round(place_uv / 0.6)).min(axis=1) < 0.012
        grey -= 14.0 * joint
    colour: Floats = paint.base + grey[:, None]
    for cx, cy, wide, tall, b, g, r in paint.pictures:
        inside = (np.abs(place_uv[:, 0] - cx) < wide / 2) & (np.abs(place_uv[:, 1] - cy) < tall / 2)
        colour[inside] = np.array([b, g, r]) + 0.4 * grey[inside, None]
    if number >= 2:
        colour[points[:, 1] < 0.09] = 0.62 * paint.base  # skirting board
    edge = np.abs(points[:, [0, 2]]).max(axis=1) if number < 2 else np.full(len(points), place.half)
    # Corners are darker, and brightness decreases away from the middle of the room.
    corner = 1.0 - 0.22 * np.exp(-(place.half - edge) / 0.5) if number < 2 else np.ones(len(points))
    away = np.exp(-np.sum(points[:, [0, 2]] ** 2, axis=1) / (3.0 * place.half) ** 2)
    lit: Floats = colour * (corner * (0.75 + 0.25 * away))[:, None]
    return lit


def _mottle(at: Floats, seed: int) -> Floats:
    """Smooth noise (n,) of mean 0 and about unit amplitude on a lattice of unit size."""
    cell = np.floor(at).astype(np.int64)
    part = at - cell
    part = part * part * (3.0 - 2.0 * part)
    total = np.zeros(len(at))
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.abs(1 - dx - part[:, 0]) * np.abs(1 - dy - part[:, 1])
            total += weight * _hash(cell[:, 0] + dx, cell[:, 1] + dy, seed)
    return (total - 0.5) * 2.0


def _hash(x: Ints, y: Ints, seed: int) -> Floats:
    """Hash of integer lattice points: values (n,) in [0, 1)."""
    mask = np.uint64(0xFFFFFFFF)
    mixed = x.astype(np.uint64) * np.uint64(0x9E3779B1) + y.astype(np.uint64) * np.uint64(0x85EBCA77)
    mixed = (mixed + np.uint64(seed)) & mask
    for shift, factor in ((15, 0x2C1B3C6D), (12, 0x297A2D39)):
        mixed = ((mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)) & mask
    mixed ^= mixed >> np.uint64(15)
    value: Floats = mixed.astype(np.float64) / 2.0**32
    return value
