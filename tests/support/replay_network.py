"""Player on a bus inside one process, with a clock that advances by waiting only."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from zenocap.common import messages as m
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.keyboard import Key, Keyboard
from zenocap.common.topics import TOPICS
from zenocap.tools.record.replay.consumers import Consumers
from zenocap.tools.record.replay.player import Player, Status
from zenocap.tools.record.replay.remap import Remapping
from zenocap.tools.record.replay.selection import ReplaySelection
from zenocap.tools.record.replay.shell import ReplayOptions, planned
from zenocap.tools.record.replay.timeline import Timeline

TODAY_NS = 1_800_000_000_000_000_000


class Timer:
    """Time advances by waiting."""

    def __init__(self, clock: ManualClock) -> None:
        self._clock = clock

    def until(self, due_ns: int) -> None:
        self._clock.set(max(due_ns, self._clock.now_ns()))


class ScriptedKeyboard(Keyboard):
    """Keys, each pressed in order once its expected status is reached."""

    def __init__(self, keys: list[tuple[Callable[[Status], bool], Key]]) -> None:
        super().__init__(None)
        self.keys = keys
        self.player: Player | None = None

    def pressed(self) -> list[Key]:
        if self.player is not None and self.keys and self.keys[0][0](self.player.status):
            return [self.keys.pop(0)[1]]
        return []


@dataclass
class Received:
    """Messages received by a subscriber, with their clock times."""

    envelopes: list[Envelope] = field(default_factory=list)

    @property
    def messages(self) -> list[m.Message]:
        return [each.message for each in self.envelopes]

    @property
    def times_ns(self) -> list[int]:
        return [each.received_ns - TODAY_NS for each in self.envelopes]

    def of(self, kind: type[m.Message], viewer: str | None = None) -> list[m.Message]:
        return [each for each in self.messages if isinstance(each, kind) and getattr(each, "viewer", None) == viewer]


@dataclass
class ReplayNetwork:
    """A network, a player's bus and a subscriber to everything."""

    clock: ManualClock = field(default_factory=lambda: ManualClock(TODAY_NS))

    def play(
        self, paths: list[Path], *, keys: list[tuple[Callable[[Status], bool], Key]] | None = None, laps: int = 0,
        rate: float = 1.0, paused: bool = False, **options: object,
    ) -> tuple[Received, Player]:  # fmt: skip
        """laps: number of repetitions before stopping; 0 to play to the end."""
        chosen = {"selection": ReplaySelection(), "remapping": Remapping()} | options
        plan = planned(Timeline(paths), ReplayOptions(**chosen))
        network = LocalNetwork(next(iter(plan.keys.values())).split("/")[1], self.clock)
        bus, reader = network.bus(), network.bus()
        for topic in TOPICS:
            reader.subscribe(topic, every=True)
        keyboard = ScriptedKeyboard(list(keys or []))
        player = Player(
            bus, self.clock, Timer(self.clock), plan, Consumers(bus, frozenset()), keyboard, lambda status: None,
            rate=rate, paused=paused, now=bool(options.get("now")),
        )  # fmt: skip
        keyboard.player = player
        player.run(lambda: bool(laps) and player.status.lap > laps)
        assert not keyboard.keys
        return Received(list(self._received(reader))), player

    def _received(self, bus: LocalBus) -> Iterator[Envelope]:
        while isinstance(event := bus.receive(), Envelope):
            yield event
