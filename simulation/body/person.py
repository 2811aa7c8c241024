"""People with random proportions, girth, clothing and manner of movement, by seed.

Joint centres follow from the landmarks of `anthropometry`.  The offsets between both are from other sources than the
tracker's constants, so that its errors on simulated people are not smaller than on real ones for that reason.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.anthropometry import Build, draw_build

Bgr = tuple[float, float, float]


@dataclass(frozen=True)
class Lengths:
    """Distances between joint centres in metres; `torso` is from the hip line to the shoulder line."""

    ankle_height: float
    shank: float
    thigh: float
    torso: float
    head_top: float
    shoulder_half: float
    hip_half: float
    upper_arm: float
    forearm: float
    hand: float
    foot: float


@dataclass(frozen=True)
class Girths:
    """Half breadths in metres of the unclothed body; (half width, half depth) where a section is not round."""

    thigh: float
    knee: float
    calf: float
    ankle: float
    upper_arm: float
    elbow: float
    forearm: float
    wrist: float
    neck: float
    chest: tuple[float, float]
    waist: tuple[float, float]
    hips: tuple[float, float]
    head: tuple[float, float]


@dataclass(frozen=True)
class Clothing:
    """Clothing and hair.

    shirt_ease, trouser_ease: distance of the cloth from the body, metres.  sleeve: fraction of the arm covered.
    trousers: fraction of the leg covered; under a skirt, its lining.  skirt: length in thighs, 0 for none.
    hair: length of the back hair, metres, 0 for short hair.  stripes: strength of the shirt's stripes in [0, 1].
    Colours are blue, green, red in [0, 255].
    """

    shirt_ease: float
    trouser_ease: float
    sleeve: float
    trousers: float
    skirt: float
    hair: float
    stripes: float
    skin_bgr: Bgr
    hair_bgr: Bgr
    shirt_bgr: Bgr
    trouser_bgr: Bgr
    shoe_bgr: Bgr


@dataclass(frozen=True)
class Manner:
    """Manner of standing and moving: angles in radians, distances in metres.

    tempo, vigour: factors on speed and amplitude.  stance_half: half the distance between the planted ankles.
    """

    arm_hang: float
    elbow_rest: float
    toe_out: float
    stance_half: float
    slouch: float
    sway: float
    tempo: float
    vigour: float


@dataclass(frozen=True)
class Person:
    """One person; equal seeds give equal persons.  age: years, None for an adult."""

    seed: int
    age: float | None
    height: float
    lengths: Lengths
    girths: Girths
    clothing: Clothing
    manner: Manner


_SKIN_BGR = ((178, 200, 232), (150, 178, 220), (122, 152, 205), (95, 125, 180), (62, 88, 138), (45, 62, 98))
_HAIR_BGR = ((28, 30, 34), (35, 50, 74), (60, 92, 132), (112, 158, 192), (128, 128, 130), (38, 60, 118))


# Joint centres relative to landmarks, cited from memory from de Leva (1996), J. Biomech. 29:1231: the shoulder below the
# acromion and the elbow above the radiale, in lengths from acromion to radiale.
_SHOULDER_BELOW, _ELBOW_ABOVE = 0.104, 0.043
_SHOULDER_INSIDE = 0.014  # the shoulder beside the acromion, in body heights; chosen by hand, about 25 mm
_HIP_HALF = 0.315  # the hips beside the middle, in breadths between the iliac crests; chosen by hand, 86 mm on average
_RELAXED = 0.93  # circumference of a relaxed upper arm or forearm over that of a flexed one; chosen by hand


def person(seed: int) -> Person:
    """The person of a seed (0 or more): an adult or a child from 6 to 16 years, 1.0 to 2.05 m tall."""
    build = draw_build(np.random.default_rng([0xB0D, seed]))
    rng = np.random.default_rng([0xAC, seed])
    height = build.measures["stature"]
    lengths = _lengths(build)
    return Person(seed, build.age, height, lengths, _girths(build, lengths), _clothing(rng, build), _manner(rng, lengths))


def _lengths(build: Build) -> Lengths:
    measure = build.measures
    height, arm = measure["stature"], measure["acromionradialelength"]
    ankle, knee = measure["lateralmalleolusheight"], measure["lateralfemoralepicondyleheight"]
    hip = measure["trochanterionheight"]  # the top of the trochanter is level with the centre of the femur's head
    shoulder = measure["acromialheight"] - _SHOULDER_BELOW * arm
    return Lengths(
        ankle_height=ankle,
        shank=knee - ankle,
        thigh=hip - knee,
        torso=shoulder - hip,
        head_top=height - shoulder,
        shoulder_half=measure["biacromialbreadth"] / 2 - _SHOULDER_INSIDE * height,
        hip_half=_HIP_HALF * measure["bicristalbreadth"],
        upper_arm=(1 - _SHOULDER_BELOW - _ELBOW_ABOVE) * arm,
        forearm=measure["radialestylionlength"],
        hand=measure["handlength"],
        foot=measure["footlength"],
    )


def _girths(build: Build, lengths: Lengths) -> Girths:
    def radius(name: str) -> float:
        return build.measures[f"{name}circumference"] / (2 * np.pi)

    def half(*names: str) -> tuple[float, ...]:
        return tuple(build.measures[name] / 2 for name in names)

    thigh, forearm = radius("thigh") / 1.06, _RELAXED * build.measures["forearmcircumferenceflexed"] / (2 * np.pi)
    breadth, depth = half("hipbreadth", "buttockdepth")
    chest, chest_depth = half("chestbreadth", "chestdepth")
    waist, waist_depth = half("waistbreadth", "waistdepth")
    head, head_depth = half("headbreadth", "headlength")
    return Girths(
        thigh=thigh,  # the surface is 1.06 times as wide at the thigh's top
        knee=0.95 * radius("lowerthigh"),  # measured above the knee
        calf=radius("calf"),
        ankle=radius("ankle"),
        upper_arm=_RELAXED * build.measures["bicepscircumferenceflexed"] / (2 * np.pi),
        elbow=0.92 * forearm,
        forearm=forearm,
        wrist=radius("wrist"),
        neck=radius("neck"),
        chest=(min(chest, 0.98 * lengths.shoulder_half), chest_depth),
        waist=(waist, waist_depth),
        hips=(max(breadth, lengths.hip_half + 0.6 * thigh), depth),
        head=(head, head_depth),
    )


def _clothing(rng: np.random.Generator, build: Build) -> Clothing:
    skirted = rng.uniform() < (0.3 if build.woman else 0.05)
    skirt = float(rng.uniform(0.75, 1.1)) if skirted else 0.0
    shorts = not skirted and rng.uniform() < 0.2
    long_hair = rng.uniform() < (0.65 if build.woman else 0.2)
    return Clothing(
        shirt_ease=float(rng.uniform(0.006, 0.030)),
        trouser_ease=float(rng.uniform(0.004, 0.024)),
        sleeve=float(rng.choice([0.25, 0.3, 0.92, 0.96])),
        trousers=0.45 * skirt if skirted else 0.48 if shorts else 0.97,
        skirt=skirt,
        hair=float(rng.uniform(0.08, 0.24)) if long_hair else 0.0,
        stripes=float(rng.uniform(0.15, 0.4)) if rng.uniform() < 0.3 else 0.0,
        skin_bgr=_near(rng, _SKIN_BGR[int(rng.integers(len(_SKIN_BGR)))], 6.0),
        hair_bgr=_near(rng, _HAIR_BGR[int(rng.integers(len(_HAIR_BGR)))], 6.0),
        shirt_bgr=_cloth(rng),
        trouser_bgr=_cloth(rng),
        shoe_bgr=_near(rng, ((35, 35, 38), (60, 75, 105), (205, 205, 205))[int(rng.integers(3))], 8.0),
    )


def _manner(rng: np.random.Generator, lengths: Lengths) -> Manner:
    return Manner(
        arm_hang=float(np.radians(rng.uniform(10.0, 15.0))),
        elbow_rest=float(np.radians(rng.uniform(6.0, 16.0))),
        toe_out=float(np.radians(rng.uniform(4.0, 14.0))),
        stance_half=lengths.hip_half * float(rng.uniform(0.95, 1.35)),
        slouch=float(np.radians(rng.uniform(-1.0, 4.0))),
        sway=float(rng.uniform(0.003, 0.008)),
        tempo=float(rng.uniform(0.90, 1.12)),
        vigour=float(rng.uniform(0.88, 1.10)),
    )


def _near(rng: np.random.Generator, bgr: tuple[int, int, int], spread: float) -> Bgr:
    b, g, r = np.clip(np.array(bgr) + rng.normal(0.0, spread, 3), 8.0, 240.0)
    return float(b), float(g), float(r)


def _cloth(rng: np.random.Generator) -> Bgr:
    """A cloth colour that differs from the grey of a wall."""
    while True:
        value = float(rng.uniform(45.0, 205.0))
        tint: Floats = rng.normal(0.0, 1.0, 3)
        tint = (tint - tint.mean()) / max(float(np.abs(tint).max()), 1e-6)
        colour: Floats = np.clip(value + tint * float(rng.uniform(5.0, 75.0)), 15.0, 225.0)
        if float(np.abs(colour - 138.0).max()) > 48.0:
            return float(colour[0]), float(colour[1]), float(colour[2])
