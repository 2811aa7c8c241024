"""Answers to unknown commands, to arguments of the wrong kind, and to `--help` at any place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from itertools import takewhile
from pathlib import Path

import typer
from typer.core import TyperGroup

from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS
from zenocap.common.rig.sources import VIDEO_SUFFIXES

OTHER_FILES: Mapping[tuple[str, ...], str] = {  # what is given instead of videos, and what to do
    (".wav", ".mp3", ".m4a", ".flac", ".ogg"): "sound alone; the videos themselves are needed",
    (".zip", ".tar", ".gz", ".tgz", ".7z", ".rar"): "unpack it, and give the folder",
    (".gif", ".webp"): "an animated picture has no true times; the video from the camera is needed",
}
CUTOFF = 0.75  # similarity of a misspelt command, 0 to 1; "cameras" and "certs" have 0.67
# Words that users try, and the commands that do it.
OTHER_WORDS = {
    ("camera", "devices", "device", "webcam", "webcams", "v4l2", "usb", "rtsp", "stream", "streams", "onvif"): ("cameras",),
    ("calibration", "intrinsics", "extrinsics", "chessboard"): ("calibrate",),
    ("start", "run", "live", "launch", "serve", "capture"): ("up", "demo"),
    ("process", "video", "videos", "offline", "solve", "mocap"): ("track",),
    ("convert", "save", "blender", "fbx", "download", *FORMATS.own): ("export",),
    ("play", "playback", "player"): ("show", "replay"),
    ("view", "watch", "open", "gui", "ui", "page", "browser", "web", "viz", "visualize"): ("show", "animator"),
    ("movie", "mp4", "png", "picture", "image", "draw", "animate"): ("render",),
    ("check", "diagnose", "test", "problems"): ("doctor",),
    ("wizard", "init", "configure", "config", "new"): ("setup",),
    ("monitor", "status", "stats", "ps", "fps", "latency"): ("top",),
    ("ls", "list", "inspect", "summary", "metadata"): ("info",),
    ("log", "rec"): ("record", "film"),
    ("filming", "shoot", "recording"): ("film",),
    ("benchmark", "bench", "stress", "capacity"): ("load",),
    ("accuracy", "angles", "compare", "error", "errors", "score", "mpjpe"): ("evaluate",),
    ("repair", "fix", "restore"): ("recover",),
    ("synchronize", "synchronise", "align", "offset", "offsets", "clap"): ("sync",),
    ("recompute", "reproduce", "validate"): ("verify",),
    ("train", "learn", "model"): ("prior", "posture"),
    ("gesture", "gestures", "action", "actions", "classify"): ("recognizer", "posture"),
    ("recognize", "recognise", "recogniser"): ("recognizer", "posture"),
    ("certificate", "certificates", "tls", "security", "keys"): ("certs",),
    ("compile", "jit"): ("warmup",),
}  # fmt: skip


class WrongArgument(UserError):
    """An argument of another kind than the command needs: wrong usage, exit status 2."""


class CommandGroup(TyperGroup):
    """The commands of zenocap; an unknown one is answered with similar ones, and `--help` anywhere is the help."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]  # of private types
        return super().parse_args(ctx, helped(args))

    def resolve_command(self, ctx: typer.Context, args: list[str]) -> object:  # type: ignore[override]  # of private types
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            ctx.fail(unknown_command(args[0], list(self.commands)))
        return super().resolve_command(ctx, args)


def helped(words: list[str]) -> list[str]:
    """The words of a command line; those that ask for help, as in `plan --measure --help`, without their options.

    An option would take `--help` as its value, and the name of a file.
    """
    options = list(takewhile(lambda word: word != "--", words))
    if not {"-h", "--help"} & set(options):
        return words
    return [*takewhile(lambda word: not word.startswith("-"), words), "--help"]


def unknown_command(word: str, commands: Sequence[str]) -> str:
    """One line for a word that is no command."""
    suffix = Path(word).suffix.lower()
    if suffix == ".toml":
        return f"{word} is a rig file, not a command: zenocap up {word}"
    if suffix == ".mcap":
        return f"{word} is a take, not a command: zenocap show {word}, or zenocap info {word}"
    if suffix in VIDEO_SUFFIXES:
        return f"{word} is a video, not a command: see zenocap track --help"
    found = [name for words, names in OTHER_WORDS.items() if word.lower() in words for name in names if name in commands]
    found = found or get_close_matches(word.lower(), commands, cutoff=CUTOFF)
    if found:
        return f"no command {word!r}; did you mean {' or '.join(f'zenocap {name}' for name in found)}?"
    return f"no command {word!r}; zenocap --help lists the commands"


def check_no_other_file(path: Path) -> None:
    """Raise WrongArgument for a file of sound, an archive or an animated picture, by its suffix: no rig, and no video."""
    for suffixes, remedy in OTHER_FILES.items():
        if path.suffix.lower() in suffixes:
            raise WrongArgument(f"{path}: no rig and no video: {remedy}")


def check_rig_path(path: Path) -> None:
    """Raise WrongArgument or UserError when `path` is certainly no rig: the text names the command for what it is."""
    if path.suffix.lower() == ".mcap":
        raise WrongArgument(
            f"{path} is a take; a rig is needed: a TOML file, or a folder with calibration.toml and videos/. "
            f"To see the take: zenocap show {path}; to publish its messages again: zenocap replay {path}"
        )
    if path.suffix.lower() in VIDEO_SUFFIXES and (path.is_file() or not path.exists()):
        raise WrongArgument(
            f"{path} is a single video; needed: videos of two or more calibrated cameras: zenocap track VIDEO VIDEO ... "
            "--calibration FILE, or FOLDER/videos/NAME.mp4 beside FOLDER/calibration.toml: zenocap track FOLDER"
        )
    check_no_other_file(path)
    if path.is_dir():
        if not (path / "calibration.toml").is_file():
            if path.name == "videos" and (path.parent / "calibration.toml").is_file():
                raise WrongArgument(f"{path}: the videos of a folder, which is needed itself: did you mean {path.parent}?")
            files = sorted(file.name for file in path.glob("*.toml"))
            others = f"; or one of its files: {', '.join(files)}" if files else ""
            raise UserError(
                f"{path}: no calibration.toml in this folder; needed: the cameras' calibration. `zenocap calibrate board` "
                f"measures it, `zenocap calibrate check FILE` reads one of anipose, Pose2Sim, OpenCV or Qualisys{others}"
            )
        return
    if not path.exists():
        toml = path.with_name(f"{path.name}.toml")
        similar = f"; did you mean {toml}?" if toml.is_file() else ""
        raise UserError(
            f"{path}: no such rig: needed: a TOML file, or a folder with calibration.toml and videos/{similar}; "
            "zenocap demo needs none"
        )


def check_take_path(path: Path) -> None:
    """Raise WrongArgument or UserError when `path` is certainly no take: the text names the command for what it is."""
    if path.suffix.lower() == ".toml":
        raise WrongArgument(
            f"{path} is a rig file; a take (.mcap) is needed. `zenocap up {path}` records one, "
            f"`zenocap track {path} -o take.mcap` makes one of its videos"
        )
    if path.suffix.lower() in VIDEO_SUFFIXES:
        raise WrongArgument(f"{path} is a video; a take (.mcap) is needed: zenocap track FOLDER -o take.mcap makes one")
    if path.is_dir():
        if (path / "calibration.toml").is_file():
            raise WrongArgument(
                f"{path} is a folder of videos; a take (.mcap) is needed: zenocap track {path} -o take.mcap makes one"
            )
        takes = sorted(path.glob("*.mcap"), key=lambda take: take.stat().st_mtime)
        newest = f"; its newest is {takes[-1]}" if takes else ", and there is none in it"
        raise WrongArgument(f"{path} is a folder; a take (.mcap) is needed{newest}")
    if not path.exists():
        near = sorted(str(take) for take in path.parent.glob("*.mcap")) if path.parent.is_dir() else []
        similar = get_close_matches(str(path), near, n=1, cutoff=CUTOFF)
        raise UserError(f"{path} cannot be read: no such file{f'; did you mean {similar[0]}?' if similar else ''}")
