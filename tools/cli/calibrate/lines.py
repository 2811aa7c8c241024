"""Command calibrate lines."""

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.calibrate.output import POOR, ForceOption, check_new, writing
from zenocap.tools.cli.calibrate.points_page import FileAndCameras, LiveOption, file_and_cameras, one_file, run_points
from zenocap.tools.cli.live_page import FpsOption, HostOption, PortOption, TokenOption
from zenocap.tools.cli.options import one_line_errors

Pair = tuple[float, float]

EXAMPLE = """# For zenocap calibrate lines: equal objects at A = (0, 0), B = (0, d_z), C = (d_x, 0), and their tops.
size = [160, 120]      # of the images, px
d_x = 1.0              # m
d_z = 1.0
t = 1.7                # height of the objects, m

[camera1]              # stands on +Z and looks to -Z
a = [79.5, 39.3]       # column and row of the top of A, px from the top left
b = [79.5, 34.5]
c = [108.3, 39.3]
distance = 5.2         # of the camera from the origin along Z, m, if measured
height = 1.0           # of the camera, m, if measured

[camera2]              # stands on -X and looks to +X
a = [79.5, 39.3]
b = [108.3, 39.3]
c = [79.5, 42.6]
distance = 5.2
height = 1.0
"""


def lines(
    measurements: FileAndCameras = None,
    example: Annotated[bool, typer.Option("--example", help="Print a TOML of measurements, and exit.")] = False,
    size: Annotated[Pair | None, typer.Option(help="Width and height of the images, px.")] = None,
    d_x: Annotated[float | None, typer.Option(help="Position of object C on the X axis, m.")] = None,
    d_z: Annotated[float | None, typer.Option(help="Position of object B on the Z axis, m.")] = None,
    t: Annotated[float | None, typer.Option(help="Height of the three objects, m.")] = None,
    a1: Annotated[Pair | None, typer.Option(help="Top of A in camera 1, column and row, px.")] = None,
    b1: Annotated[Pair | None, typer.Option(help="Top of B in camera 1.")] = None,
    c1: Annotated[Pair | None, typer.Option(help="Top of C in camera 1.")] = None,
    a2: Annotated[Pair | None, typer.Option(help="Top of A in camera 2.")] = None,
    b2: Annotated[Pair | None, typer.Option(help="Top of B in camera 2.")] = None,
    c2: Annotated[Pair | None, typer.Option(help="Top of C in camera 2.")] = None,
    distance1: Annotated[float | None, typer.Option(help="Camera 1 to origin along Z, m, if measured.")] = None,
    distance2: Annotated[
        float | None, typer.Option(help="Distance of camera 2 from the origin along X, m, if measured.")
    ] = None,
    height1: Annotated[float | None, typer.Option(help="Height of camera 1, m, if measured.")] = None,
    height2: Annotated[float | None, typer.Option(help="Height of camera 2, m, if measured.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")] = Path("calibration.toml"),
    force: ForceOption = False,
    live: LiveOption = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    token: TokenOption = None,
    live_size: Annotated[
        str, typer.Option(metavar="WxH", help="With --live: size of the images that is requested, px.")
    ] = "1280x720",
    fps: FpsOption = 30.0,
) -> None:
    """Calibrate two level cameras, aimed along the axes, from three upright objects of one height (the paper's method).

    Place them at A = (0, 0), B = (0, D_Z) and C = (D_X, 0); camera 1 on +Z looks to -Z, camera 2 on -X looks to +X.

    With --live, a page at http://127.0.0.1:8090 shows both pictures with their middle lines, in which the tops are placed,
    and at once what one pixel matters: `zenocap calibrate lines lines.toml --live cam01=/dev/video0 cam02=/dev/video2`
    """
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.line_calibration import Measurements, Pinnacles, calibrate_lines
    from zenocap.common.camera.line_sensitivity import sensitivity
    from zenocap.tools.calibration.lines_file import read_measurements, solution_report, verdict

    if example:
        typer.echo(EXAMPLE, nl=False)
        return
    options = {"--size": size, "--d-x": d_x, "--d-z": d_z, "--t": t}
    options |= {"--a1": a1, "--b1": b1, "--c1": c1, "--a2": a2, "--b2": b2, "--c2": c2}
    with one_line_errors():
        check_new(output, force)
        given = [name for name, value in options.items() if value is not None]
        if live:
            from zenocap.tools.live.points_lines import LinePoints

            if given:
                raise typer.BadParameter(f"with --live the page has the measurements: leave out {', '.join(given)}")
            path, sources = file_and_cameras(measurements, "lines.toml")
            page, program = (host, port, token), "zenocap calibrate lines --live"
            task = lambda names: LinePoints(names, path, output)  # noqa: E731
            raise typer.Exit(run_points(sources, live_size, fps, page, program, task, output))
        if measurements:
            file = one_file(measurements, "")
            if given:
                raise typer.BadParameter(f"{file} has the measurements: leave out {', '.join(given)}")
            measured = read_measurements(file)
        elif size and d_x is not None and d_z is not None and t is not None and a1 and b1 and c1 and a2 and b2 and c2:
            one = Pinnacles(a1, b1, c1, distance1, height1)
            two = Pinnacles(a2, b2, c2, distance2, height2)
            if any(side != int(side) for side in size):
                raise typer.BadParameter(f"--size {size[0]:g} {size[1]:g}: allowed: whole pixels")
            measured = Measurements((int(size[0]), int(size[1])), d_x, d_z, t, one, two)
        else:
            missing = ", ".join(name for name, value in options.items() if value is None)
            raise typer.BadParameter(f"give a TOML of measurements, or also {missing}")
        solved = calibrate_lines(measured)
        with writing(output):
            write_calibration(output, {one.camera.name: one.camera for one in solved})
    found = [sensitivity(measured, number, camera) for number, camera in enumerate(solved, start=1)]
    report = [line for camera, effects in zip(solved, found, strict=True) for line in solution_report(camera, effects)]
    typer.echo("\n".join([*report, f"written: {output}"]))
    word, reasons = verdict(measured, solved, found)
    typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
    if word == "poor":
        raise typer.Exit(POOR)
