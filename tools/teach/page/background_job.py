"""Work that takes longer, in a thread; its result is handled by the thread of the page."""

import queue
import threading
from collections.abc import Callable

Finish = Callable[[], None]
"""What follows a job, in the thread of the page."""


class BackgroundJob:
    """At most one job at a time.  failed: called with the text of an unexpected error, in the thread of `turn`."""

    def __init__(self, failed: Callable[[str], None]) -> None:
        self._failed = failed
        self._thread: threading.Thread | None = None
        self._done: queue.Queue[Finish] = queue.Queue()

    @property
    def busy(self) -> bool:
        """Whether a job runs, or its result is not handled yet."""
        return self._thread is not None

    def start(self, job: Callable[[], Finish]) -> None:
        """Run a job in a thread; `turn` calls what it returns."""

        def run() -> None:
            finish: Finish | None = None
            try:
                finish = job()
            except Exception as error:
                text = f"{type(error).__name__}: {error}"
                finish = lambda: self._failed(text)  # noqa: E731
                raise
            finally:
                self._done.put(lambda: self._finish(finish))

        self._thread = threading.Thread(target=run, name="training", daemon=True)
        self._thread.start()

    def turn(self) -> bool:
        """Handle what the thread has finished; returns whether there was anything."""
        busy = False
        while not self._done.empty():
            self._done.get()()
            busy = True
        return busy

    def _finish(self, finish: Finish | None) -> None:
        self._thread = None
        if finish is not None:
            finish()
