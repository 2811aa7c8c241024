"""Settings of a camera in a rig file: image format, exposure, gain, white balance, focus."""

from dataclasses import dataclass, fields
from typing import Protocol

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


class SettingsTable(Protocol):
    """The keys of a viewer's table; None for those that it does not have."""

    @property
    def format(self) -> str | None: ...
    @property
    def exposure(self) -> Setting | None: ...
    @property
    def gain(self) -> Setting | None: ...
    @property
    def white_balance(self) -> Setting | None: ...
    @property
    def focus(self) -> Setting | None: ...


KEYS = tuple(field.name for field in fields(CameraSettings))


def given_settings(table: SettingsTable) -> dict[str, Setting]:
    """The keys that the table has."""
    values = {key: getattr(table, key) for key in KEYS}
    return {key: value for key, value in values.items() if value is not None}


def settings_of(table: SettingsTable) -> CameraSettings:
    """The settings of a table, with the defaults for keys that it does not have."""
    values = (table.exposure, table.gain, table.white_balance, table.focus)
    return CameraSettings(table.format, *(LOCKED if value is None else value for value in values))


def setting_problem(key: str, value: Setting) -> str | None:
    """Allowed values, for one that is not."""
    if key == "format":
        return None if value in FORMATS else ", ".join(FORMATS)
    return None if isinstance(value, int) or value in (AUTO, LOCKED) else SETTINGS_ALLOWED
