"""Offsets of videos that did not begin together, as `zenocap sync` finds them, from silhouettes and from sound.

    python -m benchmarks.sync [--only silhouettes,unrelated,sound,files] [--quick]

silhouettes: simulated people, and the shared clips walk7, walk2 and real_beam4, each video cut at its beginning; of clips
at 60 frames/s every second frame in another phase, so that true offsets are multiples of half a frame period.  unrelated:
the first view of one simulated person and the second of another: no offset is right.  sound: speech-like noise and a clap
at four cameras, each with its own echoes, gain, filter, noise and distance of 2 to 6 m; `plus 3 ms/m`: against the
beginnings of the videos, otherwise against what the sound shows, which differs by the time that it takes.  files: the
videos of walk7 and walk2 written shifted, with sound at equal distances, and read as the command does.
Errors are against the first camera, in frame periods at 30 frames/s (of real_beam4 too).  wrong: certain offsets that are
more than half a frame period off.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from benchmarks.clips import SHARED
from benchmarks.hybrid.silhouettes import load_clip
from benchmarks.simulated_clip import cycle_clip
from benchmarks.takes import default_folder
from scipy.signal import butter, fftconvolve, sosfilt

from benchmarks.table import Cell, table
from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import Offset, offsets_of, reach_s
from zenocap.common.lags.tangents import SILHOUETTE_LIMITS, Outline, outline_of, silhouette_pairs
from zenocap.common.rig.rig import load_rig
from zenocap.common.video.reader import VideoReader
from zenocap.simulation.rendering.video_file import Sound, write_video
from zenocap.tools.sync.sound import RATE, SOUND_LIMITS, SoundPair
from zenocap.tools.sync.synchronize import Options, synchronize

PERIOD_S = 1 / 30
SHIFTS_S = (0.0, 0.37, -0.37, 1.13, -1.13, 2.0, -2.0)  # of the second, fourth, ... camera; rounded to frames
SHORT_SHIFTS_S = (0.0, 0.1, -0.1, 0.3, -0.3)  # of real_beam4, which is 1.7 s long
CLIPS = {"walk7": (7, 4, 2), "walk2": (2,), "real_beam4": (4, 2)}  # numbers of cameras
SIMULATED = (("walking-7", 2), ("running-12", 2), ("boxing-8", 2), ("walking-14", 4), ("running-13", 4))
MAX_S, WRONG = 10.0, 0.5
SNRS_DB, SOUND_SEEDS, SOUND_S, SOUND_RATE = (20, 0, -10, -20), 5, 12.0, 16_000
COLUMNS = ("videos", "cameras", "certain", "median error", "worst", "wrong", "not certain")
SECTIONS = ("silhouettes", "unrelated", "sound", "files")
Outlines = Mapping[str, Sequence[Outline]]


@dataclass
class Score:
    """Errors of certain offsets, in frame periods, and number of the others."""

    errors: list[float]
    uncertain: int = 0

    def add(self, found: Mapping[str, Offset], truth: Mapping[str, float]) -> None:
        first = next((name for name in truth if not found[name].reason), None)
        for name in list(truth)[1:]:
            if found[name].reason or first == name or first is None:
                self.uncertain += 1
            else:
                error_s = found[name].offset_s - found[first].offset_s - truth[name] + truth[first]
                self.errors.append(abs(error_s) / PERIOD_S)

    def row(self, name: str, cameras: int) -> list[Cell]:
        median, worst = (float(np.median(self.errors)), max(self.errors)) if self.errors else (nan, nan)
        return [name, cameras, len(self.errors), median, worst, sum(e > WRONG for e in self.errors), self.uncertain]


def simulated_outlines(name: str, views: int) -> tuple[dict[str, Camera], dict[str, list[Outline]]]:
    """Cameras and outlines of a simulated person at 60 frames/s."""
    clip = cycle_clip(name, views)
    start_ns = clip.instants[0].captured_ns
    instants = [((one.captured_ns - start_ns) / 1e9, clip.masks(one, clip.cameras)) for one in clip.instants]
    return dict(clip.cameras), _outlines(clip.cameras, instants)


def clip_outlines(name: str) -> tuple[dict[str, Camera], dict[str, list[Outline]]]:
    """Cameras and outlines of a shared clip, from its first silhouette on."""
    clip = load_clip(SHARED / "clips" / name, default_folder(), t_pose=False)
    start_ns = clip.instants[0].captured_ns
    instants = [((one.captured_ns - start_ns) / 1e9, clip.masks(one, clip.cameras)) for one in clip.instants]
    return clip.cameras, _outlines(clip.cameras, instants)


def _outlines(cameras: Mapping[str, Camera], instants: Sequence[tuple[float, dict[str, Mask]]]) -> dict[str, list[Outline]]:
    found: dict[str, list[Outline]] = {name: [] for name in cameras}
    for time_s, masks in instants:
        for name, mask in masks.items():
            if (outline := outline_of(cameras[name], mask, time_s)) is not None:
                found[name].append(outline)
    return found


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


def of_silhouettes(cameras: Mapping[str, Camera], outlines: Outlines) -> dict[str, Offset]:
    pairs = silhouette_pairs(cameras, outlines, reach_s(MAX_S))
    return offsets_of(list(cameras), pairs, replace(SILHOUETTE_LIMITS, max_lag_s=MAX_S), {})


def silhouette_rows(quick: bool) -> Iterator[list[Cell]]:
    for name, views in SIMULATED[: 1 if quick else None]:
        cameras, outlines = simulated_outlines(name, views)
        yield _silhouette_row(f"{name}, simulated", cameras, outlines, SHIFTS_S[: 3 if quick else None])
    for name, numbers in list(CLIPS.items())[1 if quick else 0 : 2 if quick else None]:
        every, outlines = clip_outlines(name)
        shifts = SHORT_SHIFTS_S if name == "real_beam4" else SHIFTS_S[: 3 if quick else None]
        for number in numbers:
            cameras = {name: every[name] for name in list(every)[:: len(every) // number][:number]}
            yield _silhouette_row(name, cameras, outlines, shifts)


def _silhouette_row(name: str, cameras: Mapping[str, Camera], outlines: Outlines, shifts: Sequence[float]) -> list[Cell]:
    score = Score([])
    for shift_s in shifts:
        shifted, truth = cut({name: outlines[name] for name in cameras}, shift_s)
        score.add(of_silhouettes(cameras, shifted), truth)
    return score.row(name, len(cameras))


def unrelated_rows(quick: bool) -> Iterator[list[Cell]]:
    """The first view of each person beside the second view of each other one."""
    people = [simulated_outlines(name, 2) for name, views in SIMULATED if views == 2][: 2 if quick else None]
    certain = uncertain = 0
    for (cameras, one), (_, other) in permutations(people, 2):
        first, second = cameras
        found = of_silhouettes(cameras, {first: one[first], second: other[second]})
        wrong = not any(offset.reason for offset in found.values())
        certain, uncertain = certain + wrong, uncertain + (not wrong)
    yield ["unrelated", 2, certain, nan, nan, certain, uncertain]


def recordings(cameras: int, snr_db: float, seed: int, seconds: float = SOUND_S) -> tuple[list[Floats], list[float]]:
    """Sound (n,) at each camera, SOUND_RATE samples/s, all from time 0 on, and the delays of the direct sound, seconds."""
    rng = np.random.default_rng(seed)
    count = round((seconds + 3) * SOUND_RATE)
    syllables = np.interp(
        np.arange(count) / SOUND_RATE, np.arange(0, seconds + 4, 0.18), rng.random(int((seconds + 4) / 0.18) + 1)
    )
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


def sound_rows(quick: bool) -> Iterator[list[Cell]]:
    names = [f"cam{k}" for k in range(4)]
    for snr_db in SNRS_DB[: 2 if quick else None]:
        corrected, plain = Score([]), Score([])
        for seed in range(1 if quick else SOUND_SEEDS):
            sounds, delays = recordings(len(names), snr_db, seed)
            for shift_s in SHIFTS_S[1::2]:
                starts = {name: (k % 2) * abs(shift_s) + 0.0137 * k for k, name in enumerate(names)}
                tracks = {name: _track(sound, starts[name]) for name, sound in zip(names, sounds, strict=True)}
                pairs = {(a, b): SoundPair(tracks[a], tracks[b], reach_s(MAX_S)) for a, b in combinations(names, 2)}
                found = offsets_of(names, pairs, replace(SOUND_LIMITS, max_lag_s=MAX_S), {})
                plain.add(found, starts)
                corrected.add(found, {name: starts[name] - delay_s for name, delay_s in zip(names, delays, strict=True)})
        yield corrected.row(f"sound, {snr_db} dB", len(names))
        yield plain.row(f"sound, {snr_db} dB, plus 3 ms/m", len(names))


def _track(sound: Floats, start_s: float) -> Floats:
    """The part from `start_s` on, at the rate of the comparison."""
    assert SOUND_RATE == 2 * RATE
    part = sound[round(start_s * SOUND_RATE) :][: round(SOUND_S * SOUND_RATE)]
    return np.asarray(part[: len(part) // 2 * 2].reshape(-1, 2).mean(axis=1))


def file_rows(quick: bool) -> Iterator[list[Cell]]:
    for name in ("walk2",) if quick else ("walk7", "walk2"):
        for by in ("sound", "silhouettes"):
            with TemporaryDirectory() as place:
                folder = Path(place) / name
                truth = shifted_copy(SHARED / "clips" / name, folder, 0.65)
                found, _ = synchronize(load_rig(folder, "hybrid"), Options(by="sound" if by == "sound" else "silhouettes"))
            score = Score([])
            score.add({id: one.offset for id, one in found.items()}, truth)
            yield score.row(f"{name}, files, {by}", len(truth))


def shifted_copy(clip: Path, folder: Path, shift_s: float) -> dict[str, float]:
    """Write a folder of videos that begin at different times, with sound; returns these times.

    Of 60 frames/s every second frame is used, so that offsets are multiples of half a frame period.
    """
    folder.mkdir(parents=True)
    (folder / "calibration.toml").write_bytes((clip / "calibration.toml").read_bytes())
    videos = sorted((clip / "videos").glob("*.mp4"))
    sounds, delays = recordings(len(videos), 10, 0)
    truth = {}
    for k, (path, sound, delay_s) in enumerate(zip(videos, sounds, delays, strict=True)):
        images, fps = _images(path)
        stride = 2 if fps > 45 else 1
        first = round((1.0 + shift_s * (k % 2) + 0.05 * k) * fps) + k % 2 * (stride - 1)
        empty = np.median(np.stack(images[:20]), axis=0).astype(np.uint8)
        (folder / "background").mkdir(exist_ok=True)
        cv2.imwrite(str(folder / "background" / f"{path.stem}.png"), empty)
        begin = round((first / fps + delay_s) * SOUND_RATE)  # as if at equal distances
        kept = images[first::stride]
        samples = sound[begin : begin + round(len(kept) * stride / fps * SOUND_RATE)]
        write_video(folder / "videos" / path.name, kept, fps=round(fps / stride), sound=Sound(samples, SOUND_RATE))
        truth[path.stem] = first / fps
    return truth


def _images(path: Path) -> tuple[list[Image], float]:
    images = []
    with VideoReader(path) as reader:
        while (frame := reader.next()) is not None:
            images.append(frame.image())
        return images, reader.fps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(SECTIONS), help="sections, separated by commas")
    parser.add_argument("--quick", action="store_true", help="a few cases of each section")
    options = parser.parse_args()
    missing = [str(folder) for folder in (SHARED / "clips" / name for name in CLIPS) if not folder.is_dir()]
    if missing:
        print(f"sync: skipped: {', '.join(missing)} missing (the shared test clips are expected beside the checkout)")
        return
    sections = {"silhouettes": silhouette_rows, "unrelated": unrelated_rows, "sound": sound_rows, "files": file_rows}
    if unknown := sorted(set(options.only.split(",")) - set(SECTIONS)):
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(SECTIONS)}")
    rows = [row for name in SECTIONS if name in options.only.split(",") for row in sections[name](options.quick)]
    print(table("Offsets of videos, errors in frame periods", COLUMNS, rows))


if __name__ == "__main__":
    main()
