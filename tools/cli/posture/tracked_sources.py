"""Rigs and clip folders that a manifest names, tracked into takes before anything is learnt from them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from zenocap.common.errors import SourceError, UserError
from zenocap.tools.cli.options import rig_at

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.joint_map import JointMap
    from zenocap.services.recognizer.features import Kind
    from zenocap.services.recognizer.training.examples import Example
    from zenocap.services.recognizer.training.manifest import ManifestRow
    from zenocap.tools.cli.posture.training_options import SourceArguments

Report = Callable[[int, int, str], None]
TRACKED = "tracked"  # folder beside a manifest


def read_examples(
    manifest: Path, kind: Kind, sources: SourceArguments, report: Report, missing: list[str] | None = None
) -> list[Example]:
    """The examples of a manifest, its rigs tracked first.  missing: takes a line for each row that has no angles.

    Raises UserError.
    """
    from zenocap.services.recognizer.training.example_files import examples_of

    rows, names = tracked_rows(manifest, sources, report)
    return examples_of(manifest, rows, kind, report, missing, names)


def tracked_rows(manifest: Path, sources: SourceArguments, report: Report) -> tuple[list[ManifestRow], JointMap | None]:
    """The rows of a manifest, its rigs tracked first, and the names of joints.  Raises UserError."""
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.services.recognizer.training.manifest import read_manifest

    names = None if sources.joints is None else read_joint_map(sources.joints)
    folder = sources.tracked or manifest.parent / TRACKED
    return with_takes(manifest, read_manifest(manifest), folder, sources.method, report), names


def with_takes(
    manifest: Path, rows: Sequence[ManifestRow], folder: Path, method: str | None, report: Report
) -> list[ManifestRow]:
    """The rows, with the take in `folder` instead of every rig; a take that is there already is not made again.

    Raises UserError with all rigs that cannot be tracked.
    """
    first: dict[Path, int] = {}
    for row in rows:
        if row.is_rig:
            first.setdefault(row.source, row.line)
    takes: dict[Path, Path] = {}
    wrong: list[str] = []
    if first:
        folder.mkdir(parents=True, exist_ok=True)
    for done, (source, line) in enumerate(first.items()):
        report(done, len(first), f"tracking {source.name}")
        try:
            takes[source] = _take(manifest, source, folder, method)
        except UserError as error:
            wrong.append(f"{manifest}: line {line}: {error}")
    if wrong:
        raise UserError("\n".join(wrong))
    return [replace(row, source=takes.get(row.source, row.source)) for row in rows]


def take_name(manifest: Path, source: Path, method: str) -> str:
    """Name of the take of a rig: its path relative to the manifest, and the method."""
    base, own = manifest.parent.resolve(), source.resolve()
    relative = own.relative_to(base) if own.is_relative_to(base) else Path(own.parent.name) / own.name
    plain = re.sub(r"[^A-Za-z0-9_.\-]+", "-", "-".join(relative.with_suffix("").parts if own.is_file() else relative.parts))
    return f"{plain}-{method}.mcap"


def _take(manifest: Path, source: Path, folder: Path, method: str | None) -> Path:
    from zenocap.tools.takes.track import track

    rig = rig_at(source, files=True, method=method)
    path = folder / take_name(manifest, source, rig.method)
    if path.exists():
        return path
    unfinished = path.with_suffix(".unfinished.mcap")
    tracked = track(rig, unfinished)
    if not tracked.poses:
        unfinished.unlink()
        states = "; ".join(f"{service}: {state}" for service, state in tracked.states.items())
        raise SourceError(f"{source}: no pose: allowed: a rig whose viewers all see a T-pose ({states})")
    return unfinished.replace(path)
