"""The cameras of a camera host: their names on the network, and what is announced of them."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.messages import HostCamera
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.source_kinds import OF_NAMES, named_source, parse_source
from zenocap.common.rig.sources import Announced, Device, LiveSource
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.video.v4l2.listing import FoundCamera, found_cameras

SUCH_AS = "cam01=rtsp://192.168.1.20/stream"
MOST_CAMERAS, MOST_MODES = 16, 48  # of one machine and one camera, as in `CameraHost`: they fit into one message


@dataclass(frozen=True)
class OfferedCamera:
    """A camera with what is announced of it."""

    source: LiveSource
    announced: HostCamera


def named_camera(text: str) -> tuple[str, LiveSource]:
    """Name and source of NAME=SOURCE.  Raises UserError."""
    name, source = named_source(text, SUCH_AS, "--camera ", installed=False)
    shown, allowed = f"--camera {name}={source.shown}", f"NAME=SOURCE, such as {SUCH_AS}; {OF_NAMES}"
    if name.startswith("."):
        raise UserError(f"{shown}: allowed: {allowed}")
    if not isinstance(source, LiveSource):
        raise UserError(f"{shown}: no camera and no stream: allowed: {allowed}")
    return name, source


def own_camera(source: Announced, named: Sequence[str]) -> LiveSource:
    """The camera of this machine that would be announced under the name of `source`.  named: NAME=SOURCE of others.

    Raises UserError.
    """
    cameras: dict[str, LiveSource] = dict(map(named_camera, named))
    with suppress(UserError):  # there is none
        for camera in found_cameras():
            cameras.setdefault(_id(camera), _device(camera.source))
    if source.camera not in cameras:
        raise UserError(
            f"{source.text}: this machine has no camera {source.camera} (there are: {', '.join(cameras) or 'none'}): "
            f"allowed: to run this on {source.machine}, or --camera {source.camera}=SOURCE"
        )
    own = cameras[source.camera]
    return replace(own, settings=source.settings) if isinstance(own, Device) else own


def offered_cameras(found: Sequence[FoundCamera], named: Mapping[str, LiveSource]) -> dict[str, OfferedCamera]:
    """The cameras that are announced, by name: the named ones, and those of this machine; MOST_CAMERAS at most."""
    offered = {
        name: OfferedCamera(source, HostCamera(id=name, source=source.shown, name=name)) for name, source in named.items()
    }
    for camera in found:
        id = _id(camera)
        if not camera.problem and id not in offered and len(offered) < MOST_CAMERAS:
            offered[id] = OfferedCamera(_device(camera.source), _announced(id, camera))
    return offered


def _id(camera: FoundCamera) -> str:
    """Name under which a camera of this machine is announced."""
    return plain_name(Path(camera.source).name).lstrip(".") or "camera"


def _device(source: str) -> Device:
    parsed = parse_source(source, Path(), installed=False)
    assert isinstance(parsed, Device)
    return parsed


def _announced(id: str, camera: FoundCamera) -> HostCamera:
    modes = [
        f"{mode.format} {mode.size[0]} x {mode.size[1]}: {', '.join(f'{rate:.4g}' for rate in mode.rates)} frames/s"
        for mode in camera.modes
    ]
    return HostCamera(
        id=id, source=camera.source, name=printable(camera.name), stable=camera.is_stable,
        modes=[printable(mode, 80) for mode in modes[:MOST_MODES]],
    )  # fmt: skip
