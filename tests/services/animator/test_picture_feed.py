"""Pictures behind a take: at a paused position, ahead of a playing one."""

import asyncio
import json
import threading
from collections.abc import Iterator

from zenocap.common.web.broadcast import Broadcaster, PageQueue
from zenocap.services.animator.picture_feed import PictureFeed

START_NS = 10**18


def test_pictures_of_a_playing_take_are_of_the_time_at_which_they_are_shown() -> None:
    loop = asyncio.new_event_loop()
    broadcaster = Broadcaster(loop, lambda: None, ("take",))
    page = PageQueue("take")
    broadcaster.add(page)
    asked: list[float] = []
    made = threading.Semaphore(0)

    def pictures(time_ns: int) -> Iterator[tuple[str, bytes]]:
        asked.append((time_ns - START_NS) / 1e9)
        threading.Event().wait(0.05)  # what decoding takes
        yield "1", b"jpeg"
        made.release()

    feed = PictureFeed(pictures, START_NS, broadcaster)
    for k in range(3):
        before = page.waiting.pop("preview/1", None)
        feed.show(10.0 * (k + 1), 0.0 if k == 2 else 2.0)
        assert made.acquire(timeout=20)
        while page.waiting.get("preview/1") in (None, before):
            loop.run_until_complete(asyncio.sleep(0.001))
        sent = json.loads(page.waiting["preview/1"])["position_s"]
        assert sent == asked[k] or abs(sent - asked[k]) < 1e-6
        while feed._lead_s == 0.0:
            loop.run_until_complete(asyncio.sleep(0.001))
    feed.close()
    loop.close()
    assert asked[0] == 10.0  # how long they take is not known yet
    assert 20.1 <= asked[1] <= 21.0
    assert asked[2] == 30.0  # paused
