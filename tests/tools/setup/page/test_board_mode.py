"""The page of the board: it collects, refuses what is in pieces, calibrates, and writes."""

from contextlib import ExitStack, closing

import msgspec
import pytest

from tests.support.board_bursts import SimulatedSearch, simulated
from tests.support.board_views import BOARD
from tests.support.live_cameras import at_once, camera_of, paced, picture, running, until
from zenocap.common.errors import UserError
from zenocap.tools.setup.page import board_mode
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page.board_mode import BoardMode
from zenocap.tools.setup.page.board_search import Burst
from zenocap.tools.setup.page.camera import LiveCamera

SIZE = (1280, 720)


@pytest.fixture
def cameras():
    """Two that give images of the simulated size; what they show is not searched."""
    image = picture(size=SIZE)
    found = [camera_of(lambda: paced(lambda k: image, 10.0), name) for name in ("cam01", "cam02")]
    with running(*found):
        until(lambda: all(one.newest is not None for one in found), "images")
        yield found


@pytest.fixture
def mode_of(monkeypatch):
    """Function of cameras, search, and a list of the written calibrations: the mode, closed at the end."""
    monkeypatch.setattr(board_mode, "BURST_PERIOD_S", 0.0)
    monkeypatch.setattr(board_mode, "WAIT_S", 0.005)
    monkeypatch.setattr(LiveCamera, "period_s", 1 / 15.0)
    with ExitStack() as modes:

        def make(cameras, search, written=None):
            def write(found):
                written.append(found)
                return "calibration.toml"

            return modes.enter_context(closing(BoardMode(cameras, BOARD, 0, write, search=search)))

        yield make


def update_of(mode):
    return msgspec.json.decode(msgspec.json.encode(mode._update()))


def result_of(mode):
    until(lambda: update_of(mode)["result"] is not None, "the result")
    return update_of(mode)["result"]


@pytest.mark.nightly
def test_it_guides_and_then_calibrates_as_from_videos(cameras, mode_of):
    written = []
    search = SimulatedSearch(simulated(2, 18.0), end=18)
    mode = mode_of(cameras, search, written)
    until(lambda: search.second >= 18, "all seconds")
    found = update_of(mode)
    assert found["missing"] == []
    assert found["edges"][0]["enough"]
    assert all(one["coverage"] > 0.3 for one in found["cameras"])
    mode.receive(lm.Calibrate())
    with pytest.raises(UserError, match="runs already"):
        mode.receive(lm.Calibrate())
    with pytest.raises(UserError, match="the calibration runs: Discard when it is done"):
        mode.receive(lm.Discard())
    result = result_of(mode)
    assert result["verdict"] == "poor"  # the floor is unknown
    assert any("floor" in reason for reason in result["reasons"])
    assert result["written"] == "calibration.toml"
    assert [one.camera.name for one in written[0].cameras] == ["cam01", "cam02"]
    assert written[0].error_m < 0.005
    mode.receive(lm.Finish())
    assert mode.finished


@pytest.mark.nightly
def test_a_calibration_in_pieces_is_refused_with_the_name_of_the_missing_camera(cameras, mode_of):
    def apart(*_):
        burst, number = search(), search.second % 2
        views, moment = ({k: one for k, one in part.items() if k == number} for part in (burst.views, burst.moment))
        return Burst(views, moment, burst.looks)

    search = SimulatedSearch(simulated(2, 20.0), end=0)
    mode = mode_of(cameras, apart)
    with pytest.raises(UserError, match="not yet: cam01, cam02 has not seen the board"):
        mode.receive(lm.Calibrate())
    search.end = 20
    until(lambda: search.second >= 20, "all seconds")
    with pytest.raises(UserError, match="cam02 is not connected with cam01"):
        mode.receive(lm.Calibrate())
    assert update_of(mode)["missing"] == ["cam02"]


@pytest.mark.nightly
def test_a_calibration_that_fails_says_why_and_the_page_goes_on(cameras, mode_of, monkeypatch):
    def failing(*_, **__):
        raise UserError("no lens fits")

    search = SimulatedSearch(simulated(2, 30.0), end=30)
    mode = mode_of(cameras, search)
    monkeypatch.setattr(board_mode, "calibrated_rig", failing)
    until(lambda: search.second >= 30, "all seconds")
    mode.receive(lm.Calibrate())
    assert result_of(mode)["reasons"] == ["no lens fits"]
    assert mode.result is None
    mode.receive(lm.Discard())
    assert all(one["moments"] == 0 for one in update_of(mode)["cameras"])


@pytest.mark.slow
def test_the_reason_why_no_board_is_found_is_told(mode_of, monkeypatch):
    monkeypatch.setattr(board_mode, "WHY_PERIOD_S", 0.05)
    camera = camera_of(lambda: at_once(lambda k: picture(level=5.0, noise=1.0), 5))
    with running(camera):
        until(lambda: camera.looks == 5, "images")
        mode = mode_of([camera], SimulatedSearch([], end=0))
        until(lambda: "too dark" in update_of(mode)["sentence"], "the reason")


def test_a_search_that_fails_is_told_and_goes_on(mode_of):
    calls = []

    def failing(*_):
        calls.append(1)
        if len(calls) < 3:
            raise ValueError("no such picture")
        return Burst({}, {}, {})

    camera = camera_of(lambda: at_once(lambda k: picture(level=5.0, noise=1.0), 5))
    with running(camera):
        until(lambda: camera.looks == 5, "images")
        mode = mode_of([camera], failing)
        until(lambda: len(calls) >= 3, "a search after the failed ones")
    assert "searching it failed: no such picture" in update_of(mode)["sentence"]


def test_the_number_of_places_on_the_floor_is_limited(mode_of):
    mode = mode_of([], SimulatedSearch([], end=0))
    for _ in range(board_mode.MOST_FLOORS):
        mode.receive(lm.Floor())
    with pytest.raises(UserError, match="on the floor 20 times: allowed: no more"):
        mode.receive(lm.Floor())
    mode.receive(lm.Discard())
    mode.receive(lm.Floor())


def test_a_calibration_that_runs_is_not_lost_by_finish(mode_of):
    mode = mode_of([], SimulatedSearch([], end=0))
    mode._busy = "calibrating"
    with pytest.raises(UserError, match="the calibration runs"):
        mode.receive(lm.Finish())
    mode._busy = ""
    mode.receive(lm.Finish())
    assert mode.finished
