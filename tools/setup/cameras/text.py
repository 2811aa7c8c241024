"""Description of cameras and streams, as lines for people and as builtins for programs."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from zenocap.common.rig.sources import without_password
from zenocap.common.video.v4l2.camera import Control, Mode
from zenocap.common.video.v4l2.listing import FoundCamera
from zenocap.tools.setup.cameras.onvif_device import AskedDevice
from zenocap.tools.setup.cameras.streams import TriedStream


def camera_lines(cameras: Sequence[FoundCamera]) -> Iterator[str]:
    """Lines on cameras of this machine."""
    if not cameras:
        yield "no camera: the video devices of this machine give no images"
    for camera in cameras:
        yield f"{camera.path}: {camera.problem or camera.name}"
        note = "" if camera.is_stable else "  # may change when plugged in again"
        yield f'  in a rig file: source = "{camera.source}"{note}'
        if camera.problem:
            continue
        yield f"  driver {camera.driver}, at {camera.bus}"
        for (name, rates), modes in groupby(camera.modes, key=lambda mode: (mode.format, mode.rates)):
            sizes = ", ".join(_size_text(mode) for mode in modes)
            yield f"  {name:5} {sizes}: {', '.join(f'{rate:.4g}' for rate in rates) or 'unknown'} frames/s"
        for control in camera.controls:
            yield f"  {control.name}: {_control_text(control)}"


def _size_text(mode: Mode) -> str:
    largest = f"{mode.size[0]} x {mode.size[1]}"
    return largest if mode.smallest is None else f"{mode.smallest[0]} x {mode.smallest[1]} to {largest}"


def _control_text(control: Control) -> str:
    now = "cannot be read" if control.value is None else control.menu.get(control.value, str(control.value))
    allowed = (
        ", ".join(f"{value} {text}" for value, text in control.menu.items())
        if control.menu
        else f"{control.minimum} to {control.maximum}{f' in steps of {control.step}' if control.step > 1 else ''}"
    )
    note = "; cannot be changed" if control.read_only else "; at present automatic, or without effect" * control.inactive
    return f"{now} ({allowed}; default {control.default}{note})"


def stream_lines(streams: Sequence[TriedStream]) -> Iterator[str]:
    for stream in streams:
        if stream.size is None:
            yield f"{stream.address}: no image: {stream.problem}"
            continue
        declared = f" ({stream.declared_rate:.4g} declared)" if stream.declared_rate else ""
        rate = f"{stream.rate:.1f} frames/s{declared}" if stream.rate else f"rate not measured{declared}"
        yield (
            f"{stream.address}: {stream.size[0]} x {stream.size[1]}, {rate}, {stream.codec}, "
            f"first image after {stream.first_s:.1f} s"
        )


def onvif_lines(devices: Sequence[AskedDevice]) -> Iterator[str]:
    """Lines on ONVIF devices and their streams."""
    for one in devices:
        words = " ".join(part for part in (one.device.name, one.device.hardware) if part)
        yield f"{one.device.address}: {one.problem or words or 'ONVIF device'}"
        for stream in one.streams:
            yield f"  {stream.profile}: {stream.size[0]} x {stream.size[1]}, {stream.encoding}"
            yield f'    in a rig file: source = "{without_password(stream.address)}"'


def onvif_data(devices: Sequence[AskedDevice]) -> list[dict[str, object]]:
    return [
        {
            **vars(one.device),
            "problem": one.problem,
            "streams": [
                {"profile": s.profile, "encoding": s.encoding, "size": s.size, "source": without_password(s.address)}
                for s in one.streams
            ],
        }
        for one in devices
    ]


def camera_data(camera: FoundCamera, picture: str | None, picture_problem: str) -> dict[str, object]:
    return {
        "device": str(camera.path),
        "source": camera.source,
        "stable": camera.is_stable,
        "name": camera.name,
        "driver": camera.driver,
        "bus": camera.bus,
        "modes": [
            {"format": its.format, "size": its.size, "smallest": its.smallest, "rates": its.rates} for its in camera.modes
        ],
        "controls": [{"name": one.name, **vars(one)} for one in camera.controls],
        "picture": picture,
        "problem": camera.problem or picture_problem,
    }


def stream_data(stream: TriedStream, picture: str | None) -> dict[str, object]:
    return {
        "address": stream.address,
        "size": stream.size,
        "codec": stream.codec,
        "rate": round(stream.rate, 3),
        "declared_rate": round(stream.declared_rate, 3),
        "first_image_s": round(stream.first_s, 3),
        "picture": picture,
        "problem": stream.problem,
    }
