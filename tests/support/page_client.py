"""A client of the animator's page."""

import asyncio
import json
from collections.abc import Callable

from websockets.asyncio.client import ClientConnection, connect

from tests.support.processes import PATIENCE_S

Updates = dict[str, dict[str, object]]  # the last of each type


async def connected(port: int) -> ClientConnection:
    """A connection to the page, once it is served."""
    while True:
        try:
            return await connect(f"ws://127.0.0.1:{port}/socket", compression=None)
        except OSError:
            await asyncio.sleep(0.1)


async def read_until(
    connection: ClientConnection, updates: Updates, condition: Callable[[Updates], object], text: str
) -> None:
    """Read updates until a condition holds."""

    async def read() -> None:
        while not condition(updates):
            for update in json.loads(await connection.recv()):
                updates[str(update["type"])] = update
            await connection.send('{"type":"acknowledge"}')

    try:
        await asyncio.wait_for(read(), PATIENCE_S)
    except TimeoutError:
        raise AssertionError(f"not seen: {text}; services {updates.get('rows')}, player {updates.get('player')}") from None
