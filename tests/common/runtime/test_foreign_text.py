"""Texts of other programs in logs and terminals: one line, no control characters, cut."""

import io
import logging

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from tests.support.built_messages import built
from tests.tools.record.launcher.test_rig_status import SERVICES, status_after
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.inbox import Inbox
from zenocap.common.observe.view import ObservedService
from zenocap.common.recording.writer import Attachment, Channel, Recording
from zenocap.common.runtime import logs
from zenocap.common.runtime.foreign_text import MAX_TEXT, printable
from zenocap.common.topics import HEALTH
from zenocap.tools.operate.monitor.display import shown
from zenocap.tools.operate.monitor.shell import plain_line as top_line
from zenocap.tools.record.launcher.display import plain_line, table
from zenocap.tools.takes.info import info
from zenocap.tools.takes.info_text import lines_of

HOSTILE = "tracking\n2026-01-01 00:00:00,000 ERROR integrator: forged\x1b]0;title\x07\x1b[31m\u202e[red]markup[/red] [/b]"


@given(st.text(st.characters(codec=None), max_size=400))
def test_every_text_becomes_one_printable_line_of_bounded_length(text: str) -> None:
    found = printable(text)
    assert all(one.isprintable() or one in "\u200c\u200d" for one in found)
    assert len(found.splitlines()) <= 1
    assert len(found) <= 10 * MAX_TEXT + 30
    assert printable(printable(text[:30])) == printable(text[:30])


def test_postures_in_any_script_stay_readable() -> None:
    for label in ("arme hoch", "手を上げる", "بالا بردن دست", "נפנוף"):
        assert printable(label) == label


def test_a_log_message_is_one_line_also_with_a_traceback() -> None:
    stream = io.StringIO()
    logs.configure("integrator", stream=stream)
    logging.getLogger("test").warning("%s: %s", "zenocap/demo/viewer/1", HOSTILE)
    logging.getLogger("test").warning("failed", exc_info=ValueError(HOSTILE))
    lines = stream.getvalue().splitlines()
    assert [line for line in lines if line.startswith("2026-01-01 00:00:00,000 ERROR")] == []
    assert "\x1b" not in stream.getvalue()
    assert r"forged\x1b]0;title\x07" in lines[0]
    assert lines[1].endswith("WARNING integrator: failed")
    assert all(line.startswith("  ") for line in lines[2:])


def test_a_rejected_message_is_logged_without_its_control_characters(caplog: pytest.LogCaptureFixture) -> None:
    inbox = Inbox(logging.getLogger("test.inbox"))
    unknown = {"type": "health", "frame": 0, "captured_ns": 0, "\x1b[2J\nfield" + "x" * 4000: 1}
    inbox.put(HEALTH.at("demo", service="viewer", id="1"), HEALTH, msgpack.packb(unknown), 0, every=True)
    assert inbox.take(0.0) is None
    inbox.reject("zenocap/de\x1b[mo\n/" + "x" * 60_000, "size", "too large")
    for line in [record.getMessage() for record in caplog.records]:
        assert line.isprintable()
        assert len(line) < 1000
    with pytest.raises(codec.BadMessage) as raised:
        codec.decode(msgpack.packb(unknown), m.Health)
    assert str(raised.value).isprintable()


def rendered(what: object) -> str:
    console = Console(file=io.StringIO(), width=400)
    console.print(what)
    return console.file.getvalue()


def test_health_of_others_neither_changes_the_terminal_nor_is_markup() -> None:
    status = status_after(built(m.Health, state=HOSTILE, rate=1.0), alive=(("viewer", "1"),))
    row = ObservedService("studio", "viewer", "1", "up", words=HOSTILE)
    drawn = rendered(table(status, SERVICES, 1.0, "take.mcap")), rendered(shown([row], "q"))
    for text in (*drawn, plain_line(status, SERVICES, 1.0), top_line(row)):
        assert "\x1b" not in text
        assert "\u202e" not in text
        assert "[red]markup[/red]" in text.replace("\n", "")


def test_posture_labels_and_reasons_of_a_take_are_escaped() -> None:
    posture = built(m.Posture, label="wave\x1b[31m\n", end_ns=1)
    assert "\x1b" not in plain_line(status_after(posture), SERVICES, 1.0)
    verdict = built(m.Verdict, reasons=[m.VerdictReason(kind="views", text=HOSTILE)])
    assert all(line.isprintable() for line in verdict.text.split("\n"))


def test_info_escapes_every_text_of_the_take(tmp_path) -> None:
    path = tmp_path / "take.mcap"
    recording = Recording(
        path, rig="demo", start_ns=1, metadata={"no\x1btes": {"k\ney": HOSTILE}},
        attachments=(Attachment("no\x1b[2Jte\n.txt", "text/plain", b"x"),),
    )  # fmt: skip
    recording.write(Channel("other/\x1b[31mkey\n", "json", "sch\x07ema", "", b""), b"{}", 1, 1)
    recording.close()
    lines = list(lines_of(info(path)))
    assert [line for line in lines if line and not line.isprintable()] == []
    assert any(r"no\x1b[2Jte\n.txt" in line for line in lines)
    assert any(r"other/\x1b[31mkey\n" in line for line in lines)
