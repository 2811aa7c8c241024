"""`zenocap load`: films made, processes run, results written."""

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from common.bus.protocol import BusError
from services.launcher.warming import compile_first
from services.load.crew import Crew
from services.load.material import rehearse
from services.load.plan import Grown, LoadError, Plan, checked
from services.load.point import Point, Setting, Tell, measured
from services.load.ramping import Ramp, in_words, ramp, value_of
from services.load.report import csv_of_soak, csv_text, report, write
from services.load.soaking import Soak, soak
from services.load.stage import calibration, film, rehearsal_file, rig_files
from services.load.text import costs_table, histogram_lines, points_table, soak_lines, soak_table

DONE, FAILED, LOSS = 0, 1, 3
LINE_S = 5.0  # between lines of progress where there is no terminal
LABELS: dict[Grown, str] = {"rate": "frames/s of each viewer", "viewers": "viewers", "rigs": "rigs"}


@dataclass(frozen=True)
class Network:
    """connect: a router that runs already; empty for one of the load's own.  config: a Zenoh configuration."""

    connect: tuple[str, ...] = ()
    config: Path | None = None


@dataclass
class Session:
    """What every measurement shares.  out: where results are printed.  progress: where it is said what is done."""

    folder: Path
    network: Network
    stopped: Callable[[], bool]
    progress: Console

    def setting(self, plan: Plan, tell: Tell) -> Setting:
        """Films and rigs of a plan, made if they are not there.  Raises OSError, RigError, SourceError, ValueError."""
        place = self.folder / f"{plan.viewers}-{plan.size[0]}x{plan.size[1]}-{plan.method}"
        if plan.part == "integrators":  # they see no picture
            calibration(place, plan)
            return Setting(rig_files(place, plan), place, self.network.connect, self.network.config)
        film(place, plan, lambda done, of: tell("rendering", done / of))
        rigs = rig_files(place, plan)
        if plan.stand_ins:
            rehearse(rehearsal_file(place, plan), lambda done, of: tell("rehearsing", done / of))
        return Setting(rigs, place, self.network.connect, self.network.config)

    def measure(self, plan: Plan) -> Point:
        with telling(self.progress, plan.title()) as tell:
            return measured(plan, self.setting(plan, tell), self.stopped, tell)


@contextmanager
def prepared(plan: Plan, network: Network, stopped: Callable[[], bool], progress: Console) -> Iterator[Session]:
    """A folder for the films, thrown away afterwards; everything compiled.  Raises LoadError."""
    if not compile_first(plan.part != "integrators", plan.has_tracker, False, stopped, progress) and not stopped():
        raise LoadError("compiling failed; what it said stands above")
    with tempfile.TemporaryDirectory(prefix="zenocap-load-") as folder:
        yield Session(Path(folder), network, stopped, progress)


def run_load(plan: Plan, what: Grown | None, session: Session, output: Path, out: Console) -> tuple[int, bytes]:
    """Measure a plan, or a ramp of it; write load.json, load.csv and load.png.  Returns exit status and the JSON.

    Raises PlanError, LoadError, BusError and OSError.
    """
    found: Ramp | None = None
    if what is None:
        points: tuple[Point, ...] = (session.measure(checked(plan)),)
    else:
        found = ramp(plan, what, session.measure, session.stopped, lambda point: out.print(points_table([point])))
        points = found.points
    written = report(points, found)
    paths = [write(output, "load.json", written), write(output, "load.csv", csv_text(points))]
    if points:
        paths += _drawn(output / "load.png", lambda path: _draw_points(path, points, what), out)
        _print_points(points, found, out)
    _say_written(paths, out)
    lost = any(point.figures.loss > 0 for point in points)
    return (LOSS if lost and found is None else DONE), written


def run_soak(
    plan: Plan, minutes: float, restart_s: float, session: Session, output: Path, out: Console
) -> tuple[int, bytes]:
    """Run for so long; write soak.json, soak.csv and soak.png.  Returns exit status, 1 if not all is flat, and the JSON.

    Raises PlanError, LoadError, BusError and OSError.
    """
    with telling(session.progress, plan.title()) as tell:
        found = soak(checked(plan), session.setting(plan, tell), minutes, restart_s, session.stopped, tell)
    written = report((), soak=found)
    paths = [write(output, "soak.json", written), write(output, "soak.csv", csv_of_soak(found))]
    if found.buckets:
        paths += _drawn(output / "soak.png", lambda path: _draw_soak(path, found), out)
    out.print(soak_table(found))
    for line in soak_lines(found):
        out.print(line, markup=False, highlight=False)
    _say_written(paths, out)
    return (DONE if found.flat else FAILED), written


def serve(plan: Plan, session: Session, out: Console) -> int:
    """Run the integrators of a load whose viewers are elsewhere, until stopped; the exit status."""
    with telling(session.progress, plan.title()) as tell:
        setting = session.setting(checked(plan), tell)
    crew = Crew(plan, setting.rigs, setting.takes, time.time_ns(), setting.connect, setting.config)
    out.print(f"{len(crew.posts)} processes for {', '.join(plan.rig_names)}; Ctrl-C ends", markup=False, highlight=False)
    try:
        crew.start()
        while not session.stopped():
            time.sleep(0.2)
            crew.poll()
            for line in crew.lines():
                session.progress.print(line, markup=False, highlight=False)
            if crew.failed:
                raise BusError(f"{', '.join(crew.failed)} failed")
    finally:
        crew.stop()
    return DONE


@contextmanager
def telling(console: Console, title: str) -> Iterator[Tell]:
    """A progress bar on a terminal; elsewhere a line when something new is done, and now and then."""
    if console.is_terminal:
        columns = (TextColumn(title), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task("", total=1.0)
            yield lambda words, share: progress.update(task, description=words, completed=share)
        return
    last_words, last_s = "", 0.0

    def tell(words: str, share: float) -> None:
        nonlocal last_words, last_s
        now_s = time.monotonic()
        if words.split(" ")[0] != last_words or now_s - last_s > LINE_S:
            last_words, last_s = words.split(" ")[0], now_s
            console.print(f"{title}: {words} ({share:.0%})", markup=False, highlight=False, soft_wrap=True)

    yield tell


def _print_points(points: tuple[Point, ...], found: Ramp | None, out: Console) -> None:
    out.print(points_table(points))
    if found is None:
        out.print(costs_table(points[0]))
        for line in histogram_lines(points[0].figures.histogram):
            out.print(line, markup=False, highlight=False)
        out.print(f"the limit: {points[0].bottleneck}", markup=False, highlight=False)
    else:
        for line in in_words(found):
            out.print(line, markup=False, highlight=False)


def _draw_points(path: Path, points: tuple[Point, ...], what: Grown | None) -> None:
    from services.load.plot import draw_points

    grown: Grown = what or "rate"
    draw_points(path, points, LABELS[grown], lambda plan: value_of(plan, grown))


def _draw_soak(path: Path, found: Soak) -> None:
    from services.load.plot import draw_soak

    draw_soak(path, found)


def _drawn(path: Path, draw: Callable[[Path], None], out: Console) -> list[Path]:
    """The picture, if there is something to draw with."""
    try:
        draw(path)
    except ModuleNotFoundError as error:
        out.print(f"no picture: {error.name} is missing: pip install 'zenocap[load]'", markup=False, highlight=False)
        return []
    return [path]


def _say_written(paths: list[Path], out: Console) -> None:
    out.print(f"written: {', '.join(str(path) for path in paths)}", markup=False, highlight=False, soft_wrap=True)
