"""Command lines that save a take for a page, and what is read from their output."""

from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.package_rows import add_row
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS, ExportFormat
from zenocap.common.formats.trajectories import MATRICES
from zenocap.common.recording.summary import read_summary
from zenocap.services.animator import save_command
from zenocap.services.animator.page.page_messages import decode_command
from zenocap.services.animator.page.save_messages import SaveFormat, SaveTake

STO = ExportFormat("sto", "more:write", (".sto", ".storage"), axes=("opensim",), points=True)
TAKE, OUTPUT = Path("/takes/walk.mcap"), Path("/takes/.zenocap-x/walk.bvh")


def line(request: SaveTake, shift: float = 0.0, *, raw: bool = False) -> list[str]:
    return save_command.command_line(TAKE, OUTPUT, request, shift, raw=raw)[4:]


def test_the_name_has_the_take_the_part_and_the_format() -> None:
    assert save_command.file_name("walk", SaveTake("bvh")) == "walk.bvh"
    assert save_command.file_name("walk", SaveTake("usd", start_s=2.5, end_s=8.0)) == "walk_2.50-8.00s.usdc"
    assert save_command.file_name("walk", SaveTake("png", start_s=2.5)) == "walk_2.50s.png"
    assert save_command.file_name("walk", SaveTake("csv", end_s=8.0)) == "walk_0.00-8.00s.csv"


def test_options_of_a_format_and_no_others_are_given() -> None:
    common = [str(TAKE), "-o", str(OUTPUT), "--remote"]
    assert line(SaveTake("bvh", joints="coco", axes="z-up")) == ["export", *common, "--to", "bvh", "--axes", "z-up"]
    assert line(SaveTake("glb", axes="z-up"), raw=True) == ["export", *common, "--raw", "--to", "glb"]
    found = line(SaveTake("trc", 1.0, 2.0, "halpe", "opensim", 6.0), shift=10.0)
    part = ["--from", "10.999500000s", "--until", "12.000500000s", "--smooth", "6"]
    assert found == ["export", *common, *part, "--to", "trc", "--joints", "halpe", "--axes", "opensim"]
    found = line(SaveTake("mp4", view="front", follow=True, trails_s=1.0, theme="dark"))
    drawn = ["--view", "front", "--size", "1280x720", "--theme", "dark", "--trails", "1", "--follow"]
    assert found == ["render", *common, *drawn]


def test_a_page_saves_every_format_that_is_one_file() -> None:
    assert set(FORMATS.own) - set(save_command.page_formats()) == {"opensim"}  # a folder, made for a model
    choices = {one.name: one for one in save_command.format_choices()}
    assert list(choices) == list(save_command.page_formats())
    assert choices["bvh"] == SaveFormat("bvh", "BVH: Blender, Unity", points=False, axes=list(MATRICES))
    assert choices["mot"].axes == ["y-up", "opensim"]


def test_a_format_of_a_package_is_saved_as_an_own_one(monkeypatch: pytest.MonkeyPatch) -> None:
    add_row(monkeypatch, FORMATS, "sto", STO)
    assert save_command.format_choices()[-1] == SaveFormat("sto", "STO", points=True, axes=["opensim"])
    request = SaveTake("sto", 2.5, axes="z-up")
    assert save_command.file_name("walk", request) == "walk_2.50s.sto"
    assert line(request)[-6:] == ["--to", "sto", "--joints", "zenocap", "--axes", "opensim"]


def test_a_format_that_cannot_be_imported_is_not_offered_and_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    add_row(monkeypatch, FORMATS, "sto", None)
    assert set(FORMATS.names()) - set(save_command.page_formats()) == {"opensim", "sto"}
    assert "not offered on the page: 'sto' of the package more: gone:ROW cannot be imported" in caplog.text


@pytest.mark.parametrize(
    "field", ['"kind":7', '"kind":"bvh","start_s":-1', '"kind":"bvh","smooth_hz":0', '"kind":"bvh","take":"x.mcap"']
)
def test_other_values_are_refused(field: str) -> None:
    assert decode_command('{"type":"save_take","kind":"bvh","start_s":1.5}') == SaveTake("bvh", 1.5)
    with pytest.raises(ValueError, match="invalid command from a page"):
        decode_command(f'{{"type":"save_take",{field}}}')


def test_positions_of_the_player_become_times_since_frame_0(tmp_path: Path) -> None:
    """The first message, at which the player begins, may be earlier than frame 0."""
    begin_ns = START_NS - 3_000_000_000
    early = built(m.Posture, captured_ns=begin_ns, label="squat", start_ns=begin_ns, end_ns=begin_ns)
    take = write_take(tmp_path / "a.mcap", [early, *messages_of_track(moving(20, rate=10.0))])
    assert read_summary(take).start_ns == begin_ns
    assert save_command.shift_s(take, SaveTake("bvh", 3.5, 4.0), raw=False) == pytest.approx(-3.0)
    for request in (SaveTake("bvh", 5.0), SaveTake("bvh", None, 2.9)):
        with pytest.raises(UserError, match=r"the part has no pose: allowed: between 3\.00 and 4\.90 s"):
            save_command.shift_s(take, request, raw=False)


def test_a_cut_take_has_no_parts(tmp_path: Path) -> None:
    take = write_take(tmp_path / "a.mcap", messages_of_track(moving(20)))
    take.write_bytes(take.read_bytes()[:-100])
    with pytest.raises(UserError, match=r"its index is lost.*zenocap recover"):
        save_command.shift_s(take, SaveTake("bvh", 1.0), raw=False)


def test_output_of_the_commands() -> None:
    assert save_command.progress_of('{"done": 4, "total": 10}') == save_command.Progress(4, 10)
    assert save_command.progress_of('{"done": 0, "total": null}') == save_command.Progress(0)
    assert save_command.progress_of("error: x") is None
    lines = ["note: 2 frames without pose: blank", "lost: cut before its end", "drawing"]
    assert save_command.notes_of(lines) == ["2 frames without pose: blank", "lost: cut before its end"]
    assert save_command.reason(["note: a", "error: x: allowed: y", "z"], 1) == "x: allowed: y"
    usage = ["Usage: export", "╭─ Error ─╮", "│ no such option │", "╰──╯"]
    assert save_command.reason(usage, 2) == "the command ended with status 2: no such option"
    assert save_command.reason([], -9) == "the command ended with status -9"
