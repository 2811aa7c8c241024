"""`zenocap replay --verify` as a program: parts of a take in, what was found out."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from time import monotonic

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from common.runtime.versions import versions
from services.takes.verify.recompute import Verified, verify

DONE, DIFFERENT, LOSS = 0, 1, 3


def run_verify(paths: Sequence[Path], tolerance: float, as_json: bool, console: Console) -> int:
    """Print what was recomputed; exit status 0 all equal, 1 something differs, 3 equal as far as it could be checked.

    Raises TakeError.
    """
    errors = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    started_s = monotonic()
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as progress:
        task = progress.add_task("recomputing (the first run compiles for some 20 s)")
        found = verify(paths, tolerance, lambda count: progress.update(task, description=f"{count} messages"))
    elapsed_s = monotonic() - started_s
    if as_json:
        print(json.dumps(asdict(found) | {"elapsed_s": elapsed_s, "differing_versions": _other_versions(found)}, indent=2))
    else:
        for line in report(found, elapsed_s):
            console.print(line, markup=False, highlight=False, soft_wrap=True)
    if found.different or found.unlogged:
        return DIFFERENT
    return LOSS if found.unchecked or found.reasons else DONE


def report(found: Verified, elapsed_s: float) -> list[str]:
    """What was found, in lines."""
    keys = sorted({*found.equal, *found.different, *found.unlogged, *found.unchecked})
    width = max(map(len, keys))
    lines = [f"{'recomputed, and':{width}} {'equal':>8} {'differ':>8} {'not logged':>10} {'unchecked':>10}"]
    counts: tuple[Counter[str], ...] = (found.equal, found.different, found.unlogged, found.unchecked)
    for key in keys:
        equal, different, unlogged, unchecked = (count[key] for count in counts)
        lines.append(f"{key:{width}} {equal:8d} {different:8d} {unlogged:10d} {unchecked:10d}")
    equal, different, unlogged, unchecked = (count.total() for count in counts)
    close = f", {found.close} of them within the tolerance" if found.close else ""
    times = f", {found.duration_s / elapsed_s:.1f} times as fast as recorded" if elapsed_s > 0 else ""
    lines.append(f"{found.checked} derived messages recomputed in {elapsed_s:.1f} s{times}: {equal} equal{close}")
    if found.first:
        lines.append(f"first difference: {found.first.key}, frame {found.first.frame}, of {found.first.captured_ns}")
        lines += [f"  {field}" for field in found.first.fields]
        lines += [f"  made with {name} {was}, this is {now}" for name, (was, now) in _other_versions(found).items()]
    if different or unlogged:
        lines.append(f"NOT equal: {different} differ, {unlogged} are not in the take")
    if unchecked or found.reasons:
        lines.append(f"not checked: {unchecked} messages")
        lines += [f"  {reason}" for reason in dict.fromkeys(found.reasons)]
    return lines


def _other_versions(found: Verified) -> dict[str, tuple[str, str]]:
    """By name, what the take was made with and what is here."""
    here = versions()
    return {name: (was, here[name]) for name, was in found.versions.items() if here.get(name, was) != was}
