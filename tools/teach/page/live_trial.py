"""Recognition of a running rig's poses with the page's model, beside the rig's own recognizer."""

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable

from zenocap.common.bus.protocol import Bus, BusError, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.messages import Posture
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.clock import RealClock
from zenocap.services.recognizer.commands import confidence_of
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.shell import SOURCES, setup_for_poses
from zenocap.services.recognizer.step import RecognizerSetup, RecognizerState, initial_state, step
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.parameters import LIVE_PERIOD_S, LIVE_SHOWN, LIVE_SILENT_S, LIVE_WAIT_S

OpenBus = Callable[[Callable[[], bool]], Bus]
NO_POSES = "no poses come from rig {name}: is it running, and has the tracker found a person?"


class LiveTrial:
    """Recognizes in a thread from `start` to `stop`.  publish: gets what the page shows, from that thread.

    open_bus: joins the network of the rig; its argument is true once it should give up.
    """

    def __init__(self, rig: Rig, publish: Callable[[pm.LiveUpdate], None], open_bus: OpenBus) -> None:
        self.name = rig.name
        self._rig, self._publish, self._open_bus = rig, publish, open_bus
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def running(self) -> bool:
        """Whether it recognizes, or is about to."""
        return self._thread is not None and self._thread.is_alive() and not self._ended.is_set()

    def start(self, model: PostureModel) -> None:
        """Recognize with a model, in place of the one before.  Raises UserError for a model that does not fit."""
        try:
            setup = setup_for_poses(self._rig, model)
        except ValueError as error:
            raise UserError(f"rig {self.name}: {error}") from error
        self.stop()
        ended = self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(setup, ended), name="live-trial", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; the page shows that it is off."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(10.0)
            self._thread = None
            self._publish(pm.LiveUpdate("off"))

    def _run(self, setup: RecognizerSetup, ended: threading.Event) -> None:
        self._publish(pm.LiveUpdate("running", f"connecting to rig {self.name} …"))
        try:
            bus = self._open_bus(ended.is_set)
            try:
                bus.subscribe(SOURCES[setup.source])
                self._recognize(setup, bus, ended)
            finally:
                bus.close()
        except (BusError, UserError) as error:
            if not ended.is_set():
                self._publish(pm.LiveUpdate("failed", str(error)))
        except Exception as error:  # a bug: the page must not look as if it still recognized
            self._publish(pm.LiveUpdate("failed", f"{type(error).__name__}: {error}"))
            raise

    def _recognize(self, setup: RecognizerSetup, bus: Bus, ended: threading.Event) -> None:
        state, shown = initial_state(setup), _ShownPostures()
        posed_s, published_s, before, fits = time.monotonic(), 0.0, pm.LiveUpdate("off"), True
        while not ended.is_set():
            event = bus.receive(LIVE_WAIT_S)
            now_s = time.monotonic()
            if isinstance(event, Envelope):
                others = state.counts.get("other_body", 0)
                state, messages = step(setup, state, event)
                posed_s, fits = now_s, state.counts.get("other_body", 0) == others
                shown.add(one for one in messages if isinstance(one, Posture))
            if now_s - published_s >= LIVE_PERIOD_S:
                published_s = now_s
                update = shown.update(self._state_text(state, now_s - posed_s, fits))
                if update != before:
                    before = update
                    self._publish(update)

    def _state_text(self, state: RecognizerState, silent_s: float, fits: bool) -> str:
        """fits: the latest pose has the body model that the rig file names."""
        if silent_s > LIVE_SILENT_S:
            return NO_POSES.format(name=self.name)
        if not fits:
            return f"the poses of rig {self.name} are of another body model than it says: is it running with this rig file?"
        if state.stream.last_ns < 0:
            return "waiting for poses"
        return "the person is lost" if state.lost else "recognizing"


class _ShownPostures:
    """The latest postures, newest first, and how often each was recognized."""

    def __init__(self) -> None:
        self._latest: deque[pm.LiveEntry] = deque(maxlen=LIVE_SHOWN)
        self._counts: Counter[str] = Counter()
        self._number = 0

    def add(self, postures: Iterable[Posture]) -> None:
        for posture in postures:
            if posture.label is None:
                continue
            self._counts[posture.label] += 1
            self._number += 1
            confidence = round(confidence_of(posture.score, posture.margin, len(posture.log_likelihoods)), 3)
            duration_s = round((posture.end_ns - posture.start_ns) / 1e9, 2)
            self._latest.appendleft(pm.LiveEntry(self._number, posture.label, confidence, duration_s))

    def update(self, text: str) -> pm.LiveUpdate:
        return pm.LiveUpdate("running", text, list(self._latest), sorted(self._counts.items()))


def live_trial(rig: Rig, options: ZenohOptions, publish: Callable[[pm.LiveUpdate], None]) -> LiveTrial:
    """The live trial of a rig that is reached with these options."""
    return LiveTrial(rig, publish, lambda ended: ZenohBus.open(options, rig.name, RealClock(), ended))
