"""Text from other programs and files for logs and terminals: one line, no control characters.

Keys, error texts, health, names of attachments and labels of postures are chosen by whoever publishes or writes them.  A
line end in them would forge a line of the log, an escape sequence would change the terminal.
"""

MAX_TEXT = 300  # characters of one text that are shown; chosen by hand
MAX_LINE = 4000  # characters of one log line; chosen by hand
JOINERS = "\u200c\u200d"  # between letters of Persian and Indian scripts, and in emoji


def printable(text: object, limit: int = MAX_TEXT) -> str:
    """`str(text)` with escapes such as \\n, \\x1b and \\u202e for characters that are not printable, cut to `limit`.

    Applied twice it changes nothing more, except that a cut text may be cut again.
    """
    whole = str(text)
    cut = whole if len(whole) <= limit else whole[:limit]
    if not cut.isprintable():
        cut = "".join(one if one.isprintable() or one in JOINERS else _escape(one) for one in cut)
    return cut if len(whole) <= limit else f"{cut}... ({len(whole)} characters)"


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
