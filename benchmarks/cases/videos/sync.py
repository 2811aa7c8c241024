"""Offsets of videos from silhouettes and from sound (`zenocap sync`).

Errors are against the first camera, in frame periods at 30 frames/s (of real_beam4 too); of clips at 60 frames/s every
second frame is used in another phase, so that true offsets are multiples of half a frame period.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations

import numpy as np
from scipy.signal import butter, fftconvolve, sosfilt

from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.shared_clips import load_clip
from benchmarks.people.simulated_clips import CYCLES, cycle_clip
from benchmarks.people.tracker import PersonClip
from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import VideoOffset, offsets_of, reach_s
from zenocap.common.lags.tangents import SILHOUETTE_LIMITS, Outline, outline_of, silhouette_pairs
from zenocap.tools.setup.sync.sound import RATE, SOUND_LIMITS, SoundPair

PERIOD_S = 1 / 30
SHIFTS_S = (0.0, 0.37, -0.37, 1.13, -1.13, 2.0, -2.0)  # of the second, fourth, ... camera; rounded to frames
SHORT_SHIFTS_S = (0.0, 0.1, -0.1, 0.3, -0.3)  # of real_beam4, which is 1.7 s long
CLIPS = {"walk7": (7, 4, 2), "walk2": (2,), "real_beam4": (4, 2)}  # numbers of cameras
SIMULATED = (("walking-7", 2), ("running-12", 2), ("boxing-8", 2), ("walking-14", 4), ("running-13", 4))
MAX_S, WRONG = 10.0, 0.5
SNRS_DB, SOUND_S, SOUND_RATE = (20, 0, -10, -20), 12.0, 16_000
Outlines = Mapping[str, Sequence[Outline]]


@dataclass
class OffsetScore:
    """Errors of certain offsets, in frame periods, and number of the others."""

    errors: list[float] = field(default_factory=list)
    uncertain: int = 0

    def add(self, found: Mapping[str, VideoOffset], truth: Mapping[str, float]) -> None:
        first = next((name for name in truth if not found[name].reason), None)
        for name in list(truth)[1:]:
            if found[name].reason or first == name or first is None:
                self.uncertain += 1
            else:
                error_s = found[name].offset_s - found[first].offset_s - truth[name] + truth[first]
                self.errors.append(abs(error_s) / PERIOD_S)

    def figures(self, allowed: float = WRONG) -> dict[str, float]:
        """allowed: error in frame periods up to which an offset is not wrong."""
        counts = {
            "certain": len(self.errors),
            "wrong": sum(e > allowed for e in self.errors),
            "not certain": self.uncertain,
        }
        known = {"error": float(np.median(self.errors)), "worst": max(self.errors)} if self.errors else {}
        return {**counts, **known}


def run(one: Case) -> Figures:
    """Offsets of a simulated or shared clip at one cut, the seed's.  Options: views."""
    cameras, outlines = _outlines_of(one)
    shifts = SHORT_SHIFTS_S if one.film == "real_beam4" else SHIFTS_S
    score = OffsetScore()
    if one.seed < len(shifts):
        shifted, truth = cut({name: outlines[name] for name in cameras}, shifts[one.seed])
        score.add(of_silhouettes(cameras, shifted), truth)
    return score.figures()


def _outlines_of(one: Case) -> tuple[Mapping[str, Camera], dict[str, list[Outline]]]:
    views = one.option("views", 2)
    if one.film.partition("-")[0] in CYCLES:
        return outlines_of(cycle_clip(one.film, views))
    every, outlines = outlines_of(load_clip(one.film, t_pose=False))
    return {name: every[name] for name in list(every)[:: len(every) // views][:views]}, outlines


def run_unrelated(one: Case) -> Figures:
    """The first view of each person beside the second view of each other one: no offset is right."""
    people = [outlines_of(cycle_clip(name, 2)) for name, views in SIMULATED if views == 2][: one.option("people", 3)]
    certain = uncertain = 0
    for (cameras, own), (_, other) in permutations(people, 2):
        first, second = cameras
        found = of_silhouettes(cameras, {first: own[first], second: other[second]})
        wrong = not any(offset.reason for offset in found.values())
        certain, uncertain = certain + wrong, uncertain + (not wrong)
    return {"certain": certain, "wrong": certain, "not certain": uncertain}


def run_sound(one: Case) -> Figures:
    """Offsets from sound, with random rooms and noise.

    Options: snr (dB); plain, against the beginnings of the videos, otherwise without the time that sound takes.
    """
    names, score = [f"cam{k}" for k in range(4)], OffsetScore()
    sounds, delays = recordings(len(names), one.option("snr", 20), one.seed)
    for shift_s in SHIFTS_S[1::2]:
        starts = {name: (k % 2) * abs(shift_s) + 0.0137 * k for k, name in enumerate(names)}
        tracks = {name: _track(sound, starts[name]) for name, sound in zip(names, sounds, strict=True)}
        pairs = {(a, b): SoundPair(tracks[a], tracks[b], reach_s(MAX_S)) for a, b in combinations(names, 2)}
        found = offsets_of(names, pairs, replace(SOUND_LIMITS, max_lag_s=MAX_S), {})
        taken = [0.0] * len(names) if one.option("plain", False) else delays
        score.add(found, {name: starts[name] - delay_s for name, delay_s in zip(names, taken, strict=True)})
    return score.figures()


def outlines_of(clip: PersonClip) -> tuple[dict[str, Camera], dict[str, list[Outline]]]:
    """Cameras and outlines of a clip, from its first silhouette on."""
    start_ns = clip.instants[0].captured_ns
    found: dict[str, list[Outline]] = {name: [] for name in clip.cameras}
    for instant in clip.instants:
        time_s = (instant.captured_ns - start_ns) / 1e9
        for name, mask in clip.masks(instant, clip.cameras).items():
            if (outline := outline_of(clip.cameras[name], mask, time_s)) is not None:
                found[name].append(outline)
    return dict(clip.cameras), found


def cut(outlines: Outlines, shift_s: float) -> tuple[dict[str, list[Outline]], dict[str, float]]:
    """Outlines of videos of which every second one begins `shift_s` later (earlier if negative), and the true beginnings.

    Above 45 frames/s, every second frame is used, and every second camera takes the odd ones.
    """
    period_s = float(np.median(np.diff([one.time_s for one in next(iter(outlines.values()))])))
    stride, shifted, truth = 2 if period_s < 1 / 45 else 1, {}, {}
    for k, (name, every) in enumerate(outlines.items()):
        first = round(abs(shift_s) * (k % 2 == (shift_s > 0)) / period_s) + k % 2 * (stride - 1)
        truth[name] = first * period_s
        numbered = ((round(one.time_s / period_s) - first, one) for one in every)
        shifted[name] = [replace(one, time_s=n * period_s) for n, one in numbered if n >= 0 and n % stride == 0]
    return shifted, truth


def of_silhouettes(cameras: Mapping[str, Camera], outlines: Outlines) -> dict[str, VideoOffset]:
    pairs = silhouette_pairs(cameras, outlines, reach_s(MAX_S))
    return offsets_of(list(cameras), pairs, replace(SILHOUETTE_LIMITS, max_lag_s=MAX_S), {})


def recordings(cameras: int, snr_db: float, seed: int) -> tuple[list[Floats], list[float]]:
    """Sound (n,) at each camera, SOUND_RATE samples/s, all from time 0 on, and the delays of the direct sound, seconds."""
    rng = np.random.default_rng(seed)
    count, times_s = round((SOUND_S + 3) * SOUND_RATE), np.arange(0, SOUND_S + 4, 0.18)
    syllables = np.interp(np.arange(count) / SOUND_RATE, times_s, rng.random(int((SOUND_S + 4) / 0.18) + 1))
    speech = sosfilt(butter(2, (250, 3000), "band", fs=SOUND_RATE, output="sos"), rng.standard_normal(count))
    source = 0.05 * speech / speech.std() * np.clip(syllables - 0.4, 0, None)
    clap = round((0.4 + 0.3 * rng.random()) * count)
    source[clap : clap + 160] += rng.standard_normal(160) * np.exp(-np.arange(160) / 40)
    sounds, delays = [], []
    for _ in range(cameras):
        delay_s = float(rng.uniform(2, 6)) / 343
        room = np.zeros(round(0.35 * SOUND_RATE))
        room[round(delay_s * SOUND_RATE)] = 1
        tail = np.arange(len(room) - round((delay_s + 0.005) * SOUND_RATE))
        room[-len(tail) :] += 0.05 * rng.standard_normal(len(tail)) * np.exp(-tail / (0.08 * SOUND_RATE))
        sound = fftconvolve(source, room)[:count]
        band = rng.uniform(80, 400), rng.uniform(3500, 7500)
        sound = sosfilt(butter(1, band, "band", fs=SOUND_RATE, output="sos"), sound)
        noise = rng.standard_normal(count) * sound.std() * 10 ** (-snr_db / 20)
        sounds.append((sound + noise) * rng.uniform(0.2, 1.0))
        delays.append(delay_s)
    return sounds, delays


def _track(sound: Floats, start_s: float) -> Floats:
    """The part from `start_s` on, at the rate of the comparison."""
    assert SOUND_RATE == 2 * RATE
    part = sound[round(start_s * SOUND_RATE) :][: round(SOUND_S * SOUND_RATE)]
    return np.asarray(part[: len(part) // 2 * 2].reshape(-1, 2).mean(axis=1))


COLUMNS = (
    Quantity("certain", "", 0, joined="sum"),
    Quantity("error", "periods", 2, joined="median"),
    Quantity("worst", "periods", 2),
    Quantity("wrong", "", 0, joined="sum"),
    Quantity("not certain", "", 0, joined="sum"),
)


def inputs(one: Case) -> tuple[str, ...]:
    return () if one.film.partition("-")[0] in CYCLES else (f"clips/{one.film}",)


SYNC = Kind(
    "sync",
    "Offsets of videos from silhouettes: simulated people and shared clips, each video cut at its beginning by up to ±2 s "
    "(`real_beam4` by ±0.3 s), seven cuts. Wrong: certain and more than half a frame period off.",
    run,
    COLUMNS,
    {f"{name}, {views} views": case(name, views=views) for name, views in SIMULATED}
    | {f"{name}, {views} views": case(name, views=views) for name, numbers in CLIPS.items() for views in numbers},
    case("walking-7"),
    seeds=len(SHIFTS_S),
    rows="videos, cameras",
    inputs=inputs,
)
UNRELATED = Kind(
    "sync-unrelated",
    "The first view of one simulated person beside the second view of another: no offset is right.",
    run_unrelated,
    COLUMNS,
    {"unrelated": case("people")},
    case("people", people=2),
    seeds=1,
    rows="videos",
)
SOUND = Kind(
    "sync-sound",
    "Offsets of videos from sound: speech-like noise and one clap in a reverberant room, 12 s, four cameras with different "
    "distances, gains, filters and noise; plus 3 ms/m: with the time that sound takes.",
    run_sound,
    COLUMNS,
    {
        f"{snr} dB{', plus 3 ms/m' if plain else ''}": case("sound", snr=snr, plain=plain)
        for snr in SNRS_DB
        for plain in (False, True)
    },
    case("sound"),
    seeds=5,
    rows="sound",
)
