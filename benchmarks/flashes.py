"""Offsets of videos from a flash or a lamp, as `zenocap sync --by flash` finds them, on films of simulated people.

    python -m benchmarks.flashes [--people 3] [--quick]

Two cameras film a walk at 30 frames/s; one begins -2.0 to +2.0 s before or after the other, at any phase of the frames.
A light is added to the images as far as it falls into the exposure of each: as long as stated in frame periods, or switched
on for good; 0.03 periods are 1 ms.  exposure: part of the frame period.  hard: the light saturates half of the image.
none: no light, so that no offset is right.  files: written as H.264 and read as the command does.
Errors are in frame periods; wrong: certain and more than half a period off for several exposures, more than one for a
flash that is shorter than the frame period, whose place within the frame no frame shows.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, nan
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from benchmarks.takes import SMALL, Film, default_folder, filmed, simulation_digest

from benchmarks.table import Cell, table
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Bytes, Floats, Image
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.lags.pairs import Offset, offsets_of, reach_s
from zenocap.common.rig.rig import load_rig
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import motion_timeline
from zenocap.simulation.rendering.video_file import write_video
from zenocap.tools.sync.light import FLASH_LIMITS, FlashPair, light_changes
from zenocap.tools.sync.synchronize import Options, synchronize
from zenocap.tools.sync.videos import Brightness, brightness_of

FPS, RENDERED_FPS = 30.0, 60.0
FILM_S, LENGTH_S = 8.0, 4.0  # rendered, and of each video
FIRST_PERSON = 700
OFFSETS_S = tuple(np.round(np.linspace(-2.0, 2.0, 24), 3).tolist())  # at any phase of the frames
SETTLED_S, BEFORE_END_S = 0.9, 0.3  # the light is on after the one and before the other
MAX_S = 10.0
COLUMNS = ("light", "exposure", "certain", "median error", "worst", "wrong", "not certain")


@dataclass(frozen=True)
class Light:
    """periods: how long it is on, inf for a lamp, 0 for none.  grey: added to a white surface, of 255.

    exposure: of the cameras, in frame periods.
    """

    name: str
    periods: float
    exposure: float = 1.0
    grey: float = 60.0

    def share(self, since_s: Floats) -> Floats:
        """Share of exposures that the light is on.  since_s: (n,) beginnings of the exposures from that of the light on."""
        length_s, on_s = self.exposure / FPS, self.periods / FPS
        lit = np.clip(np.minimum(since_s + length_s, on_s) - np.maximum(since_s, 0.0), 0.0, None)
        # A flash gives its light however short it is: all of it is seen by one exposure.
        found: Floats = lit / (length_s if on_s >= length_s else max(on_s, 1e-9))
        return found

    @property
    def allowed(self) -> float:
        """Error in frame periods up to which an offset is not wrong."""
        return 1.0 if self.periods < 1.0 or self.exposure < 1.0 else 0.5


LIGHTS = (
    Light("lamp", inf), Light("lamp", inf, 0.5), Light("lamp", inf, 0.1), Light("lamp, hard", inf, 1.0, 200.0),
    Light("flash of 2 periods", 2.0), Light("flash of 2 periods", 2.0, 0.5), Light("flash of 1 period", 1.0),
    Light("flash of 1 period", 1.0, 0.5), Light("flash of 1 period, weak", 1.0, 1.0, 8.0),
    Light("flash of 1 period, hard", 1.0, 1.0, 200.0), Light("flash of 0.03 periods", 0.03), Light("none", 0.0),
)  # fmt: skip


def walk(seed: int) -> Film:
    """Film of a walking person at RENDERED_FPS, without empty scene."""
    subject = person(seed)
    script = motion_timeline(subject, "walking", seed)
    begin_s = script.motion_from_s
    poses = [script.pose_at(begin_s + k / RENDERED_FPS) for k in range(round(FILM_S * RENDERED_FPS))]
    return filmed(subject, poses, 0, SMALL, seed, default_folder() / f"flashes-{seed}-{simulation_digest()}.npz")


def video(images: Bytes, start_s: float, light: Light, on_s: float) -> Iterator[Image]:
    """Images of a video that begins at `start_s` of the film, with a light from `on_s` on."""
    times_s = start_s + np.arange(round(LENGTH_S * FPS)) / FPS
    shares = light.share(times_s - on_s) if light.periods > 0 else np.zeros(len(times_s))
    for time_s, share in zip(times_s, shares, strict=True):
        image = images[min(len(images) - 1, round(float(time_s) * RENDERED_FPS))]
        # Surfaces reflect the light as they do the rest; black ones of a room some of it.
        added = light.grey * share * (0.3 + 0.7 * image.astype(np.float64) / 255)
        yield np.asarray(np.clip(image + added, 0, 255), dtype=np.uint8)


def begins(offset_s: float, rng: np.random.Generator) -> tuple[dict[str, float], float]:
    """Beginnings of both videos in the film, at any phase, and the time of the light."""
    first_s = max(0.0, -offset_s) + rng.uniform(0.0, 1 / FPS)
    starts = {"1": first_s, "2": first_s + offset_s}
    earliest_s = max(starts.values()) + SETTLED_S
    return starts, float(rng.uniform(earliest_s, min(starts.values()) + LENGTH_S - BEFORE_END_S))


def found_in(film: Film, starts: Mapping[str, float], light: Light, on_s: float) -> Offset:
    """Offset of the second video."""
    changes = {}
    for view, start_s in starts.items():
        cells = np.array([brightness_of(image) for image in video(film.images[view], start_s, light, on_s)])
        changes[view] = light_changes(Brightness(np.arange(len(cells)) / FPS, cells))
    pairs = {("1", "2"): FlashPair(changes["1"], changes["2"], reach_s(MAX_S))} if all(changes.values()) else {}
    return offsets_of(list(starts), pairs, replace(FLASH_LIMITS, max_lag_s=MAX_S), {})["2"]


def found_in_files(film: Film, starts: Mapping[str, float], light: Light, on_s: float) -> Offset:
    """The same, of video files and by the command's function."""
    with TemporaryDirectory(prefix="zenocap-") as place:
        folder = Path(place)
        cameras = {f"cam0{view}": camera for view, camera in zip(starts, paper_cameras(SMALL), strict=True)}
        write_calibration(folder / "calibration.toml", cameras)
        for view, start_s in starts.items():
            images = video(film.images[view], start_s, light, on_s)
            write_video(folder / "videos" / f"cam0{view}.mp4", images, fps=round(FPS))
        found, _ = synchronize(load_rig(folder, "hybrid"), Options(by="flash"))
    return found["cam02"].offset


def row(light: Light, films: Mapping[int, Film], offsets: tuple[float, ...], *, files: bool) -> list[Cell]:
    errors, uncertain = [], 0
    for seed, film in films.items():
        for k, offset_s in enumerate(offsets):
            starts, on_s = begins(offset_s, np.random.default_rng([seed, k]))
            found = (found_in_files if files else found_in)(film, starts, light, on_s)
            if found.reason:
                uncertain += 1
            else:
                errors.append(abs(found.offset_s - offset_s) * FPS)
    median, worst = (float(np.median(errors)), max(errors)) if errors else (nan, nan)
    wrong = len(errors) if light.periods == 0 else sum(error > light.allowed for error in errors)
    name = f"{light.name}, files" if files else light.name
    return [name, light.exposure, len(errors), median, worst, wrong, uncertain]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="a few offsets of one person")
    options = parser.parse_args()
    films = {seed: walk(seed) for seed in range(FIRST_PERSON, FIRST_PERSON + (1 if options.quick else options.people))}
    offsets = OFFSETS_S[::10] if options.quick else OFFSETS_S
    rows = [row(light, films, offsets, files=False) for light in LIGHTS]
    rows += [row(light, films, offsets[::5], files=True) for light in (LIGHTS[0], LIGHTS[6], LIGHTS[-1])]
    print(table("Offsets of videos from a light, errors in frame periods", COLUMNS, rows))


if __name__ == "__main__":
    main()
