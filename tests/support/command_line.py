"""The command line with all commands, for tests that call them in this process."""

from zenocap.tools.cli.main import program

app = program()
