"""Running pages of set-up and teaching under hostile commands: handled, or refused with a reason."""

import asyncio
import json
import logging
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TypeVar

import msgspec
import msgspec.inspect as mi
import pytest
from websockets.asyncio.client import ClientConnection

from tests.common.web.test_server import first_list, talk
from tests.support.board_bursts import SimulatedSearch, simulated
from tests.support.board_views import BOARD
from tests.support.hostile import drawn
from tests.support.live_cameras import at_once, camera_of, paced, picture, until
from tests.support.message_strategies import values
from tests.support.posture_takes import posture_spans, posture_take
from tests.support.room_pictures import marked_picture
from tests.system.browser.test_postures import served as served_postures
from tests.tools.setup.page.test_live_page import served as served_cameras
from tests.tools.setup.page.test_live_page import updates_until_all
from tests.tools.setup.page.test_points_scene import CAMERAS, LENSES, NAMES
from zenocap.common.web.page import Page
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.tools.setup.calibration.board_calibration import BoardCalibration
from zenocap.tools.setup.page import board_mode
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page.board_mode import BoardMode
from zenocap.tools.setup.page.camera import LiveCamera
from zenocap.tools.setup.page.point_messages import PointCommand
from zenocap.tools.setup.page.points_mode import PointsMode
from zenocap.tools.setup.page.points_scene import ScenePointTask
from zenocap.tools.teach.page import messages as pm

pytestmark = pytest.mark.nightly
C = TypeVar("C")
COMMANDS = 250
BATCH = 16  # commands that are sent before the page has handled those before: fewer than may wait
NO_COMMANDS = ("", "null", "[]", "{}", "[" * 3000, "\0", "1e999", '{"type":"x"}', '{"type":["add"]}')


def hostile_texts(kinds: object, known: Sequence[object], number: int) -> Iterator[str]:
    """Valid commands with random content, some of it known to the page; damaged copies; and what is no command."""
    rng = random.Random(number)
    for command in drawn(values(mi.type_info(kinds)), COMMANDS, number):
        fields = msgspec.to_builtins(command)
        for name, value in fields.items():
            alike = [one for one in known if type(one) is type(value)]
            if name != "type" and alike and rng.random() < 0.7:
                fields[name] = rng.choice(alike)
        text = json.dumps(fields)
        place = rng.randrange(len(text))
        yield from (text, text[:place], f"{text[:place]}{chr(rng.randrange(32, 0x250))}{text[place + 1 :]}")
    yield from NO_COMMANDS


def attack(page: Page[C], address: str, texts: Iterator[str]) -> None:
    """Send all of them, and wait until they are handled."""
    handled: Callable[[], bool] = page._commands.empty

    async def send(connection: ClientConnection) -> None:
        for number, text in enumerate(texts):
            await connection.send(text)
            while number % BATCH == 0 and not handled():
                await asyncio.sleep(0.005)

    talk(address, send)
    until(handled, "the end of the commands")


def failures(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR]


@pytest.mark.parametrize("number", range(2))
def test_the_page_of_postures_outlasts_hostile_commands(
    number: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    manifest, (name, start_s, end_s) = tmp_path / "examples.csv", posture_spans()[0]
    valid = msgspec.json.encode(pm.AddLabel(0, start_s, end_s, name)).decode()
    known = ("kick", "anna", "", 0, 1, 2, 0.0, 1.5, 3.0, 6.0)
    with served_postures(posture_take(tmp_path / "monday.mcap"), manifest) as page:
        attack(page._page, page.address, hostile_texts(pm.Command, known, number))
        assert "hello" in talk(page.address, first_list)
        assert failures(caplog) == []
        attack(page._page, page.address, iter([valid]))
        until(manifest.is_file, "the file of the labels")
    assert read_manifest(manifest)  # whatever was labelled can be read


@pytest.mark.parametrize("number", range(2))
def test_the_page_of_points_outlasts_hostile_commands(
    number: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    cameras = [camera_of(lambda name=name: at_once(lambda _: marked_picture(CAMERAS[name]), 1), name) for name in NAMES]
    mode = PointsMode(cameras, ScenePointTask(NAMES, tmp_path / "points.toml", tmp_path / "room.toml", LENSES))
    known = (*NAMES, "door", "corner", 0.0, 1.0, None)
    with closing(mode), served_cameras(cameras, mode=mode) as page:
        attack(page._page, page.address, hostile_texts(PointCommand, known, number))
        assert "hello" in talk(page.address, first_list)
        assert failures(caplog) == []


@pytest.mark.parametrize("number", range(2))
def test_the_page_of_cameras_outlasts_hostile_commands(number: int, caplog: pytest.LogCaptureFixture) -> None:
    names = ("left", "right")
    with served_cameras([camera_of(lambda: paced(picture), name) for name in names]) as page:
        attack(page._page, page.address, hostile_texts(lm.Command, (*names, ""), number))
        talk(page.address, lambda connection: updates_until_all(connection, *(("picture", name) for name in names)))
        assert failures(caplog) == []


@pytest.mark.parametrize("seconds", [0, 18])  # of views of the board
def test_the_page_of_a_board_outlasts_hostile_commands(
    seconds: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """All but the one that ends it: with views of the board a calibration runs, and is written."""
    monkeypatch.setattr(board_mode, "BURST_PERIOD_S", 0.0)
    monkeypatch.setattr(board_mode, "WAIT_S", 0.005)
    monkeypatch.setattr(LiveCamera, "period_s", 1 / 15.0)
    image, names, written = picture(size=(1280, 720)), ("cam01", "cam02"), list[BoardCalibration]()
    cameras = [camera_of(lambda: paced(lambda _: image, 10.0), name) for name in names]
    search = SimulatedSearch(simulated(2, 18.0), end=seconds)

    def write(found: BoardCalibration) -> str:
        written.append(found)
        return "calibration.toml"

    kinds = lm.Enlarge | lm.Anew | lm.Settle | lm.Calibrate | lm.Floor | lm.Discard | PointCommand
    mode = BoardMode(cameras, BOARD, 0, write, search=search)
    with closing(mode), served_cameras(cameras, mode=mode) as page:
        until(lambda: search.second >= seconds, "the views")
        attack(page._page, page.address, iter(['{"type":"calibrate"}']))
        attack(page._page, page.address, hostile_texts(kinds, (*names, ""), seconds))
        assert "hello" in talk(page.address, first_list)
        until(lambda: not mode._busy, "the end of the calibration")
        assert failures(caplog) == []
        assert len(written) >= bool(seconds)
        attack(page._page, page.address, iter(['{"type":"finish"}']))
        until(lambda: mode.finished, "the end")
