"""The cast of acted takes: who does which posture how often."""

import pytest

from common.actor.style import POSTURES
from services.takes.act.cast import CAST, Act, acts, people


def test_people_of_different_seeds_are_different() -> None:
    assert not set(people(0)) & set(people(1))
    assert len(people(0)) == len(people(1)) == CAST


def test_everybody_does_every_posture_as_often() -> None:
    found = acts(people(0), POSTURES, 2)
    assert len(found) == len(set(found)) == CAST * len(POSTURES) * 2


def test_no_two_takes_have_a_name_or_a_room_in_common() -> None:
    found = acts(people(3), POSTURES, 10)
    assert len({one.name for one in found}) == len({one.room for one in found}) == len(found)


def test_an_unknown_posture_is_refused_with_what_is_allowed() -> None:
    with pytest.raises(ValueError, match=r"posture 'handstand': allowed: march, "):
        acts([0], ["handstand"])


def test_the_posture_ends_its_script() -> None:
    script = Act(4, "squat", 1).script()
    assert script.segments[-1].name == "squat"
    assert script.segments[-1].start_s == script.motion_from_s < script.duration_s
