"""Commands that the guided set-up runs: each is one that the command line takes."""

import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.documentation import parse
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.common.rig.rig import load_rig
from zenocap.tools.cli import setup_steps
from zenocap.tools.cli.options import DONE
from zenocap.tools.setup.cameras.away import write_away
from zenocap.tools.setup.network import Network
from zenocap.tools.setup.state import CALIBRATION, RIG, Cameras, next_step, read_cameras, write_cameras

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
        (setup_steps.calibrate, AWAY, ["w", "lenses.toml", 1.75, "", ""], ["film", "calibrate walk"]),
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

    def command(*words: str) -> int:
        if words[0] == "film" and known is AWAY:
            write_away(Path("walk"), {"hall": ("hall", "/films/walk")})
        lines.append(words)
        return DONE

    def prompt(text: str, **_: object) -> object:
        if "copied" in text:  # by the one who is asked
            for file in (Path("walk/videos/hall.mkv"), Path("walk/times/hall.csv")):
                file.parent.mkdir()
                file.touch()
        return next(given)

    monkeypatch.chdir(tmp_path)
    Path("lenses.toml").touch()
    for film in ("board", "walk"):
        Path(film).mkdir()
    monkeypatch.setattr(setup_steps, "_command", command)
    monkeypatch.setattr("typer.prompt", prompt)
    monkeypatch.setattr("typer.confirm", lambda *_, **__: True)
    step(tmp_path, known)
    assert list(given) == []
    assert all("--fetch" not in words for words in lines)  # what is not secured leaves no machine by itself
    for words, command in zip(lines, commands, strict=True):
        assert " ".join(words).startswith(f"{command} ")
        parse(shlex.join(("zenocap", *words)))
    network = [word for words in lines for word in words if word in ("--mode", "--connect", "--config")]
    assert len(set(network)) == (3 if known is AWAY and "film" in commands else 0)


def test_a_calibration_with_other_names_and_another_shape_is_matched_by_asking(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second camera of the file is the first of the set-up; its images are 4:3, and 1280 x 720 was requested."""
    one, two = paper_cameras((640, 480))
    file = tmp_path / "lenses.toml"
    write_calibration(file, {"hall": replace(one, name="hall"), "wall": replace(two, name="wall")})
    known = Cameras({"left": "/dev/video0", "right": "/dev/video2"}, looked=True)
    folder = tmp_path / "studio"
    write_cameras(folder, known)
    answers = iter(["f", str(file), "door", "wall", "hall"])  # a wrong name is asked again
    asked: list[str] = []

    def command(*words: str) -> int:
        Path(words[words.index("-o") + 1]).write_bytes(file.read_bytes())
        return DONE

    monkeypatch.setattr(setup_steps, "_command", command)
    monkeypatch.setattr("typer.prompt", lambda *_, **__: next(answers))
    monkeypatch.setattr("typer.confirm", lambda text, **_: bool(asked.append(text)) or True)
    setup_steps.calibrate(folder, known)
    assert list(answers) == []
    assert asked == [
        "the calibration is for images of 640 x 480, of another shape than the 1280 x 720 that are requested from the "
        "cameras; request 640 x 480?"
    ]
    calibrated = read_calibration(folder / CALIBRATION)
    assert list(calibrated) == ["left", "right"]
    assert calibrated["left"].centre == pytest.approx(two.centre, abs=1e-6)
    found = read_cameras(folder)
    assert found is not None
    assert found.size == (640, 480)
    assert next_step(folder) == "rig"
    setup_steps.write_rig(folder, found)
    assert [viewer.camera.size for viewer in load_rig(folder / RIG).viewers] == [(640, 480)] * 2
