"""The board: what is heard is shown, as a table and as a line."""

import io

from rich.console import Console

from common import messages as m
from common.bus.protocol import Alive, Envelope
from common.topics import topic_of
from services.launcher.board import MOST, Board, lost_words
from services.launcher.display import plain_line, table

SERVICES = [("viewer", "1"), ("viewer", "2"), ("integrator", "main")]


def heard(*messages: m.Message, alive: tuple[tuple[str, str], ...] = ()) -> Board:
    board = Board()
    for service, id in alive:
        board = board.heard(Alive(service, id, True, 0))
    for message in messages:
        topic = topic_of(type(message))
        board = board.heard(Envelope("key", topic, message, 0))
    return board


def health(id: str, rate: float = 15.0, **counts: int) -> m.Health:
    return m.Health(
        frame=0,
        captured_ns=0,
        service="viewer",
        id=id,
        state="tracking",
        rate=rate,
        stages_ms={"step_frame": 1.25, "publish": 9.0},
        counts=counts,
    )


def bap(**changes: object) -> m.UniversalBap:
    fields: dict[str, object] = {
        "position": (0.0, 0.9, 0.0),
        "angles": {"navel.y": 1.5707963, "right_elbow.x": -0.001},
        "scores": {"1": 0.83},
        "views": {"1": "facade", "2": "flank"},
        "stale": [],
        "lost": [],
    }
    return m.UniversalBap(frame=7, captured_ns=0, **(fields | changes))  # type: ignore[arg-type]  # a table of fields


def shown(board: Board) -> str:
    console = Console(width=160, file=io.StringIO())
    with console.capture() as capture:
        console.print(table(board, SERVICES, 3.0, "a.mcap"))
    return capture.get()


def test_everything_that_is_known_is_shown() -> None:
    board = heard(health("1", dropped_frames=3), bap(), alive=(("viewer", "1"), ("viewer", "2")))
    text = shown(board)
    for words in ("15.0", "silhouette + place 1.2", "facade", "0.83", "tracking", "turn   90°", "right elbow    0°", "3"):
        assert words in text
    assert "starting" in text  # viewer 2 is there, but has not said anything
    line = plain_line(board, SERVICES, 3.0)
    assert "viewer 1: 15.0/s facade 0.83 tracking" in line
    assert "integrator: not there" in line
    assert "frame 7: turn 90°, right elbow 0°" in line


def test_before_the_first_pose_it_says_what_is_waited_for() -> None:
    assert "all viewers see the initial posture" in shown(heard())


def test_who_went_is_not_there() -> None:
    board = heard(health("1"), alive=(("viewer", "1"),)).heard(Alive("viewer", "1", False, 0))
    assert "viewer 1: not there" in plain_line(board, SERVICES, 1.0)


def test_what_is_lost_and_old_is_said() -> None:
    assert lost_words(bap()) == ""
    assert lost_words(bap(lost=["right_arm"], stale=["2"])) == "searching for right arm; without viewer 2"


def test_poses_of_all_viewers_are_counted() -> None:
    board = heard(bap(), bap(stale=["2"]), bap())
    assert (board.poses, board.whole) == (3, 2)


def tracker_pose(**changes: object) -> m.TrackerPose:
    fields: dict[str, object] = {
        "position": (0.0, 0.9, 0.0), "angles": {"navel.y": 1.5707963}, "position_spread": (0.01, 0.01, 0.01),
        "spread": {}, "likelihood": 0.0, "effective": 20.0, "lost": False, "views": ["1", "2"],
    }  # fmt: skip
    return m.TrackerPose(frame=7, captured_ns=0, **(fields | changes))  # type: ignore[arg-type]  # a table of fields


def test_a_tracker_is_shown_with_its_rate_its_latency_and_the_views_it_uses() -> None:
    tracker = m.Health(
        frame=0, captured_ns=0, service="tracker", id="main", state="tracking, without viewer 3", rate=14.9,
        stages_ms={"step_tick": 8.25, "result_age": 21.5, "step_silhouette": 0.1}, counts={"dropped_instants": 4},
    )  # fmt: skip
    services = [("viewer", "1"), ("viewer", "3"), ("tracker", "main")]
    board = heard(health("1"), health("3"), tracker, tracker_pose(), alive=tuple(services))
    line = plain_line(board, services, 3.0)
    assert "viewer 1: 15.0/s used tracking | viewer 3: 15.0/s left out tracking" in line
    assert "tracker: 14.9/s tracking, without viewer 3 | frame 7: turn 90°" in line
    console = Console(width=160, file=io.StringIO())
    with console.capture() as capture:
        console.print(table(board, services, 3.0, "a.mcap"))
    assert "follow 8.2  since capture 21.5" in capture.get()
    assert lost_words(tracker_pose(lost=True)) == "searching for the person"


def test_poses_of_the_tracker_are_whole_when_every_viewer_there_is_used() -> None:
    viewers = (("viewer", "1"), ("viewer", "2"))
    board = heard(tracker_pose(), tracker_pose(views=["1"]), tracker_pose(views=["1", "2", "3"]), alive=viewers)
    assert (board.poses, board.whole) == (3, 2)


def test_the_last_posture_is_shown_and_all_are_counted() -> None:
    def posture(label: str | None) -> m.Posture:
        return m.Posture(
            frame=9, captured_ns=3 * 10**9, label=label, start_ns=0, end_ns=25 * 10**8, log_likelihoods={"kick": -90.0},
            score=0.2, margin=0.5,
        )  # fmt: skip

    board = heard(posture(None), posture("kick"), posture("kick"))
    assert board.postures == {"none of its postures": 1, "kick": 2}
    assert "posture: kick, 2.5 s, margin 0.50" in shown(board)
    assert "posture: kick" in plain_line(board, SERVICES, 3.0)


def test_strangers_do_not_fill_it() -> None:
    board = heard(*(health(f"stranger{number}") for number in range(MOST + 10)))
    assert len(board.health) == MOST
    again = board.heard(Envelope("key", topic_of(m.Health), health("stranger0", rate=7.0), 0))
    assert again.health[("viewer", "stranger0")].rate == 7.0
