"""Table of services, and the services of a rig from its file."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.recording.setup_file import recorded_rig
from zenocap.common.rig.methods import METHODS, method_of
from zenocap.common.rig.recognizer import RecognizerTable, recognizer_spec
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.security import allowed_members
from zenocap.common.rig.services import (
    OF_RIGS,
    SERVICES,
    TIMEKEEPER,
    file_name,
    kinds_of,
    services_of,
    sort_key,
    title,
    warmup_parts,
)
from zenocap.common.rig.tracker import TrackerTable, tracker_spec
from zenocap.common.topics import TOPICS, service_at
from zenocap.tools.cli.main import COMMANDS
from zenocap.tools.operate.warmup.parts import PARTS

TWO_VIEW = replace(demo_rig("two-view"), recognizer=None)
HYBRID = replace(TWO_VIEW, method="hybrid", tracker=tracker_spec(TrackerTable(), "hybrid", True, Path()))
BOTH = replace(HYBRID, method="both")
WITH_RECOGNIZER = replace(TWO_VIEW, recognizer=recognizer_spec(RecognizerTable(), "two-view", Path()))
RIGS = (TWO_VIEW, HYBRID, BOTH, WITH_RECOGNIZER)


def test_every_service_has_a_folder_with_a_shell_and_a_command() -> None:
    commands = {name for group in COMMANDS.values() for name in group}
    for kind in SERVICES:
        assert (ROOT / "services" / kind.name / "shell.py").is_file()
        assert (kind.command or kind.name).split()[0] in commands
    assert {path.parent.name for path in (ROOT / "services").glob("*/shell.py")} == {kind.name for kind in SERVICES}
    assert {path.parent.name for path in (ROOT / "services").glob("*/step.py")} == set(OF_RIGS)
    assert TIMEKEEPER in OF_RIGS


def test_no_rig_runs_and_no_certificate_names_a_service_of_a_machine() -> None:
    """What a camera host does is asked of it on keys of its machine."""
    assert [kind.name for kind in SERVICES if not kind.of_rig] == ["camera"]
    for rig in RIGS:
        assert "camera" not in dict(services_of(rig))
        assert "camera" not in {member.service for member in allowed_members(rig)}


def test_the_services_of_a_rig() -> None:
    viewers = (("viewer", "1"), ("viewer", "2"))
    integrator, animator = ("integrator", "main"), ("animator", "main")
    assert services_of(TWO_VIEW) == (*viewers, integrator, animator)
    assert services_of(HYBRID) == services_of(BOTH) == (*viewers, integrator, ("tracker", "main"), animator)
    assert services_of(WITH_RECOGNIZER, required=True) == (*viewers, integrator, ("recognizer", "main"))


@pytest.mark.parametrize("rig", RIGS)
def test_a_take_has_the_services_of_its_rig(rig: Rig) -> None:
    assert services_of(recorded_rig(rig)) == services_of(rig)


def test_services_whose_inputs_are_in_the_take_are_recomputed() -> None:
    assert [kind.name for kind in kinds_of(TWO_VIEW) if kind.recomputed(TWO_VIEW)] == ["viewer", "integrator"]
    assert [kind.name for kind in kinds_of(HYBRID) if kind.recomputed(HYBRID)] == ["integrator", "tracker"]
    assert [kind.name for kind in kinds_of(BOTH) if kind.recomputed(BOTH)] == ["viewer", "integrator", "tracker"]


def test_poses_of_a_packages_method_are_not_recomputed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pose service is not known to `zenocap verify`; all that its take shares with others is."""
    for rig, left in ((TWO_VIEW, ["viewer"]), (HYBRID, ["integrator"])):
        row = replace(method_of(rig.method), name="other", recomputes_pose=False)
        monkeypatch.setitem(METHODS._rows, "other", row)
        other = replace(rig, method="other")
        assert [kind.name for kind in kinds_of(other) if kind.recomputed(other)] == left


def test_the_warmup_parts_of_a_rig() -> None:
    assert warmup_parts(TWO_VIEW) == ("silhouettes", "actor", "tracking")
    assert warmup_parts(HYBRID) == ("silhouettes", "actor", "tracker")
    assert warmup_parts(BOTH) == ("silhouettes", "actor", "tracking", "tracker")
    assert set().union(*map(warmup_parts, RIGS)) <= set(PARTS)


def test_file_names_titles_and_order_of_services() -> None:
    assert (file_name(("viewer", "1")), title(("viewer", "1"))) == ("viewer-1", "viewer 1")
    assert file_name(("integrator", "main")) == title(("integrator", "main")) == "integrator"
    keys = [("viewer", "10"), ("other", "main"), ("viewer", "2"), ("animator", "main"), ("integrator", "main")]
    assert [title(key) for key in sorted(keys, key=sort_key)] == [
        "viewer 2", "viewer 10", "integrator", "animator", "other",
    ]  # fmt: skip


def test_the_keys_of_the_topics_name_services_of_the_table() -> None:
    names = {service_at(topic.at("r", viewer="1", service="viewer", id="1")) for topic in TOPICS}
    assert {key[0] for key in names if key} <= {kind.name for kind in SERVICES}
