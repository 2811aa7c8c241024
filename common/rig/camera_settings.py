"""Settings of a camera in a rig file: image format, exposure, gain, white balance, focus."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import msgspec

AUTO, LOCKED = "auto", "locked"
# Pixel formats of Video4Linux2 that OpenCV converts to colour images (modules/videoio/src/cap_v4l.cpp).
FORMATS = ("MJPG", "JPEG", "YUYV", "UYVY", "NV12", "NV21", "YV12", "YU12", "BGR3", "RGB3", "GREY")
SETTINGS_ALLOWED = f'a whole number in the range that `zenocap cameras` lists, "{AUTO}" or "{LOCKED}"'

Setting = int | str  # a value in the camera's units, AUTO or LOCKED


@dataclass(frozen=True)
class CameraSettings:
    """format: None for compressed images where the camera has them.

    LOCKED: automatic for some seconds after the camera is opened, then fixed at the value found.
    """

    format: str | None = None
    exposure: Setting = LOCKED
    gain: Setting = LOCKED
    white_balance: Setting = LOCKED
    focus: Setting = LOCKED


KEYS = tuple(field.name for field in fields(CameraSettings))


def given_settings(table: object) -> dict[str, Setting]:
    """The settings that a viewer's table, or `CameraSettings`, has: those that are not None."""
    values = {key: getattr(table, key) for key in KEYS}
    return {key: value for key, value in values.items() if value is not None}


def settings_of(given: Mapping[str, Setting]) -> CameraSettings:
    """The settings of values that `setting_problem` allows, with the defaults for the other keys."""
    return msgspec.convert(given, CameraSettings)


def setting_problem(key: str, value: Setting) -> str | None:
    """Allowed values, for one that is not."""
    if key == "format":
        return None if value in FORMATS else ", ".join(FORMATS)
    return None if isinstance(value, int) or value in (AUTO, LOCKED) else SETTINGS_ALLOWED
