"""One run: a rig, the rounds of a schedule, and what they did."""

import random
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from os import getloadavg
from pathlib import Path

from benchmarks.chaos import invariants
from benchmarks.chaos.injection import Injector
from benchmarks.chaos.observer import Observer, SeenPose, longest_gap_s, settled_ns
from benchmarks.chaos.page_visitors import answers
from benchmarks.chaos.running_rig import RunningRig, Seen, rig_file
from benchmarks.chaos.schedule import IMPOSTOR, INTEGRATOR, ROUTER, SERVICES, VIEWERS, Round, schedule
from benchmarks.chaos.takes import Content, Span, content, dishonest, missing_poses, uncovered_poses, within

RIG = "chaos"
START_S = 180.0  # until the first poses: compilation, empty scene
PATIENCE_S = 40.0  # for the recovery from a fault, before the run goes on
UNDISTURBED_GAP_S = 5.0  # longest pause of the poses during faults that do not concern them
MARGIN_NS = 2_000_000_000  # around a fault of the log in which its messages are excused
DISK_MB, DISK_MB_PER_S, LARGEST_DISK_MB = 100, 0.5, 1000


@dataclass(frozen=True)
class Limits:
    """Longest times after the end of a fault (s).  poses_s: until poses are back.  all_s: until all views contribute."""

    poses_s: float = 5.0
    all_s: float = 30.0


@dataclass(frozen=True)
class Recovery:
    """poses_s, views_s, services_s: after the end of the fault; None: not within PATIENCE_S."""

    round: Round
    at_s: float
    begin_ns: int
    end_ns: int
    poses_s: float | None
    views_s: float | None
    services_s: float | None
    gap_s: float
    load: float


@dataclass
class Outcome:
    """Result of a run.  notes: what is worth knowing and no violation."""

    seed: int
    seconds: float
    recoveries: list[Recovery] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    processes: list[Seen] = field(default_factory=list)
    takes: list[Content] = field(default_factory=list)
    poses: list[SeenPose] = field(default_factory=list)
    log_bytes: int = 0
    summary: str = ""


@contextmanager
def small_disk(folder: Path, seconds: float) -> Iterator[Path | None]:
    """A disk for the recordings that a fault can fill: a tmpfs; None where this user may not mount one."""
    megabytes = min(LARGEST_DISK_MB, DISK_MB + DISK_MB_PER_S * seconds)
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes:.0f}m", "zenocap-chaos", str(folder)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=False)


class Run:
    """A run of one seed.  say: called with a line for every round."""

    def __init__(
        self, seed: int, seconds: float, limits: Limits, kinds: tuple[str, ...], say: Callable[[str], None]
    ) -> None:
        self._limits, self._kinds, self._say = limits, kinds, say
        self.outcome = Outcome(seed, seconds)
        self._removals = self._starts = 0

    def run(self, folder: Path, size: str, fps: float) -> Outcome:
        """Run the rig in `folder`, with the faults one round after another, and check everything."""
        outcome = self.outcome
        with ExitStack() as stack:
            disk = stack.enter_context(small_disk(folder / "disk", outcome.seconds))
            if disk is None:
                outcome.notes.append("no fault 'full disk': this user may not mount a small disk")
            recordings = (disk or folder / "disk") / "recordings"
            file = rig_file(folder, RIG, size, fps, outcome.seed)
            rig = stack.enter_context(RunningRig(folder, recordings, file))
            viewers = [name.partition(" ")[2] for name in VIEWERS]
            observer = Observer(rig.endpoint, RIG, viewers, SERVICES)
            observer.start()
            stack.callback(observer.close)
            self._rig, self._observer = rig, observer
            self._injector = Injector(rig, RIG, observer, disk, outcome.seed)
            if not self._wait(lambda: self._back_ns(0, len(VIEWERS)) is not None and self._works(0), START_S):
                raise RuntimeError(f"the rig does not track within {START_S:g} s: {rig.log_text()[-2000:]}")
            begin_s = time.monotonic()
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
        ready = self._wait(lambda: self._back_ns(end_ns, all_views) is not None and self._works(end_ns), PATIENCE_S)
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
        if recovery.poses_s is None or recovery.poses_s > self._limits.poses_s:
            found.append(f"poses back after {_text(recovery.poses_s)}, allowed: {self._limits.poses_s:g} s")
        if recovery.views_s is None or recovery.views_s > self._limits.all_s:
            found.append(f"poses of all views after {_text(recovery.views_s)}, allowed: {self._limits.all_s:g} s")
        if recovery.services_s is None:
            since = [name for name in SERVICES if not self._healthy(name, recovery.end_ns)]
            found.append(f"not all services work after {PATIENCE_S:g} s: {', '.join(since) or 'page'}")
        if not any(fault.disturbs_poses for fault in recovery.round.faults) and recovery.gap_s > UNDISTURBED_GAP_S:
            found.append(f"no pose for {recovery.gap_s:.1f} s during a fault that does not concern poses")
        where = f"seed {self.outcome.seed}, {recovery.at_s:.1f} s, {recovery.round.name}"
        self.outcome.violations += [f"{where}: {text}" for text in found]
        self._say(
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
        found += invariants.obeyed_orders(observer.health, self._spans("flood"), orders)
        starts = sum(seen.name == INTEGRATOR for seen in outcome.processes)
        records = sum(what == "record" for _, what in observer.sent)
        found += invariants.too_many_takes(len(paths), records, starts, self._removals, output[-500:])
        found += self._losses()
        for take in outcome.takes:
            forged = any(begin <= take.last_ns and end >= take.first_ns for begin, end in self._spans(IMPOSTOR))
            found += dishonest(take, forged=forged)
        if rig.status not in (0, 3):
            found.append(f"`zenocap up` ended with status {rig.status}: {output[-500:]}")
        if observer.problem or observer.dropped:
            outcome.notes.append(f"the observer lost messages: {observer.problem or observer.dropped}")
        outcome.violations += [f"seed {outcome.seed}: {text}" for text in found]

    def _losses(self) -> list[str]:
        """Poses that are in no take although one was written, beyond what was counted as lost at other times than these.

        What Zenoh drops before a subscriber, on links that a flood of huge messages fills, is counted by nobody.
        """
        outcome, health = self.outcome, self._observer.health
        excused = self._excused()
        missing = missing_poses(outcome.poses, outcome.takes, excused)
        flooded = [pose for pose in missing if within(pose.received_ns, self._spans("huge"))]
        counted = invariants.counted_losses(health, excused)
        times = ", ".join(f"{self._run_s(pose.received_ns):.1f}" for pose in missing[:10])
        at = f" (at {times} s)" if missing else ""
        text = f"{len(missing)} poses are in no take{at}, {counted} messages counted as lost then"
        outcome.notes.append(f"{text}; {len(flooded)} of them during floods of huge messages, dropped by the network")
        found = [text] if len(missing) - len(flooded) > counted else []
        covered = [(take.first_ns, take.last_ns + MARGIN_NS) for take in outcome.takes]
        uncovered = uncovered_poses(outcome.poses, self._logging(), [*excused, *covered])
        if uncovered:
            at_s = self._run_s(uncovered[0].received_ns)
            text = f"{len(uncovered)} poses from {at_s:.1f} s on are in no take, although the integrator records"
            found.append(text)
        return found

    def _run_s(self, time_ns: int) -> float:
        """Time of the run, as it is printed for the faults (s)."""
        first = self.outcome.recoveries[0]
        return (time_ns - first.begin_ns) / 1e9 + first.at_s

    def _logging(self) -> list[Span]:
        """Times at which the integrator said that it records, without an error."""
        states = [one for one in self._observer.health if one.service == INTEGRATOR]
        spans = []
        for one, after in pairwise(states):
            counts = (one.health.counts, after.health.counts)
            on = all(each.get("log_on") and not each.get("log_stopped") for each in counts)
            if on and after.received_ns - one.received_ns < MARGIN_NS:
                spans.append((one.received_ns, after.received_ns))
        return spans

    def _excused(self) -> list[Span]:
        """Times at which messages need not be in a take: the log or the network is hit, or a take was deleted with them."""
        spans = []
        for recovery in self.outcome.recoveries:
            until_ns = recovery.end_ns + round_ns(max(recovery.services_s or PATIENCE_S, 1.0)) + MARGIN_NS
            for fault in recovery.round.faults:
                hit = fault.hits & {ROUTER, INTEGRATOR} or fault.kind in ("full disk", "requests")
                if hit:
                    spans.append((recovery.begin_ns - MARGIN_NS, until_ns))
        starts = sorted(take.first_ns for take in self.outcome.takes)
        for deleted_ns in self._injector.deleted_ns:  # the deleted file began after the last one before it
            begin_ns = max((take.last_ns for take in self.outcome.takes if take.last_ns < deleted_ns), default=0)
            end_ns = min((start for start in starts if start > deleted_ns), default=deleted_ns)
            spans.append((begin_ns, end_ns + MARGIN_NS))
        return spans

    def _spans(self, kind: str) -> list[Span]:
        """Times of the rounds with a kind of fault."""
        return [
            (recovery.begin_ns, recovery.end_ns + MARGIN_NS)
            for recovery in self.outcome.recoveries
            if any(kind in (fault.kind, fault.target) for fault in recovery.round.faults)
        ]

    def _back_ns(self, since_ns: int, views: int) -> int | None:
        return settled_ns(self._observer.poses, since_ns, lambda pose: not pose.lost and pose.views >= views)

    def _works(self, since_ns: int) -> bool:
        """Whether every service has reported since then, and the page is served."""
        return all(self._healthy(name, since_ns) for name in SERVICES) and answers(self._rig.page_port)

    def _healthy(self, name: str, since_ns: int) -> bool:
        return any(one.service == name and one.received_ns > since_ns for one in reversed(self._observer.health[-200:]))

    def _wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        end_s = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end_s or self._rig.ended:
                return False
            time.sleep(0.1)
        return True


def round_ns(seconds: float) -> int:
    return int(seconds * 1e9)


def _seconds(time_ns: int | None, since_ns: int) -> float | None:
    return None if time_ns is None else (time_ns - since_ns) / 1e9


def _text(seconds: float | None) -> str:
    return f"not within {PATIENCE_S:g} s" if seconds is None else f"{seconds:.1f} s"
