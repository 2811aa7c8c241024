"""Viewers of a rig that camera hosts run: what is sent to them, and the rig that they make of it.

Only calibration, names and numbers are sent; the source is the receiver's own, and no path is among them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zenocap.common.arrays import LARGEST_PX, Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery, HostedLens, HostedViewer
from zenocap.common.rig.camera_settings import KEYS, CameraSettings, Setting, given_settings, setting_problem, settings_of
from zenocap.common.rig.file import LogTable, ZenohTable
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import (
    PLAIN_BACKGROUNDS,
    Announced,
    Device,
    FirstFrames,
    LiveSource,
    empty_frames,
    most_first,
)
from zenocap.common.rig.tracker import TrackerTable, tracker_spec
from zenocap.common.rig.two_view import ADDITIONS
from zenocap.common.rig.viewers import SAME_SHAPE

LARGEST_ASSIGNED_PX = LARGEST_PX // 2  # of an image; above 8K; its background takes many times the memory; by hand


@dataclass(frozen=True)
class HostedCamera:
    """An announced camera of a rig.  viewer: its id."""

    viewer: str
    source: Announced


def hosted_cameras(rig: Rig) -> tuple[HostedCamera, ...]:
    """The cameras of a rig that camera hosts announce."""
    return tuple(HostedCamera(one.id, one.source) for one in rig.viewers if isinstance(one.source, Announced))


def assignment(rig: Rig, id: str, now_ns: int) -> AssignQuery:
    """The query that assigns viewer `id` of a rig to the host of its camera."""
    viewer = rig.viewer(id)
    camera, lens = viewer.camera, viewer.camera.fisheye
    kind = next((name for name, one in PLAIN_BACKGROUNDS.items() if one == viewer.background), None)
    if kind is None and not isinstance(viewer.background, FirstFrames):
        allowed = "allowed on another machine: adaptive, first:N, first:SECONDSs, median, mog2"
        raise UserError(f"viewer {id}: background {viewer.background}: {allowed}")
    settings = viewer.source.settings if isinstance(viewer.source, Announced) else CameraSettings()
    return AssignQuery(
        frame=0,
        captured_ns=now_ns,
        what="assign",
        rig=rig.name,
        digest=rig.digest,
        tracker=method_of(rig.method).only_silhouettes,
        additions=sorted(rig.additions),
        viewer=HostedViewer(
            id=id,
            camera=camera.name,
            calibrated_size=viewer.calibrated_size,
            size=camera.size,
            matrix=_numbers(camera.matrix),
            distortions=_numbers(camera.distortions),
            rotation=_numbers(camera.rotation),
            translation=_numbers(camera.translation),
            fisheye=None
            if lens is None
            else HostedLens(size=lens.size, matrix=_numbers(lens.matrix), coefficients=_numbers(lens.coefficients)),
            fps=float(viewer.fps),
            rig_fps=float(rig.fps),
            background=kind or "first",
            empty_frames=empty_frames(viewer.background) or 60,
            preview=viewer.preview,
            silhouette=viewer.silhouette,
            settings=settings_text(settings),
        ),
    )


def hosted_rig(query: AssignQuery, source: LiveSource, base: Path, *, previews: bool) -> Rig:
    """The rig of a host's viewer, with one viewer of its own and, for the rate of the rig, another one.

    source: of the host.  base: folder of its films.  previews: whether small pictures may be published.
    Raises UserError for an assignment that makes no viewer.
    """
    if query.viewer is None:
        raise UserError("assignment: no viewer: allowed: one")
    one = query.viewer
    if unknown := [name for name in query.additions if name not in ADDITIONS]:
        raise UserError(f"assignment: additions {', '.join(unknown)}: allowed: {', '.join(ADDITIONS)}")
    if isinstance(source, Device):
        source = replace(source, settings=checked_settings(one.settings))
    background = FirstFrames(one.empty_frames) if one.background == "first" else PLAIN_BACKGROUNDS[one.background]
    check_sizes(one)
    viewer = Viewer(
        one.id, _camera(one), one.calibrated_size, source, background, one.fps, one.preview and previews, one.silhouette
    )
    slowest = replace(viewer, id=f"{one.id[:60]}-all", fps=min(one.fps, one.rig_fps))
    return Rig(
        query.rig, "hybrid" if query.tracker else "two-view", (viewer, slowest), (), base, query.digest, ZenohTable(),
        LogTable(), (), tracker=tracker_spec(TrackerTable(), "hybrid", True, base, files=False) if query.tracker else None,
        additions=frozenset(query.additions), film=True,
    )  # fmt: skip


def check_sizes(one: HostedViewer) -> None:
    """Raise UserError for images that no camera has, a working size that is larger than the calibrated one or of another
    shape, and more empty frames than are learnt from.
    """
    (width, height), (full_width, full_height) = one.size, one.calibrated_size
    for size in (one.size, one.calibrated_size):
        if size[0] * size[1] > LARGEST_ASSIGNED_PX:
            raise UserError(f"assignment: size = {list(size)}: allowed: {LARGEST_ASSIGNED_PX} pixels at most")
    if abs(width * full_height / (height * full_width) - 1.0) > SAME_SHAPE:
        raise UserError(
            f"assignment: size = {[width, height]}: allowed: the shape of the calibrated {full_width} x {full_height} px"
        )
    if width > full_width or height > full_height:
        raise UserError(
            f"assignment: size = {[width, height]}: allowed: at most the calibrated {full_width} x {full_height} px"
        )
    if one.background == "first" and one.empty_frames > (most := most_first(one.size)):
        raise UserError(f"assignment: empty_frames = {one.empty_frames}: allowed: 1 to {most} at {width} x {height} px")


def settings_text(settings: CameraSettings) -> dict[str, str]:
    """Settings of a camera for a message; those without a value are left out."""
    return {key: str(value) for key, value in given_settings(settings).items()}


def checked_settings(texts: Mapping[str, str]) -> CameraSettings:
    """Settings of a camera from a message.  Raises UserError for keys and values that a rig file may not have either."""
    values: dict[str, Setting] = {}
    for key, text in texts.items():
        value: Setting = int(text) if text.removeprefix("-").isdecimal() and len(text) < 12 else text
        problem = setting_problem(key, value) if key in KEYS else ", ".join(KEYS)
        if problem is not None:
            raise UserError(f"assignment: {key} = {value!r}: allowed: {problem}")
        values[key] = value
    return settings_of(values)


def _camera(one: HostedViewer) -> Camera:
    """Raises UserError where the numbers are no calibration."""
    matrix, rotation = np.reshape(one.matrix, (3, 3)), np.reshape(one.rotation, (3, 3))
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3)):
        raise UserError("assignment: no calibration: allowed: focal lengths above 0 and a rotation")
    lens = one.fisheye
    fisheye = None if lens is None else FisheyeLens(lens.size, np.reshape(lens.matrix, (3, 3)), np.array(lens.coefficients))
    distortions, translation = np.array(one.distortions, dtype=np.float64), np.array(one.translation)
    return Camera(one.camera, one.size, matrix, distortions, rotation, translation, fisheye)


def _numbers(values: Floats) -> list[float]:
    return [float(value) for value in np.asarray(values, dtype=np.float64).ravel()]
