"""Recomputing a take finds changed messages, and names the parts that it cannot check.

The take is tracked on this machine: golden takes may come from another type of processor, whose last digits differ.
"""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import msgspec
import pytest

from tests.golden.make import make_arms
from tests.support.command import zenocap
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.messages import PROCESS, SENT
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.topics import HANDLED, HEALTH, UNIVERSAL_BAP
from zenocap.tools.takes.verify.recompute import verify
from zenocap.tools.takes.verify.result import Reason, Verification, data_of, difference

pytestmark = pytest.mark.slow

BAP = "zenocap/demo/integrator/bap"
Change = Callable[[Envelope], Envelope | None]
M = TypeVar("M", bound=m.Message)


@pytest.fixture(scope="session")
def arms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The take of the simulated person who raises both arms, tracked here."""
    path = tmp_path_factory.mktemp("verify") / "arms.mcap"
    make_arms(path)
    return path


def changed(arms: Path, path: Path, change: Change, *, setup: bool = True, healths: Sequence[Envelope] = ()) -> Path:
    """A copy of the take with every message as `change` returns it; None leaves it out.  healths: before and after them."""
    take = TakeReader(arms)
    received = [*healths[:1], *take.envelopes(), *healths[1:]]
    files = tuple(Attachment(name, "", data) for name, data in take.attachments.items() if setup or name != SETUP_FILE)
    recording = Recording(path, rig="demo", start_ns=0, attachments=files)
    for each in received:
        new = change(each)
        if new is not None:
            recording.record(new)
    assert recording.close().failure is None
    return path


def without(arms: Path, folder: Path, dropped: Callable[[m.Message], bool]) -> Verification:
    """Result for a copy of the take without some of its messages."""
    path = folder / "changed.mcap"
    path.unlink(missing_ok=True)
    return verify([changed(arms, path, lambda one: None if dropped(one.message) else one)])


def altering(kind: type[M], frame: int, fields: Callable[[M], dict[str, object]]) -> Change:
    """Other values in some fields of the messages of a type and frame."""

    def change(received: Envelope) -> Envelope:
        if not isinstance(received.message, kind) or received.message.frame != frame:
            return received
        message = msgspec.structs.replace(received.message, **fields(received.message))
        return Envelope(received.key, received.topic, message, received.received_ns, codec.encode(message))

    return change


def health(at_ns: int, poses: int) -> Envelope:
    """Of the integrator, which has sent so many poses."""
    counts = {PROCESS: 1, SENT + UNIVERSAL_BAP.name: poses}
    message = m.Health(
        frame=0, captured_ns=at_ns, service="integrator", id="main", state="", rate=0.0, stages_ms={}, counts=counts
    )
    return Envelope(HEALTH.at("demo", service="integrator", id="main"), HEALTH, message, at_ns, codec.encode(message))


def totals(found: Verification) -> tuple[int, int, int, int]:
    return tuple(count.total() for count in (found.equal, found.different, found.unlogged, found.unchecked))  # type: ignore[return-value]


def test_one_changed_angle_is_found_and_named(arms: Path, tmp_path: Path) -> None:
    """A changed pose is the first difference; the viewers that received it publish other messages from there on."""
    change = altering(m.UniversalBap, 70, lambda one: {"angles": one.angles | {"right_knee.x": 0.25}})
    found = verify([changed(arms, tmp_path / "changed.mcap", change)])
    assert found.different[BAP] >= 1
    assert found.first is not None
    assert (found.first.key, found.first.frame) == (BAP, 70)
    (field,) = found.first.fields
    assert field.startswith("angles.right_knee.x: logged 0.25, recomputed ")


@pytest.mark.nightly
def test_a_missing_pose_is_reported(arms: Path, tmp_path: Path) -> None:
    found = without(arms, tmp_path, lambda one: isinstance(one, m.UniversalBap) and one.frame == 70)
    assert found.unlogged == {BAP: 1}
    # It was an input of these services: recomputation is impossible from there on.
    assert [reason.service for reason in found.reasons] == [("viewer", "1"), ("viewer", "2"), ("recognizer", "main")]
    assert all(f"its input {BAP} of" in reason.text for reason in found.reasons)
    assert found.unchecked.total() > 0
    assert found.different.total() == 0


def test_a_pose_that_was_lost_on_the_way_to_the_log_is_no_difference(arms: Path, tmp_path: Path) -> None:
    """The healths of its service count it."""
    baps = [one for one in TakeReader(arms).envelopes() if one.key == BAP]
    healths = [health(one.received_ns, count) for one, count in ((baps[0], 0), (baps[-1], len(baps)))]

    def lost(*poses: Envelope) -> Verification:
        path = tmp_path / f"{len(poses)}.mcap"
        return verify([changed(arms, path, lambda one: None if one in poses else one, healths=healths)])

    found = lost(baps[-1])
    assert (found.failed, found.complete) == (False, False)
    assert found.lost == {BAP: 1}
    assert "1 of its messages universal_bap were lost on the way to the log" in [reason.text for reason in found.reasons]
    assert lost(*baps[-2:]).lost == {BAP: 2}
    assert not lost().reasons


@pytest.mark.nightly
def test_a_missing_silhouette_ends_the_check_of_that_viewer_only(arms: Path, tmp_path: Path) -> None:
    found = without(arms, tmp_path, lambda one: isinstance(one, m.Silhouette) and (one.viewer, one.frame) == ("1", 80))
    assert len(found.reasons) == 1
    assert str(found.reasons[0]).startswith("viewer 1: its silhouette of ")
    assert {key for key, count in found.unchecked.items() if count} == {
        "zenocap/demo/viewer/1/sighting",
        "zenocap/demo/viewer/1/bap",
        "zenocap/demo/integrator/verdict",  # it rests on all of them
    }
    assert found.equal[BAP] == verify([arms]).equal[BAP]


@pytest.mark.nightly
def test_a_missing_input_trace_is_reported(arms: Path, tmp_path: Path) -> None:
    found = without(
        arms, tmp_path, lambda one: isinstance(one, m.Handled) and (one.service, one.frame) == ("integrator", 3)
    )
    assert found.reasons == [
        next(reason for reason in found.reasons if str(reason).startswith("integrator main: its inputs before"))
    ]
    assert found.unchecked[BAP] > 0
    assert found.equal[BAP] > 0


@pytest.mark.nightly
def test_without_the_last_input_trace_the_end_is_not_checked(arms: Path, tmp_path: Path) -> None:
    traces = (one.message for one in TakeReader(arms).envelopes((HANDLED,)))
    last = max(trace.frame for trace in traces if trace.service == "integrator")
    found = without(arms, tmp_path, lambda one: isinstance(one, m.Handled) and one.frame >= last)
    assert [str(reason) for reason in found.reasons] == ["published after the last input trace"]
    assert found.unchecked.total() > 0
    assert found.different.total() == found.unlogged.total() == 0


@pytest.mark.nightly
def test_a_service_without_input_trace_is_named(arms: Path, tmp_path: Path) -> None:
    found = without(arms, tmp_path, lambda one: isinstance(one, m.Handled) and one.service == "viewer")
    assert found.reasons == [Reason(("viewer", id), "its input trace is not in the take") for id in "12"]
    assert found.equal[BAP] > 90
    assert found.unchecked[BAP] == 0


@pytest.mark.nightly
def test_numbers_may_differ_by_the_tolerance(arms: Path, tmp_path: Path) -> None:
    change = altering(m.Sighting, 75, lambda one: {"width": one.width + 1e-9})
    path = changed(arms, tmp_path / "changed.mcap", change)
    assert totals(verify([path]))[1] >= 1
    found = verify([path], tolerance=1e-6)
    assert totals(found)[1:] == (0, 0, 0)
    assert found.close >= 1


def test_a_take_without_its_setup_is_refused(arms: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"old\.mcap: no attachment setup\.json"):
        verify([changed(arms, tmp_path / "old.mcap", lambda received: received, setup=False)])


def test_a_take_without_messages_is_refused(arms: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is nothing to verify"):
        without(arms, tmp_path, lambda _: True)
    with pytest.raises(
        UserError, match=r"nothing can be verified: integrator main: its input trace is not in the take; .*viewer 1: "
    ):
        without(arms, tmp_path, lambda one: isinstance(one, m.Handled))


def test_an_input_trace_with_unknown_keys_is_reported(arms: Path, tmp_path: Path) -> None:
    found = verify([changed(arms, tmp_path / "changed.mcap", altering(m.Handled, 2, lambda _: {"keys": []}))])
    assert any("its input key 0 of" in reason.text for reason in found.reasons)


def test_numbers_names_and_lengths_differ_field_by_field() -> None:
    one = m.UniversalBap(
        frame=1, captured_ns=2, position=(0.0, 1.0, 2.0), angles={"a": 1.0, "b": 2.0}, scores={}, views={"1": "facade"},
        stale=[], lost=[],
    )  # fmt: skip
    other = msgspec.structs.replace(one, position=(0.0, 1.5, 2.0), angles={"a": 1.0, "c": 2.0}, stale=["2"])
    found = difference("key", one, other)
    assert found is not None
    assert found.fields == (
        "position[1]: logged 1.0, recomputed 1.5",
        "angles.b: logged 2.0, recomputed 'nothing'",
        "angles.c: logged 'nothing', recomputed 2.0",
        "stale: logged [], recomputed ['2']",
    )
    assert difference("key", one, one) is None


@pytest.mark.nightly
def test_the_command_reports_equal_different_and_unchecked(arms: Path, tmp_path: Path) -> None:
    status, out, _ = zenocap("verify", arms)
    assert (status, f"{verify([arms]).checked} derived messages recomputed" in out) == (0, True)
    path = changed(arms, tmp_path / "changed.mcap", altering(m.Assignment, 60, lambda _: {"yaw": 0.125}))
    status, out, _ = zenocap("verify", path)
    assert (status, "first difference: zenocap/demo/integrator/assignment, frame 60" in out) == (1, True)
    assert "yaw: logged 0.125, recomputed" in out
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(arms.read_bytes()[:-50_000])  # the posture model at the start is most of the take's 1.2 MB
    status, out, _ = zenocap("verify", cut)
    assert (status, "cut before its end" in out) == (3, True)
    assert zenocap("verify", arms, "--tolerance", "2")[0] == 2


def test_the_data_of_a_verification_are_json() -> None:
    """Counters were none: `--json` ended with a traceback."""
    found = Verification(equal=Counter({"a/pose": 2}), reasons=[Reason(None, "no model")])
    data = json.loads(json.dumps(data_of(found, 1.0)))
    assert (data["equal"], data["different"], data["reasons"]) == ({"a/pose": 2}, {}, ["no model"])
