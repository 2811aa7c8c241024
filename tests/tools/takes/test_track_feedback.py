"""Offline tracking with the pose fed back to the viewers."""

from dataclasses import replace
from pathlib import Path

import pytest

from zenocap.common.messages import Handled, Silhouette
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import Actor, AdaptiveBackground
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import track
from zenocap.tools.takes.verify.recompute import verify

pytestmark = pytest.mark.slow


def rig(*, feedback: bool) -> Rig:
    """The demo rig of the tracker, small, with a simulated person who raises both arms once."""
    small = at_working_size(demo_rig(), (160, 120), None)
    changed = {"source": Actor("raise-both-arms", 3), "background": AdaptiveBackground(), "feedback": feedback}
    return replace(small, viewers=tuple(replace(viewer, **changed) for viewer in small.viewers))


def silhouettes(take: Path) -> list[bytes]:
    return [
        found.data
        for recorded in Take(take).messages()
        if (found := envelope(recorded)) and isinstance(found.message, Silhouette)
    ]


@pytest.mark.nightly
def test_two_runs_are_equal_for_any_number_of_cores_and_the_poses_are_traced_inputs(tmp_path: Path) -> None:
    one, two, off = tmp_path / "one.mcap", tmp_path / "two.mcap", tmp_path / "off.mcap"
    result = track(rig(feedback=True), one, jobs=1)
    assert result.poses > 10
    assert result.problems == ()
    track(rig(feedback=True), two, jobs=2)
    assert one.read_bytes() == two.read_bytes()
    track(rig(feedback=False), off)
    assert len(silhouettes(one)) == len(silhouettes(off)) > 0
    assert silhouettes(one) != silhouettes(off)
    received = [found.message for recorded in Take(one).messages() if (found := envelope(recorded))]
    keys = {
        key for message in received if isinstance(message, Handled) and message.service == "viewer" for key in message.keys
    }
    assert any(key.endswith("tracker/pose") for key in keys)
    found = verify([one])
    assert sum(found.different.values()) == 0
    assert sum(found.equal.values()) > 0
