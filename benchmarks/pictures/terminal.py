"""Screenshots of `zenocap demo` in a terminal of 80 columns and 24 lines."""

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

from rich.console import Console
from rich.terminal_theme import DEFAULT_TERMINAL_THEME, MONOKAI
from rich.text import Text

from tests.support.browser import chromium

COLUMNS, LINES = 80, 24
DEMO_S = 40.0  # until the screenshot; it begins with compiled kernels
THEMES = {"light": DEFAULT_TERMINAL_THEME, "dark": MONOKAI}
PAGE = (
    '<body style="margin: 0"><pre style="display: inline-block; margin: 0; padding: 8px; color: {foreground}; '
    'background: {background}; font: 16px monospace">{code}</pre></body>'
)
# Colours stay in the text; what else rich writes is to move up, to erase a line, and to hide the cursor.
CONTROL = re.compile(r"(\r\n|\n|\x1b\[1A|\x1b\[2K|\r|\x1b\[\?25[hl])")


def draw(folder: Path) -> None:
    """Write terminal-dark.png and terminal-light.png."""
    shown = Text("\n").join(screen_of(written_by_demo()))
    with chromium() as browser:
        page = browser.new_page()
        for scheme, theme in THEMES.items():
            console = Console(record=True, width=COLUMNS, file=StringIO(), force_terminal=True)
            console.print(shown)
            page.set_content(console.export_html(theme=theme, code_format=PAGE, inline_styles=True))
            page.locator("pre").screenshot(path=folder / f"terminal-{scheme}.png")


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
        while time.monotonic() < end_s:
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
