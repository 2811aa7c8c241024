"""The clothed surface of a person at rest and in a pose: tubes with skinning weights of the bones."""

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.limb_surface import arm, foot, leg
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import LEFT, OUTWARD, RIGHT, SIDES, PersonPose
from zenocap.simulation.body.skeleton import BONES, CHEST, HEAD, PELVIS, THIGH, WAIST, Bones, pose_bones, rest_bones
from zenocap.simulation.body.tube_mesh import Ring, Tube, merge_meshes, tube


def rest_surface(person: Person) -> Tube:
    """The person's whole surface, upright, with arms and legs straight down."""
    tubes = [_torso(person), *_head(person)]
    for side in SIDES:
        tubes += [*arm(person, side), leg(person, side), foot(person, side)]
    if person.clothing.skirt > 0.0:
        tubes.append(_skirt(person))
    surface = merge_meshes(tubes)
    # Cloth and skin do not have a uniform colour.
    rng = np.random.default_rng([0x5F, person.seed])
    uneven = rng.normal(1.0, 0.035, (len(surface.points), 1))
    return replace(surface, bgr=np.clip(surface.bgr * uneven, 0.0, 255.0))


def skin(rest: Tube, person: Person, pose: PersonPose | Bones) -> tuple[Floats, Floats]:
    """Linear blend skinning: points (n, 3) metres in the world and unit normals (n, 3) of a rest surface in a pose."""
    bones, at_rest = pose_bones(person, pose), rest_bones(person)
    shift = bones.origin - np.einsum("bij,bj->bi", bones.rotation, at_rest.origin)
    carried = rest.weights @ np.concatenate([bones.rotation.reshape(BONES, 9), shift], axis=1)
    turn = carried[:, :9].reshape(-1, 3, 3)
    points: Floats = np.einsum("nij,nj->ni", turn, rest.points) + carried[:, 9:]
    normals: Floats = np.einsum("nij,nj->ni", turn, rest.normals)
    normals /= np.maximum(np.sqrt(np.einsum("ni,ni->n", normals, normals)), 1e-9)[:, None]
    return points, normals


def _torso(person: Person) -> Tube:
    size, girth, wear = person.lengths, person.girths, person.clothing
    hip_line = float(rest_bones(person).origin[PELVIS, 1])
    hips, waist, chest = girth.hips, girth.waist, girth.chest
    across = size.shoulder_half
    loose = 0.5 * waist[0] + 0.5 * max(hips[0], chest[0]), 0.5 * waist[1] + 0.5 * max(hips[1], chest[1])
    hang = min(wear.shirt_ease / 0.03, 1.0)  # a loose shirt does not follow the waist
    middle = tuple((1.0 - hang) * w + hang * v for w, v in zip(waist, loose, strict=True))
    # Height in torso lengths, half width, half depth, ease relative to shirt_ease, forward offset in metres.
    profile = (
        (-0.20, 0.45 * hips[0], 0.60 * hips[1], 0.0, -0.004),
        (-0.13, 0.90 * hips[0], 0.95 * hips[1], 0.3, -0.006),
        (-0.02, hips[0], hips[1], 0.7, -0.008),
        (0.12, 0.98 * hips[0], 0.97 * hips[1], 1.0, -0.004),
        (0.28, 0.5 * (middle[0] + hips[0]), 0.5 * (middle[1] + hips[1]), 1.0, 0.002),
        (0.42, middle[0], middle[1], 1.0, 0.004),
        (0.58, 0.5 * (middle[0] + chest[0]), 0.5 * (middle[1] + chest[1]), 1.0, 0.002),
        (0.74, chest[0], chest[1], 0.8, 0.004),
        (0.86, 1.03 * chest[0], 0.96 * chest[1], 0.6, 0.0),
        (0.95, across, 0.80 * chest[1], 0.4, -0.006),
        (1.03, 0.90 * across, 0.60 * chest[1], 0.3, -0.010),
        (1.07, 0.62 * across, 0.48 * chest[1], 0.2, -0.012),
        (1.11, 1.25 * girth.neck, 1.15 * girth.neck, 0.1, -0.010),
    )
    hem = 0.10 if wear.shirt_ease < 0.014 else -0.10  # a tight shirt is tucked in
    rings = []
    for k, (height, width, depth, ease, front) in enumerate(profile):
        share = float(np.clip((height - 0.16) / (2.0 * (WAIST - 0.16)), 0.0, 1.0))
        stripe = 1.0 - wear.stripes * (k % 2)
        cloth = wear.shirt_bgr if height > hem else wear.trouser_bgr
        b, g, r = (x * stripe for x in cloth) if height > hem else cloth
        extra = wear.shirt_ease * ease
        centre = (0.0, hip_line + height * size.torso, front)
        rings.append(Ring(centre, (width + extra, depth + extra), {PELVIS: 1.0 - share, CHEST: share}, (b, g, r)))
    return tube(rings, BONES, around=24, power=2.4)


def _head(person: Person) -> list[Tube]:
    size, girth, wear = person.lengths, person.girths, person.clothing
    base = float(rest_bones(person).origin[HEAD, 1])
    wide, deep = girth.head
    tall = 0.72 * size.head_top  # chin to crown
    chin = base + size.head_top - tall
    neck = [
        Ring((0.0, base + 0.02 * size.head_top, -0.012), (girth.neck, girth.neck), {CHEST: 1.0}, wear.skin_bgr),
        Ring((0.0, 0.5 * (base + chin), -0.004), (girth.neck, girth.neck), {CHEST: 0.5, HEAD: 0.5}, wear.skin_bgr),
        Ring((0.0, chin + 0.25 * tall, -0.004), (girth.neck, girth.neck), {HEAD: 1.0}, wear.skin_bgr),
    ]
    rings = []
    for share, width, depth, ahead in (
        (0.00, 0.35, 0.30, 0.42),
        (0.06, 0.58, 0.52, 0.30),
        (0.20, 0.80, 0.78, 0.10),
        (0.38, 0.93, 0.95, 0.02),
        (0.56, 1.00, 1.00, -0.02),
        (0.72, 0.98, 0.98, -0.03),
        (0.86, 0.82, 0.82, -0.03),
        (0.95, 0.55, 0.55, -0.03),
        (1.00, 0.15, 0.15, -0.03),
    ):
        centre = (0.0, chin + share * tall, 0.012 + ahead * deep)
        rings.append(Ring(centre, (width * wide, depth * deep), {HEAD: 1.0}, wear.skin_bgr))
    skull = tube(rings, BONES, around=16)
    bgr = skull.bgr.copy()
    height, front = (skull.points[:, 1] - chin) / tall, (skull.points[:, 2] - 0.012) / deep
    bgr[(height > 0.78) | ((height > 0.25) & (front < 0.05))] = wear.hair_bgr
    face = (np.abs(skull.points[:, 0]) < 0.5 * wide) & (front > 0.6) & (abs(height - 0.56) < 0.05)
    bgr[face] *= 0.72  # eyes and brows
    tubes = [tube(neck, BONES, around=12), replace(skull, bgr=bgr)]
    if wear.hair > 0.0:
        tubes.append(_back_hair(person, chin, tall))
    return tubes


def _back_hair(person: Person, chin: float, tall: float) -> Tube:
    (wide, deep), length = person.girths.head, person.clothing.hair
    rings = []
    for share, width, depth in ((0.0, 0.55, 0.2), (0.2, 1.06, 0.52), (0.6, 1.10, 0.50), (1.0, 0.80, 0.30)):
        height = chin + 0.85 * tall - share * (0.55 * tall + length)
        on_head = 1.0 if share < 0.5 else 0.75
        centre = (0.0, height, -0.55 * deep)
        weights = {HEAD: on_head, CHEST: 1.0 - on_head}
        rings.append(Ring(centre, (width * wide, depth * deep), weights, person.clothing.hair_bgr))
    return tube(rings, BONES, around=12)


def _skirt(person: Person) -> Tube:
    size, girth, wear = person.lengths, person.girths, person.clothing
    hip_line = float(rest_bones(person).origin[PELVIS, 1])
    top, length = 0.22 * size.torso, 0.22 * size.torso + wear.skirt * size.thigh
    rings = []
    for share in (0.0, 0.12, 0.3, 0.5, 0.7, 0.85, 1.0):
        flare = 1.0 + 0.20 * share if share > 0.0 else 0.85  # the waistband is under the shirt
        below = max(share * length - top, 0.0) / size.thigh
        ease = wear.shirt_ease * 0.5 + wear.trouser_ease * (0.3 + share)
        half = (girth.hips[0] * flare + ease, girth.hips[1] * flare + ease)
        down = min(1.2 * below, 0.85)
        rings.append(Ring((0.0, hip_line + top - share * length, -0.004), half, {PELVIS: 1.0 - down}, wear.trouser_bgr))
    skirt = tube(rings, BONES, around=24, power=2.2)
    weights = skirt.weights.copy()
    left = np.clip(0.5 + 0.8 * skirt.points[:, 0] / girth.hips[0] * OUTWARD[LEFT], 0.0, 1.0)
    on_legs = 1.0 - weights[:, PELVIS]
    weights[:, THIGH[LEFT]] = left * on_legs
    weights[:, THIGH[RIGHT]] = (1.0 - left) * on_legs
    return replace(skirt, weights=weights)
