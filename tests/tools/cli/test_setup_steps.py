"""Commands that the guided set-up runs: each is one that the command line takes."""

import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.documentation import parse
from zenocap.tools.cli import setup_steps
from zenocap.tools.cli.options import DONE
from zenocap.tools.setup.network import Network
from zenocap.tools.setup.state import Cameras

HERE = Cameras({"left": "/dev/video0", "right": "rtsp://user:secret@192.168.1.20/stream"}, (640, 480), 25.0)
AWAY = Cameras(
    {"left": "/dev/video0", "hall": "discover:hall/cam01"},
    network=Network("client", ("tcp/192.168.1.10:7447",), config="/zenoh.json5", multicast_scouting=False),
)


def take(folder: Path, _: Cameras) -> None:
    setup_steps.take(folder, 12.0)


@pytest.mark.parametrize(
    ("step", "known", "answers", "commands"),
    [
        (setup_steps.look, HERE, [], ["cameras"]),
        (setup_steps.look, AWAY, [], ["cameras"]),
        (setup_steps.calibrate, HERE, ["b", 35.0], ["calibrate board"]),
        (setup_steps.calibrate, AWAY, ["b", 35.0, ""], ["film", "calibrate board"]),
        (setup_steps.calibrate, HERE, ["w", "lenses.toml", 1.75, ""], ["film", "calibrate walk"]),
        (setup_steps.calibrate, AWAY, ["w", "lenses.toml", 1.75, ""], ["film", "calibrate walk"]),
        (setup_steps.calibrate, HERE, ["f", "lenses.toml"], ["calibrate convert"]),
        (take, HERE, [""], ["up"]),
    ],
)
def test_the_commands_of_a_step_are_parsed(
    step: Callable[[Path, Cameras], None], known: Cameras, answers: list[object], commands: list[str],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    lines: list[tuple[str, ...]] = []
    given = iter(answers)
    monkeypatch.chdir(tmp_path)
    Path("lenses.toml").touch()
    for film in ("board", "walk"):
        Path(film).mkdir()
    monkeypatch.setattr(setup_steps, "_command", lambda *words: lines.append(words) or DONE)
    monkeypatch.setattr("typer.prompt", lambda *_, **__: next(given))
    monkeypatch.setattr("typer.confirm", lambda *_, **__: True)
    step(tmp_path, known)
    assert list(given) == []
    for words, command in zip(lines, commands, strict=True):
        assert " ".join(words).startswith(f"{command} ")
        parse(shlex.join(("zenocap", *words)))
    network = [word for words in lines for word in words if word in ("--mode", "--connect", "--config")]
    assert len(set(network)) == (3 if known is AWAY and "film" in commands else 0)
