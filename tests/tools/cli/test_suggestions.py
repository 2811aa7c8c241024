"""Suggestions for unknown commands and arguments of the wrong type: one line with the correct command."""

from pathlib import Path

import pytest

from tests.support.command import printed, refused
from tests.tools.cli.test_main import NAMES
from zenocap.tools.cli.suggestions import OTHER_WORDS, helped, unknown_command


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("devices", "did you mean zenocap cameras?"),
        ("blender", "did you mean zenocap export?"),
        ("latency", "did you mean zenocap top?"),
        ("Start", "did you mean zenocap up or zenocap demo?"),
        ("exprot", "did you mean zenocap export?"),
        ("studio.toml", "zenocap up studio.toml"),
        ("walk.mcap", "zenocap info walk.mcap"),
        ("film.MP4", "zenocap track --help"),
        ("fly", "zenocap --help lists the commands"),
    ],
)
def test_unknown_command_suggests_the_intended_one(word: str, expected: str) -> None:
    assert expected in unknown_command(word, NAMES)
    assert "certs" not in unknown_command(word, NAMES)
    assert word in printed(word, status=2)


def test_synonyms_map_to_commands_and_are_not_commands() -> None:
    for words, names in OTHER_WORDS.items():
        assert set(names) <= set(NAMES)
        assert not set(words) & set(NAMES)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "film.mp4").write_bytes(b"")
    (tmp_path / "walk.mcap").write_bytes(b"")
    (tmp_path / "studio.toml").write_text("")
    for name in ("clip", "empty"):
        (tmp_path / name).mkdir()
    (tmp_path / "clip" / "calibration.toml").write_text("")
    (tmp_path / "clip" / "videos").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("line", "status", "words"),
    [
        ("track film.mp4 -o a.mcap", 2, ("videos need --calibration FILE", "zenocap calibrate")),
        ("track film.mp4 walk.mcap", 2, ("one rig file or folder, or videos with --calibration FILE",)),
        ("track empty --up-axis z", 2, ("--up-axis: allowed with --calibration",)),
        ("track studio.toml --empty-seconds 1", 1, ("a rig file has the backgrounds of its viewers",)),
        ("track clip/videos", 2, ("did you mean", "clip?")),
        ("track clip.zip", 2, ("clip.zip: no rig and no video: unpack it",)),
        (
            "track film.mp4 sound.wav --calibration clip/calibration.toml",
            2,
            ("sound.wav: no rig and no video: sound alone",),
        ),
        ("track a.gif b.gif", 2, ("a.gif: no rig and no video: an animated picture",)),
        ("up clip.zip", 2, ("unpack it",)),
        ("track clip -o no/such/a.xyz", 2, ("a.xyz: allowed: a take (.mcap), or an export (", ".bvh")),
        ("up walk.mcap", 2, ("is a take", "a rig is needed", "zenocap show")),
        ("viewer walk.mcap --id 1", 2, ("is a take", "a rig is needed")),
        ("up empty", 1, ("no calibration.toml in this folder", "zenocap calibrate")),
        ("up studi", 1, ("no such rig", "a TOML file")),
        ("up studio", 1, ("no such rig", "did you mean", "studio.toml?")),
        ("info studio.toml", 2, ("is a rig file", "zenocap up", "zenocap track")),
        ("export walk.mcap -o no/such/a.xyz", 2, ("a.xyz: allowed: a name ending in ", ".bvh")),
        ("export clip -o a.bvh", 2, ("is a folder of videos", "zenocap track")),
        ("replay .", 2, ("is a folder", "its newest is walk.mcap")),
        ("verify film.mp4", 2, ("is a video", "zenocap track")),
        ("evaluate empty --truth a.trc", 2, ("is a folder", "there is none in it")),
        ("info wlak.mcap", 1, ("no such file", "did you mean walk.mcap?")),
        ("recover nowhere.mcap", 1, ("nowhere.mcap cannot be read: no such file",)),
        ("up nowhere.toml", 1, ("no such rig",)),
        ("viewer nowhere.toml --id 1", 1, ("no such rig",)),
        ("integrator nowhere.toml", 1, ("no such rig",)),
        ("tracker nowhere.toml", 1, ("no such rig",)),
        ("info nowhere.mcap", 1, ("no such file",)),
        ("verify nowhere.mcap", 1, ("cannot be read",)),
        ("export nowhere.mcap --to csv -o a.csv", 1, ("cannot be read",)),
        ("evaluate nowhere.mcap --truth a.trc", 1, ("cannot be read",)),
        ("router -l nonsense", 1, ("PROTOCOL/ADDRESS expected",)),
    ],
)
def test_a_missing_file_and_one_of_the_wrong_type_are_a_line_that_suggests_the_right_command(
    line: str, status: int, words: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    error = refused(*line.split(), status=status)
    assert error.startswith("error: ")
    assert [word for word in words if word not in error] == []


@pytest.mark.slow
@pytest.mark.parametrize("line", ["plan --measure --help", "track folder -o --help", "export take.mcap --to -h x"])
def test_help_is_never_the_value_of_an_option(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = line.split()
    assert f"zenocap {words[0]}" in printed(*words)
    assert not list(tmp_path.iterdir())


def test_words_after_two_dashes_are_no_options() -> None:
    assert helped(["track", "--", "--help"]) == ["track", "--", "--help"]
    assert helped(["calibrate", "board", "--square", "--help"]) == ["calibrate", "board", "--help"]
