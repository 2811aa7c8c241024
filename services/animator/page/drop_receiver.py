"""Takes dropped on a page: one at a time, on a socket of their own, refused before anything is stored.

The page sends the bytes of the file as messages of at most MAX_DROPPED_PIECE bytes; the answer is one line, "" for a take
that is opened.  What cannot be a take is refused by its name, its size and its first bytes.
"""

import asyncio
import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_records import MAGIC
from zenocap.common.recording.reader import TakeReader
from zenocap.common.topics import topic_at
from zenocap.services.animator import parameters as p

SUFFIX = ".mcap"


class DropReceiver:
    """Receives files into a private folder, which `close` removes.

    on_take: called with the path of a checked take, in the thread of the server.
    """

    def __init__(self, on_take: Callable[[Path], None]) -> None:
        self._on_take = on_take
        self._folder: Path | None = None
        self._kept: list[Path] = []
        self._busy = False

    async def receive(self, connection: ServerConnection) -> None:
        """Receive one file, answer, and close the connection."""
        if self._busy:
            answer = "refused: another take is being received"
        else:
            self._busy = True
            try:
                answer = await self._received(connection)
            except (UserError, TimeoutError) as error:
                answer = str(error).partition("\n")[0] or f"refused: no data for {p.DROPPED_PAUSE_S:g} s"
            except OSError as error:
                answer = f"the take cannot be stored: {error.strerror or error}"
            except ConnectionClosed:
                return
            finally:
                self._busy = False
        try:
            await connection.send(answer)
            await connection.close()
        except ConnectionClosed:
            pass

    def close(self) -> None:
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    async def _received(self, connection: ServerConnection) -> str:
        """Store and open a take; return "".  Raises UserError, OSError, TimeoutError and ConnectionClosed."""
        query = parse_qs(urlsplit(connection.request.path if connection.request else "").query)
        name, size = query.get("name", [""])[0], query.get("size", [""])[0]
        wanted = checked_size(name, size)
        piece = await self._piece(connection)
        if not piece.startswith(MAGIC):
            raise UserError(f"{name}: is no MCAP file: allowed: a take, recorded or made by zenocap track")
        folder = await asyncio.to_thread(self._new_folder, name, wanted)
        path, stored = folder / stored_name(name), False
        try:
            with path.open("wb") as file:
                count = 0
                while True:
                    count += len(piece)
                    if count > wanted:
                        raise UserError(f"{name}: more than the {wanted} bytes that were announced")
                    await asyncio.to_thread(file.write, piece)
                    if count == wanted:
                        break
                    piece = await self._piece(connection)
            await asyncio.to_thread(check_take, path)
            self._on_take(path)
            stored = True
        finally:
            if stored:
                self._kept.append(folder)
            else:
                shutil.rmtree(folder, ignore_errors=True)
        while len(self._kept) > p.KEPT_DROPS:
            shutil.rmtree(self._kept.pop(0), ignore_errors=True)
        return ""

    async def _piece(self, connection: ServerConnection) -> bytes:
        data = await asyncio.wait_for(connection.recv(), p.DROPPED_PAUSE_S)
        if isinstance(data, str) or not data:
            raise UserError("refused: not the bytes of a file")
        return data

    def _new_folder(self, name: str, size: int) -> Path:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="zenocap-dropped-"))
        free = shutil.disk_usage(self._folder).free
        if free < size + p.DROPPED_FREE_BYTES:
            spare = max(0, free - p.DROPPED_FREE_BYTES)
            raise UserError(
                f"{name}: {size / 1e6:.1f} MB: allowed: {spare / 1e6:.1f} MB, the space of {self._folder.parent}"
            )
        return Path(tempfile.mkdtemp(dir=self._folder))


def checked_size(name: str, size: str) -> int:
    """Size in bytes of a file that may be received.  Raises UserError."""
    if not name.lower().endswith(SUFFIX) or len(name) > 200:
        raise UserError(f"{name[:200]}: is no take: allowed: a file whose name ends with {SUFFIX}")
    if not re.fullmatch(r"\d{1,15}", size) or not 0 < int(size) <= p.MAX_DROPPED_BYTES:
        megabytes = f"{int(size) / 1e6:.1f} MB" if re.fullmatch(r"\d{1,15}", size) else "of unknown size"
        allowed = f"1 byte to {p.MAX_DROPPED_BYTES / 1e6:.0f} MB"
        raise UserError(f"{name}: {megabytes}: allowed: {allowed}; zenocap show opens larger takes")
    return int(size)


def stored_name(name: str) -> str:
    """Name of a file without what a path or a terminal could mistake."""
    stem = re.sub(r"[^\w .()+,=-]", "_", name[: -len(SUFFIX)]).strip(" .-")
    return f"{stem or 'take'}{SUFFIX}"


def check_take(path: Path) -> None:
    """Raise UserError for a file that is no take of zenocap: without one of its messages among the first ones."""
    for number, recorded in enumerate(TakeReader(path).messages()):
        if topic_at(recorded.topic) is not None:
            return
        if number >= p.MAX_FOREIGN_MESSAGES:
            break
    raise UserError(f"{path.name}: an MCAP file without messages of zenocap: allowed: a take")
