"""Surfaces of the limbs: sleeves, hands, trouser legs and shoes."""

import numpy as np

from zenocap.simulation.body.person import Bgr, Person
from zenocap.simulation.body.pose import OUTWARD
from zenocap.simulation.body.skeleton import BONES, CHEST, FOOT, FOREARM, PELVIS, SHANK, THIGH, UPPER_ARM, rest_bones
from zenocap.simulation.body.tube_mesh import Ring, Tube, tube


def arm(person: Person, side: int) -> list[Tube]:
    """Surface of the arm from shoulder to wrist with the sleeve, and of the hand."""
    size, girth, wear = person.lengths, person.girths, person.clothing
    upper, fore = UPPER_ARM[side], FOREARM[side]
    x, shoulder, _ = (float(v) for v in rest_bones(person).origin[upper])
    reach = size.upper_arm + size.forearm
    elbow = size.upper_arm / reach
    deltoid = 1.22 * girth.upper_arm
    # Fraction of the arm from shoulder to wrist, radius, skinning weight of the forearm.
    profile = (
        (-0.058, 0.35 * deltoid, 0.0),
        (-0.036, 0.74 * deltoid, 0.0),
        (0.010, 1.00 * deltoid, 0.0),
        (0.10, 1.02 * deltoid, 0.0),
        (0.24, 1.04 * girth.upper_arm, 0.0),
        (elbow - 0.16, 0.97 * girth.upper_arm, 0.0),
        (elbow - 0.06, 1.02 * girth.elbow, 0.25),
        (elbow, girth.elbow, 0.5),
        (elbow + 0.06, 1.03 * girth.elbow, 0.8),
        (elbow + 0.14, girth.forearm, 1.0),
        (0.80, 0.5 * (girth.forearm + girth.wrist), 1.0),
        (0.93, 1.05 * girth.wrist, 1.0),
        (1.02, girth.wrist, 1.0),
    )
    rings = []
    for k, (share, radius, on_forearm) in enumerate(profile):
        covered = share < wear.sleeve
        radius += 0.55 * wear.shirt_ease * min(1.0, max(share, 0.0) * 4.0) if covered else 0.0
        on_chest = 0.45 if k == 0 else 0.2 if k == 1 else 0.0
        weights = {CHEST: on_chest, upper: 1.0 - on_chest - on_forearm, fore: on_forearm}
        bgr = wear.shirt_bgr if covered else wear.skin_bgr
        rings.append(Ring((x, shoulder - share * reach, 0.0), (radius, radius), weights, bgr))
    return [tube(rings, BONES, around=12), _hand(person, side, x, shoulder - reach)]


def _hand(person: Person, side: int, x: float, wrist: float) -> Tube:
    size, girth = person.lengths, person.girths
    rings = []
    # The palm faces the thigh: thin across, wide front to back; the thumb widens it to the front.
    for share, thick, broad, front in (
        (-0.05, 0.85, 0.95, 0.0),
        (0.12, 0.80, 1.35, 0.10),
        (0.32, 0.80, 1.75, 0.30),
        (0.50, 0.72, 1.60, 0.20),
        (0.72, 0.62, 1.20, 0.05),
        (0.90, 0.50, 0.95, 0.0),
        (1.00, 0.25, 0.45, 0.0),
    ):
        centre = (x - OUTWARD[side] * 0.05 * share * size.hand, wrist - share * size.hand, front * girth.wrist)
        half = (thick * girth.wrist, broad * girth.wrist)
        rings.append(Ring(centre, half, {FOREARM[side]: 1.0}, person.clothing.skin_bgr))
    return tube(rings, BONES, around=10)


def leg(person: Person, side: int) -> Tube:
    """Surface of the leg from hip to ankle with the trouser leg."""
    size, girth, wear = person.lengths, person.girths, person.clothing
    thigh, shank = THIGH[side], SHANK[side]
    x, hip, _ = (float(v) for v in rest_bones(person).origin[thigh])
    reach = size.thigh + size.shank
    knee = size.thigh / reach
    # Fraction of the leg from hip to ankle, radius, weights of pelvis and shank, backward offset in calf radii.
    profile = (
        (-0.10, 0.55 * girth.thigh, 0.80, 0.0, 0.0),
        (-0.03, 0.92 * girth.thigh, 0.50, 0.0, 0.0),
        (0.06, 1.06 * girth.thigh, 0.15, 0.0, 0.0),
        (0.16, 1.02 * girth.thigh, 0.0, 0.0, 0.0),
        (0.28, 0.90 * girth.thigh, 0.0, 0.0, 0.0),
        (knee - 0.10, 0.30 * girth.thigh + 0.70 * girth.knee, 0.0, 0.1, 0.0),
        (knee - 0.04, girth.knee, 0.0, 0.3, 0.0),
        (knee, girth.knee, 0.0, 0.5, 0.0),
        (knee + 0.05, 0.97 * girth.knee, 0.0, 0.8, 0.15),
        (knee + 0.14, girth.calf, 0.0, 1.0, 0.30),
        (knee + 0.24, 0.92 * girth.calf, 0.0, 1.0, 0.25),
        (0.88, 0.45 * girth.calf + 0.55 * girth.ankle, 0.0, 1.0, 0.10),
        (0.965, 1.05 * girth.ankle, 0.0, 1.0, 0.0),
        (1.02, girth.ankle, 0.0, 1.0, 0.0),
    )
    rings = []
    for share, radius, on_pelvis, on_shank, back in profile:
        covered = share < wear.trousers or share < 0.05
        if covered:
            # Trousers hang straight from the widest part: the looser they are, the less they follow the leg.
            radius = radius + wear.trouser_ease * min(1.0, 0.35 + max(share, 0.0))
        colour: Bgr = wear.trouser_bgr if covered else wear.skin_bgr
        centre = (x, hip - share * reach, -back * girth.calf)
        weights = {PELVIS: on_pelvis, thigh: 1.0 - on_pelvis - on_shank, shank: on_shank}
        rings.append(Ring(centre, (radius, radius), weights, colour))
    return tube(rings, BONES, around=14)


def foot(person: Person, side: int) -> Tube:
    """Surface of the shoe; its sole is on the ground at rest."""
    size = person.lengths
    x, ankle, _ = (float(v) for v in rest_bones(person).origin[FOOT[side]])
    rings = []
    # Position along the foot from the heel, half width and height, in foot lengths.
    for share, width, top in (
        (0.00, 0.06, 0.14),
        (0.05, 0.12, 0.24),
        (0.18, 0.135, 0.34),
        (0.34, 0.135, 0.33),
        (0.52, 0.155, 0.25),
        (0.72, 0.175, 0.19),
        (0.88, 0.150, 0.14),
        (0.97, 0.090, 0.10),
        (1.00, 0.040, 0.06),
    ):
        height = 0.5 * min(top * size.foot, 1.3 * ankle)
        centre = (x, height, (share - 0.24) * size.foot)
        rings.append(Ring(centre, (width * size.foot, height), {FOOT[side]: 1.0}, person.clothing.shoe_bgr))
    return tube(rings, BONES, around=12, axes="xy", power=2.6)


def mean_radius(surface: Tube, bone: int) -> float:
    """Mean radius of a bone's surface, metres: of circles with the areas of the sections, averaged over the length.

    surface: one tube hanging along Y at rest; sections with at least half their weight on the bone count.
    """
    ours = surface.weights[:, bone] > 0.5
    heights = np.unique(np.round(surface.points[ours, 1], 6))
    radii = []
    for height in heights:
        section = surface.points[ours & (np.abs(surface.points[:, 1] - height) < 1e-6)]
        if len(section) > 3:
            half = 0.5 * (section.max(axis=0) - section.min(axis=0))
            radii.append(float(np.sqrt(half[0] * half[2])))
    return float(np.mean(radii))
