"""Segments of a take listed, or labelled, in the terminal."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from zenocap.tools.cli.options import check_folder

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.trajectories import Trajectories
    from zenocap.services.recognizer.model import PostureModel
    from zenocap.services.recognizer.training.labelling import Candidate, Suggestion
    from zenocap.services.recognizer.training.manifest import ManifestRow
    from zenocap.tools.cli.posture.label_options import LabelArguments, LabelExpert

FRAMES_PER_S = 20.0  # of the playback
HELP = """  a label        label the segment, such as kick  Enter      accept the suggestion
  s              skip the segment                 r          play it again
  b SECONDS      move its start; -: earlier       e SECONDS  move its end; -: earlier
  q              save the labels and quit         ?          show this help"""


def label_in_terminal(
    source: Path, guesser: tuple[str, PostureModel] | None, given: LabelArguments, expert: LabelExpert
) -> None:
    """List the segments of a take, or label them; guesser: name and model that suggests labels.  Raises UserError."""
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.common.formats.motion_files import read_centres
    from zenocap.services.recognizer.training.example_files import read_features
    from zenocap.services.recognizer.training.labelling import add_rows, candidates_of, is_labelled, suggestions_in
    from zenocap.services.recognizer.training.manifest import write_manifest
    from zenocap.tools.teach.page.manifest_file import manifest_at

    output = None if given.output is None else manifest_at(given.output)
    names = None if given.joints is None else read_joint_map(given.joints)
    motion = read_features(source, "directions", names)
    found = candidates_of(motion.times_s, motion.features, motion.rate)
    rows = _rows_of(output)
    left = [one for one in found if not is_labelled(rows, source, one)]
    suggested: list[Suggestion | None] = [None] * len(left)
    if guesser is not None:
        suggested = suggestions_in(guesser[1], read_features(source, guesser[1].features, names), left)
    guesses = dict(zip(left, suggested, strict=True))
    if output is None or given.only_list or given.as_json:
        _list(source, guesses, given.as_json)
        return
    if given.accept:
        chosen = [(one, guess.label) for one, guess in guesses.items() if guess and guess.known]
    else:
        centres = read_centres(source, names) if expert.play else None
        limits = float(motion.times_s[0]), float(motion.times_s[-1])
        chosen = labels_entered(guesses, limits, centres, expert.speed)
    named = add_rows(rows, source, given.person, chosen)
    if chosen:
        write_manifest(output, named)
    typer.echo(f"{output}: {len(chosen)} of {len(left)} labelled, {len(named)} rows")


def _list(source: Path, guesses: Mapping[Candidate, Suggestion | None], as_json: bool) -> None:
    if as_json:
        rows = [asdict(one) | {"guess": asdict(guess) if guess else None} for one, guess in guesses.items()]
        typer.echo(json.dumps({"source": str(source), "candidates": rows}, ensure_ascii=False))
        return
    if not guesses:
        typer.echo(f"{source}: no movement is long enough, or all segments are labelled")
        return
    typer.echo(f"{'':>3} {'start s':>8} {'end s':>8} {'seconds':>8}  {'suggestion':24} moving limbs")
    for number, (one, guess) in enumerate(guesses.items(), 1):
        typer.echo(
            f"{number:3d} {one.start_s:8.2f} {one.end_s:8.2f} {one.end_s - one.start_s:8.2f}  {guess or '-'!s:24} "
            f"{', '.join(one.limbs)}"
        )
    typer.echo("a suggestion with ?: the likeliest posture, but below the model's threshold")


def _rows_of(output: Path | None) -> list[ManifestRow]:
    """Raises UserError."""
    from zenocap.services.recognizer.training.manifest import read_manifest

    check_folder(output)
    return [] if output is None or not output.is_file() else read_manifest(output)


def labels_entered(
    guesses: Mapping[Candidate, Suggestion | None], limits: tuple[float, float], centres: Trajectories | None, speed: float
) -> list[tuple[Candidate, str]]:
    """Labels entered for the candidates; those entered before q, Ctrl-C or Ctrl-D are kept.

    limits: start and end of the take, seconds.  centres: joint centres to play; None: no playback.
    """
    chosen: list[tuple[Candidate, str]] = []
    typer.echo(HELP)
    with suppress(KeyboardInterrupt, OSError):  # at any moment; the terminal is gone
        for number, (one, guess) in enumerate(guesses.items(), 1):
            answer = _labelled(one, guess, f"{number} of {len(guesses)}", limits, centres, speed)
            if answer is None:
                break
            chosen += [answer] * bool(answer[1])
    return chosen


def _labelled(
    one: Candidate, guess: Suggestion | None, number: str, limits: tuple[float, float], centres: Trajectories | None,
    speed: float,
) -> tuple[Candidate, str] | None:  # fmt: skip
    """A candidate, as the user has moved it, and its label, empty to skip it; None at the end of the answers."""
    while True:
        if centres is not None:
            _play(centres, one, speed)
        answer = _answer(one, guess, number, limits)
        if answer is None:
            return None
        if isinstance(answer, str):
            return one, answer
        one = answer


def _answer(one: Candidate, guess: Suggestion | None, number: str, limits: tuple[float, float]) -> Candidate | str | None:
    """The label of a candidate, empty to skip it; the candidate to play again; or None at the end of the answers."""
    while True:
        span = f"{one.start_s:.2f} to {one.end_s:.2f} s, {', '.join(one.limbs)}"
        typer.echo(f"{number}: {span}; suggestion: {guess or 'none'}")
        try:
            entered = input("posture> ").strip()
        except (EOFError, KeyboardInterrupt):
            typer.echo("")
            return None
        match entered.split(" ", 1):
            case ["q"]:
                return None
            case ["s"]:
                return ""
            case ["r"]:
                return one
            case ["?"]:
                typer.echo(HELP)
            case ["b" | "e" as which, value]:
                if (moved := _moved(one, which, value, limits)) is not None:
                    return moved
                typer.echo(f"{entered!r}: allowed: seconds, such as {which} -0.2, within the take, begin before end")
            case _:
                text = entered or (guess.label if guess else "")
                problem = _problem(text) if text else "no suggestion: type a label, s to skip the segment, or ? for help"
                if problem is None:
                    return text
                typer.echo(problem)


def _moved(one: Candidate, which: str, value: str, limits: tuple[float, float]) -> Candidate | None:
    try:
        by = float(value)
    except ValueError:
        return None
    moved = replace(one, start_s=one.start_s + by) if which == "b" else replace(one, end_s=one.end_s + by)
    return moved if limits[0] <= moved.start_s < moved.end_s <= limits[1] else None


def _problem(text: str) -> str | None:
    from zenocap.services.recognizer.training.examples import LONGEST_LABEL

    if len(text) <= LONGEST_LABEL and text.isprintable():
        return None
    return f"posture = {text!r}: allowed: 1 to {LONGEST_LABEL} printable characters"


def _play(data: Trajectories, one: Candidate, speed: float) -> None:
    """In the terminal; Ctrl-C ends it early."""
    from rich.live import Live

    from zenocap.tools.takes.figure_text import pictures

    with suppress(KeyboardInterrupt):
        texts = pictures(data, one.start_s, one.end_s, FRAMES_PER_S / speed)
        with Live(refresh_per_second=2 * FRAMES_PER_S) as live:
            for text in texts:
                live.update(text)
                time.sleep(1.0 / FRAMES_PER_S)
