"""Recomputing a take finds what was changed in it, and says what it cannot check."""

from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from common import codec
from common import messages as m
from common.bus.protocol import Envelope
from common.take.reading import Take, TakeError, envelope
from common.take.recording import Attachment, Recording
from common.take.setup import SETUP_FILE
from services.cli import app
from services.takes.verify.difference import difference
from services.takes.verify.recompute import Verified, verify

GOLDEN = Path(__file__).parent / "golden" / "arms.mcap"
BAP = "zenocap/demo/integrator/bap"
Change = Callable[[Envelope], Envelope | None]


def changed(path: Path, change: Change, *, setup: bool = True) -> Path:
    """A copy of the golden take with every message as `change` has it; None leaves it out."""
    take = Take(GOLDEN)
    received = [envelope(recorded) for recorded in take.messages()]
    files = tuple(Attachment(name, "", data) for name, data in take.attachments.items() if setup or name != SETUP_FILE)
    recording = Recording(path, rig="demo", start_ns=0, attachments=files)
    for each in received:
        assert each is not None
        new = change(each)
        if new is not None:
            recording.record(new)
    assert recording.close().failure is None
    return path


def with_message(received: Envelope, message: m.Message) -> Envelope:
    return Envelope(received.key, received.topic, message, received.received_ns, codec.encode(message))


def totals(found: Verified) -> tuple[int, int, int, int]:
    return tuple(count.total() for count in (found.equal, found.different, found.unlogged, found.unchecked))  # type: ignore[return-value]


def test_one_changed_angle_is_found_and_named(tmp_path: Path) -> None:
    """A pose that was changed is the first difference; viewers that were fed it say something else from there on."""

    def change(received: Envelope) -> Envelope:
        if isinstance(received.message, m.UniversalBap) and received.message.frame == 70:
            angles = received.message.angles | {"right_knee.x": 0.25}
            return with_message(received, msgspec.structs.replace(received.message, angles=angles))
        return received

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert found.different[BAP] >= 1
    assert found.first is not None
    assert (found.first.key, found.first.frame) == (BAP, 70)
    (field,) = found.first.fields
    assert field.startswith("angles.right_knee.x: logged 0.25, recomputed ")


def test_a_pose_that_is_missing_is_told(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope | None:
        return None if isinstance(received.message, m.UniversalBap) and received.message.frame == 70 else received

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert found.unlogged == {BAP: 1}
    # Both viewers were fed it: they cannot be followed from there.
    assert [reason.partition(":")[0] for reason in found.reasons] == ["viewer 1", "viewer 2"]
    assert all(f"it was fed {BAP} of" in reason for reason in found.reasons)
    assert found.unchecked.total() > 0
    assert found.different.total() == 0


def test_a_missing_silhouette_ends_the_checking_of_that_viewer_alone(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope | None:
        silhouette = received.message
        return (
            None
            if isinstance(silhouette, m.Silhouette) and (silhouette.viewer, silhouette.frame) == ("1", 80)
            else received
        )

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert len(found.reasons) == 1
    assert found.reasons[0].startswith("viewer 1: its silhouette of ")
    assert {key for key, count in found.unchecked.items() if count} == {
        "zenocap/demo/viewer/1/sighting",
        "zenocap/demo/viewer/1/bap",
    }
    assert found.equal[BAP] == verify([GOLDEN]).equal[BAP]


def test_a_missing_account_is_told(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope | None:
        handled = received.message
        return (
            None if isinstance(handled, m.Handled) and handled.service == "integrator" and handled.frame == 3 else received
        )

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert found.reasons == [
        next(reason for reason in found.reasons if reason.startswith("integrator main: what it was fed"))
    ]
    assert found.unchecked[BAP] > 0
    assert found.equal[BAP] > 0


def test_without_the_last_account_the_end_is_not_checked(tmp_path: Path) -> None:
    last = max(e.message.frame for e in handled_of("integrator"))

    def change(received: Envelope) -> Envelope | None:
        return None if isinstance(received.message, m.Handled) and received.message.frame >= last else received

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert found.reasons == ["what was said after the last account of what was handled"]
    assert found.unchecked.total() > 0
    assert found.different.total() == found.unlogged.total() == 0


def test_who_never_said_what_it_was_fed_is_named(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope | None:
        return None if isinstance(received.message, m.Handled) and received.message.service == "viewer" else received

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert found.reasons == [f"viewer {id}: the take does not have what it was fed" for id in "12"]
    assert found.equal[BAP] > 90
    assert found.unchecked[BAP] == 0


def handled_of(service: str) -> Iterator[Envelope]:
    for recorded in Take(GOLDEN).messages():
        received = envelope(recorded)
        if received and isinstance(received.message, m.Handled) and received.message.service == service:
            yield received


def test_the_same_digits_within_a_tolerance(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope:
        if isinstance(received.message, m.Sighting) and received.message.present and received.message.frame == 75:
            return with_message(received, msgspec.structs.replace(received.message, width=received.message.width + 1e-9))
        return received

    path = changed(tmp_path / "changed.mcap", change)
    assert totals(verify([path]))[1] >= 1
    found = verify([path], tolerance=1e-6)
    assert totals(found)[1:] == (0, 0, 0)
    assert found.close >= 1


def test_a_take_without_its_setup_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TakeError, match=r"old\.mcap: no attachment setup\.json"):
        verify([changed(tmp_path / "old.mcap", lambda received: received, setup=False)])


def test_a_take_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TakeError, match="there is nothing to verify"):
        verify([changed(tmp_path / "empty.mcap", lambda _: None)])
    with pytest.raises(
        TakeError, match="nothing can be verified: integrator main: the take does not have what it was fed; viewer 1: "
    ):
        verify([changed(tmp_path / "mute.mcap", lambda e: None if isinstance(e.message, m.Handled) else e)])


def test_an_account_of_keys_that_it_does_not_have_is_no_crash(tmp_path: Path) -> None:
    def change(received: Envelope) -> Envelope:
        if isinstance(received.message, m.Handled) and received.message.frame == 2:
            return with_message(received, msgspec.structs.replace(received.message, keys=[]))
        return received

    found = verify([changed(tmp_path / "changed.mcap", change)])
    assert any("it was fed key 0 of" in reason for reason in found.reasons)


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


def test_the_command_says_equal_different_or_unchecked(tmp_path: Path) -> None:
    def tampered(received: Envelope) -> Envelope:
        if isinstance(received.message, m.Assignment) and received.message.frame == 60:
            return with_message(received, msgspec.structs.replace(received.message, yaw=0.125))
        return received

    whole = CliRunner().invoke(app, ["replay", "--verify", str(GOLDEN), "--tolerance", "1e-6"])
    assert whole.exit_code == 0
    assert f"{verify([GOLDEN]).checked} derived messages recomputed" in whole.stdout
    path = changed(tmp_path / "changed.mcap", tampered)
    different = CliRunner().invoke(app, ["replay", "--verify", str(path)])
    assert different.exit_code == 1
    assert "first difference: zenocap/demo/integrator/assignment, frame 60" in different.stdout
    assert "yaw: logged 0.125, recomputed" in different.stdout
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(GOLDEN.read_bytes()[: GOLDEN.stat().st_size // 2])
    half = CliRunner().invoke(app, ["replay", "--verify", str(cut), "--tolerance", "1e-6"])
    assert half.exit_code == 3
    assert "cut before its end" in half.stdout
    wrong = CliRunner().invoke(app, ["replay", str(GOLDEN), "--tolerance", "1"])
    assert wrong.exit_code == 2
