"""The table of keys: keys and names are inverse to each other, and no two topics share a key."""

from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.message_strategies import NAMES
from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.common.topics import TOPICS, Topic, service_at, topic_at, topic_of


@given(st.sampled_from(TOPICS), NAMES, NAMES, NAMES)
def test_names_round_trip_through_keys(topic: Topic, rig: str, first: str, second: str) -> None:
    names = {"viewer": first, "service": first, "id": second}
    found = topic.names(topic.at(rig, **names))
    assert found["rig"] == rig
    assert found.items() <= (names | {"rig": rig}).items()


@given(st.sampled_from(TOPICS), NAMES, NAMES)
def test_a_key_belongs_to_one_topic(topic: Topic, rig: str, name: str) -> None:
    key = topic.at(rig, viewer=name, service=name, id=name)
    assert [other for other in TOPICS if other.names(key) is not None] == [topic]
    assert topic_at(key) is topic


def test_omitted_names_become_wildcards() -> None:
    assert topics.SIGHTING.on("studio") == "zenocap/studio/viewer/*/sighting"
    assert topics.HEALTH.on("studio", service="viewer") == "zenocap/studio/viewer/*/health"


@pytest.mark.parametrize(
    ("rig", "names", "words"),
    [
        ("my rig", {"viewer": "1"}, "rig = 'my rig'"), ("studio", {}, "viewer = "), ("studio", {"viewer": ""}, "viewer = "),
        *(("studio", {"viewer": name}, "viewer = ") for name in ("*", "a/b", "a\n")),
    ],
)  # fmt: skip
def test_a_key_without_valid_names_is_refused(rig: str, names: dict[str, str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        topics.SIGHTING.at(rig, **names)


def test_a_message_type_has_one_topic_or_is_an_error() -> None:
    assert [topic_of(topic.message) for topic in TOPICS] == list(TOPICS)
    with pytest.raises(ValueError, match=r"ClockQuery has no topic; known: PartialBdp"):
        topic_of(m.ClockQuery)


def test_keys_of_liveliness_and_clock_belong_to_no_topic() -> None:
    others = [topics.CLOCK, topics.ALIVE, topics.CLAIM]
    filled = [key.format(rig="r", service="s", id="i", claim="c") for key in others]
    assert [topic_at(key) for key in filled] == [None] * 3
    assert all(a != b for a, b in permutations(filled, 2))


@pytest.mark.parametrize(
    ("key", "service"),
    [
        ("zenocap/r/viewer/1/bap", ("viewer", "1")),
        ("zenocap/r/viewer/1/health", ("viewer", "1")),
        ("zenocap/r/integrator/bap", ("integrator", "main")),
        ("zenocap/r/integrator/main/health", ("integrator", "main")),
        ("zenocap/r/tracker/fast/health", ("tracker", "fast")),
        ("zenocap/r/nothing", None),
    ],
)
def test_the_service_is_found_from_a_key(key: str, service: tuple[str, str] | None) -> None:
    assert service_at(key) == service
