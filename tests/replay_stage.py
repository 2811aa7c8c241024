"""A player on a bus inside one process, on a clock that only waiting moves, and a reader of everything."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from common import messages as m
from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Envelope
from common.runtime.clock import ManualClock
from common.runtime.keys import Key, Keyboard
from common.topics import TOPICS
from services.takes.replay.consumers import Consumers
from services.takes.replay.player import Player, Status
from services.takes.replay.renaming import Renaming
from services.takes.replay.selection import Selection
from services.takes.replay.shell import Wishes, planned
from services.takes.replay.timeline import Timeline

TODAY_NS = 1_800_000_000_000_000_000


class Waiting:
    """Time passes when it is waited for."""

    def __init__(self, clock: ManualClock) -> None:
        self._clock = clock

    def until(self, due_ns: int) -> None:
        self._clock.set(max(due_ns, self._clock.now_ns()))


class Pressed(Keyboard):
    """Keys pressed once the status is what each waits for, in order."""

    def __init__(self, keys: list[tuple[Callable[[Status], bool], Key]]) -> None:
        super().__init__(None)
        self.keys = keys
        self.player: Player | None = None

    def pressed(self) -> list[Key]:
        if self.player is not None and self.keys and self.keys[0][0](self.player.status):
            return [self.keys.pop(0)[1]]
        return []


@dataclass
class Heard:
    """What a reader heard, and when on the clock."""

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
class Stage:
    """A network, a player's bus and a reader of everything."""

    clock: ManualClock = field(default_factory=lambda: ManualClock(TODAY_NS))

    def play(
        self,
        paths: list[Path],
        *,
        keys: list[tuple[Callable[[Status], bool], Key]] | None = None,
        laps: int = 0,
        rate: float = 1.0,
        paused: bool = False,
        **wishes: object,
    ) -> tuple[Heard, Player]:
        """laps: to stop after; 0 to play to the end."""
        chosen = {"selection": Selection(), "renaming": Renaming()} | wishes
        plan = planned(Timeline(paths), Wishes(**chosen))
        network = LocalNetwork(next(iter(plan.keys.values())).split("/")[1], self.clock)
        bus, reader = network.bus(), network.bus()
        for topic in TOPICS:
            reader.subscribe(topic, every=True)
        keyboard = Pressed(list(keys or []))
        player = Player(
            bus, self.clock, Waiting(self.clock), plan, Consumers(bus, frozenset()), keyboard, lambda status: None,
            rate=rate, paused=paused, now=bool(wishes.get("now")),
        )  # fmt: skip
        keyboard.player = player
        player.run(lambda: bool(laps) and player.status.lap > laps)
        assert not keyboard.keys
        return Heard(list(self._received(reader))), player

    def _received(self, bus: LocalBus) -> Iterator[Envelope]:
        while isinstance(event := bus.receive(), Envelope):
            yield event
