"""`zenocap load`: films and rigs of a load, its processes, its results as files."""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from zenocap.common.bus.protocol import BusError
from zenocap.common.errors import pip_install
from zenocap.tools.measure.load_plan import LoadError, Plan, checked
from zenocap.tools.measure.load_processes import Deployment, LoadNetwork, LoadProcesses
from zenocap.tools.measure.measurement import Measurement, ReportProgress, measure_plan
from zenocap.tools.measure.ramp import Ramp, RampQuantity, ramp, ramp_lines, value_of
from zenocap.tools.measure.recorded_messages import record_messages
from zenocap.tools.measure.report import csv_of_soak, csv_text, report, write
from zenocap.tools.measure.scene import calibration, film, recording_rig_file, rig_files
from zenocap.tools.measure.soak import Soak, soak
from zenocap.tools.measure.tables import costs_table, histogram_lines, points_table, rate_line, soak_lines, soak_table
from zenocap.tools.operate.warmup.processes import compile_parts

DONE, FAILED, LOSS = 0, 1, 3
LINE_S = 10.0  # between lines of progress where there is no terminal
LABELS: dict[RampQuantity, str] = {"rate": "frames/s of each viewer", "viewers": "viewers", "rigs": "rigs"}


@dataclass
class LoadSession:
    """State shared by all measurements.  progress: console of the progress messages."""

    folder: Path
    network: LoadNetwork
    stopped: Callable[[], bool]
    progress: Console

    def deployment(self, plan: Plan, show: ReportProgress) -> Deployment:
        """Films and rigs of a plan, created unless they exist.  Raises OSError, UserError, SourceError, ValueError."""
        place = self.folder / f"{plan.viewers}-{plan.size[0]}x{plan.size[1]}-{plan.method}"
        if plan.part == "integrators":  # integrators need no images
            calibration(place, plan)
            return Deployment(rig_files(place, plan), place, self.network)
        film(place, plan, lambda done, of: show("rendering", done / of))
        rigs = rig_files(place, plan)
        if plan.stand_ins:
            record_messages(recording_rig_file(place, plan), lambda done, of: show("recording messages", done / of))
        return Deployment(rigs, place, self.network)

    def measure(self, plan: Plan) -> Measurement:
        with progress_reporter(self.progress, plan.title()) as show:
            return measure_plan(plan, self.deployment(plan, show), self.stopped, show)


@contextmanager
def prepared(plan: Plan, network: LoadNetwork, stopped: Callable[[], bool], progress: Console) -> Iterator[LoadSession]:
    """Compile everything, and create a temporary folder for the films.  Raises LoadError."""
    actor = ("actor",) if plan.part != "integrators" else ()
    parts = ("silhouettes", *actor, "tracker" if plan.has_tracker else "tracking")
    if not compile_parts(parts, stopped, progress) and not stopped():
        raise LoadError("compiling failed; its output is above")
    with tempfile.TemporaryDirectory(prefix="zenocap-load-") as folder:
        yield LoadSession(Path(folder), network, stopped, progress)


def run_load(
    plan: Plan, quantity: RampQuantity | None, session: LoadSession, output: Path, out: Console
) -> tuple[int, bytes]:
    """Measure a plan, or a ramp of it; write load.json, load.csv and load.png.  Returns exit status and the JSON.

    Raises PlanError, LoadError, BusError and OSError.
    """
    found: Ramp | None = None
    if quantity is None:
        points: tuple[Measurement, ...] = (session.measure(checked(plan)),)
    else:
        found = ramp(plan, quantity, session.measure, session.stopped, lambda point: out.print(points_table([point])))
        points = found.points
    written = report(points, found)
    paths = [write(output, "load.json", written), write(output, "load.csv", csv_text(points))]
    if points:
        paths += _drawn(output / "load.png", out, points, quantity or "rate")
        _print_points(points, found, out)
    _print_written(paths, out)
    lost = any(point.figures.loss > 0 for point in points)
    return (LOSS if lost and found is None else DONE), written


def run_soak(
    plan: Plan, minutes: float, restart_s: float, session: LoadSession, output: Path, out: Console
) -> tuple[int, bytes]:
    """Run for `minutes`; write soak.json, soak.csv and soak.png.  Returns exit status, 1 if something grows, and the JSON.

    Raises PlanError, LoadError, BusError and OSError.
    """
    with progress_reporter(session.progress, plan.title()) as show:
        found = soak(checked(plan), session.deployment(plan, show), minutes, restart_s, session.stopped, show)
    written = report((), soak=found)
    paths = [write(output, "soak.json", written), write(output, "soak.csv", csv_of_soak(found))]
    if found.buckets:
        paths += _drawn(output / "soak.png", out, found)
    out.print(soak_table(found))
    for line in soak_lines(found):
        out.print(line, markup=False, highlight=False)
    _print_written(paths, out)
    return (DONE if found.flat else FAILED), written


def serve(plan: Plan, session: LoadSession, out: Console) -> int:
    """Run the integrators of a load whose viewers are elsewhere, until stopped; the exit status."""
    with progress_reporter(session.progress, plan.title()) as show:
        deployment = session.deployment(checked(plan), show)
    processes = LoadProcesses(plan, deployment, time.time_ns())
    out.print(
        f"{len(processes.specs)} processes for {', '.join(plan.rig_names)}; Ctrl-C ends", markup=False, highlight=False
    )
    try:
        processes.start()
        while not session.stopped():
            time.sleep(0.2)
            processes.poll()
            for line in processes.lines():
                session.progress.print(line, markup=False, highlight=False)
            if processes.failed:
                raise BusError(f"{', '.join(processes.failed)} failed")
    finally:
        processes.stop()
    return DONE


@contextmanager
def progress_reporter(console: Console, title: str) -> Iterator[ReportProgress]:
    """A progress bar on a terminal; elsewhere a line per activity, and one every LINE_S seconds."""
    if console.is_terminal:
        columns = (TextColumn(title), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task("", total=1.0)
            yield lambda activity, share: progress.update(task, description=activity, completed=share)
        return
    last_activity, last_s = "", 0.0

    def show(activity: str, share: float) -> None:
        nonlocal last_activity, last_s
        now_s = time.monotonic()
        if activity.split(" ")[0] != last_activity or now_s - last_s > LINE_S:
            last_activity, last_s = activity.split(" ")[0], now_s
            console.print(f"{title}: {activity} ({share:.0%})", markup=False, highlight=False, soft_wrap=True)

    yield show


def _print_points(points: tuple[Measurement, ...], found: Ramp | None, out: Console) -> None:
    out.print(points_table(points))
    if found is None:
        out.print(costs_table(points[0]))
        out.print(rate_line(points[0]), markup=False, highlight=False, soft_wrap=True)
        for line in histogram_lines(points[0].figures.histogram):
            out.print(line, markup=False, highlight=False)
        out.print(f"the limit: {points[0].bottleneck}", markup=False, highlight=False)
    else:
        for line in ramp_lines(found):
            out.print(line, markup=False, highlight=False)


def _drawn(path: Path, out: Console, found: Sequence[Measurement] | Soak, quantity: RampQuantity = "rate") -> list[Path]:
    """Draw a plot if matplotlib is installed; return the paths written.  quantity: on the axis of measurements."""
    try:
        from zenocap.tools.measure.plot import draw_points, draw_soak
    except ModuleNotFoundError as error:
        out.print(f"no picture: {error.name} is missing: {pip_install('load')}", markup=False, highlight=False)
        return []
    if isinstance(found, Soak):
        draw_soak(path, found)
    else:
        draw_points(path, found, LABELS[quantity], lambda plan: value_of(plan, quantity))
    return [path]


def _print_written(paths: list[Path], out: Console) -> None:
    out.print(f"written: {', '.join(str(path) for path in paths)}", markup=False, highlight=False, soft_wrap=True)
