"""Rig files in a folder: the demo's, changed, and those of network cameras."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.rig import demo_rig_file

CALIBRATION = demo_rig_file("two-view").with_name("demo-calibration.toml")


def written_demo(folder: Path, more: str = "", *, name: str = "demo", method: str = "two-view") -> Path:
    """The demo of a method as NAME.toml, with the calibration of the package.  more: what is appended."""
    text = demo_rig_file(method).read_text(encoding="utf-8").replace(CALIBRATION.name, str(CALIBRATION))
    path = folder / f"{name}.toml"
    path.write_text(text.replace('name = "demo"', f'name = "{name}"', 1) + f"\n{more}", encoding="utf-8")
    return path


def written_rig(
    folder: Path, cameras: Mapping[str, Camera], sources: Sequence[str], *, name: str, head: str = "", each: str = ""
) -> Path:
    """A file rig.toml of cameras with the given sources, viewers "0", "1" ..., and its calibration.

    head, each: lines of the rig and of every viewer.
    """
    write_calibration(folder / "calibration.toml", dict(cameras))
    text = f'name = "{name}"\ncalibration = "calibration.toml"\n{head}\n'
    for number, (camera, source) in enumerate(zip(cameras, sources, strict=True)):
        text += f'[[viewer]]\nid = "{number}"\ncamera = "{camera}"\nsource = "{source}"\n{each}\n'
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"
