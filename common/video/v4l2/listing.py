"""The cameras of this machine, with the names that stay the same when they are plugged in again."""

import os
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.video.v4l2.camera import Control, Mode, V4l2Camera

DEV = Path("/dev")
STABLE = ("v4l/by-id", "v4l/by-path")  # folders of udev, below /dev, the better one first
NUMBERED = re.compile(r"video(\d{1,3})")


@dataclass(frozen=True)
class FoundCamera:
    """A camera of this machine, or a device file that cannot be asked.

    path: /dev/videoN.  source: what a rig file has, the stable name where there is one.  problem: why name, modes and
    controls are missing; empty otherwise.
    """

    path: Path
    source: str
    name: str = ""
    driver: str = ""
    bus: str = ""
    modes: tuple[Mode, ...] = ()
    controls: tuple[Control, ...] = ()
    problem: str = ""

    @property
    def is_stable(self) -> bool:
        """Whether `source` names the same camera after it was plugged in again."""
        return self.source != str(self.path)


def found_cameras(dev: Path = DEV, opener: Callable[[Path], V4l2Camera] = V4l2Camera) -> tuple[FoundCamera, ...]:
    """All cameras in the order of their numbers; device files that give no images are left out.

    Raises UserError where there is no Video4Linux2, or no device file.
    """
    if sys.platform != "linux":
        raise UserError(
            f"cameras are listed on Linux only, not on {sys.platform}: a rig file takes them by number, as source = 0"
        )
    numbered = {int(match[1]): path for path in dev.glob("video*") if (match := NUMBERED.fullmatch(path.name))}
    if not numbered:
        raise UserError(
            f"{dev}/video*: no such device: no camera is plugged in, its driver is not loaded, or this is a container that "
            "was not given the devices (docker run --device /dev/video0)"
        )
    names = stable_names(dev)
    listed = (_listed(path, names.get(os.path.realpath(path), str(path)), opener) for _, path in sorted(numbered.items()))
    return tuple(camera for camera in listed if camera is not None)


def stable_names(dev: Path = DEV) -> dict[str, str]:
    """Name that a rig file should have, by device file.

    by-id names the camera itself.  Where two cameras of one kind have the same serial number, udev keeps one, and the
    other gets its name by-path, which is that of the socket.
    """
    names: dict[str, str] = {}
    for folder in STABLE:
        for link in sorted((dev / folder).glob("*")):
            names.setdefault(os.path.realpath(link), str(link))
    return names


def _listed(path: Path, source: str, opener: Callable[[Path], V4l2Camera]) -> FoundCamera | None:
    try:
        with opener(path) as camera:
            if not camera.is_camera:
                return None
            return FoundCamera(path, source, camera.name, camera.driver, camera.bus, camera.modes(), camera.controls())
    except PermissionError:
        return FoundCamera(path, source, problem="no permission: add this user to the group `video` and log in again")
    except OSError as error:
        return FoundCamera(path, source, problem=f"does not answer: {error.strerror or error}")
