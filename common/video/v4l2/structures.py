"""Structures, request numbers and constants of Video4Linux2, from the kernel's headers.

linuxpy has all of this, but its licence (GPL 3) does not allow zenocap to depend on it.
"""

import ctypes
from enum import IntEnum, IntFlag

U8, U32, S32, U64, S64 = ctypes.c_uint8, ctypes.c_uint32, ctypes.c_int32, ctypes.c_uint64, ctypes.c_int64


class Capability(ctypes.Structure):
    _fields_ = (
        ("driver", U8 * 16), ("card", U8 * 32), ("bus_info", U8 * 32), ("version", U32), ("capabilities", U32),
        ("device_caps", U32), ("reserved", U32 * 3),
    )  # fmt: skip


class FormatDescription(ctypes.Structure):
    _fields_ = (
        ("index", U32), ("type", U32), ("flags", U32), ("description", U8 * 32), ("pixelformat", U32), ("mbus_code", U32),
        ("reserved", U32 * 3),
    )  # fmt: skip


class FrameSize(ctypes.Structure):
    """values: width, height; or least width, largest width, step, least height, largest height, step."""

    _fields_ = (("index", U32), ("pixel_format", U32), ("type", U32), ("values", U32 * 6), ("reserved", U32 * 2))


class FrameInterval(ctypes.Structure):
    """values: numerator, denominator (s); or those of the shortest interval, the longest one and the step."""

    _fields_ = (
        ("index", U32), ("pixel_format", U32), ("width", U32), ("height", U32), ("type", U32), ("values", U32 * 6),
        ("reserved", U32 * 2),
    )  # fmt: skip


class ControlDescription(ctypes.Structure):
    _fields_ = (
        ("id", U32), ("type", U32), ("name", U8 * 32), ("minimum", S64), ("maximum", S64), ("step", U64),
        ("default_value", S64), ("flags", U32), ("elem_size", U32), ("elems", U32), ("nr_of_dims", U32),
        ("dims", U32 * 4), ("reserved", U32 * 32),
    )  # fmt: skip


class MenuItem(ctypes.Structure):
    """text: of a menu; an integer menu has a signed 64-bit value in its first bytes."""

    _pack_ = 1
    _fields_ = (("id", U32), ("index", U32), ("text", U8 * 32), ("reserved", U32))


class ControlValue(ctypes.Structure):
    _fields_ = (("id", U32), ("value", S32))


def _request(direction: int, number: int, structure: type[ctypes.Structure]) -> int:
    """_IOC(direction, 'V', number, sizeof(structure)) of <asm-generic/ioctl.h>."""
    return direction << 30 | ctypes.sizeof(structure) << 16 | ord("V") << 8 | number


_READ, _WRITE = 2, 1
QUERYCAP = _request(_READ, 0, Capability)
ENUM_FMT = _request(_READ | _WRITE, 2, FormatDescription)
G_CTRL = _request(_READ | _WRITE, 27, ControlValue)
S_CTRL = _request(_READ | _WRITE, 28, ControlValue)
QUERYMENU = _request(_READ | _WRITE, 37, MenuItem)
ENUM_FRAMESIZES = _request(_READ | _WRITE, 74, FrameSize)
ENUM_FRAMEINTERVALS = _request(_READ | _WRITE, 75, FrameInterval)
QUERY_EXT_CTRL = _request(_READ | _WRITE, 103, ControlDescription)

CAPTURE = 1  # V4L2_BUF_TYPE_VIDEO_CAPTURE
CAPTURE_MPLANE = 9  # V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE
DISCRETE = 1  # of frame sizes and intervals
NEXT_CONTROL = 0x80000000  # V4L2_CTRL_FLAG_NEXT_CTRL


class Capabilities(IntFlag):
    VIDEO_CAPTURE = 0x1
    VIDEO_CAPTURE_MPLANE = 0x1000
    STREAMING = 0x04000000
    DEVICE_CAPS = 0x80000000


class ControlType(IntEnum):
    INTEGER = 1
    BOOLEAN = 2
    MENU = 3
    BUTTON = 4
    BITMASK = 8
    INTEGER_MENU = 9


class ControlFlag(IntFlag):
    DISABLED = 0x1
    READ_ONLY = 0x4
    INACTIVE = 0x10  # at present without effect, such as the exposure while it is automatic
    WRITE_ONLY = 0x40


class ControlId(IntEnum):
    """Controls that a rig file sets."""

    AUTO_WHITE_BALANCE = 0x0098090C
    AUTO_GAIN = 0x00980912
    GAIN = 0x00980913
    WHITE_BALANCE_TEMPERATURE = 0x0098091A
    AUTO_EXPOSURE = 0x009A0901
    EXPOSURE_TIME = 0x009A0902
    EXPOSURE_CHANGES_RATE = 0x009A0903
    FOCUS = 0x009A090A
    AUTO_FOCUS = 0x009A090C
