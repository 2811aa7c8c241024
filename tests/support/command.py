"""The command line in this process."""

import logging

from typer.testing import CliRunner, Result

from zenocap.tools.cli.main import program

app = program()


def _ended(*arguments: object) -> Result:
    """Result of a command; its logging, on a stream that is closed then, ends with it, also in a fixture of a session."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200", "NO_COLOR": "1"})
    root.handlers[:] = handlers
    root.setLevel(level)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def zenocap(*arguments: object) -> tuple[int, str, str]:
    """Exit status, standard output, standard error.  Raises what the command raises."""
    result = _ended(*arguments)
    return result.exit_code, result.stdout, result.stderr


def printed(*arguments: object, status: int = 0) -> str:
    """Both outputs, as a terminal shows them, of a command that ends with this status."""
    result = _ended(*arguments)
    assert result.exit_code == status, result.output
    return result.output


def refused(*arguments: object, status: int = 1) -> str:
    """The error of a command that prints nothing else: one line."""
    output = printed(*arguments, status=status)
    assert output.count("\n") == 1, output
    return output
