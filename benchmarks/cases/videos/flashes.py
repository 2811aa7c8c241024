"""Offsets of videos from a flash or a lamp (`zenocap sync --by flash`), on simulated films.

A light is added to the images as far as it falls into the exposure of each: as long as stated in frame periods, or switched
on for good; 0.03 periods are 1 ms.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.cases.videos.sync import COLUMNS, OffsetScore
from benchmarks.harness.case import Case, Figures, Kind, case
from benchmarks.people.films import SMALL, Film, filmed
from tests.support.simulated_cameras import paper_cameras
from tests.support.video_file import write_video
from zenocap.common.arrays import Bytes, Floats, Image
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.lags.pairs import VideoOffset, offsets_of, reach_s
from zenocap.common.rig.rig import load_rig
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import motion_timeline
from zenocap.tools.setup.sync.light import FLASH_LIMITS, FlashPair, light_changes
from zenocap.tools.setup.sync.synchronize import SyncOptions, synchronize
from zenocap.tools.setup.sync.videos import Brightness, brightness_of

FPS, RENDERED_FPS = 30.0, 60.0
FILM_S, LENGTH_S = 8.0, 4.0  # rendered, and of each video
FIRST_PERSON = 700
OFFSETS_S = tuple(np.round(np.linspace(-2.0, 2.0, 24), 3).tolist())  # at any phase of the frames
SETTLED_S, BEFORE_END_S = 0.9, 0.3  # the light is on after the one and before the other
MAX_S = 10.0


@dataclass(frozen=True)
class AddedLight:
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
    AddedLight("lamp", inf), AddedLight("lamp", inf, 0.5), AddedLight("lamp", inf, 0.1),
    AddedLight("lamp, hard", inf, 1.0, 200.0), AddedLight("flash of 2 periods", 2.0),
    AddedLight("flash of 2 periods", 2.0, 0.5), AddedLight("flash of 1 period", 1.0),
    AddedLight("flash of 1 period", 1.0, 0.5), AddedLight("flash of 1 period, weak", 1.0, 1.0, 8.0),
    AddedLight("flash of 1 period, hard", 1.0, 1.0, 200.0), AddedLight("flash of 0.03 periods", 0.03),
    AddedLight("none", 0.0),
)  # fmt: skip


def run(one: Case) -> Figures:
    """Offsets of one person.  Options: exposure; files, written and read as the command does; every, of the offsets."""
    light = next(each for each in LIGHTS if (each.name, each.exposure) == (one.film, one.option("exposure", 1.0)))
    seed, files = FIRST_PERSON + one.seed, one.option("files", False)
    score, film = OffsetScore(), walk(seed)
    for k, offset_s in enumerate(OFFSETS_S[:: one.option("every", 5 if files else 1)]):
        starts, on_s = begins(offset_s, np.random.default_rng([seed, k]))
        found = (found_in_files if files else found_in)(film, starts, light, on_s)
        score.add({"1": replace(found, offset_s=0.0, reason=""), "2": found}, {"1": 0.0, "2": offset_s})
    return score.figures(light.allowed if light.periods else 0.0)


@lru_cache(maxsize=1)
def walk(seed: int) -> Film:
    """Film of a walking person at RENDERED_FPS, without empty scene."""
    subject = person(seed)
    script = motion_timeline(subject, "walking", seed)
    poses = [script.pose_at(script.motion_from_s + k / RENDERED_FPS) for k in range(round(FILM_S * RENDERED_FPS))]
    return filmed(subject, poses, 0, SMALL, seed, RENDERED_FPS)


def video(images: Bytes, start_s: float, light: AddedLight, on_s: float) -> Iterator[Image]:
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


def found_in(film: Film, starts: Mapping[str, float], light: AddedLight, on_s: float) -> VideoOffset:
    """Offset of the second video."""
    changes = {}
    for view, start_s in starts.items():
        cells = np.array([brightness_of(image) for image in video(film.images[view], start_s, light, on_s)])
        changes[view] = light_changes(Brightness(np.arange(len(cells)) / FPS, cells))
    pairs = {("1", "2"): FlashPair(changes["1"], changes["2"], reach_s(MAX_S))} if all(changes.values()) else {}
    return offsets_of(list(starts), pairs, replace(FLASH_LIMITS, max_lag_s=MAX_S), {})["2"]


def found_in_files(film: Film, starts: Mapping[str, float], light: AddedLight, on_s: float) -> VideoOffset:
    """The same, of video files and by the command's function."""
    with TemporaryDirectory(prefix="zenocap-") as place:
        folder = Path(place)
        cameras = {f"cam0{view}": camera for view, camera in zip(starts, paper_cameras(SMALL), strict=True)}
        write_calibration(folder / "calibration.toml", cameras)
        for view, start_s in starts.items():
            images = video(film.images[view], start_s, light, on_s)
            write_video(folder / "videos" / f"cam0{view}.mp4", images, fps=round(FPS))
        found, _ = synchronize(load_rig(folder, "hybrid"), SyncOptions(by="flash"))
    return found["cam02"].offset


FLASHES = Kind(
    "flashes",
    "Offsets of videos from a light: two cameras film a simulated person who walks, at 30 frames/s; one begins up to 2 s "
    "before or after the other, at any phase of the frames, 24 offsets, three people. Exposure: part of a frame period; "
    "hard: the light saturates half of the image. Wrong: certain and more than half a period off, one for short exposures "
    "and flashes.",
    run,
    COLUMNS,
    {f"{light.name}, exposure {light.exposure:g}": case(light.name, exposure=light.exposure) for light in LIGHTS}
    | {f"{light.name}, files": case(light.name, files=True) for light in (LIGHTS[0], LIGHTS[6], LIGHTS[-1])},
    case("lamp", every=12),
    rows="light",
)
