"""The page of the board: it collects, refuses what is in pieces, calibrates, and writes."""

import msgspec
import pytest

from tests.support.board_bursts import SimulatedSearch, simulated
from tests.support.board_views import BOARD
from tests.support.live_cameras import at_once, camera_of, paced, picture, until
from zenocap.common.errors import UserError
from zenocap.tools.setup.page import board_mode
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page.board_mode import BoardMode

SIZE = (1280, 720)


@pytest.fixture
def cameras():
    """Two that give images of the simulated size; what they show is not searched."""
    image = picture(size=SIZE)
    found = [camera_of(lambda: paced(lambda k: image, 10.0), name) for name in ("cam01", "cam02")]
    for one in found:
        one.start()
    until(lambda: all(one.newest is not None for one in found), "images")
    yield found
    for one in found:
        one.stop()


def mode_of(cameras, search, monkeypatch, written=None, period_s=0.0) -> BoardMode:
    monkeypatch.setattr(board_mode, "BURST_PERIOD_S", period_s)
    monkeypatch.setattr(board_mode, "WAIT_S", 0.005)

    def write(found):
        (written if written is not None else []).append(found)
        return "calibration.toml"

    for camera in cameras:
        monkeypatch.setattr(type(camera), "period_s", 1 / 15.0, raising=False)
    return BoardMode(cameras, BOARD, 0, write, search=search)


def update_of(mode):
    return msgspec.json.decode(msgspec.json.encode(mode._update()))


@pytest.mark.nightly
def test_it_guides_and_then_calibrates_as_from_videos(cameras, monkeypatch):
    written = []
    search = SimulatedSearch(simulated(2, 18.0), end=18)
    mode = mode_of(cameras, search, monkeypatch, written)
    until(lambda: search.second >= 18, "all seconds")
    found = update_of(mode)
    assert found["missing"] == []
    assert found["edges"][0]["enough"]
    assert all(one["coverage"] > 0.3 for one in found["cameras"])
    mode.receive(lm.Calibrate())
    with pytest.raises(UserError, match="runs already"):
        mode.receive(lm.Calibrate())
    until(lambda: update_of(mode)["result"] is not None, "the result")
    result = update_of(mode)["result"]
    assert result["verdict"] == "poor"  # the floor is unknown
    assert any("floor" in reason for reason in result["reasons"])
    assert result["written"] == "calibration.toml"
    assert [one.camera.name for one in written[0].cameras] == ["cam01", "cam02"]
    assert written[0].error_m < 0.005
    mode.receive(lm.Finish())
    assert mode.finished
    mode.close()


@pytest.mark.nightly
def test_a_calibration_in_pieces_is_refused_with_the_name_of_the_missing_camera(cameras, monkeypatch):
    seen = simulated(2, 20.0)

    def apart(*_):
        burst = search()
        number = search.second % 2
        keep = lambda part: {k: one for k, one in part.items() if k == number}  # noqa: E731
        return type(burst)(keep(burst.views), keep(burst.moment), burst.looks)

    search = SimulatedSearch(seen, end=20)
    mode = mode_of(cameras, apart, monkeypatch)
    with pytest.raises(UserError, match="not yet: cam01, cam02 has not seen the board"):
        mode.receive(lm.Calibrate())
    until(lambda: search.second >= 20, "all seconds")
    with pytest.raises(UserError, match="cam02 is not connected with cam01"):
        mode.receive(lm.Calibrate())
    assert update_of(mode)["missing"] == ["cam02"]
    mode.close()


@pytest.mark.nightly
def test_a_calibration_that_fails_says_why_and_the_page_goes_on(cameras, monkeypatch):
    def failing(*_, **__):
        raise UserError("no lens fits")

    search = SimulatedSearch(simulated(2, 30.0), end=30)
    mode = mode_of(cameras, search, monkeypatch)
    monkeypatch.setattr(board_mode, "calibrated_rig", failing)
    until(lambda: search.second >= 30, "all seconds")
    mode.receive(lm.Calibrate())
    until(lambda: update_of(mode)["result"] is not None, "the result")
    assert update_of(mode)["result"]["reasons"] == ["no lens fits"]
    assert mode.result is None
    mode.receive(lm.Discard())
    assert all(one["moments"] == 0 for one in update_of(mode)["cameras"])
    mode.close()


@pytest.mark.slow
def test_the_reason_why_no_board_is_found_is_told(monkeypatch):
    monkeypatch.setattr(board_mode, "WHY_PERIOD_S", 0.05)
    camera = camera_of(lambda: at_once(lambda k: picture(level=5.0, noise=1.0), 5))
    camera.start()
    until(lambda: camera.looks == 5, "images")
    search = SimulatedSearch([], end=0)
    mode = mode_of([camera], search, monkeypatch)
    until(lambda: "too dark" in update_of(mode)["sentence"], "the reason")
    mode.close()
    camera.stop()
