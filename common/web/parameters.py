"""Limits of the page server, with unit and provenance.  "By hand" means chosen without a measurement."""

# Pages.
MAX_PAGES = 64  # open at a time; by hand
MAX_UNACKNOWLEDGED = 3  # lists on their way to a page: 60 lists/s at a round trip of 50 ms
MAX_COMMAND_BYTES = 4096  # of a command from a page; by hand
MOST_COMMANDS = 64  # that wait; further ones are refused; by hand
PING_PERIOD_S, PING_TIMEOUT_S = 10.0, 20.0  # a page that does not answer is disconnected; by hand
CLOSE_TIMEOUT_S = 1.0  # for the closing handshake; by hand

# Connections, of each port.
MAX_WAITING = 128  # without a completed handshake; a browser opens six for a page; by hand
HANDSHAKE_TIMEOUT_S = 5.0  # from the connection to the end of its handshake; by hand
ERROR_LINE_PERIOD_S = 60.0  # between two log lines on one kind of malformed request; by hand

# Saved files.
MAX_OFFERED = 16  # latest ones that pages can get; by hand
MAX_OFFERED_BYTES = 512 << 20  # of one of them, which is sent from memory; by hand
