"""Labels of a take entered in the terminal."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.trajectories import Trajectories
    from zenocap.services.recognizer.training.labelling import Candidate, Suggestion

FRAMES_PER_S = 20.0  # of the playback
HELP = """  a label        label the segment, such as kick  Enter      accept the suggestion
  s              skip the segment                 r          play it again
  b SECONDS      move its start; -: earlier       e SECONDS  move its end; -: earlier
  q              save the labels and quit         ?          show this help"""


def labels_entered(
    guesses: Mapping[Candidate, Suggestion | None], limits: tuple[float, float], centres: Trajectories | None, speed: float
) -> list[tuple[Candidate, str]]:
    """Labels entered for the candidates; those entered before q, Ctrl-C or Ctrl-D are kept.

    limits: start and end of the take, seconds.  centres: joint centres to play; None: no playback.
    """
    chosen: list[tuple[Candidate, str]] = []
    typer.echo(HELP)
    for number, (one, guess) in enumerate(guesses.items(), 1):
        play_again = True
        while True:
            if play_again and centres is not None:
                _play(centres, one, speed)
            play_again = False
            span = f"{one.start_s:.2f} to {one.end_s:.2f} s, {', '.join(one.limbs)}"
            typer.echo(f"{number} of {len(guesses)}: {span}; suggestion: {guess or 'none'}")
            try:
                entered = input("posture> ").strip()
            except (EOFError, KeyboardInterrupt):
                typer.echo("")
                return chosen
            word, _, value = entered.partition(" ")
            if entered == "q":
                return chosen
            if entered == "s":
                break
            if entered == "?":
                typer.echo(HELP)
            elif entered == "r":
                play_again = True
            elif word in ("b", "e") and value:
                moved = _moved(one, word, value, limits)
                if moved is None:
                    typer.echo(f"{entered!r}: allowed: seconds, such as {word} -0.2, within the take, begin before end")
                else:
                    one, play_again = moved, True
            elif entered or guess:
                text = entered or (guess.label if guess else "")
                problem = _problem(text)
                if problem is None:
                    chosen.append((one, text))
                    break
                typer.echo(problem)
            else:
                typer.echo("no suggestion: type a label, s to skip the segment, or ? for help")
    return chosen


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

    from zenocap.tools.recordings.figure_text import pictures

    texts = pictures(data, one.start_s, one.end_s, FRAMES_PER_S / speed)
    try:
        with Live(refresh_per_second=2 * FRAMES_PER_S) as live:
            for text in texts:
                live.update(text)
                time.sleep(1.0 / FRAMES_PER_S)
    except KeyboardInterrupt:
        return
