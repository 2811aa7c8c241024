"""The command that helps a person to make a manifest: posture label."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.commands.options import JsonOption, one_line_errors

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.formats.trc import Trajectories
    from services.recognizer.candidates import Candidate
    from services.recognizer.manifest import Row
    from services.recognizer.model import PostureModel
    from services.recognizer.naming import Guess

FRAMES_PER_S = 20.0  # of what is played
SHIPPED = "fifteen"
HELP = """  a label        name it, such as kick            Enter      take what is guessed
  s              skip it                          r          play it again
  b SECONDS      begin so much later, or -earlier e SECONDS  end so much later, or -earlier
  q              write what is named, and leave   ?          this help"""


def label(
    source: Annotated[
        Path, typer.Argument(metavar="TAKE", help="A take (.mcap), or motion capture (.bvh, .trc).", show_default=False)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="MANIFEST", help="Write here; rows that it has are kept.", show_default=False
        ),
    ] = None,
    model: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help=f"Guesses labels; default: {SHIPPED}, which is shipped.")
    ] = None,
    person: Annotated[str, typer.Option(metavar="NAME", help="Who is seen in the take.")] = "1",
    accept: Annotated[
        bool, typer.Option("--accept", help="Ask nothing: take all guesses of which the model is sure.")
    ] = False,
    only_list: Annotated[bool, typer.Option("--list", help="List the candidates, and no more.")] = False,
    play: Annotated[bool, typer.Option(help="Play every candidate in the terminal.")] = True,
    speed: Annotated[float, typer.Option(min=0.05, max=20, help="How fast candidates are played.")] = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Find stretches of a take that may be postures, see them, and name them for a manifest.

    A stretch is where somebody moves until they are still again. With MANIFEST every stretch is played in the terminal and
    asked for; what was named before is not asked for again, so that the work can be broken off. Without, they are listed.

    Example: `zenocap posture label take.mcap -o examples.csv --person anna`
    """
    with one_line_errors():
        from common.formats.motions import read_centres
        from services.recognizer.candidates import candidates_of
        from services.recognizer.manifest import write_manifest
        from services.recognizer.naming import guesses_of, is_named, with_named
        from services.recognizer.reading import features_in

        guesser = _guesser(model)
        motion = features_in(source, "directions")
        found = candidates_of(motion.times_s, motion.features, motion.rate)
        rows = _rows_of(output)
        left = [one for one in found if not is_named(rows, source, one)]
        none: list[Guess | None] = [None] * len(left)
        guesses = dict(zip(left, guesses_of(guesser, source, left) if guesser else none, strict=True))
        if output is None or only_list or as_json:
            _list(source, guesses, as_json)
            return
        if accept:
            chosen = [(one, guess.label) for one, guess in guesses.items() if guess and guess.known]
        else:
            centres = read_centres(source) if play else None
            chosen = _asked(guesses, (float(motion.times_s[0]), float(motion.times_s[-1])), centres, speed)
        named = with_named(rows, source, person, chosen)
        if chosen:
            write_manifest(output, named)
    typer.echo(f"{output}: {len(chosen)} of {len(left)} named, {len(named)} rows")


def _guesser(name: str | None) -> PostureModel | None:
    """Raises PostureModelError for a model that was asked for."""
    from services.recognizer.file import PostureModelError, find_model, read_model

    try:
        return read_model(find_model(name or SHIPPED))
    except PostureModelError:
        if name is not None:
            raise
        return None


def _list(source: Path, guesses: Mapping[Candidate, Guess | None], as_json: bool) -> None:
    if as_json:
        rows = [asdict(one) | {"guess": asdict(guess) if guess else None} for one, guess in guesses.items()]
        typer.echo(json.dumps({"source": str(source), "candidates": rows}, ensure_ascii=False))
        return
    if not guesses:
        typer.echo(f"{source}: nobody moves for long enough, or all is named")
        return
    typer.echo(f"{'':>3} {'start s':>8} {'end s':>8} {'seconds':>8}  {'guess':24} what moves")
    for number, (one, guess) in enumerate(guesses.items(), 1):
        typer.echo(
            f"{number:3d} {one.start_s:8.2f} {one.end_s:8.2f} {one.end_s - one.start_s:8.2f}  {guess or '-'!s:24} "
            f"{', '.join(one.limbs)}"
        )
    typer.echo("a guess with ? is the likeliest posture, of which the model is not sure")


def _asked(
    guesses: Mapping[Candidate, Guess | None], limits: tuple[float, float], centres: Trajectories | None, speed: float
) -> list[tuple[Candidate, str]]:
    """What a person says of every candidate; what was said stays when they leave by q, Ctrl-C or Ctrl-D.

    limits: of the take, seconds.  centres: to be played, None not to.
    """
    chosen: list[tuple[Candidate, str]] = []
    typer.echo(HELP)
    for number, (one, guess) in enumerate(guesses.items(), 1):
        again = True
        while True:
            if again and centres is not None:
                _play(centres, one, speed)
            again = False
            span = f"{one.start_s:.2f} to {one.end_s:.2f} s, {', '.join(one.limbs)}"
            typer.echo(f"{number} of {len(guesses)}: {span}; guess: {guess or 'none'}")
            try:
                said = input("posture> ").strip()
            except (EOFError, KeyboardInterrupt):
                typer.echo("")
                return chosen
            word, _, value = said.partition(" ")
            if said == "q":
                return chosen
            if said == "s":
                break
            if said == "?":
                typer.echo(HELP)
            elif said == "r":
                again = True
            elif word in ("b", "e") and value:
                moved = _moved(one, word, value, limits)
                if moved is None:
                    typer.echo(f"{said!r}: allowed: seconds, such as {word} -0.2, within the take, begin before end")
                else:
                    one, again = moved, True
            elif said or guess:
                text = said or (guess.label if guess else "")
                problem = _wrong(text)
                if problem is None:
                    chosen.append((one, text))
                    break
                typer.echo(problem)
            else:
                typer.echo("nothing is guessed: type a label, s to skip it, or ? for help")
    return chosen


def _moved(one: Candidate, which: str, value: str, limits: tuple[float, float]) -> Candidate | None:
    try:
        by = float(value)
    except ValueError:
        return None
    moved = replace(one, start_s=one.start_s + by) if which == "b" else replace(one, end_s=one.end_s + by)
    return moved if limits[0] <= moved.start_s < moved.end_s <= limits[1] else None


def _wrong(text: str) -> str | None:
    from services.recognizer.examples import LONGEST_LABEL

    if len(text) <= LONGEST_LABEL and text.isprintable():
        return None
    return f"posture = {text!r}: allowed: 1 to {LONGEST_LABEL} printable characters"


def _play(data: Trajectories, one: Candidate, speed: float) -> None:
    """In the terminal; Ctrl-C ends it early."""
    from rich.live import Live

    from services.takes.figure_text import pictures

    texts = pictures(data, one.start_s, one.end_s, FRAMES_PER_S / speed)
    try:
        with Live(refresh_per_second=2 * FRAMES_PER_S) as live:
            for text in texts:
                live.update(text)
                time.sleep(1.0 / FRAMES_PER_S)
    except KeyboardInterrupt:
        return


def _rows_of(output: Path | None) -> list[Row]:
    """Raises ManifestError."""
    from services.recognizer.manifest import ManifestError, read_manifest

    if output is None or not output.is_file():
        if output is not None and not output.parent.is_dir():
            raise ManifestError(f"{output}: there is no folder {output.parent}: allowed: a file in a folder that exists")
        return []
    return read_manifest(output)
