"""Playback of takes: commands of a page while messages arrive without end."""

from itertools import repeat
from pathlib import Path
from unittest.mock import Mock

from zenocap.common.bus.protocol import Alive
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.animator.playback import StopPlayer, TakePlayer

MANY = 10_000  # events


def test_a_flood_of_messages_keeps_no_page_from_stopping_a_take(tmp_path: Path) -> None:
    player = TakePlayer(tmp_path, Mock(pages=0), ManualClock(1), ())
    player.close()  # its thread, which would take the command
    player.send(StopPlayer())
    bus = Mock(receive=Mock(side_effect=[*repeat(Alive("viewer", "1", True, 1), MANY), None]))
    replay = Mock(running=True, status=None)
    assert player._show("take", bus, replay, 0.0, None) == StopPlayer()
    assert bus.receive.call_count < MANY
