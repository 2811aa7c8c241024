"""Takes that are dropped on a page: what is refused, and that nothing of it stays."""

import asyncio
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlencode

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.common.web.test_server import TOKEN, talk
from tests.support.animator_stand_in import StandIn, stand_in
from tests.support.pose_tracks import moving
from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_records import MAGIC
from zenocap.services.animator.page import drop_receiver as module
from zenocap.services.animator.page.drop_receiver import check_take, checked_size, stored_name
from zenocap.services.animator.parameters import KEPT_DROPS, MAX_DROPPED_BYTES, MAX_DROPPED_PIECE


@pytest.fixture
def take(tmp_path: Path) -> bytes:
    return write_take(tmp_path / "a.mcap", messages_of_track(moving(20))).read_bytes()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder for temporary files."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path / "tmp"


@pytest.fixture
def animator(tmp_path: Path, folder: Path) -> Iterator[StandIn]:
    with stand_in(tmp_path) as one:
        yield one


@pytest.fixture
def played(animator: StandIn, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Paths of the dropped takes that the animator plays."""
    found: list[Path] = []
    monkeypatch.setattr(animator.bridge._feed.player, "send", lambda command: found.append(command.path))
    return found


def address_of(animator: StandIn, name: str, size: int) -> str:
    base, _, query = animator.address.partition("?")
    return f"{base.replace('http', 'ws')}drop?{urlencode({'name': name, 'size': size})}&{query}"


def dropped(animator: StandIn, content: bytes, name: str = "my walk.mcap", size: int | None = None) -> str:
    async def run() -> str:
        address = address_of(animator, name, len(content) if size is None else size)
        async with connect(address, compression=None) as connection:
            with suppress(ConnectionClosed):  # refused before its end: the answer has come
                for at in range(0, len(content), MAX_DROPPED_PIECE):
                    await connection.send(content[at : at + MAX_DROPPED_PIECE])
            return str(await asyncio.wait_for(connection.recv(), 30))

    return asyncio.run(run())


def files_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_a_take_is_stored_in_a_private_folder_and_played(
    animator: StandIn, take: bytes, folder: Path, played: list[Path]
) -> None:
    for number in range(KEPT_DROPS + 1):
        assert dropped(animator, take) == ""
        assert len(played) == number + 1
    assert played[-1].read_bytes() == take
    assert played[-1].name == "my walk.mcap"
    assert played[-1].parent.stat().st_mode & 0o077 == 0
    assert len(files_in(folder)) == KEPT_DROPS
    animator.close()
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("walk.mp4", MAGIC, "walk.mp4: is no take: allowed: a file whose name ends with .mcap"),
        ("walk.mcap", b"not a take", "walk.mcap: is no MCAP file"),
        ("walk.mcap", MAGIC + bytes(3), "walk.mcap: an MCAP file without messages of zenocap"),
        ("walk.mcap", MAGIC + MAGIC, "walk.mcap: an MCAP file without messages of zenocap"),
    ],
    ids=["suffix", "first bytes", "cut", "empty"],
)
def test_what_is_no_take_is_one_line_and_leaves_nothing(
    name: str, content: bytes, text: str, animator: StandIn, folder: Path, played: list[Path]
) -> None:
    answer = dropped(animator, content, name)
    assert answer.startswith(text)
    assert "\n" not in answer
    assert (played, files_in(folder)) == ([], [])


@pytest.mark.slow
def test_sizes(animator: StandIn, take: bytes, folder: Path, played: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.p, "DROPPED_PAUSE_S", 0.3)
    assert "more than the 40 bytes that were announced" in dropped(animator, take, size=40)
    assert dropped(animator, take, size=len(take) + 1) == "refused: no data for 0.3 s"
    assert "allowed: 1 byte to 1000 MB" in dropped(animator, take, size=MAX_DROPPED_BYTES + 1)
    assert dropped(animator, take + bytes(MAX_DROPPED_PIECE), size=len(take)) != ""
    monkeypatch.setattr(module.p, "DROPPED_FREE_BYTES", 1 << 60)
    assert "allowed: 0.0 MB, the space of" in dropped(animator, take)
    assert (played, files_in(folder)) == ([], [])


@pytest.mark.slow
def test_one_take_at_a_time_and_a_page_that_leaves_frees_the_place(
    animator: StandIn, take: bytes, folder: Path, played: list[Path]
) -> None:
    async def hold() -> str:
        async with connect(address_of(animator, "a.mcap", len(take)), compression=None) as first:
            await first.send(take[:100])
            await asyncio.sleep(0.2)
            async with connect(address_of(animator, "b.mcap", len(take)), compression=None) as second:
                return str(await asyncio.wait_for(second.recv(), 30))

    assert asyncio.run(hold()) == "refused: another take is being received"
    assert dropped(animator, take) == ""
    assert [path.name for path in played] == ["my walk.mcap"]
    assert files_in(folder) == ["my walk.mcap"]


def test_the_token_and_the_origin_are_required(take: bytes, tmp_path: Path) -> None:
    with stand_in(tmp_path, token=TOKEN) as animator:
        address = address_of(animator, "a.mcap", len(take))

        async def open_it(address: str, origin: str | None) -> None:
            async with connect(address, origin=origin, compression=None):
                pass

        for wrong, origin in ((address.replace(TOKEN, "x" * 20), None), (address, "https://evil.example")):
            with pytest.raises(InvalidStatus, match="403"):
                asyncio.run(open_it(wrong, origin))


def test_commands_keep_their_limit_where_files_are_received(animator: StandIn) -> None:
    async def send(connection: ClientConnection) -> int:
        await connection.send("x" * 5000)
        await connection.wait_closed()
        return connection.close_code or 0

    assert talk(animator.address, send) == 1009


@pytest.mark.parametrize(
    ("name", "stored"),
    [
        ("walk.mcap", "walk.mcap"), ("../../etc/x.mcap", "_.._etc_x.mcap"), ("-rf.mcap", "rf.mcap"), (".mcap", "take.mcap"),
        ("a\x1b[31m\n.MCAP", "a__31m_.mcap"), ("größe 2.mcap", "größe 2.mcap"),
    ],
)  # fmt: skip
def test_names_of_stored_files(name: str, stored: str) -> None:
    assert stored_name(name) == stored


@pytest.mark.parametrize("size", ["", "-1", "0", "1e3", "9" * 20])
def test_impossible_sizes(size: str) -> None:
    with pytest.raises(UserError, match=r"^a\.mcap: .*allowed: 1 byte to 1000 MB"):
        checked_size("a.mcap", size)


def test_a_cut_take_is_opened(take: bytes, tmp_path: Path) -> None:
    (tmp_path / "cut.mcap").write_bytes(take[: len(take) // 2])
    check_take(tmp_path / "cut.mcap")
