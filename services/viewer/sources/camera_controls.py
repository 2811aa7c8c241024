"""Exposure, gain, white balance and focus of a camera: fixed, automatic, or locked."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from zenocap.common.errors import OpenError
from zenocap.common.rig.camera_settings import AUTO, LOCKED, CameraSettings
from zenocap.common.video.v4l2.camera import Control, V4l2Camera
from zenocap.common.video.v4l2.structures import ControlId

MANUAL_EXPOSURE, AUTO_EXPOSURES = 1, (3, 0)  # of V4L2_CID_EXPOSURE_AUTO: aperture priority keeps the iris, and is common


@dataclass(frozen=True)
class Setting:
    """A key and its controls.

    value: control of the setting.  automatic: that switches it.  on, off: its values; of `on` the first that it has.
    """

    key: str
    value: ControlId
    automatic: ControlId
    on: tuple[int, ...] = (1,)
    off: int = 0


SETTINGS = (
    Setting("exposure", ControlId.EXPOSURE_TIME, ControlId.AUTO_EXPOSURE, AUTO_EXPOSURES, MANUAL_EXPOSURE),
    Setting("gain", ControlId.GAIN, ControlId.AUTO_GAIN),
    Setting("white_balance", ControlId.WHITE_BALANCE_TEMPERATURE, ControlId.AUTO_WHITE_BALANCE),
    Setting("focus", ControlId.FOCUS, ControlId.AUTO_FOCUS),
)


@dataclass
class CameraControls:
    """The controls of one camera through its failures and returns: locked values stay those found at first.

    name: of the source, for reports and errors.  open_camera: raises OSError.
    """

    name: str
    path: Path
    settings: CameraSettings
    report: Callable[[str], None]
    open_camera: Callable[[Path], V4l2Camera] = V4l2Camera
    _locked: dict[str, int] = field(default_factory=dict)
    _reported: set[str] = field(default_factory=set)

    def begin(self) -> bool:
        """Set what is known when the camera was opened; returns whether some must settle before `lock`.

        Raises OpenError for a format or value that the camera does not have.
        """
        try:
            with self.open_camera(self.path) as camera:
                self._check_format(camera)
                controls = {control.id: control for control in camera.controls()}
                if self.settings.exposure != AUTO and ControlId.EXPOSURE_CHANGES_RATE in controls:
                    self._set(camera, ControlId.EXPOSURE_CHANGES_RATE, 0)  # a long exposure must not lower the frame rate
                return any([self._begin(camera, controls, one) for one in SETTINGS])
        except OSError as error:
            self._report_once(f"controls cannot be set: {error.strerror or error}")
            return False

    def lock(self) -> None:
        """Fix the values that the camera has chosen."""
        try:
            with self.open_camera(self.path) as camera:
                controls = {control.id: control for control in camera.controls()}
                for one in SETTINGS:  # all are read before any is fixed: exposure and gain are chosen together
                    found = controls.get(one.value)
                    if self._is_locked(one) and found is not None and found.value is not None:
                        self._locked.setdefault(one.key, found.value)
                for one in SETTINGS:
                    if self._is_locked(one) and one.key in self._locked:
                        self._fix(camera, controls, one, self._locked[one.key])
        except OSError as error:
            self._report_once(f"controls cannot be fixed: {error.strerror or error}")
            return
        if self._locked:
            self.report(f"{self.name}: fixed: {', '.join(f'{key} {value}' for key, value in self._locked.items())}")

    def _begin(self, camera: V4l2Camera, controls: dict[int, Control], one: Setting) -> bool:
        """Set one; returns whether it must settle."""
        wanted: int | str = getattr(self.settings, one.key)
        control = controls.get(one.value)
        if control is None or (wanted == AUTO and one.automatic not in controls):
            lacking = "setting of this kind" if control is None else "automatic of its own"
            self._report_once(f"{one.key} = {wanted}: left out: the camera has no {lacking}")
            return False
        if isinstance(wanted, int):
            if not control.minimum <= wanted <= control.maximum:
                raise OpenError(f"{self.name}: {one.key} = {wanted}: allowed: {control.minimum} to {control.maximum}")
            self._fix(camera, controls, one, wanted)
            return False
        if wanted == LOCKED and one.key in self._locked:
            self._fix(camera, controls, one, self._locked[one.key])
            return False
        switch = controls.get(one.automatic)
        if switch is not None and not switch.read_only:
            value = next((on for on in one.on if on in switch.menu or not switch.menu), None)
            if value is not None:
                self._set(camera, one.automatic, value)
        return wanted == LOCKED

    def _fix(self, camera: V4l2Camera, controls: dict[int, Control], one: Setting, value: int) -> None:
        switch = controls.get(one.automatic)
        if switch is not None and not switch.read_only:
            self._set(camera, one.automatic, one.off)
        self._set(camera, one.value, value)

    def _set(self, camera: V4l2Camera, control: ControlId, value: int) -> None:
        """Set one control; a failure is reported and does not stop the camera."""
        try:
            camera.set(control, value)
        except OSError as error:
            self._report_once(f"{control.name.lower()} = {value}: not set: {error.strerror or error}")

    def _is_locked(self, one: Setting) -> bool:
        return bool(getattr(self.settings, one.key) == LOCKED)

    def _check_format(self, camera: V4l2Camera) -> None:
        formats = tuple(dict.fromkeys(mode.format for mode in camera.modes()))
        if self.settings.format is not None and formats and self.settings.format not in formats:
            raise OpenError(f"{self.name}: format = {self.settings.format!r}: allowed: {', '.join(formats)}")

    def _report_once(self, text: str) -> None:
        if text not in self._reported:
            self._reported.add(text)
            self.report(f"{self.name}: {text}")
