"""One camera of Video4Linux2: what it is, its modes, and its controls."""

import ctypes
import errno
import fcntl
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from zenocap.common.closable import Closable
from zenocap.common.video.v4l2 import structures as v4l2
from zenocap.common.video.v4l2.structures import Capabilities, ControlFlag, ControlType

# Of a file descriptor, a request and a structure, which it changes; raises OSError.
Ioctl = Callable[[int, int, ctypes.Structure], object]
MAX_ENTRIES = 256  # of one list of a driver; one that never ends its list must not stop the program


@dataclass(frozen=True)
class Mode:
    """Format and size of images.  rates: frames/s, highest first; empty when the driver gives none.

    size: (width, height), px; where any size in a range can be chosen, the largest.  smallest: then the least.
    """

    format: str
    size: tuple[int, int]
    rates: tuple[float, ...]
    smallest: tuple[int, int] | None = None


@dataclass(frozen=True)
class Control:
    """A setting of a camera, in the units of its driver.  value: None when it cannot be read.

    menu: texts by value, of a control that is a choice.
    """

    id: int
    name: str
    minimum: int
    maximum: int
    step: int
    default: int
    value: int | None
    menu: dict[int, str]
    read_only: bool
    inactive: bool


class V4l2Camera(Closable):
    """An open device file.  It may be open while another program, or OpenCV, takes its images."""

    def __init__(self, path: Path, ioctl: Ioctl = fcntl.ioctl, opener: Callable[[str, int], int] = os.open) -> None:
        """Raises OSError: FileNotFoundError, PermissionError, or of a file that is no V4L2 device."""
        self.path, self._ioctl = path, ioctl
        self._file = opener(str(path), os.O_RDWR | getattr(os, "O_NONBLOCK", 0))
        try:
            found = v4l2.Capability()
            self._ioctl(self._file, v4l2.QUERYCAP, found)
        except OSError:
            os.close(self._file)
            raise
        self.driver, self.name, self.bus = map(_text, (found.driver, found.card, found.bus_info))
        own = found.capabilities & Capabilities.DEVICE_CAPS
        self.capabilities: int = found.device_caps if own else found.capabilities

    def close(self) -> None:
        os.close(self._file)

    @property
    def is_camera(self) -> bool:
        """Whether it gives images: nodes of metadata, outputs and codecs do not."""
        return bool(self.capabilities & (Capabilities.VIDEO_CAPTURE | Capabilities.VIDEO_CAPTURE_MPLANE))

    def modes(self) -> tuple[Mode, ...]:
        """All formats and sizes with their rates, in the order of the driver."""
        multiplanar = not self.capabilities & Capabilities.VIDEO_CAPTURE
        found: list[Mode] = []
        for index in range(MAX_ENTRIES):
            entry = v4l2.FormatDescription(index=index, type=v4l2.CAPTURE_MPLANE if multiplanar else v4l2.CAPTURE)
            if not self._has(v4l2.ENUM_FMT, entry):
                break
            found += self._sizes(entry.pixelformat)
        return tuple(found)

    def controls(self) -> tuple[Control, ...]:
        """All controls with a number as value; not buttons, texts and those the driver disables."""
        return tuple(self._controls())

    def get(self, control: int) -> int:
        """Value of a control.  Raises OSError."""
        value = v4l2.ControlValue(id=control)
        self._ioctl(self._file, v4l2.G_CTRL, value)
        return int(value.value)

    def set(self, control: int, value: int) -> None:
        """Raises OSError."""
        self._ioctl(self._file, v4l2.S_CTRL, v4l2.ControlValue(id=control, value=value))

    def _has(self, request: int, structure: ctypes.Structure) -> bool:
        """Fill the structure; False after the end of a list, or where the driver does not have this list."""
        try:
            self._ioctl(self._file, request, structure)
        except OSError as error:
            if error.errno in (errno.EINVAL, errno.ENOTTY, errno.ENODATA):
                return False
            raise
        return True

    def _sizes(self, pixel_format: int) -> Iterator[Mode]:
        name = fourcc_text(pixel_format)
        for index in range(MAX_ENTRIES):
            entry = v4l2.FrameSize(index=index, pixel_format=pixel_format)
            if not self._has(v4l2.ENUM_FRAMESIZES, entry):
                return
            if entry.type != v4l2.DISCRETE:
                least_width, width, _, least_height, height, _ = entry.values
                rates = self._rates(pixel_format, width, height)
                yield Mode(name, (width, height), rates, (least_width, least_height))
                return
            width, height = entry.values[:2]
            yield Mode(name, (width, height), self._rates(pixel_format, width, height))

    def _rates(self, pixel_format: int, width: int, height: int) -> tuple[float, ...]:
        found: set[Fraction] = set()
        for index in range(MAX_ENTRIES):
            entry = v4l2.FrameInterval(index=index, pixel_format=pixel_format, width=width, height=height)
            if not self._has(v4l2.ENUM_FRAMEINTERVALS, entry):
                break
            pairs = [entry.values[0:2]] if entry.type == v4l2.DISCRETE else [entry.values[0:2], entry.values[2:4]]
            found |= {Fraction(below, above) for above, below in pairs if above and below}
            if entry.type != v4l2.DISCRETE:
                break
        return tuple(float(rate) for rate in sorted(found, reverse=True))

    def _controls(self) -> Iterator[Control]:
        last = 0
        for _ in range(MAX_ENTRIES):
            entry = v4l2.ControlDescription(id=last | v4l2.NEXT_CONTROL)
            if not self._has(v4l2.QUERY_EXT_CTRL, entry) or entry.id <= last:
                return
            last = entry.id
            if entry.flags & ControlFlag.DISABLED or entry.type not in iter(NUMBERS) or entry.nr_of_dims:
                continue
            yield Control(
                id=entry.id, name=_text(entry.name), minimum=entry.minimum, maximum=entry.maximum, step=entry.step,
                default=entry.default_value, value=None if entry.flags & ControlFlag.WRITE_ONLY else self._value(entry.id),
                menu=self._menu(entry), read_only=bool(entry.flags & ControlFlag.READ_ONLY),
                inactive=bool(entry.flags & ControlFlag.INACTIVE),
            )  # fmt: skip

    def _value(self, control: int) -> int | None:
        try:
            return self.get(control)
        except OSError:  # some drivers list controls that the camera does not answer
            return None

    def _menu(self, entry: v4l2.ControlDescription) -> dict[int, str]:
        if entry.type not in (ControlType.MENU, ControlType.INTEGER_MENU):
            return {}
        found = {}
        for index in range(max(0, entry.minimum), min(entry.maximum, MAX_ENTRIES) + 1):
            item = v4l2.MenuItem(id=entry.id, index=index)
            if self._has(v4l2.QUERYMENU, item):  # menus may have gaps
                number = int.from_bytes(bytes(item.text[:8]), "little", signed=True)
                found[index] = _text(item.text) if entry.type == ControlType.MENU else str(number)
        return found


NUMBERS = (ControlType.INTEGER, ControlType.BOOLEAN, ControlType.MENU, ControlType.BITMASK, ControlType.INTEGER_MENU)


def fourcc_text(code: int) -> str:
    """Name of a pixel format, such as MJPG; bit 31 marks big-endian variants."""
    name = (code & 0x7FFFFFFF).to_bytes(4, "little").decode("ascii", "replace").rstrip()
    return f"{name}-BE" if code >> 31 else name


def _text(letters: "ctypes.Array[ctypes.c_uint8]") -> str:
    return bytes(letters).split(b"\0")[0].decode("utf-8", "replace").strip()
