"""Presence of services on the page: starting, well, silent, gone."""

from hypothesis import given
from hypothesis import strategies as st

from tests.support.animator_stand_in import EXPECTED, NOW, health, sighting
from tests.support.animator_stand_in import observed_after as after
from zenocap.common.bus.protocol import Alive
from zenocap.common.observe.view import GONE_NS, MOST_OTHERS, SILENT_NS
from zenocap.services.animator.parameters import FRAME_TIMEOUT_NS
from zenocap.services.animator.presence import Condition, Presence, condition, silent_ns, troubled

VIEWER, INTEGRATOR = ("viewer", "1"), ("integrator", "main")


def condition_at(presence: Presence, now_ns: int) -> Condition:
    return condition(presence, VIEWER, now_ns)


def test_a_service_without_messages_is_starting() -> None:
    assert condition_at(after(), NOW) == "starting"
    assert condition_at(after(Alive("viewer", "1", True, NOW)), NOW + 20 * SILENT_NS) == "starting"


def test_a_viewer_without_frames_is_stale_after_a_second_even_if_its_health_continues() -> None:
    presence = after(sighting("1", 0, NOW))
    assert condition_at(presence, NOW + FRAME_TIMEOUT_NS) == "ok"
    assert troubled(presence, NOW + 2 * FRAME_TIMEOUT_NS) == ["viewer 1"]  # in the health text
    presence = after(health("viewer", "1", NOW), presence=presence, now_ns=NOW + FRAME_TIMEOUT_NS)
    assert condition_at(presence, NOW + FRAME_TIMEOUT_NS + 1) == "stale"


def test_a_viewer_that_learns_the_background_is_ok_with_its_health_alone() -> None:
    presence = after(Alive("viewer", "1", True, NOW), health("viewer", "1", NOW, "learning the background (9 frames)"))
    assert condition_at(presence, NOW + FRAME_TIMEOUT_NS + 1) == "ok"
    assert condition_at(presence, NOW + SILENT_NS + 1) == "stale"


def test_a_viewer_that_ended_is_gone_until_its_next_message_and_may_learn_the_background_again() -> None:
    gone = after(sighting("1", 0, NOW), Alive("viewer", "1", False, NOW + 1))
    assert condition_at(gone, NOW + 2) == "gone"
    assert condition_at(after(sighting("1", 1, NOW + 3), presence=gone, now_ns=NOW + 3), NOW + 4) == "ok"
    back = after(Alive("viewer", "1", True, NOW + 2), presence=gone)
    back = after(health("viewer", "1", NOW), presence=back, now_ns=NOW + 2 * FRAME_TIMEOUT_NS)
    assert condition_at(back, NOW + 2 * FRAME_TIMEOUT_NS + 1) == "ok"


@given(silent_ns=st.integers(0, 20 * FRAME_TIMEOUT_NS))
def test_a_silent_viewer_never_becomes_ok_without_a_message(silent_ns: int) -> None:
    presence = after(sighting("1", 0, NOW))
    found = [condition_at(presence, NOW + silent_ns // 2), condition_at(presence, NOW + silent_ns)]
    assert found in (["ok", "ok"], ["ok", "stale"], ["stale", "stale"])


def test_a_service_without_health_is_silent_and_one_without_token_gone() -> None:
    presence = after(Alive(*INTEGRATOR, True, NOW), health(*INTEGRATOR, NOW))
    assert condition(presence, INTEGRATOR, NOW + SILENT_NS) == "ok"
    assert condition(presence, INTEGRATOR, NOW + SILENT_NS + 1) == "stale"
    assert condition(after(Alive(*INTEGRATOR, False, NOW), presence=presence), INTEGRATOR, NOW + GONE_NS + 1) == "gone"


def test_the_silence_of_a_viewer_is_that_of_its_frames() -> None:
    presence = after(health(*VIEWER, NOW), health(*INTEGRATOR, NOW))
    presence = after(sighting("1", 0, NOW), presence=presence, now_ns=NOW + 5)
    assert [silent_ns(presence, one, NOW + 7) for one in EXPECTED] == [2, 0, 7]


def test_the_services_of_the_rig_are_first_and_others_follow_as_they_come() -> None:
    presence = after(health("recorder", "here", NOW), health(*INTEGRATOR, NOW), health("camera", "b", NOW))
    assert presence.services == (*EXPECTED, ("recorder", "here"), ("camera", "b"))
    assert condition(presence, ("recorder", "here"), NOW) == "ok"


def test_unknown_services_are_limited_in_number() -> None:
    many = [(Alive("viewer", f"s{k}", True, NOW), sighting(f"s{k}", 0, NOW)) for k in range(2 * MOST_OTHERS)]
    presence = after(*(event for pair in many for event in pair))
    assert len(presence.services) == MOST_OTHERS + len(EXPECTED)
    assert len(presence.frames) <= MOST_OTHERS
