"""Rig with a recognizer, offline: postures in the take, recomputed byte for byte."""

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from tests.common.recording.test_tracker_take import messages_of, with_attachments
from tests.support.command import app
from tests.support.command_receivers import http_receiver
from tests.support.recognizer_cases import small_model
from tests.support.stored import stored_files
from zenocap.common import messages as m
from zenocap.common.errors import UserError
from zenocap.common.recording.opening import attachments
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import POSTURES_FILE, SETUP_FILE, read_setup
from zenocap.common.rig.commands import posture_commands
from zenocap.common.rig.recognizer import RecognizerSpec
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import Actor
from zenocap.services.recognizer.model_file import write_model
from zenocap.tools.takes.track import Tracked, track
from zenocap.tools.takes.verify.recompute import verify

pytestmark = pytest.mark.slow

POSTURES = "zenocap/demo/recognizer/posture"


def rig_with(model: Path) -> Rig:
    """The demo rig with a simulated person who squats with the arms forward: no posture of the small model."""
    rig = demo_rig("two-view")
    viewers = tuple(replace(viewer, source=Actor("squat-arms-forward", 3), preview=False) for viewer in rig.viewers)
    return replace(rig, viewers=viewers, recognizer=RecognizerSpec(model, "integrator"))


def files_of(take: Path) -> dict[str, bytes]:
    """Attachments."""
    reader = TakeReader(take)
    list(reader.messages())
    return dict(reader.attachments)


def tracked(folder: Path) -> Tracked:
    write_model(folder / "small.postures", small_model())
    return track(rig_with(folder / "small.postures"), folder / "a.mcap")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The take, beside its model."""
    sources = [__name__, "zenocap.tools.takes.track"]
    return stored_files(tmp_path_factory.mktemp("take"), tracked, "recognizer", sources=sources) / "a.mcap"


@pytest.mark.nightly
def test_tracking_reports_the_state_of_the_recognizer(path: Path, tmp_path: Path) -> None:
    found = tracked(tmp_path)
    assert found.problems == ()
    assert found.states["recognizer"].startswith("running")
    assert (tmp_path / "a.mcap").read_bytes() == path.read_bytes()


def test_the_take_has_postures_and_their_model(path: Path) -> None:
    posture_messages = messages_of(path, m.Posture)
    assert posture_messages
    assert all(set(one.log_likelihoods) == set(small_model().labels) for one in posture_messages)
    assert all(one.start_ns < one.end_ns <= one.captured_ns for one in posture_messages)
    assert files_of(path)[POSTURES_FILE] == path.with_name("small.postures").read_bytes()
    assert read_setup(path, files_of(path)[SETUP_FILE]).recognizer.source == "integrator"


def test_info_counts_postures(path: Path) -> None:
    result = CliRunner().invoke(app, ["info", str(path)])
    assert "recognizer/posture" in result.output
    assert "postures    " in result.output
    counted = json.loads(CliRunner().invoke(app, ["info", str(path), "--json"]).output)["recognised"]
    assert counted["answers"] == len(messages_of(path, m.Posture))


def test_a_take_with_another_model_cannot_be_recomputed(path: Path, tmp_path: Path) -> None:
    setup = files_of(path)[SETUP_FILE]
    with pytest.raises(UserError, match=r"attachment recognizer\.postures is missing"):
        verify([with_attachments(path, tmp_path / "b.mcap", {SETUP_FILE: setup})])
    with pytest.raises(UserError, match=r"attachment recognizer\.postures: sha256 = [0-9a-f]{12}\.\.\.: allowed: "):
        verify([with_attachments(path, tmp_path / "c.mcap", {SETUP_FILE: setup, POSTURES_FILE: b"another"})])


@pytest.mark.nightly
def test_a_take_without_its_model_is_recomputed_except_for_postures(path: Path, tmp_path: Path) -> None:
    recorded = read_setup(path, files_of(path)[SETUP_FILE])
    unknown = msgspec.structs.replace(recorded.recognizer, model_sha256=None)
    setup = msgspec.json.encode(msgspec.structs.replace(recorded, recognizer=unknown))
    found = verify([with_attachments(path, tmp_path / "b.mcap", {SETUP_FILE: setup})])
    assert found.first is None
    assert found.unchecked == {POSTURES: len(messages_of(path, m.Posture)), "zenocap/demo/integrator/verdict": 1}
    assert [str(reason) for reason in found.reasons] == ["recognizer main: its model is not in the take"]


def test_a_model_on_another_machine_is_not_attached() -> None:
    names = {attachment.name for attachment in attachments(rig_with(Path("on-another-machine.postures")), {})}
    assert POSTURES_FILE not in names


@pytest.mark.nightly
def test_tracking_and_verifying_perform_no_commands(tmp_path: Path) -> None:
    rig = demo_rig("two-view")
    viewers = tuple(replace(viewer, source=Actor("raise-both-arms", 3), preview=False) for viewer in rig.viewers)
    with http_receiver() as receiver:
        commands = posture_commands({"raise-both-arms": {"action": "http", "url": receiver.url}}, ())
        rig = replace(rig, viewers=viewers, recognizer=replace(rig.recognizer, commands=commands))
        track(rig, tmp_path / "a.mcap")
        labels = [message.label for message in messages_of(tmp_path / "a.mcap", m.Posture)]
        assert "raise-both-arms" in labels
        assert verify([tmp_path / "a.mcap"]).equal[POSTURES] == len(labels)
        assert receiver.requests == []
    assert messages_of(tmp_path / "a.mcap", m.CommandResult) == []
