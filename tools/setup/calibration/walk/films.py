"""The silhouettes of a person who walks, from the videos of a folder and the lenses of its cameras."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import Outline
from zenocap.common.rig.folder import with_suffix
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import VIDEO_SUFFIXES, VideoFile
from zenocap.common.rig.viewers import of_source
from zenocap.common.toml_file import read_toml
from zenocap.tools.setup.calibration.lens_model import LensModel
from zenocap.tools.setup.calibration.silhouettes import Hulls, hulls_of
from zenocap.tools.setup.calibration.walk.delays import SilhouetteSeries, series_of
from zenocap.tools.setup.calibration.walk.parameters import LEAST_INSTANTS, MOST_INSTANTS, PER_S
from zenocap.tools.setup.cameras.away import require_copied
from zenocap.tools.setup.sync.videos import from_its_beginning, outlines_of

LEVEL = np.diag([1.0, -1.0, -1.0])  # of a camera that looks along -Z of a Y-up world


@dataclass(frozen=True)
class FilmedWalk:
    """cameras: with their lenses, at no particular pose.  hulls: of each, nearest to the instants of timing.

    notes: for the user.  begins: of each video, s, as sync.toml has it.
    """

    cameras: Mapping[str, Camera]
    hulls: Mapping[str, Hulls]
    timing: SilhouetteSeries
    begins: Mapping[str, float]
    notes: tuple[str, ...]


def filmed(folder: Path, lenses: Mapping[str, Lens], seconds: float, on_frame: Callable[[int], None]) -> FilmedWalk:
    """Hulls of the person in each video of a folder.  Raises UserError."""
    if not folder.is_dir():
        raise UserError(f"{folder}: no such folder: allowed: a folder with videos/, as `zenocap film` makes it")
    require_copied(folder)
    videos = with_suffix(folder / "videos", VIDEO_SUFFIXES)
    if len(videos) < 2:
        raise UserError(f"{folder}: videos/ has {len(videos)} video(s): allowed: one for each of two cameras or more")
    missing = [path.stem for path in videos if path.stem not in lenses]
    if missing and len(lenses) > 1:
        raise UserError(f"{folder}: no lens of {', '.join(missing)}: there are lenses of {', '.join(lenses)}")
    only = next(iter(lenses.values()))
    clip = folder / "clip.toml"
    up_axis = str(read_toml(clip).get("up_axis", "y")) if clip.is_file() else "y"
    known = {path.stem: of_source(lenses.get(path.stem, only), VideoFile(path)) for path in videos}
    cameras = {name: LensModel.of(lens).camera(name, LEVEL, np.zeros(3)) for name, lens in known.items()}
    with TemporaryDirectory() as place:
        calibration = Path(place) / "lenses.toml"
        write_calibration(calibration, cameras, up_axis)
        rig = load_rig(folder, "hybrid", calibration=calibration)
        viewers = {viewer.id: from_its_beginning(rig, viewer) for viewer in rig.viewers}
        outlines = outlines_of(viewers, seconds, on_frame)
    names = {viewer.id: viewer.camera.name for viewer in rig.viewers}
    begins = {viewer.id: viewer.source.offset_ns / 1e9 for viewer in rig.viewers if isinstance(viewer.source, VideoFile)}
    periods = {viewer.id: 1.0 / viewer.fps for viewer in rig.viewers}
    for id, found in outlines.items():
        if len(found) < LEAST_INSTANTS:
            raise UserError(
                f"{folder}: {names[id]}: a person in {len(found)} images: allowed: {LEAST_INSTANTS} or more; is the scene "
                "empty at the start (empty_seconds in clip.toml), and the light steady?"
            )
    times = {id: np.array([one.time_s + begins[id] for one in found]) for id, found in outlines.items()}
    begin, end = min(one[0] for one in times.values()), max(one[-1] for one in times.values())
    count = min(MOST_INSTANTS, max(2, math.floor((end - begin) * PER_S)))
    instants = np.linspace(begin, end, count)
    hulls, series = {}, {}
    for id, found in outlines.items():
        near = np.abs(times[id][:, None] - instants).argmin(axis=0)
        chosen: list[Outline | None] = [
            found[k] if abs(times[id][k] - instant) <= 0.6 * periods[id] else None
            for k, instant in zip(near, instants, strict=True)
        ]
        hulls[names[id]] = hulls_of(viewers[id].camera, chosen)
        series[names[id]] = series_of(times[id], hulls_of(viewers[id].camera, found))
    timing = SilhouetteSeries(series, instants)
    return FilmedWalk(
        {name: cameras[name] for name in hulls}, hulls, timing, {names[id]: begins[id] for id in names}, rig.notes
    )
