"""The live page: pictures and measures of its cameras, access, pages that are slow."""

import asyncio
import base64
import json
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

import cv2
import numpy as np
import pytest

from tests.common.web.test_server import fetched, talk, updates_of
from tests.support.live_cameras import at_once, camera_of, paced, picture, running, until
from zenocap.common.errors import OpenError, UserError
from zenocap.common.rig.animator import PageTable
from zenocap.tools.cli.live_page import page_table
from zenocap.tools.setup.page.page import CamerasOnly, LivePage, wait_for_images

TOKEN = "a-token-of-sixteen-letters"


@contextmanager
def served(cameras, table=None, mode=None) -> Iterator[LivePage]:
    """A page that runs in a thread."""
    page, ended = LivePage(cameras, table or PageTable(port=0), "zenocap test", mode or CamerasOnly()), threading.Event()
    page.open()
    thread = threading.Thread(target=page.run, args=(ended.is_set,), daemon=True)
    with closing(page), running(*cameras):
        thread.start()
        try:
            yield page
        finally:
            ended.set()
            thread.join(5.0)


async def updates_until_all(connection, *wanted):
    found = []
    while not set(wanted) <= {(one["type"], one.get("camera")) for one in found}:
        found += await updates_of(connection)
    return found


def test_a_page_gets_pictures_and_measures_of_all_cameras():
    cameras = [camera_of(lambda: paced(picture, 20.0), name) for name in ("left", "right")]
    with served(cameras) as page:
        wanted = [(kind, name) for kind in ("picture", "state") for name in ("left", "right")]
        found = talk(page.address, lambda connection: updates_until_all(connection, *wanted))
    hello = next(one for one in found if one["type"] == "hello")
    assert [(one["name"], one["expected"]) for one in hello["cameras"]] == [("left", None), ("right", None)]
    shown = next(one for one in found if one["type"] == "picture")
    assert (shown["width"], shown["height"], shown["corners"]) == (96, 64, None)
    image = cv2.imdecode(np.frombuffer(base64.b64decode(shown["jpeg"]), np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(image.astype(int) - picture()).mean() < 8
    state = next(one for one in found if one["type"] == "state")
    assert {row["key"] for row in state["rows"]} == {"rate", "jitter", "focus", "exposure", "noise", "drift", "flicker"}


def test_a_page_that_opens_later_gets_the_one_picture_of_a_source_that_gives_no_other():
    camera = camera_of(lambda: paced(picture, 20.0, count=1))
    with served([camera]) as page:
        until(lambda: page._shown["left"].frame is not None, "the picture")
        found = talk(page.address, lambda connection: updates_until_all(connection, ("picture", "left")))
    assert any(one["type"] == "picture" for one in found)


@pytest.mark.nightly
def test_pictures_are_reduced_until_a_page_enlarges_the_camera():
    images = [picture(k, size=(1280, 720)) for k in range(2)]
    camera = camera_of(lambda: paced(lambda k: images[k % 2], 20.0))

    async def sizes(connection):
        found = []
        for command in ("", "left", ""):
            await connection.send(json.dumps({"type": "enlarge", "camera": command}))
            await asyncio.sleep(0.4)
            for _ in range(6):
                for one in await updates_of(connection):
                    if one["type"] == "picture":
                        last = cv2.imdecode(np.frombuffer(base64.b64decode(one["jpeg"]), np.uint8), cv2.IMREAD_COLOR)
            found.append(last.shape[1])
        return found

    with served([camera]) as page:
        assert talk(page.address, sizes) == [640, 1280, 640]


def test_files_of_the_page_and_nothing_else_are_served_to_those_with_the_token():
    with served([]) as page:
        for name in ("", "main.js", "camera_card.js", "live.css", "base.css", "connection.js", "icon.svg"):
            status, headers, body = fetched(page.address + name)
            assert status == 200, name
            assert "default-src 'none'" in headers["Content-Security-Policy"]
            assert body
        assert fetched(page.address + "page.py")[0] == 404
        assert fetched(page.address, Host="evil.example")[0] == 403
    with served([], PageTable(port=0, token=TOKEN)) as page:
        assert fetched(page.address)[0] == 200
        assert fetched(page.address.partition("?")[0])[0] == 403


@pytest.mark.parametrize(
    ("host", "token", "text"),
    [
        ("0.0.0.0", None, "--host 0.0.0.0: allowed: an address of this machine only.* or any together with --token"),
        ("127.0.0.1", "short", "16 to 128 letters"),
    ],
)
def test_an_open_page_needs_a_long_token(host, token, text):
    with pytest.raises(UserError, match=text):
        page_table(host, 0, token)
    assert len(page_table(host, 0, "new").token) >= 16


def test_an_unknown_command_is_answered_and_the_page_lives():
    async def act(connection):
        await connection.send('{"type":"calibrate"}')
        found = []
        while not any(one["type"] == "notice" for one in found):
            found += await updates_of(connection)
        return [one["text"] for one in found if one["type"] == "notice"]

    with served([camera_of(lambda: paced(picture))]) as page:
        assert talk(page.address, act) == ["this page shows the cameras only"]


@pytest.mark.slow
def test_a_command_ends_when_no_camera_opens():
    def refused():
        raise OpenError("camera 0: no such camera")
        yield

    left, right, one = camera_of(refused, "left"), camera_of(refused, "right"), camera_of(lambda: at_once(picture, 3))
    with running(left, right), pytest.raises(OpenError, match="no such camera"):
        wait_for_images([left, right], lambda: False, 5.0)
    with running(one):
        wait_for_images([left, one], lambda: False, 5.0)
        until(lambda: one.newest is not None, "an image")
