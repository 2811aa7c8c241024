"""Rig with other settings for offline tracking: size, rate, tracker, decoding, people."""

from dataclasses import replace

from zenocap.common.errors import UserError
from zenocap.common.rig.methods import method_of, tracker_methods
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import VideoFile
from zenocap.common.rig.table_errors import TableError
from zenocap.common.rig.tracker import TrackerOverrides, with_front_of, with_overrides
from zenocap.common.rig.viewers import at_rate

SAME_SHAPE = 0.02  # largest difference of the ratio of width and height from that of the calibrated size


def at_working_size(rig: Rig, size: tuple[int, int] | None, fps: float | None) -> Rig:
    """The rig with every viewer's working size and rate replaced where given.  Raises UserError.

    The empty scene at the beginning keeps its duration.
    """
    return replace(rig, viewers=tuple(_resized(rig, viewer, size, fps) for viewer in rig.viewers))


def with_tracker(rig: Rig, overrides: TrackerOverrides) -> Rig:
    """The rig with the given options instead of its own tracker's.  Raises UserError."""
    if rig.tracker is None:
        if overrides != TrackerOverrides():
            raise UserError(
                f"rig {rig.name}: method = {rig.method!r} has no tracker: allowed with "
                f"{', '.join(f'--{name}' for name in vars(overrides))}: {', '.join(tracker_methods())}"
            )
        return rig
    try:
        spec = with_overrides(rig.tracker, method_of(rig.method).tracker_method, overrides)
        spec = with_front_of(spec, {viewer.id: viewer.camera.name for viewer in rig.viewers})
    except TableError as error:
        raise UserError(f"--{error}") from error
    return replace(rig, tracker=spec)


def decoded_by_hardware(rig: Rig) -> Rig:
    """The rig with its video files decoded by hardware where that is possible."""
    viewers = tuple(
        replace(viewer, source=replace(viewer.source, hardware=True)) if isinstance(viewer.source, VideoFile) else viewer
        for viewer in rig.viewers
    )
    return replace(rig, viewers=viewers)


def with_people(rig: Rig) -> Rig:
    """The rig with the network that finds people in every viewer."""
    return replace(rig, viewers=tuple(replace(viewer, people=True) for viewer in rig.viewers))


def _resized(rig: Rig, viewer: Viewer, size: tuple[int, int] | None, fps: float | None) -> Viewer:
    if size is not None:
        width, height = viewer.calibrated_size
        if abs((size[0] / width) / (size[1] / height) - 1) > SAME_SHAPE:
            raise UserError(
                f"rig {rig.name}: viewer {viewer.id}: size {size[0]}x{size[1]}: allowed: the shape of the calibrated "
                f"{width}x{height} px, such as {size[0]}x{round(size[0] * height / width)}"
            )
        viewer = replace(viewer, camera=viewer.camera.resized(size))
    if fps is None:
        return viewer
    return at_rate(viewer, fps)
