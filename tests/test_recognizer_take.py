"""A rig with a recogniser, offline: postures in the take, recomputed byte for byte, shown by info and to Foxglove."""

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from recognizer_cases import small_model
from test_tracker_take import messages_of, with_attachments
from typer.testing import CliRunner

from common import messages as m
from common.runtime.recognizer_table import RecognizerSpec
from common.runtime.rig import Rig, demo_rig
from common.runtime.specs import Actor
from common.take.opening import attachments
from common.take.reading import Take, TakeError
from common.take.setup import POSTURES_FILE, SETUP_FILE, read_setup
from services.cli import app
from services.recognizer.file import write_model
from services.takes.track import Tracked, track
from services.takes.verify.recompute import verify

POSTURES = "zenocap/demo/recognizer/posture"


def rig_with(model: Path) -> Rig:
    """The demo's rig with an actor who boxes, which is no posture of the small model, but movement."""
    rig = demo_rig()
    viewers = tuple(replace(viewer, source=Actor("boxing", 3), preview=False) for viewer in rig.viewers)
    return replace(rig, viewers=viewers, recognizer=RecognizerSpec(model, "integrator"))


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Tracked]:
    folder = tmp_path_factory.mktemp("take")
    write_model(folder / "small.postures", small_model())
    return folder / "a.mcap", track(rig_with(folder / "small.postures"), folder / "a.mcap")


def test_the_take_has_what_was_recognised_and_with_what(tracked: tuple[Path, Tracked]) -> None:
    path, found = tracked
    assert found.problems == ()
    assert found.states["recognizer"].startswith("listening")
    said = [message for message in messages_of(path, m.Posture) if isinstance(message, m.Posture)]
    assert said
    assert all(set(one.log_likelihoods) == set(small_model().labels) for one in said)
    assert all(one.start_ns < one.end_ns <= one.captured_ns for one in said)
    take = Take(path)
    list(take.messages())
    assert take.attachments[POSTURES_FILE] == path.with_name("small.postures").read_bytes()
    recorded = read_setup(path, take.attachments[SETUP_FILE]).recognizer
    assert recorded is not None
    assert recorded.source == "integrator"


def test_it_is_recomputed_byte_for_byte(tracked: tuple[Path, Tracked]) -> None:
    path, _ = tracked
    found = verify([path])
    assert found.first is None
    assert (found.different.total(), found.unlogged.total(), found.unchecked.total()) == (0, 0, 0)
    assert found.equal[POSTURES] == len(messages_of(path, m.Posture))


def test_info_counts_them(tracked: tuple[Path, Tracked]) -> None:
    path, _ = tracked
    result = CliRunner().invoke(app, ["info", str(path)])
    assert "recognizer/posture" in result.output
    assert "postures    " in result.output
    counted = json.loads(CliRunner().invoke(app, ["info", str(path), "--json"]).output)["recognised"]
    assert counted["answers"] == len(messages_of(path, m.Posture))


def test_a_take_with_another_model_cannot_be_recomputed(tracked: tuple[Path, Tracked], tmp_path: Path) -> None:
    path, _ = tracked
    take = Take(path)
    list(take.messages())
    setup = take.attachments[SETUP_FILE]
    with pytest.raises(TakeError, match=r"attachment recognizer\.postures is missing"):
        verify([with_attachments(path, tmp_path / "b.mcap", {SETUP_FILE: setup})])
    with pytest.raises(TakeError, match=r"attachment recognizer\.postures: sha256 = [0-9a-f]{12}\.\.\.: allowed: "):
        verify([with_attachments(path, tmp_path / "c.mcap", {SETUP_FILE: setup, POSTURES_FILE: b"another"})])


def test_a_take_whose_model_was_not_at_hand_is_recomputed_but_for_its_postures(
    tracked: tuple[Path, Tracked], tmp_path: Path
) -> None:
    path, _ = tracked
    take = Take(path)
    list(take.messages())
    recorded = read_setup(path, take.attachments[SETUP_FILE])
    assert recorded.recognizer is not None
    unknown = msgspec.structs.replace(recorded.recognizer, model_sha256=None)
    setup = msgspec.json.encode(msgspec.structs.replace(recorded, recognizer=unknown))
    found = verify([with_attachments(path, tmp_path / "b.mcap", {SETUP_FILE: setup})])
    assert found.first is None
    assert found.unchecked == {POSTURES: len(messages_of(path, m.Posture))}
    assert found.reasons == ["recognizer main: the take does not have the model that it was made with"]


def test_a_model_on_another_machine_is_not_attached() -> None:
    names = {attachment.name for attachment in attachments(rig_with(Path("on-another-machine.postures")))}
    assert POSTURES_FILE not in names
