"""`zenocap calibrate lines` and `check`: from measured markers to a calibration file, and what a file says."""

import json
import tomllib
from itertools import combinations
from pathlib import Path
from typing import Annotated, NoReturn

import msgspec
import typer

from common.camera.files import CalibrationError, read_calibration, write_calibration
from common.camera.lines import LinesError, Measurements, Pinnacles, SolvedCamera, calibrate_lines
from common.camera.pairs import angle_between_deg, attitude, most_orthogonal_pair
from common.camera.pinhole import Camera

FAILED, POOR = 1, 3
NEARLY_ORTHOGONAL_DEG = 20.0

calibrate = typer.Typer(help="Find out where the cameras stand.", no_args_is_help=True)

Pair = tuple[float, float]


class _CameraTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    a: Pair
    b: Pair
    c: Pair
    distance: float | None = None
    height: float | None = None


class _MeasurementsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    size: tuple[int, int]
    d_x: float
    d_z: float
    t: float
    camera1: _CameraTable
    camera2: _CameraTable


EXAMPLE = """A file of measurements has the same names (px from the top left, metres):

    size = [160, 120]
    d_x = 1.0
    d_z = 1.0
    t = 1.7
    camera1 = { a = [79.5, 39.3], b = [79.5, 34.5], c = [108.3, 39.3], distance = 5.2 }
    camera2 = { a = [79.5, 39.3], b = [108.3, 39.3], c = [79.5, 42.6], distance = 5.2 }
"""


@calibrate.command(epilog=EXAMPLE.replace("\n\n    ", "\n\n\b\n    "))
def lines(
    measurements: Annotated[Path | None, typer.Argument(help="TOML of measurements, instead of the options.")] = None,
    size: Annotated[Pair | None, typer.Option(help="Width and height of the images, px.")] = None,
    d_x: Annotated[float | None, typer.Option(help="Where object C stands on the X axis, m.")] = None,
    d_z: Annotated[float | None, typer.Option(help="Where object B stands on the Z axis, m.")] = None,
    t: Annotated[float | None, typer.Option(help="Height of the three objects, m.")] = None,
    a1: Annotated[Pair | None, typer.Option(help="Top of A in camera 1, column and row, px.")] = None,
    b1: Annotated[Pair | None, typer.Option(help="Top of B in camera 1.")] = None,
    c1: Annotated[Pair | None, typer.Option(help="Top of C in camera 1.")] = None,
    a2: Annotated[Pair | None, typer.Option(help="Top of A in camera 2.")] = None,
    b2: Annotated[Pair | None, typer.Option(help="Top of B in camera 2.")] = None,
    c2: Annotated[Pair | None, typer.Option(help="Top of C in camera 2.")] = None,
    distance1: Annotated[float | None, typer.Option(help="Camera 1 to origin along Z, m, if measured.")] = None,
    distance2: Annotated[float | None, typer.Option(help="Camera 2 to origin along X, m, if measured.")] = None,
    height1: Annotated[float | None, typer.Option(help="Height of camera 1, m, if measured.")] = None,
    height2: Annotated[float | None, typer.Option(help="Height of camera 2, m, if measured.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")] = Path("calibration.toml"),
) -> None:
    """The paper's calibration: two level cameras aimed along the axes, three upright objects of one height.

    Stand them at A = (0, 0), B = (0, D_Z) and C = (D_X, 0); camera 1 on +Z looks to -Z, camera 2 on -X looks to +X.
    """
    options = {"--size": size, "--d-x": d_x, "--d-z": d_z, "--t": t}
    options |= {"--a1": a1, "--b1": b1, "--c1": c1, "--a2": a2, "--b2": b2, "--c2": c2}
    if measurements is not None:
        if given := [name for name, value in options.items() if value is not None]:
            raise typer.BadParameter(f"{measurements} has the measurements: leave out {', '.join(given)}")
        measured = _read(measurements)
    elif size and d_x is not None and d_z is not None and t is not None and a1 and b1 and c1 and a2 and b2 and c2:
        one = Pinnacles(a1, b1, c1, distance1, height1)
        two = Pinnacles(a2, b2, c2, distance2, height2)
        if any(side != int(side) for side in size):
            raise typer.BadParameter(f"--size {size[0]:g} {size[1]:g}: allowed: whole pixels")
        measured = Measurements((int(size[0]), int(size[1])), d_x, d_z, t, one, two)
    else:
        missing = ", ".join(name for name, value in options.items() if value is None)
        raise typer.BadParameter(f"give a TOML of measurements, or also {missing}")
    try:
        solved = calibrate_lines(measured)
        write_calibration(output, {one.camera.name: one.camera for one in solved})
    except (LinesError, CalibrationError) as error:
        _fail(str(error))
    except OSError as error:
        _fail(f"{output}: cannot be written: {error.strerror}")
    for camera in solved:
        _print_solved(camera)
    typer.echo(f"written: {output}")
    if remarks := [remark for camera in solved for remark in camera.remarks]:
        typer.echo("verdict: poor")
        for remark in remarks:
            typer.echo(f"  {remark}")
        raise typer.Exit(POOR)
    typer.echo("verdict: good")


@calibrate.command()
def check(
    file: Annotated[Path, typer.Argument(help="Calibration: anipose or Pose2Sim TOML, OpenCV, Qualisys.")],
    up_axis: Annotated[str, typer.Option(help="The file's own up axis: y or z.")] = "y",
    as_json: Annotated[bool, typer.Option("--json", help="For programs.")] = False,
) -> None:
    """Where the cameras of a file stand, how they look, and which two are most nearly orthogonal."""
    try:
        cameras = read_calibration(file, up_axis)
    except CalibrationError as error:
        _fail(str(error))
    pair = most_orthogonal_pair(cameras) if len(cameras) > 1 else None
    if as_json:
        typer.echo(json.dumps(_as_data(cameras, pair), indent=2))
        return
    for name, camera in cameras.items():
        stands = attitude(camera)
        x, y, z = camera.centre
        typer.echo(f"{name}: {camera.size[0]} x {camera.size[1]} px, focal length {_focal(camera)} px")
        typer.echo(f"  at ({x:.3f}, {y:.3f}, {z:.3f}) m, Y up")
        heading = f"heading {stands.heading_deg:.1f} degrees from -Z towards +X"
        typer.echo(f"  {heading}, tilt {stands.tilt_deg:+.1f}, roll {stands.roll_deg:+.1f}")
        if y <= 0:
            typer.echo("  below the ground: is the up axis right (--up-axis z)?")
    for one, other in combinations(cameras, 2):
        typer.echo(f"{one} and {other}: {angle_between_deg(cameras[one], cameras[other]):.1f} degrees apart")
    if pair is not None:
        angle = angle_between_deg(*(cameras[name] for name in pair))
        typer.echo(f"most nearly orthogonal: {pair[0]} (front) and {pair[1]}, {angle:.1f} degrees apart")
        if abs(angle - 90) > NEARLY_ORTHOGONAL_DEG:
            typer.echo("  far from 90 degrees: method two-view will suffer; joint and hybrid take any angle")


def _read(path: Path) -> Measurements:
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        content = msgspec.convert(tables, _MeasurementsFile)
    except OSError as error:
        _fail(f"{path}: cannot be read: {error.strerror}")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        _fail(f"{path}: not TOML: {error}")
    except msgspec.ValidationError as error:
        _fail(f"{path}: {error}; allowed: size, d_x, d_z, t, camera1, camera2 with a, b, c, distance, height")
    one, two = (Pinnacles(c.a, c.b, c.c, c.distance, c.height) for c in (content.camera1, content.camera2))
    return Measurements(content.size, content.d_x, content.d_z, content.t, one, two)


def _print_solved(solved: SolvedCamera) -> None:
    x, y, z = solved.camera.centre
    typer.echo(f"{solved.camera.name}: focal length {solved.focal_px:.1f} px, at ({x:.3f}, {y:.3f}, {z:.3f}) m")
    typer.echo(f"  distance {solved.distance_m:.3f} ± {solved.distance_error_m:.3f} m")
    residuals = ", ".join(f"{name}' ({x:+.2f}, {y:+.2f})" for name, (x, y) in zip("ABC", solved.residuals_px, strict=True))
    typer.echo(f"  residuals px: {residuals}")


def _as_data(cameras: dict[str, Camera], pair: tuple[str, str] | None) -> dict[str, object]:
    entries = []
    for name, camera in cameras.items():
        stands = attitude(camera)
        entries.append(
            {
                "name": name,
                "size_px": list(camera.size),
                "position_m": camera.centre.tolist(),
                "focal_px": [float(camera.matrix[0, 0]), float(camera.matrix[1, 1])],
                "heading_deg": stands.heading_deg,
                "tilt_deg": stands.tilt_deg,
                "roll_deg": stands.roll_deg,
            }
        )
    angles = [
        {"cameras": [one, other], "angle_deg": angle_between_deg(cameras[one], cameras[other])}
        for one, other in combinations(cameras, 2)
    ]
    return {"cameras": entries, "angles": angles, "most_orthogonal": list(pair) if pair else None}


def _focal(camera: Camera) -> str:
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    return f"{fx:.1f}" if abs(fx - fy) < 0.05 else f"{fx:.1f} x {fy:.1f}"


def _fail(text: str) -> NoReturn:
    typer.echo(f"error: {text}", err=True)
    raise typer.Exit(FAILED)
