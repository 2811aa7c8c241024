"""Screenshot of `zenocap demo` in a terminal of 80 columns and 24 lines."""

import os
import pty
import re
import signal
import subprocess
import sys
import tempfile
import termios
import time
from contextlib import suppress
from io import StringIO
from pathlib import Path
from select import select

from rich.console import Console
from rich.terminal_theme import DEFAULT_TERMINAL_THEME, MONOKAI
from rich.text import Text

from tests.support.browser import chromium

COLUMNS, LINES = 80, 24
DEMO_S = 40.0  # until the screenshot; it begins with compiled kernels
PAUSE_S = 0.1  # in which nothing is written: what is on the screen is whole
THEMES = MONOKAI, DEFAULT_TERMINAL_THEME  # dark, light
SCREEN = (
    '<pre style="margin: 0; padding: 8px; color: {foreground}; background: {background}; font: 16px monospace">{code}</pre>'
)
# Colours stay in the text; what else rich writes is to move up, to erase a line, and to hide the cursor.
CONTROL = re.compile(r"(\r\n|\n|\x1b\[1A|\x1b\[2K|\r|\x1b\[\?25[hl])")


def draw(folder: Path) -> None:
    """Write terminal.png: the same in a dark and in a light one."""
    console = Console(record=True, width=COLUMNS, file=StringIO(), force_terminal=True)
    console.print(Text("\n").join(screen_of(written_by_demo())))
    screens = [console.export_html(theme=theme, clear=False, code_format=SCREEN, inline_styles=True) for theme in THEMES]
    with chromium() as browser:
        page = browser.new_page()
        page.set_content(f'<div style="display: inline-block">{"".join(screens)}</div>')
        page.locator("div").screenshot(path=folder / "terminal.png")


def written_by_demo() -> str:
    """What it has written to a terminal after DEMO_S."""
    own, terminal = pty.openpty()
    termios.tcsetwinsize(terminal, (LINES, COLUMNS))
    command = [sys.executable, "-P", "-m", "zenocap", "demo", "--port", "0"]
    written, end_s = b"", time.monotonic() + DEMO_S
    with (
        tempfile.TemporaryDirectory() as place,
        subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=terminal, cwd=place) as process,
    ):
        os.close(terminal)
        while time.monotonic() < end_s or select([own], [], [], PAUSE_S)[0]:
            written += os.read(own, 1 << 16)
        process.send_signal(signal.SIGINT)
        with suppress(OSError):  # its end; it waits where nothing is read
            while os.read(own, 1 << 16):
                pass
    os.close(own)
    return written.decode()


def screen_of(text: str) -> list[Text]:
    """The last LINES lines of a terminal of COLUMNS after a text."""
    lines, row = [""], 0
    for part in CONTROL.split(text):
        match part:
            case "\n" | "\r\n":
                row += 1
                lines += [""] * (row + 1 - len(lines))
            case "\x1b[1A":
                row -= 1
            case "\x1b[2K":
                lines[row] = ""
            case _ if not CONTROL.fullmatch(part):
                lines[row] += part
    whole = map(Text.from_ansi, lines)
    return [one for line in whole for one in line.divide(range(COLUMNS, len(line), COLUMNS))][-LINES:]
