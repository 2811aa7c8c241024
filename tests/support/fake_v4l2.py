"""Fake Video4Linux2 device: the kernel's requests, answered from tables."""

import ctypes
import errno
import os
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from zenocap.common.video.v4l2.camera import V4l2Camera

# Printed by a C program with the kernel's header (x86-64, Linux 6.1).
QUERYCAP, ENUM_FMT, G_CTRL, S_CTRL, QUERYMENU = 0x80685600, 0xC0405602, 0xC008561B, 0xC008561C, 0xC02C5625
ENUM_FRAMESIZES, ENUM_FRAMEINTERVALS, QUERY_EXT_CTRL = 0xC02C564A, 0xC034564B, 0xC0E85667
CAPTURE_NODE, METADATA_NODE = 0x04200001, 0x04A00000  # device capabilities of uvcvideo's two nodes
WHOLE_DEVICE = 0x84A00001  # its capabilities
INTEGER, BOOLEAN, MENU, BUTTON = 1, 2, 3, 4


@dataclass
class FakeControl:
    """kind, name, minimum, maximum, step, default, value, menu texts, flags."""

    kind: int
    name: str
    minimum: int
    maximum: int
    step: int
    default: int
    value: int
    menu: dict[int, str] = field(default_factory=dict)
    flags: int = 0


def webcam_controls() -> dict[int, FakeControl]:
    """Controls of a common USB camera, as uvcvideo lists them."""
    return {
        0x00980900: FakeControl(INTEGER, "Brightness", -64, 64, 1, 0, 3),
        0x0098090C: FakeControl(BOOLEAN, "White Balance, Automatic", 0, 1, 1, 1, 1),
        0x00980913: FakeControl(INTEGER, "Gain", 0, 100, 1, 0, 12),
        0x0098091A: FakeControl(INTEGER, "White Balance Temperature", 2800, 6500, 10, 4600, 4210, flags=0x10),
        0x009A0901: FakeControl(MENU, "Auto Exposure", 0, 3, 1, 3, 3, {1: "Manual Mode", 3: "Aperture Priority Mode"}),
        0x009A0902: FakeControl(INTEGER, "Exposure Time, Absolute", 1, 5000, 1, 157, 312, flags=0x10),
        0x009A0903: FakeControl(BOOLEAN, "Exposure, Dynamic Framerate", 0, 1, 1, 0, 1),
        0x009A090F: FakeControl(BUTTON, "Reset", 0, 0, 0, 0, 0),
    }


@dataclass
class FakeDevice:
    """sizes: rates by (width, height), by format.  refused: the error of all controls' values, 0 for none."""

    name: str = "Webcam: Webcam"
    capabilities: int = CAPTURE_NODE
    sizes: dict[str, dict[tuple[int, int], list[int]]] = field(
        default_factory=lambda: {"MJPG": {(1280, 720): [30, 60], (640, 480): [30]}, "YUYV": {(640, 480): [30, 15]}}
    )
    controls: dict[int, FakeControl] = field(default_factory=webcam_controls)
    stepwise: bool = False
    written: list[tuple[int, int]] = field(default_factory=list)

    def ioctl(self, file: int, request: int, structure: ctypes.Structure) -> None:
        view = memoryview(structure).cast("B")
        answer = {
            QUERYCAP: self._capability, ENUM_FMT: self._format, ENUM_FRAMESIZES: self._size, G_CTRL: self._get,
            ENUM_FRAMEINTERVALS: self._interval, QUERY_EXT_CTRL: self._control, QUERYMENU: self._menu, S_CTRL: self._set,
        }[request]  # fmt: skip
        answer(view)

    def _capability(self, view: memoryview) -> None:
        text = struct.pack("16s32s32s", b"uvcvideo", self.name.encode(), b"usb-0000:00:14.0-1")
        view[:] = text + struct.pack("6I", 0x060100, WHOLE_DEVICE, self.capabilities, 0, 0, 0)

    def _format(self, view: memoryview) -> None:
        index, kind = struct.unpack_from("II", view)
        if kind != 1 or index >= len(self.sizes):
            raise OSError(errno.EINVAL, "Invalid argument")
        name = list(self.sizes)[index]
        view[12:48] = struct.pack("32s4s", b"a format", name.encode())

    def _size(self, view: memoryview) -> None:
        index, code = struct.unpack_from("I4s", view)
        sizes = list(self.sizes[code.decode()])
        if index >= (1 if self.stepwise else len(sizes)):
            raise OSError(errno.EINVAL, "Invalid argument")
        width, height = sizes[index]
        values = (3, 32, width, 2, 16, height, 2) if self.stepwise else (1, width, height, 0, 0, 0, 0)
        view[8:36] = struct.pack("7I", *values)

    def _interval(self, view: memoryview) -> None:
        index, code, width, height = struct.unpack_from("I4sII", view)
        rates = self.sizes[code.decode()][width, height]
        if index >= len(rates):
            raise OSError(errno.EINVAL, "Invalid argument")
        view[16:28] = struct.pack("3I", 1, 1, rates[index])

    def _control(self, view: memoryview) -> None:
        (asked,) = struct.unpack_from("I", view)
        later = sorted(one for one in self.controls if one > asked & 0x7FFFFFFF)
        if not asked & 0x80000000 or not later:
            raise OSError(errno.EINVAL, "Invalid argument")
        one = self.controls[later[0]]
        head = struct.pack("II32s", later[0], one.kind, one.name.encode())
        ranges = struct.pack("qqQq", one.minimum, one.maximum, one.step, one.default)
        view[:] = (head + ranges + struct.pack("4I", one.flags, 4, 1, 0)).ljust(232, b"\0")

    def _menu(self, view: memoryview) -> None:
        control, index = struct.unpack_from("II", view)
        if index not in self.controls[control].menu:
            raise OSError(errno.EINVAL, "Invalid argument")
        view[8:40] = struct.pack("32s", self.controls[control].menu[index].encode())

    def _get(self, view: memoryview) -> None:
        (control,) = struct.unpack_from("I", view)
        if control not in self.controls:
            raise OSError(errno.EINVAL, "Invalid argument")
        view[4:8] = struct.pack("i", self.controls[control].value)

    def _set(self, view: memoryview) -> None:
        control, value = struct.unpack_from("Ii", view)
        one = self.controls[control]
        if not one.minimum <= value <= one.maximum:
            raise OSError(errno.ERANGE, "Numerical result out of range")
        one.value = value
        self.written.append((control, value))

    def open(self, path: Path) -> V4l2Camera:
        """The camera at `path`, which need not exist."""
        return V4l2Camera(path, self.ioctl, lambda _, flags: os.open(os.devnull, os.O_RDWR))


def fake_dev(folder: Path, devices: dict[int, FakeDevice], links: dict[str, int]) -> Callable[[Path], V4l2Camera]:
    """Write device files and udev's links to `folder`; returns what opens them.  links: number by v4l/by-id/NAME."""
    for number in devices:
        (folder / f"video{number}").touch()
    for name, number in links.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).symlink_to(folder / f"video{number}")
    return lambda path: devices[int(path.name.removeprefix("video"))].open(path)
