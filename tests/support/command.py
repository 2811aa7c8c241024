"""The command line in this process."""

from typer.testing import CliRunner

from zenocap.tools.cli.main import program

app = program()


def zenocap(*arguments: object) -> tuple[int, str, str]:
    """Exit status, standard output, standard error.  Raises what the command raises."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200", "NO_COLOR": "1"})
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr
