"""The `[recognizer.commands]` tables of a rig: actions that a recognized posture triggers.

A posture has one action, `[recognizer.commands.POSTURE]`, or several, `[[recognizer.commands.POSTURE]]`; `"*"` stands for
every posture.  `action` is "zenoh", "osc", "udp", "http" or "program".  Payloads, bodies and OSC arguments may contain
placeholders, see `zenocap.services.recognizer.event_text`.
"""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeAlias
from urllib.parse import urlsplit

import msgspec
from msgspec import Meta

from zenocap.common.rig.animator import Host, Port, is_loopback
from zenocap.common.rig.table_errors import TableError, choice_problem, invalid_value, unknown_key
from zenocap.common.topics import ROOT

COOLDOWN_S = 1.0  # chosen by hand: shorter than any posture of the model `fifteen`, which take 2 to 4 s
HTTP_TIMEOUT_S, PROGRAM_TIMEOUT_S = 2.0, 10.0  # chosen by hand
MAX_COMMANDS = 64  # of a rig: each has a thread of its own; chosen by hand

Text = Annotated[str, Meta(max_length=1000, pattern=r"^[^\0]*$")]
Timeout = Annotated[float, Meta(ge=0.1, le=60)]
Int32 = Annotated[int, Meta(ge=-(2**31), le=2**31 - 1)]
Arguments = Annotated[tuple[Int32 | float | Text, ...], Meta(max_length=16)]
Texts = Annotated[tuple[Text, ...], Meta(max_length=64)]

KEY = re.compile(r"[^\s/*$?#@][^\s/*$?#]*(?:/[^\s/*$?#@][^\s/*$?#]*)*")
KEY_ALLOWED = f"a Zenoh key without wildcards that does not begin with {ROOT}/, such as lab/slides/next"
MAX_FLOAT32 = 3.4e38  # largest number in single precision, rounded down
OSC_ADDRESS = re.compile(r"(?:/[!-~]+)+")
OSC_EXCLUDED = frozenset("#*,?[]{}")  # patterns of OSC 1.0
OSC_ALLOWED = "an OSC address such as /slides/next, ASCII without spaces and without # * , ? [ ] { }"
METHODS = ("GET", "POST")
URL_ALLOWED = "an http:// address of this machine, such as http://127.0.0.1:8000/next"


class _Action(msgspec.Struct, frozen=True, kw_only=True, tag_field="action"):
    """Common to all actions.

    min_confidence: least confidence of the posture, 0 to 1, see `zenocap.services.recognizer.commands.confidence_of`.
    cooldown: least time between two triggers of this command, seconds.
    """

    min_confidence: Annotated[float, Meta(ge=0, le=1)] = 0.0
    cooldown: Annotated[float, Meta(ge=0, le=3600)] = COOLDOWN_S


class ZenohAction(_Action, frozen=True, kw_only=True, tag="zenoh"):
    """Put of `payload` on `key`, in the Zenoh session of the recognizer."""

    key: Annotated[str, Meta(max_length=250)]
    payload: Text = ""

    @property
    def target(self) -> str:
        return self.key


class OscAction(_Action, frozen=True, kw_only=True, tag="osc"):
    """OSC message over UDP.  arguments: integers of 32 bits, numbers in single precision, texts."""

    host: Host = "127.0.0.1"
    port: Port
    address: Annotated[str, Meta(max_length=250)]
    arguments: Arguments = ()

    @property
    def target(self) -> str:
        return f"{self.host}:{self.port}{self.address}"


class UdpAction(_Action, frozen=True, kw_only=True, tag="udp"):
    """One UDP datagram with `payload`, UTF-8; by default a JSON object with everything that is known of the posture."""

    host: Host = "127.0.0.1"
    port: Port
    payload: Text = "{json}"

    @property
    def target(self) -> str:
        return f"{self.host}:{self.port}"


class HttpAction(_Action, frozen=True, kw_only=True, tag="http"):
    """HTTP request to this machine.  timeout: of the connection and of the response, seconds."""

    url: Text
    method: str = "GET"
    body: Text = ""
    timeout: Timeout = HTTP_TIMEOUT_S

    @property
    def target(self) -> str:
        return f"{self.method} {self.url}"


class ProgramAction(_Action, frozen=True, kw_only=True, tag="program"):
    """Program of `allowed_programs`, started without a shell.  timeout: after which it is killed, seconds."""

    program: Text
    arguments: Texts = ()
    timeout: Timeout = PROGRAM_TIMEOUT_S

    @property
    def target(self) -> str:
        return self.program


Kind: TypeAlias = Literal["zenoh", "osc", "udp", "http", "program"]
Action: TypeAlias = ZenohAction | OscAction | UdpAction | HttpAction | ProgramAction
ACTIONS: Mapping[Kind, type[Action]] = {
    "zenoh": ZenohAction, "osc": OscAction, "udp": UdpAction, "http": HttpAction, "program": ProgramAction,
}  # fmt: skip
EVERY = "*"  # table of actions that every posture triggers


@dataclass(frozen=True)
class PostureCommand:
    """An action and the posture that triggers it, or EVERY.  key: of its table in the rig file, below `recognizer`."""

    posture: str
    action: Action
    key: str

    @property
    def kind(self) -> Kind:
        """Kind of the action, as in the rig file."""
        return next(kind for kind, action in ACTIONS.items() if type(self.action) is action)


def posture_commands(
    tables: Mapping[str, object], allowed_programs: Sequence[str], *, must_exist: bool = True
) -> tuple[PostureCommand, ...]:
    """Commands of the table `recognizer.commands`, in its order.  Raises TableError.

    allowed_programs: absolute paths.  must_exist: whether the programs must be on this machine.
    """
    for number, program in enumerate(allowed_programs):
        if not Path(program).is_absolute():
            raise TableError(f"allowed_programs[{number}] = {program!r}: allowed: an absolute path")
    commands: list[PostureCommand] = []
    for posture, tables_of_posture in tables.items():
        key = f"commands.{posture}"
        match tables_of_posture:
            case dict():
                commands.append(PostureCommand(posture, _action(key, tables_of_posture, allowed_programs), key))
            case list():
                for number, table in enumerate(tables_of_posture):
                    own = f"{key}[{number}]"
                    commands.append(PostureCommand(posture, _action(own, table, allowed_programs), own))
            case value:
                raise TableError(f"{key} = {value!r}: allowed: a table, or a list of tables, with an action")
    if len(commands) > MAX_COMMANDS:
        raise TableError(f"commands = {len(commands)} actions: allowed: at most {MAX_COMMANDS}")
    if must_exist:
        check_programs(commands)
    return tuple(commands)


def check_programs(commands: Sequence[PostureCommand]) -> None:
    """Raise TableError for a program that this machine does not have, or that is not executable."""
    for command in commands:
        match command.action:
            case ProgramAction(program=program) if not (os.path.isfile(program) and os.access(program, os.X_OK)):
                raise TableError(f"{command.key}.program = {program!r}: no such program: allowed: an executable file")


def check_postures(commands: Sequence[PostureCommand], labels: Sequence[str], model: str) -> None:
    """Raise TableError for a command of a posture that the model does not have.  labels: those of the model."""
    for command in commands:
        if command.posture not in (*labels, EVERY):
            raise TableError(choice_problem(command.key, command.posture, tuple(labels)) + f"; model: {model}")


def _action(key: str, table: object, allowed_programs: Sequence[str]) -> Action:
    if not isinstance(table, dict):
        raise TableError(f"{key} = {table!r}: allowed: a table with an action")
    name = table.get("action")
    if name is None:
        raise TableError(f"{key}.action is missing: allowed: {', '.join(map(repr, ACTIONS))}")
    kind = next((kind for kind in ACTIONS if kind == name), None)
    if kind is None:
        raise TableError(choice_problem(f"{key}.action", str(name), tuple(ACTIONS)))
    problem = unknown_key(key, table, ACTIONS[kind], ("action",))
    if problem is not None:
        raise TableError(problem)
    try:
        action: Action = msgspec.convert(table, ACTIONS[kind])
    except msgspec.ValidationError as error:
        raise TableError(invalid_value(table, str(error), key)) from error
    problem = _problem(action, allowed_programs)
    if problem is not None:
        raise TableError(f"{key}.{problem}")
    return action


def _problem(action: Action, allowed_programs: Sequence[str]) -> str | None:
    """Reason why the values of an action are not allowed; None when they are."""
    match action:
        case ZenohAction(key=key):
            if not KEY.fullmatch(key) or key.split("/")[0] == ROOT:
                return f"key = {key!r}: allowed: {KEY_ALLOWED}"
        case OscAction():
            return _osc_problem(action)
        case HttpAction():
            return _http_problem(action)
        case ProgramAction(program=program):
            if program not in allowed_programs:
                programs = ", ".join(map(repr, allowed_programs)) or "none"
                return f"program = {program!r}: allowed: those of recognizer.allowed_programs: {programs}"
    return None


def _osc_problem(action: OscAction) -> str | None:
    if not OSC_ADDRESS.fullmatch(action.address) or OSC_EXCLUDED & set(action.address):
        return f"address = {action.address!r}: allowed: {OSC_ALLOWED}"
    for number, argument in enumerate(action.arguments):
        if isinstance(argument, float) and not abs(argument) <= MAX_FLOAT32:
            return f"arguments[{number}] = {argument!r}: allowed: a number in single precision"
    return None


def _http_problem(action: HttpAction) -> str | None:
    if not is_loopback_url(action.url):
        return f"url = {action.url!r}: allowed: {URL_ALLOWED}"
    if action.method not in METHODS:
        return choice_problem("method", action.method, METHODS)
    if action.body and action.method != "POST":
        return f"body = {action.body!r}: allowed: only with method = 'POST'"
    return None


def is_loopback_url(url: str) -> bool:
    """Whether `url` is an http address of this machine, without a user name."""
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        return False
    printable = all("!" <= letter <= "~" for letter in url)
    named = parts.scheme == "http" and parts.username is None and port != 0
    return printable and named and is_loopback(parts.hostname or "")
