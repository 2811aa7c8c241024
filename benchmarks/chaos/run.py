"""One run: a rig, the rounds of a schedule, and what they did."""

import random
import shutil
import tempfile
import time
from contextlib import ExitStack
from os import getloadavg
from pathlib import Path
from statistics import median

from benchmarks.chaos import invariants
from benchmarks.chaos.injection import STEP_S, Injector
from benchmarks.chaos.losses import losses
from benchmarks.chaos.observer import Observer, longest_gap_s, settled_ns
from benchmarks.chaos.outcome import PATIENCE_S, Recovery, RunOutcome
from benchmarks.chaos.page_visitors import answers
from benchmarks.chaos.running_rig import START_S, RunningRig, rig_file
from benchmarks.chaos.schedule import IMPOSTOR, INTEGRATOR, SERVICES, VIEWERS, Round, schedule
from benchmarks.chaos.stated import wrong_statement
from benchmarks.chaos.takes import content, dishonest
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.harness.results import HOLDS
from tests.support.small_disk import mounted

RIG, SIZE, FPS = "chaos", "160x120", 15.0
POSES_S, ALL_S = 5.0, 30.0  # longest times from the end of a fault until poses are back, and those of all views
UNDISTURBED_GAP_S = 5.0  # longest pause of the poses during faults that do not concern them
DISK_MB, DISK_MB_PER_S, LARGEST_DISK_MB = 100, 0.5, 1000


class Run:
    """A run of one seed.  kinds: see `schedule`.  poses_s: longest time from the end of a fault until poses are back."""

    def __init__(self, seed: int, seconds: float, kinds: tuple[str, ...] = (), poses_s: float = POSES_S) -> None:
        self._kinds, self._poses_s = kinds, poses_s
        self.outcome = RunOutcome(seed, seconds)
        self._removals = 0

    def run(self, folder: Path) -> RunOutcome:
        """Run the rig in `folder`, with the faults one round after another, and check everything."""
        outcome = self.outcome
        with ExitStack() as stack:
            megabytes = min(LARGEST_DISK_MB, DISK_MB + DISK_MB_PER_S * outcome.seconds)  # a fault can fill them
            disk = stack.enter_context(mounted(folder / "disk", int(1024 * megabytes)))
            if disk is None:
                outcome.notes.append("no fault 'full disk': this user may not mount a small disk")
            recordings = (disk or folder / "disk") / "recordings"
            file = rig_file(folder, RIG, SIZE, FPS, outcome.seed)
            rig = stack.enter_context(RunningRig(folder, recordings, file))
            viewers = [name.partition(" ")[2] for name in VIEWERS]
            observer = Observer(rig.endpoint, RIG, viewers, SERVICES, frames=True)
            observer.start()
            stack.callback(observer.close)
            self._rig, self._observer = rig, observer
            self._injector = Injector(rig, RIG, observer, disk)
            if not rig.wait(lambda: self._back_ns(0, len(VIEWERS)) is not None and self._works(0), START_S):
                raise RuntimeError(f"the rig does not track within {START_S:g} s: {rig.log_text()[-2000:]}")
            begin_s, outcome.begin_ns = time.monotonic(), time.time_ns()
            for number, round in enumerate(schedule(outcome.seed, self._kinds)):
                if time.monotonic() - begin_s + round.pause_s >= outcome.seconds or rig.ended:
                    break
                self._round(number, round, begin_s, disk is not None)
            outcome.seconds = time.monotonic() - begin_s
            if rig.ended:
                outcome.violations.append(f"`zenocap up` ended by itself: {rig.output()[-1000:]}")
            time.sleep(1.0)
            rig.stop()
            observer.close()
            paths = sorted((disk or folder / "disk").rglob("*.mcap"))
            self._check(paths)
            if disk is not None:  # which is gone after the run
                (folder / "takes").mkdir()
                for number, path in enumerate(paths):
                    shutil.copy(path, folder / "takes" / f"{number}-{path.name}")
        return outcome

    def _round(self, number: int, round: Round, begin_s: float, has_disk: bool) -> None:
        time.sleep(round.pause_s)
        faults = [fault for fault in round.faults if fault.kind != "full disk" or has_disk]
        if not faults:
            return
        rng_name = f"{self.outcome.seed} {number}"
        begins = [(fault, self._injector.prepare(fault, random.Random(f"{rng_name} {fault.name}"))) for fault in faults]
        at_s, begin_ns = time.monotonic() - begin_s, time.time_ns()
        ends = sorted(((fault.seconds, begin()) for fault, begin in begins), key=lambda end: end[0])
        for seconds, end in ends:
            time.sleep(max(0.0, begin_ns / 1e9 + seconds - time.time()))
            end()
        end_ns = time.time_ns()
        self._removals += sum(fault.kind == "recordings" for fault in faults)
        all_views = len(VIEWERS)
        ready = self._rig.wait(lambda: self._back_ns(end_ns, all_views) is not None and self._works(end_ns), PATIENCE_S)
        if self._injector.restore_log:
            self._injector.log_again()
        services_s = (time.time_ns() - end_ns) / 1e9 if ready else None
        recovery = Recovery(
            round, at_s, begin_ns, end_ns,
            _seconds(self._back_ns(end_ns, 1), end_ns), _seconds(self._back_ns(end_ns, all_views), end_ns), services_s,
            longest_gap_s(self._observer.poses, begin_ns, end_ns), getloadavg()[0],
        )  # fmt: skip
        self.outcome.recoveries.append(recovery)
        self._judge(recovery)

    def _judge(self, recovery: Recovery) -> None:
        found = []
        if recovery.poses_s is None or recovery.poses_s > self._poses_s:
            found.append(f"poses back after {_text(recovery.poses_s)}, allowed: {self._poses_s:g} s")
        if recovery.views_s is None or recovery.views_s > ALL_S:
            found.append(f"poses of all views after {_text(recovery.views_s)}, allowed: {ALL_S:g} s")
        if recovery.services_s is None:
            since = [name for name in SERVICES if not self._healthy(name, recovery.end_ns)]
            found.append(f"not all services work after {PATIENCE_S:g} s: {', '.join(since) or 'page'}")
        if not any(fault.disturbs_poses for fault in recovery.round.faults) and recovery.gap_s > UNDISTURBED_GAP_S:
            found.append(f"no pose for {recovery.gap_s:.1f} s during a fault that does not concern poses")
        where = f"seed {self.outcome.seed}, {recovery.at_s:.1f} s, {recovery.round.name}"
        self.outcome.violations += [f"{where}: {text}" for text in found]
        print(
            f"{recovery.at_s:6.1f} s  {recovery.round.name}: poses {_text(recovery.poses_s)}, all views "
            f"{_text(recovery.views_s)}, all services {_text(recovery.services_s)}; load {recovery.load:.1f}"
            + "".join(f"\n          VIOLATION {text}" for text in found)
        )

    def _check(self, paths: list[Path]) -> None:
        """Invariants of the whole run, after its end."""
        outcome, rig, observer = self.outcome, self._rig, self._observer
        outcome.processes, outcome.poses = list(rig.processes.values()), observer.poses
        outcome.takes = [content(path) for path in paths]
        outcome.log_bytes = rig.log_bytes()
        output = rig.output()
        outcome.summary = "; ".join(line for line in output.splitlines()[-12:] if "lost" in line and " s | " not in line)
        found = invariants.unexpected_ends(outcome.processes, rig.killed)
        found += invariants.large_processes(outcome.processes)
        found += invariants.log_problems(rig.log_text(), outcome.log_bytes, outcome.seconds)
        orders = [time_ns for time_ns, _ in observer.sent]
        found += invariants.obeyed_orders(observer.health, outcome.spans("flood"), orders)
        starts = sum(seen.name == INTEGRATOR for seen in outcome.processes)
        records = sum(what == "record" for _, what in observer.sent)
        found += invariants.too_many_takes(len(paths), records, starts, self._removals, output[-500:])
        found += losses(outcome, observer.health, self._injector.deleted_ns)
        clock = [(begin - round(1e9 * STEP_S[1]), end) for begin, end in outcome.spans("clock")]
        found += wrong_statement(output, rig.status, outcome.takes, observer.messages, clock)
        for take in outcome.takes:
            forged = any(begin <= take.last_ns and end >= take.first_ns for begin, end in outcome.spans(IMPOSTOR))
            found += dishonest(take, forged=forged)
        if rig.status not in (0, 3):
            found.append(f"`zenocap up` ended with status {rig.status}: {output[-500:]}")
        if observer.problem or observer.dropped:
            outcome.notes.append(f"the observer lost messages: {observer.problem or observer.dropped}")
        outcome.violations += [f"seed {outcome.seed}: {text}" for text in found]

    def _back_ns(self, since_ns: int, views: int) -> int | None:
        return settled_ns(self._observer.poses, since_ns, views)

    def _works(self, since_ns: int) -> bool:
        """Whether every service has reported since then, and the page is served."""
        return all(self._healthy(name, since_ns) for name in SERVICES) and answers(self._rig.page_port)

    def _healthy(self, name: str, since_ns: int) -> bool:
        return any(one.service == name and one.received_ns > since_ns for one in reversed(self._observer.health[-200:]))


def _seconds(time_ns: int | None, since_ns: int) -> float | None:
    return None if time_ns is None else (time_ns - since_ns) / 1e9


def _text(seconds: float | None) -> str:
    return f"not within {PATIENCE_S:g} s" if seconds is None else f"{seconds:.1f} s"


def run(one: Case) -> Figures:
    """A run of one seed; its violations are printed.  Options: seconds; only, kinds or targets of faults."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = Run(one.seed, one.option("seconds", 120.0), one.option("only", ())).run(Path(folder).resolve())
    print(outcome.text())
    back = [found.poses_s for found in outcome.recoveries if found.poses_s is not None]
    return {
        "rounds": len(outcome.recoveries),
        "faults": sum(len(found.round.faults) for found in outcome.recoveries),
        "not back": len(outcome.recoveries) - len(back),
        **({"poses back": median(back), "worst": max(back)} if back else {}),
        "violations": len(outcome.violations),
        HOLDS: not outcome.violations,
        "load": max(found.load for found in outcome.recoveries) if outcome.recoveries else 0.0,
    }


CHAOS = Kind(
    "chaos",
    "Faults at random, drawn by a seed, against a whole rig: `zenocap up` with three simulated cameras at 160×120 and 15 "
    "frames/s, tracker, recognizer, page and log around a router; time from the end of a fault until poses are back, and "
    "violations of what must hold.",
    run,
    (
        *(Quantity(name, "", 0, joined="sum") for name in ("rounds", "faults", "not back")),
        Quantity("poses back", "s", 1, joined="median"),
        Quantity("worst", "s", 1),
        Quantity("violations", "", 0, joined="sum"),
        Quantity(HOLDS, worst="low"),
        Quantity("load", "", 1),
    ),
    {f"{minutes} minutes": case("random", seconds=60.0 * minutes) for minutes in (2, 10, 120)}
    | {"impostor": case("random", only=("impostor",))},
    case("random", seconds=10.0),
    rows="time for faults",
    timed=True,
)
