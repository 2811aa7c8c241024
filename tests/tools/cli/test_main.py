"""The command line: help texts, start-up, exit statuses, and user errors in one line."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command
from typer.testing import CliRunner

from tests.common.rig.test_rig import CALIBRATION
from tests.support.command import app, printed, refused, zenocap
from tests.support.places import ROOT
from tests.support.video_file import write_video
from zenocap.common.arrays import Image
from zenocap.common.rig.rig import demo_rig, demo_rig_file
from zenocap.tools.cli.main import COMMANDS, HELP, program
from zenocap.tools.cli.options import UNUSABLE
from zenocap.tools.option_groups import EXPERT, PANELS, RESEARCH

runner = CliRunner()
NAMES = [name for group in COMMANDS.values() for name in group]
NETWORKED = ("up", "viewer", "integrator", "tracker", "recognizer", "router", "record", "replay", "top", "metrics")
SIZE = (160, 120)
MOST_OPTIONS = 10  # of a command that shows them in one panel


def commands_in(group: TyperGroup, name: str = "") -> Iterator[tuple[str, TyperCommand]]:
    """Names and commands of a group and of the groups in it."""
    for word, command in group.commands.items():
        if isinstance(command, TyperGroup):
            yield from commands_in(command, f"{word} ")
        else:
            yield f"{name}{word}", command


def grey(count: int = 12, size: tuple[int, int] = SIZE) -> Iterator[Image]:
    return (np.full((size[1], size[0], 3), 10 * k % 250, dtype=np.uint8) for k in range(count))


@pytest.fixture
def studio(tmp_path: Path) -> Path:
    """A rig file with two short videos."""
    for name in ("cam01", "cam02"):
        write_video(tmp_path / "videos" / f"{name}.mp4", grey(), fps=15)
    text = CALIBRATION.replace("[640.0, 480.0]", "[160.0, 120.0]")
    text = text.replace("[[600.0, 0.0, 319.5], [0.0, 600.0, 239.5]", "[[150.0, 0.0, 79.5], [0.0, 150.0, 59.5]")
    (tmp_path / "calibration.toml").write_text(text)
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "videos/cam0{k}.mp4"\nbackground = "first:3"\n'
        for k in (1, 2)
    )
    path = tmp_path / "studio.toml"
    path.write_text(f'name = "studio"\ncalibration = "calibration.toml"\n{viewers}[log]\nfolder = "takes"\n')
    return path


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name, _ in commands_in(get_command(app))])
def test_every_command_has_a_help_text_with_an_example(name: str) -> None:
    text = printed(*name.split(), "--help")
    assert len(text.split()) > 30
    assert name.startswith("calibrate ") or "Example" in text


@pytest.mark.slow
@pytest.mark.parametrize("command", NETWORKED)
def test_networked_commands_have_the_options_of_zenoh(command: str) -> None:
    text = printed(command, "--help")
    for option in ("-e", "--connect", "-l", "--listen", "-c", "--config", "--no-multicast-scouting"):
        assert option in text
    assert ("--mode" in text) == (command != "router")


@pytest.mark.slow
def test_the_help_lists_every_command_in_its_group() -> None:
    groups = re.split(r"╭─ ", printed("-h"))[2:]
    listed = {part.split(" ─")[0]: re.findall(r"^│ ([a-z]+) ", part, re.MULTILINE) for part in groups}
    assert {panel: set(names) for panel, names in listed.items()} == {
        panel: set(names) for panel, names in COMMANDS.items()
    }
    assert sum(map(len, listed.values())) == len(NAMES)


def test_the_help_has_the_exit_statuses_of_the_readme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^Exit status of every command: (.*)$", readme, re.MULTILINE)
    assert line in " ".join(HELP.split())
    assert f"also {UNUSABLE}, done but unusable" in line


@pytest.mark.slow
def test_help_texts_have_no_chains() -> None:
    chain = re.compile(r"\b(by how long|by which|of how|of which|of whom)\b")
    texts = [
        (name, text or "")
        for name, command in commands_in(get_command(app))
        for text in (command.help, *(getattr(one, "help", None) for one in command.params))
    ]
    assert len(texts) > 300
    assert [(name, text) for name, text in texts if chain.search(" ".join(text.split()))] == []


@pytest.mark.slow
def test_every_command_is_described_in_one_line() -> None:
    """Of a terminal of 80 columns."""
    text = runner.invoke(app, ["--help"], env={"COLUMNS": "80", "NO_COLOR": "1"}).stdout
    assert re.findall(r"^│ {8}.*│$", text, re.MULTILINE) == []
    assert len(re.findall(r"^│ [a-z]+ +[A-Z].*\.+ *│$", text, re.MULTILINE)) == len(NAMES)


@pytest.mark.parametrize(
    ("words", "names"), [(["top"], ["top"]), (["posture", "info"], ["posture"]), (["fly"], NAMES), ([], NAMES)]
)
def test_a_command_is_made_without_the_others(words: list[str], names: list[str]) -> None:
    made = program(words)
    found = [one.name for one in (*made.registered_commands, *made.registered_groups)]
    assert sorted(map(str, found)) == sorted(names)


@pytest.mark.slow
def test_commands_with_many_options_have_them_in_panels() -> None:
    without = []
    for name, command in commands_in(get_command(app)):
        options = [one for one in command.params if one.param_type_name == "option" and not getattr(one, "hidden", False)]
        panels = {getattr(one, "rich_help_panel", None) for one in options}
        if len(options) > MOST_OPTIONS and not {EXPERT, RESEARCH} & panels:
            without.append(name)
    assert without == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["track", "calibrate lines", "posture train", "posture evaluate", "load"])
def test_commands_with_options_for_research_have_three_panels(name: str) -> None:
    panels = re.findall(r"^╭─ (.+?) ─", printed(*name.split(), "--help"), re.MULTILINE)
    assert [panel for panel in panels if panel in PANELS] == [*PANELS]


@pytest.mark.slow
def test_the_version_is_printed() -> None:
    assert "Show the version and exit." in printed("--help")
    assert printed("--version").startswith("zenocap 0.")


@pytest.mark.slow
def test_the_end_of_a_command_waits_for_threads_and_leaves_the_interpreter_as_it_is() -> None:
    """A thread of a library that waited for the interpreter aborted it: status -6 of a page that was interrupted."""
    code = """
import atexit, sys, threading, time
from zenocap.tools.cli.main import main

class Module:
    def __del__(self): print("taken apart")

kept = Module()
atexit.register(print, "at exit")
threading.Thread(target=lambda: (time.sleep(0.2), print("thread"))).start()
threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
sys.argv = ["zenocap", *sys.argv[1:]]
main()
"""
    for arguments, status in ((["--version"], 0), (["fly"], 2)):
        found = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)
        assert found.returncode == status
        lines = found.stdout.splitlines()
        assert lines[-1] == "at exit"
        assert "thread" in lines
        assert "taken apart" not in lines


@pytest.mark.slow
def test_a_second_ctrl_c_ends_the_wait_for_threads() -> None:
    code = """
import signal, threading, time
from zenocap.tools.cli.main import leave

signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in what a shell starts in its background

def wait(waited=threading._shutdown):
    print("waiting", flush=True)
    waited()

threading._shutdown = wait
threading.Thread(target=time.sleep, args=(600,)).start()
leave(3)
"""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **pipes, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "waiting\n"
        while process.poll() is None:  # a signal just before a wait for a lock does not end it, as of any Python program
            process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                process.wait(20.0)
        assert process.communicate() == ("", "")
        assert process.returncode == 3


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize(("status", "expected"), [(0, 120), (3, 3)])
def test_output_that_cannot_be_written_is_no_success(status: int, expected: int) -> None:
    code = f"from zenocap.tools.cli.main import leave; print('lost'); leave({status})"
    environment = os.environ | {"PYTHONUNBUFFERED": ""}
    with open("/dev/full", "w") as full:
        found = subprocess.run([sys.executable, "-c", code], stdout=full, env=environment, check=False)
    assert found.returncode == expected


@pytest.mark.slow
@pytest.mark.parametrize("redirection", [">&-", "2>&-"])
def test_a_closed_output_is_no_error(redirection: str) -> None:
    command = f'"{sys.executable}" -P -m zenocap --version {redirection}'
    found = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")


@pytest.mark.slow
def test_help_imports_no_heavy_modules() -> None:
    start = "import sys; from zenocap.tools.cli.main import program; program();"
    code = f"{start} print(sorted({{'numba', 'zenoh', 'scipy', 'mcap'}} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.nightly
@pytest.mark.parametrize(
    "line",
    [
        "viewer studio.toml",
        "track studio.toml -o a.mcap --size 160",
        "track studio.toml -o a.mcap --method joint",
        "export a.mcap -o a.fbx",
        "export a.mcap --to fbx -o a.fbx",
        "fly",
    ],
)
def test_wrong_usage_is_status_2(line: str) -> None:
    printed(*line.split(), status=2)


@pytest.mark.nightly
def test_a_video_without_a_person_gives_a_take_and_a_message(studio: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("track", studio, "-o", tmp_path / "a.mcap")
    assert (status, "12 frames, 0 poses" in out, "no pose" in err) == (4, True, True)
    found = json.loads(zenocap("info", tmp_path / "a.mcap", "--json")[1])
    assert found["messages"] > 2
    assert found["attachments"].keys() == {"studio.toml", "calibration.toml", "parameters.json", "setup.json"}
    assert {channel["schema"] for channel in found["channels"]} >= {"zenocap.Silhouette", "zenocap.CameraInfo"}
    assert "no T-pose was measured" in refused("export", tmp_path / "a.mcap", "--to", "trc", "-o", tmp_path / "a.trc")


@pytest.mark.slow
def test_truncated_take_is_reported(studio: Path, tmp_path: Path) -> None:
    zenocap("track", studio, "-o", tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "b.mcap").write_bytes(data[: len(data) // 2])
    assert "cut before its end" in printed("info", tmp_path / "b.mcap", status=3)


def changed(old: str, new: str) -> Callable[[Path], None]:
    def change(studio: Path) -> None:
        text = studio.read_text()
        assert old in text
        studio.write_text(text.replace(old, new))

    return change


def cut_video(studio: Path) -> None:
    (studio.parent / "videos" / "cam02.mp4").write_bytes(b"not a video at all" * 50)


def large_video(studio: Path) -> None:
    write_video(studio.parent / "videos" / "cam02.mp4", grey(size=(320, 200)), fps=15)


BAD = [  # what is wrong in a rig file itself: tests/common/rig
    (changed("videos/cam02.mp4", "videos/cam09.mp4"), ("viewer[1].source", "no file", "cam09.mp4")),
    (cut_video, ("cam02.mp4", "not a video that can be decoded")),
    (large_video, ("cam02.mp4", "320 x 200", "160 x 120")),
    (changed('name = "studio"', 'name = "studio"\nmethod = "joint"'), ("method = 'joint'", "two-view")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "words"), BAD, ids=[words[0] for _, words in BAD])
def test_invalid_rig_is_a_one_line_error(change: Callable[[Path], None], words: tuple[str, ...], studio: Path) -> None:
    change(studio)
    up = "method" in words[0]  # track has an option for it
    options = ("up", studio, "--seconds", "1") if up else ("track", studio, "-o", studio.parent / "a.mcap")
    status, _, err = zenocap(*options)
    (line,) = [line for line in err.splitlines() if not line.startswith("note:")]
    assert (status, line.startswith("error: ")) == (1, True)
    assert [word for word in words if word not in line] == []
    assert not (studio.parent / "a.mcap").exists()


@pytest.mark.slow
def test_truncated_video_is_tracked_to_its_last_readable_frame(studio: Path, tmp_path: Path) -> None:
    path = studio.parent / "videos" / "cam02.avi"
    write_video(path, grey(60), fps=15, codec="mjpeg", pixels="yuvj420p")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
    changed("cam02.mp4", "cam02.avi")(studio)
    status, out, err = zenocap("track", studio, "-o", tmp_path / "a.mcap")
    assert (status, "frames" in out) == (4, True)
    assert "lost: " in err
    assert "cam02.avi" in err


def test_unknown_viewer_error_lists_the_known_viewers(studio: Path) -> None:
    assert "no viewer '7'; there are: 1, 2" in printed("viewer", studio, "--id", "7", status=1)


@pytest.mark.nightly
def test_track_to_bvh_equals_track_and_export(tmp_path: Path) -> None:
    for file in demo_rig("two-view").files:
        (tmp_path / file.name).write_text(file.read_text().replace("actor:demo?seed=4", "actor:raise-both-arms?seed=4"))
    rig = tmp_path / demo_rig_file("two-view").name
    assert "the take was temporary" in printed("track", rig, "-o", tmp_path / "one.bvh")
    printed("track", rig, "-o", tmp_path / "arms.mcap")
    printed("export", tmp_path / "arms.mcap", "-o", tmp_path / "two.bvh")
    assert (tmp_path / "one.bvh").read_bytes() == (tmp_path / "two.bvh").read_bytes()
    printed("verify", tmp_path / "arms.mcap")


@pytest.mark.slow
def test_without_a_pose_nothing_is_exported(studio: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("track", studio, "-o", tmp_path / "a.bvh")
    assert (status, out) == (4, "12 frames, 0 poses\n")
    assert "T-pose" in err
    assert not (tmp_path / "a.bvh").exists()
