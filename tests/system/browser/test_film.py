"""Chromium plays the films of `zenocap render` and `zenocap track --overlay`."""

import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.browser import visited
from tests.support.places import ROOT
from zenocap.common.formats.pose_track import Bound
from zenocap.tools.takes.render.film import RenderOptions, render

pytestmark = pytest.mark.nightly
TAKE = ROOT / "tests" / "golden" / "arms.mcap"
SIZE = (320, 240)
FILMS = {"h264.mp4": None, "vp9.mp4": "vp9", "vp9.webm": None}
NO_ICON = '<link rel="icon" href="data:,">'
PLAY = """async () => {
    const video = document.querySelector("video");
    video.muted = true;
    await video.play();
    while (video.currentTime < 0.3) await new Promise(done => setTimeout(done, 20));
    video.pause();
    const canvas = document.createElement("canvas");
    canvas.width = video.videoWidth; canvas.height = video.videoHeight;
    const context = canvas.getContext("2d");
    context.drawImage(video, 0, 0);
    const pixels = [...context.getImageData(0, 0, canvas.width, canvas.height).data];
    return {ready: video.readyState, width: video.videoWidth, height: video.videoHeight, seconds: video.duration, pixels};
}"""


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The films, an animated picture, and the picture at 0.3 s of them."""
    place = tmp_path_factory.mktemp("films")
    for name, codec in FILMS.items():
        options = RenderOptions(Bound(60), Bound(75), size=SIZE, codec=codec)  # type: ignore[arg-type]
        render(TAKE, place / name, options)
        (place / f"{name}.html").write_text(f'{NO_ICON}<video src="{name}"></video>')
    render(TAKE, place / "a.webp", RenderOptions(Bound(60), Bound(65), size=SIZE))
    (place / "a.webp.html").write_text(f'{NO_ICON}<img src="a.webp">')
    render(TAKE, place / "expected.png", RenderOptions(Bound(64), Bound(75), size=SIZE, captions=False))
    return place


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


@pytest.mark.parametrize("name", FILMS)
def test_chromium_plays_a_film(name: str, browser: object, address: str, folder: Path) -> None:
    with visited(browser, f"{address}/{name}.html") as visit:
        seen = visit.evaluate(PLAY)
    assert seen["ready"] >= 2  # it has the picture at the present position
    assert (seen["width"], seen["height"]) == SIZE
    assert seen["seconds"] == pytest.approx(16 / 15, abs=0.1)
    picture = np.array(seen["pixels"], dtype=np.uint8).reshape(SIZE[1], SIZE[0], 4)[..., 2::-1].astype(int)
    expected = cv2.imread(str(folder / "expected.png")).astype(int)
    corner = (slice(5, 40), slice(5, 40))  # background: colours arrive as they were drawn
    assert np.abs(picture[corner].mean(axis=(0, 1)) - expected[corner].mean(axis=(0, 1))).max() < 3
    orange = picture[..., 2] - picture[..., 0] > 60
    assert orange.sum() > 200  # the left limbs
    assert picture.std() > 20


def test_chromium_shows_an_animated_picture(browser: object, address: str) -> None:
    size = """async () => { const image = document.querySelector('img'); await image.decode();
        return [image.naturalWidth, image.naturalHeight]; }"""
    with visited(browser, f"{address}/a.webp.html") as visit:
        found = visit.evaluate(size)
    assert tuple(found) == SIZE
