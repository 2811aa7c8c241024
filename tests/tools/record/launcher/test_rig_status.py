"""Status display of a rig from received messages, as a table and as a line."""

import io
from collections.abc import Sequence

import pytest
from rich.console import Console

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.observe.view import MOST_OTHERS, RigView
from zenocap.common.topics import topic_of
from zenocap.tools.record.launcher.display import plain_line, table
from zenocap.tools.record.launcher.rig_status import MAX_POSTURES, RigStatus, lost_text

SERVICES = [("viewer", "1"), ("viewer", "2"), ("integrator", "main")]


def status_after(*messages: m.Message, alive: tuple[tuple[str, str], ...] = ()) -> RigStatus:
    return updated(RigStatus(RigView("studio")), *(Alive(service, id, True, 0) for service, id in alive), *messages)


def updated(status: RigStatus, *events: Alive | m.Message) -> RigStatus:
    for one in events:
        event = one if isinstance(one, Alive) else Envelope("key", topic_of(type(one)), one, 0)
        status = status.updated(event, 0)
    return status


def health(id: str, rate: float = 15.0, **counts: int) -> m.Health:
    return built(
        m.Health, id=id, state="tracking", rate=rate, stages_ms={"step_frame": 1.25, "publish": 9.0}, counts=counts,
    )  # fmt: skip


def bap(**changes: object) -> m.UniversalBap:
    angles = {"navel.y": 1.5707963, "right_elbow.x": -0.001}
    views = {"1": "facade", "2": "flank"}
    return built(m.UniversalBap, **({"frame": 7, "angles": angles, "scores": {"1": 0.83}, "views": views} | changes))


def tracker_pose(**changes: object) -> m.TrackerPose:
    return built(m.TrackerPose, **({"frame": 7, "angles": {"navel.y": 1.5707963}, "views": ["1", "2"]} | changes))


def posture(label: str | None) -> m.Posture:
    return built(m.Posture, label=label, end_ns=25 * 10**8, margin=0.5)


def table_text(status: RigStatus, services: Sequence[tuple[str, str]] = SERVICES) -> str:
    console = Console(width=160, file=io.StringIO())
    with console.capture() as capture:
        console.print(table(status, services, 3.0, "a.mcap"))
    return capture.get()


def test_table_and_line_show_all_received_values() -> None:
    status = status_after(health("1", dropped_frames=3), bap(), alive=(("viewer", "1"), ("viewer", "2")))
    text = table_text(status)
    for words in ("15.0", "silhouette + place 1.2", "facade", "0.83", "tracking", "turn   90°", "right elbow    0°", "3"):
        assert words in text
    assert "starting" in text  # viewer 2 is alive, but has published nothing
    line = plain_line(status, SERVICES, 3.0)
    assert "viewer 1: 15.0/s facade 0.83 tracking" in line
    assert "integrator: not running" in line
    assert "frame 7: turn 90°, right elbow 0°" in line


def test_everything_is_seen_in_a_terminal_of_80_columns_and_24_rows() -> None:
    """The address of the page and the end of the take stand whole, each service has one line, its state two words."""
    services = [("integrator", "main"), *SERVICES[:2], ("tracker", "main"), ("recognizer", "main"), ("animator", "main")]
    state = "showing tracker; page http://127.0.0.1:43210/, 1 open"
    page = built(m.Health, service="animator", id="main", state=state, phase=m.Phase.RUNNING)
    learning = built(m.Health, id="1", state="learning the background (21 frames)", phase=m.Phase.LEARNING_BACKGROUND)
    long = built(m.Health, service="tracker", id="main", state="tracking, " * 9, phase=m.Phase.TRACKING, rate=14.9)
    bent = {f"{side}_{joint}.x": turn for joint, turn in (("elbow", 2.4), ("knee", -2.1)) for side in ("right", "left")}
    pose = tracker_pose(angles={"navel.y": -3.1, **bent})
    status = status_after(learning, health("2"), page, long, pose, alive=tuple(services))
    console = Console(width=80, file=io.StringIO())
    with console.capture() as capture:
        console.print(table(status, services, 12.0, "recordings/demo-2026-11-28T17-00-00.mcap", 80))
    lines = capture.get().splitlines()
    assert len(lines) < 24 - 6  # below the notes
    assert max(map(len, lines)) <= 80
    assert "turn -178°  right elbow 138°  left elbow 138°  right knee 120°  left knee 120°" in lines
    assert "page: http://127.0.0.1:43210/    Ctrl-C ends" in lines[0]
    assert lines[-1] == "take: recordings/demo-2026-11-28T17-00-00.mcap"
    for service, words in (("viewer 1", "learning background"), ("tracker", "tracking"), ("animator", "running")):
        (line,) = (line for line in lines if line.split("│")[1:2] and line.split("│")[1].strip() == service)
        assert line.split("│")[-2].strip() == words


def test_table_shows_the_missing_initial_posture_before_the_first_pose() -> None:
    assert "all viewers see a T-pose" in table_text(status_after())


def test_stopped_service_is_shown_as_not_there() -> None:
    status = status_after(health("1"), alive=(("viewer", "1"),)).updated(Alive("viewer", "1", False, 0), 0)
    assert "viewer 1: not running" in plain_line(status, SERVICES, 1.0)


@pytest.mark.parametrize(
    ("pose", "text"),
    [
        (bap(), ""),
        (bap(lost=["right_arm"], stale=["2"]), "searching for right arm; without viewer 2"),
        (tracker_pose(lost=True), "searching for the person"),
    ],
)
def test_what_is_lost_and_stale_viewers_are_shown(pose: m.Message, text: str) -> None:
    assert lost_text(pose) == text


@pytest.mark.parametrize(
    "poses",
    [(bap(), bap(stale=["2"]), bap()), (tracker_pose(), tracker_pose(views=["1"]), tracker_pose(views=["1", "2", "3"]))],
    ids=["two-view", "tracker"],
)
def test_poses_are_counted_and_those_of_every_running_viewer(poses: tuple[m.Message, ...]) -> None:
    status = status_after(*poses, alive=(("viewer", "1"), ("viewer", "2")))
    assert (status.poses, status.complete) == (3, 2)


def test_of_both_methods_the_poses_of_the_tracker_are_counted_and_shown() -> None:
    status = status_after(bap(), tracker_pose(views=["1", "2"]), bap(), alive=(("viewer", "1"), ("viewer", "2")))
    assert isinstance(status.pose, m.TrackerPose)
    assert status.poses == 2


def test_tracker_is_shown_with_rate_latency_and_used_views() -> None:
    tracker = built(
        m.Health, service="tracker", id="main", state="tracking, without viewer 3", rate=14.9,
        stages_ms={"step_tick": 8.25, "result_age": 21.5, "step_silhouette": 0.1}, counts={"dropped_instants": 4},
    )  # fmt: skip
    services = [("viewer", "1"), ("viewer", "3"), ("tracker", "main")]
    status = status_after(health("1"), health("3"), tracker, tracker_pose(), alive=tuple(services))
    line = plain_line(status, services, 3.0)
    assert "viewer 1: 15.0/s used tracking | viewer 3: 15.0/s left out tracking" in line
    assert "tracker: 14.9/s tracking, without viewer 3 | frame 7: turn 90°" in line
    assert "follow 8.2  since capture 21.5" in table_text(status, services)


def test_the_last_posture_is_shown_and_all_are_counted() -> None:
    status = status_after(posture(None), posture("kick"), posture("kick"))
    assert status.postures == {"unknown movement": 1, "kick": 2}
    assert "posture: kick, 2.5 s, margin 0.50" in table_text(status)
    assert "posture: kick" in plain_line(status, SERVICES, 3.0)


def test_number_of_stored_health_messages_is_bounded() -> None:
    status = status_after(*(health(f"unknown{number}") for number in range(MOST_OTHERS + 10)))
    assert len(status.services.health) == MOST_OTHERS
    again = updated(status, health("unknown0", rate=7.0))
    assert again.services.health[("viewer", "unknown0")].rate == 7.0


def test_the_tables_are_bounded_and_the_own_services_always_in_them() -> None:
    status = RigStatus(RigView("studio", tuple(SERVICES)))
    for number in range(3 * MOST_OTHERS):
        name = f"unknown{number}"
        status = updated(status, Alive("viewer", name, True, 0), health(name), posture(f"label {number}"))
    status = updated(status, Alive("viewer", "1", True, 0), health("1"))
    for found in (status.services.alive, status.services.health):
        assert len(found) <= MOST_OTHERS + len(SERVICES)
        assert ("viewer", "1") in found
    assert len(status.postures) <= MAX_POSTURES + 1
    assert sum(status.postures.values()) == 3 * MOST_OTHERS
