"""People with random proportions, girth, clothing and manner of movement, by seed.

Mean segment lengths in body heights follow Drillis and Contini (1966) as in Winter, Biomechanics, 4th ed., fig. 4.1;
spreads are similar to those of adult anthropometric surveys.  The tracker's body table has the same source, so most means
are equal to its constants (head, thigh, torso): errors of the measured body are optimistic.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats

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
    """One person; equal seeds give equal persons."""

    seed: int
    height: float
    lengths: Lengths
    girths: Girths
    clothing: Clothing
    manner: Manner


_SKIN_BGR = ((178, 200, 232), (150, 178, 220), (122, 152, 205), (95, 125, 180), (62, 88, 138), (45, 62, 98))
_HAIR_BGR = ((28, 30, 34), (35, 50, 74), (60, 92, 132), (112, 158, 192), (128, 128, 130), (38, 60, 118))


def person(seed: int) -> Person:
    """The person of a seed (0 or more): 1.50 to 1.95 m tall, with independent proportions, girth and clothing."""
    rng = np.random.default_rng([0xAC, seed])
    build = float(rng.uniform())  # 0: narrow shoulders and wide hips, 1: the opposite
    height = float(np.clip(rng.normal(1.64 + 0.15 * build, 0.08), 1.50, 1.95))
    lengths = _lengths(rng, height, build)
    girths = _girths(rng, height, build, lengths)
    return Person(seed, height, lengths, girths, _clothing(rng, build), _manner(rng, lengths))


def _lengths(rng: np.random.Generator, height: float, build: float) -> Lengths:
    def share(mean: float, spread: float) -> float:
        return mean * float(np.clip(rng.normal(1.0, spread), 1.0 - 2.0 * spread, 1.0 + 2.0 * spread))

    column = np.array([share(0.043, 0.05), share(0.242, 0.03), share(0.245, 0.03), share(0.288, 0.03), 0.182])
    ankle, shank, thigh, torso, head_top = (float(x) for x in height * column / column.sum())
    arm = share(1.0, 0.03)
    return Lengths(
        ankle_height=ankle,
        shank=shank,
        thigh=thigh,
        torso=torso,
        head_top=head_top,
        shoulder_half=height * share(0.098 + 0.012 * build, 0.03),
        hip_half=height * share(0.052 - 0.003 * build, 0.05),
        upper_arm=height * arm * share(0.174, 0.02),
        forearm=height * arm * share(0.147, 0.02),
        hand=height * share(0.106, 0.03),
        foot=height * share(0.152, 0.03),
    )


def _girths(rng: np.random.Generator, height: float, build: float, lengths: Lengths) -> Girths:
    mass = float(np.clip(rng.lognormal(0.0, 0.10), 0.86, 1.25))  # linear factor on girth

    def radius(share: float) -> float:
        return height * share * mass * float(rng.normal(1.0, 0.03))

    hips = max(radius(0.098 - 0.008 * build), lengths.hip_half + radius(0.038))
    chest = min(radius(0.085 + 0.010 * build), lengths.shoulder_half * 0.98)
    belly = 1.0 + max(0.0, mass - 1.0) * float(rng.uniform(0.2, 1.2))
    return Girths(
        thigh=radius(0.050),
        knee=radius(0.034),
        calf=radius(0.034),
        ankle=radius(0.0215),
        upper_arm=radius(0.0265 + 0.003 * build),
        elbow=radius(0.0225),
        forearm=radius(0.0235),
        wrist=radius(0.0155),
        neck=height * (0.031 + 0.005 * build) * mass**0.5,
        chest=(chest, radius(0.064)),
        waist=(radius(0.076 + 0.004 * build) * belly, radius(0.057) * belly**1.5),
        hips=(hips, radius(0.068)),
        head=(height * float(rng.normal(0.0455, 0.0015)), height * float(rng.normal(0.0575, 0.0015))),
    )


def _clothing(rng: np.random.Generator, build: float) -> Clothing:
    skirted = rng.uniform() < 0.35 * (1.0 - build)
    skirt = float(rng.uniform(0.75, 1.1)) if skirted else 0.0
    shorts = not skirted and rng.uniform() < 0.2
    long_hair = rng.uniform() < 0.75 - 0.65 * build
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
