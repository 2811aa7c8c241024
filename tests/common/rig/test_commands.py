"""Tables [recognizer.commands.POSTURE]: actions, defaults, one line for every rejected value."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.common.rig.test_rig import RIG, write_rig
from zenocap.common.errors import UserError
from zenocap.common.rig.commands import (
    COOLDOWN_S,
    HTTP_TIMEOUT_S,
    MAX_COMMANDS,
    PROGRAM_TIMEOUT_S,
    PostureCommand,
    ProgramAction,
    ZenohAction,
    check_postures,
    is_loopback_url,
    posture_commands,
)
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.table_errors import TableError

EVERY_ACTION = """
[recognizer]
allowed_programs = ["/bin/sh"]

[recognizer.commands.raise-right-arm]
action = "zenoh"
key = "lab/slides/next"
payload = "1"
min_confidence = 0.3
cooldown = 2

[[recognizer.commands.raise-left-arm]]
action = "osc"
host = "192.168.1.20"
port = 9000
address = "/slides/previous"
arguments = [1, 0.5, "left"]

[[recognizer.commands.raise-left-arm]]
action = "http"
url = "http://127.0.0.1:8000/previous?by=arm"

[recognizer.commands."squat"]
action = "http"
url = "http://localhost:8000/"
method = "POST"
body = "{}"
timeout = 0.5

[recognizer.commands.kick-right]
action = "program"
program = "/bin/sh"
arguments = ["-c", "exit 0"]
"""
ZENOH, OSC = 'action = "zenoh"\nkey = "a"\n', 'action = "osc"\nport = 9000\naddress = "/a"\n'
UDP = 'action = "udp"\nport = 9100\n'
HTTP, PROGRAM = 'action = "http"\nurl = "http://127.0.0.1/"\n', 'action = "program"\nprogram = "/bin/sh"\n'


def commands_of(folder: Path, text: str, *, files: bool = True) -> tuple[PostureCommand, ...]:
    return load_rig(write_rig(folder, RIG + text), files=files).recognizer.commands


def test_actions_of_every_posture_are_of_every_model_and_there_may_be_none(tmp_path: Path) -> None:
    (command,) = commands_of(tmp_path, f'\n[recognizer.commands."*"]\n{UDP}')
    found = (command.posture, command.kind, command.key, command.action.target)
    assert found == ("*", "udp", "commands.*", "127.0.0.1:9100")
    check_postures([command], ["squat"], "mine")
    assert commands_of(tmp_path, "\n[recognizer]\n") == ()


def test_every_action_is_read_in_the_order_of_the_file(tmp_path: Path) -> None:
    found = commands_of(tmp_path, EVERY_ACTION)
    assert [(one.posture, one.kind, one.key, one.action.target) for one in found] == [
        ("raise-right-arm", "zenoh", "commands.raise-right-arm", "lab/slides/next"),
        ("raise-left-arm", "osc", "commands.raise-left-arm[0]", "192.168.1.20:9000/slides/previous"),
        ("raise-left-arm", "http", "commands.raise-left-arm[1]", "GET http://127.0.0.1:8000/previous?by=arm"),
        ("squat", "http", "commands.squat", "POST http://localhost:8000/"),
        ("kick-right", "program", "commands.kick-right", "/bin/sh"),
    ]
    zenoh, osc, get, post, program = (one.action for one in found)
    assert zenoh == ZenohAction(key="lab/slides/next", payload="1", min_confidence=0.3, cooldown=2.0)
    assert osc.arguments == (1, 0.5, "left")
    assert (get.method, get.body, get.timeout) == ("GET", "", HTTP_TIMEOUT_S)
    assert (get.cooldown, get.min_confidence) == (COOLDOWN_S, 0.0)
    assert (post.method, post.body, post.timeout) == ("POST", "{}", 0.5)
    assert program == ProgramAction(program="/bin/sh", arguments=("-c", "exit 0"), timeout=PROGRAM_TIMEOUT_S)


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ('key = "a"', r"commands\.squat\.action is missing: allowed: 'zenoh', 'osc', 'udp', 'http', 'program'"),
        ('action = "zeno"', r"commands\.squat\.action = 'zeno': allowed: 'zenoh', .*; did you mean 'zenoh'\?"),
        ("action = 5", r"commands\.squat\.action = '5': allowed: 'zenoh', "),
        (ZENOH + "keys = 1", r"commands\.squat\.keys = 1: no such key; allowed: action, .*key, .*did you mean 'key'"),
        ('action = "zenoh"', r"commands\.squat\.key is missing"),
        (ZENOH + "min_confidence = 2", r"commands\.squat\.min_confidence = 2: allowed: float <= 1"),
        (ZENOH + "cooldown = -1", r"commands\.squat\.cooldown = -1: allowed: float >= 0"),
        (ZENOH + "payload = 1", r"commands\.squat\.payload = 1: allowed: str"),
        (ZENOH.replace('"a"', '"a/**"'), r"commands\.squat\.key = 'a/\*\*': allowed: a Zenoh key without wildcards"),
        (ZENOH.replace('"a"', '"/a"'), r"commands\.squat\.key = '/a': allowed: "),
        (ZENOH.replace('"a"', '""'), r"commands\.squat\.key = '': allowed: "),
        (ZENOH.replace('"a"', '"@/router"'), r"commands\.squat\.key = '@/router': allowed: "),
        (ZENOH.replace('"a"', '"zenocap/studio/request"'),
         r"commands\.squat\.key = 'zenocap/studio/request': allowed: .* does not begin with zenocap/"),
        (UDP.replace("9100", "0"), r"commands\.squat\.port = 0: allowed: int >= 1"),
        (UDP + "arguments = [1]", r"commands\.squat\.arguments = .*: no such key; allowed: action, "),
        (OSC.replace("9000", "0"), r"commands\.squat\.port = 0: allowed: int >= 1"),
        (OSC.replace("9000", "70000"), r"commands\.squat\.port = 70000: allowed: int <= 65535"),
        (OSC + 'host = ""', r"commands\.squat\.host = '': allowed: str of length >= 1"),
        (OSC.replace('"/a"', '"a"'), r"commands\.squat\.address = 'a': allowed: an OSC address such as /slides/next"),
        (OSC.replace('"/a"', '"/a*"'), r"commands\.squat\.address = '/a\*': allowed: an OSC address"),
        (OSC + "arguments = [true]", r"commands\.squat\.arguments\[0\] = True: allowed: int \| float \| str"),
        (OSC + "arguments = [3000000000]", r"commands\.squat\.arguments\[0\] = 3000000000: allowed: int <= 2147483647"),
        (OSC + r'arguments = ["\u0000"]', r"commands\.squat\.arguments\[0\] = '\\x00': allowed: str matching regex"),
        (OSC + "arguments = [nan]", r"commands\.squat\.arguments\[0\] = nan: allowed: a number in single precision"),
        (HTTP.replace("127.0.0.1", "example.org"),
         r"commands\.squat\.url = 'http://example\.org/': allowed: an http:// address of this machine"),
        (HTTP.replace("http:", "https:"), r"commands\.squat\.url = 'https://127\.0\.0\.1/': allowed: an http://"),
        (HTTP.replace("127.0.0.1", "127.0.0.1:99999"), r"commands\.squat\.url = 'http://127\.0\.0\.1:99999/': allowed: "),
        (HTTP + 'method = "PUT"', r"commands\.squat\.method = 'PUT': allowed: 'GET', 'POST'"),
        (HTTP + 'body = "x"', r"commands\.squat\.body = 'x': allowed: only with method = 'POST'"),
        (HTTP + "timeout = 100", r"commands\.squat\.timeout = 100: allowed: float <= 60"),
        (PROGRAM.replace("/bin/sh", "/bin/rm"),
         r"commands\.squat\.program = '/bin/rm': allowed: those of recognizer\.allowed_programs: '/bin/sh', '/no/such/"),
        (PROGRAM.replace("/bin/sh", "/no/such/program"),
         r"commands\.squat\.program = '/no/such/program': no such program: allowed: an executable file"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path: Path, lines: str, text: str) -> None:
    table = f'\n[recognizer]\nallowed_programs = ["/bin/sh", "/no/such/program"]\n[recognizer.commands.squat]\n{lines}\n'
    path = write_rig(tmp_path, RIG + table)
    with pytest.raises(UserError, match=rf"recognizer\.{text}") as caught:
        load_rig(path)
    assert str(caught.value).startswith(f"{path}: recognizer.")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ('allowed_programs = ["sh"]', r"recognizer\.allowed_programs\[0\] = 'sh': allowed: an absolute path"),
        ("commands = 5", r"recognizer\.commands = 5: allowed: "),
        ("commands.squat = 5", r"recognizer\.commands\.squat = 5: allowed: a table, or a list of tables"),
        ("commands.squat = [5]", r"recognizer\.commands\.squat\[0\] = 5: allowed: a table with an action"),
    ],
)
def test_values_of_a_wrong_kind_are_named(tmp_path: Path, line: str, text: str) -> None:
    with pytest.raises(UserError, match=text):
        load_rig(write_rig(tmp_path, f"{RIG}\n[recognizer]\n{line}\n"))


def test_a_program_is_an_executable_file_of_this_machine_and_anything_on_another(tmp_path: Path) -> None:
    program = tmp_path / "lights"
    program.write_text("#!/bin/sh\n")
    table = f'\n[recognizer]\nallowed_programs = ["{program}"]\n[recognizer.commands.squat]\n'
    text = table + PROGRAM.replace("/bin/sh", str(program))
    (command,) = commands_of(tmp_path, text, files=False)
    assert command.action.target == str(program)
    with pytest.raises(UserError, match="no such program: allowed: an executable file"):
        commands_of(tmp_path, text)
    os.chmod(program, 0o700)
    assert commands_of(tmp_path, text) == (command,)


def test_there_are_at_most_so_many_commands() -> None:
    tables = {"squat": [{"action": "zenoh", "key": "a"}] * (MAX_COMMANDS + 1)}
    with pytest.raises(TableError, match=rf"commands = {MAX_COMMANDS + 1} actions: allowed: at most {MAX_COMMANDS}"):
        posture_commands(tables, ())


def test_a_posture_that_the_model_does_not_have_is_refused() -> None:
    commands = posture_commands({"squatt": {"action": "zenoh", "key": "a"}}, ())
    text = r"commands\.squatt = 'squatt': allowed: 'squat', 'kick'; did you mean 'squat'\?; model: mine\.postures"
    with pytest.raises(TableError, match=text):
        check_postures(commands, ("squat", "kick"), "mine.postures")
    check_postures(commands, ("squatt",), "mine.postures")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "[::1]", "localhost"])
def test_addresses_of_this_machine_are_allowed(host: str) -> None:
    assert is_loopback_url(f"http://{host}:8000/a?b=c")


@pytest.mark.parametrize(
    "url",
    [
        "http://192.168.1.1/", "http://0.0.0.0/", "http://127.0.0.1.example.org/", "http://user@127.0.0.1/",
        "http://127.0.0.1@example.org/", "ftp://127.0.0.1/", "//127.0.0.1/", "127.0.0.1", "http://", "http://[::1/",
        "http://127.0.0.1/a b", "http://127.0.0.1/\r\nHost: x", "http://2130706433/", "http://127.0.0.1:0/", "",
    ],
)  # fmt: skip
def test_other_addresses_are_refused(url: str) -> None:
    assert not is_loopback_url(url)


@given(st.text(st.characters(exclude_characters="/?#\\"), max_size=30))
def test_no_text_breaks_the_check_of_addresses(text: str) -> None:
    assert is_loopback_url(f"http://{text}.example.org/") is False
