"""Renaming of viewers and rigs in keys and messages: every renamed message is valid for its new key."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from tests.support.message_strategies import NAMES, messages_of
from zenocap.common import messages as m
from zenocap.common.bus.inbox import disagreeing_name
from zenocap.common.topics import ASSIGNMENT, TOPICS, UNIVERSAL_BAP, Topic
from zenocap.tools.record.replay.remap import Remap, Remapping, parsed_remap, remapped_keys


def remapping(*texts: str, rig: str | None = None) -> Remapping:
    return Remapping(tuple(map(parsed_remap, texts)), rig)


@pytest.mark.parametrize(
    ("remap", "new"),
    [
        (remapping("viewer/1:=viewer/3"), "zenocap/demo/viewer/3/bap"),
        (remapping("zenocap/demo:=zenocap/lab"), "zenocap/lab/viewer/1/bap"),
        (remapping(rig="lab"), "zenocap/lab/viewer/1/bap"),
        (remapping("viewer/1:=viewer/left", rig="lab"), "zenocap/lab/viewer/left/bap"),
        (remapping("zenocap/demo/viewer/1:=zenocap/demo/viewer/9"), "zenocap/demo/viewer/9/bap"),
        (remapping("viewer/11:=viewer/3", "zenocap/de:=zenocap/lab"), "zenocap/demo/viewer/1/bap"),
    ],
)
def test_keys_are_renamed_by_whole_parts(remap: Remapping, new: str) -> None:
    assert remap.key("zenocap/demo/viewer/1/bap") == new


@pytest.mark.nightly
@given(st.sampled_from(TOPICS).flatmap(lambda t: st.tuples(st.just(t), messages_of(t.message))), NAMES, NAMES)
def test_a_renamed_message_agrees_with_its_new_key(found: tuple[Topic, m.Message], viewer: str, rig: str) -> None:
    topic, message = found
    key = topic.at("demo", **({"viewer": "1"} | topic.names_of(message)))
    own = topic.names_of(message).get("viewer", "1")
    both = Remapping((Remap(f"viewer/{own}", f"viewer/{viewer}"),), rig)
    new = both.key(key)
    renamed = both.message(topic, message, key)
    assert topic.names(new)["rig"] == rig
    assert disagreeing_name(topic, new, renamed) is None
    back = Remapping((Remap(f"viewer/{viewer}", f"viewer/{own}"),), "demo")
    assert back.key(new) == key


@pytest.mark.nightly
@given(messages_of(m.Assignment), messages_of(m.UniversalBap))
def test_integrator_messages_contain_the_new_viewer_names(assignment: m.Assignment, bap: m.UniversalBap) -> None:
    swap = remapping("viewer/1:=viewer/2", "viewer/2:=viewer/1")

    names = {"1": "2", "2": "1"}

    def swapped(found: dict[str, object]) -> dict[str, object]:
        return {names.get(viewer, viewer): value for viewer, value in found.items()}

    assert swap.message(ASSIGNMENT, assignment, ASSIGNMENT.at("demo")).views == swapped(assignment.views)
    renamed = swap.message(UNIVERSAL_BAP, bap, UNIVERSAL_BAP.at("demo"))
    assert (renamed.scores, renamed.views) == (swapped(bap.scores), swapped(bap.views))
    assert renamed.stale == [names.get(viewer, viewer) for viewer in bap.stale]


def test_rename_by_full_key_applies_inside_messages() -> None:
    remap = remapping("zenocap/demo/viewer/1:=zenocap/demo/viewer/3")
    bap = built(m.UniversalBap, scores={"1": 0.5})
    assert remap.message(UNIVERSAL_BAP, bap, UNIVERSAL_BAP.at("demo")).scores == {"3": 0.5}


@pytest.mark.parametrize("text", ["viewer/1", "viewer/1:=", ":=viewer/1", "viewer/*:=viewer/1", "zenocap/a:=viewer/1"])
def test_invalid_rename_is_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="--remap"):
        parsed_remap(text)


@pytest.mark.parametrize("text", ["viewer/1/bap:=viewer/1/sighting", "viewer:=camera", "zenocap/demo:=zenocap/a/b"])
def test_rename_to_a_key_of_another_topic_is_rejected(text: str) -> None:
    with pytest.raises(ValueError, match=r"would become zenocap/.*, which is no key of partial_bap"):
        remapping(text).key("zenocap/demo/viewer/1/bap")


def test_rename_that_merges_two_keys_is_rejected() -> None:
    with pytest.raises(ValueError, match="would both become zenocap/demo/viewer/2/bap"):
        remapped_keys(remapping("viewer/1:=viewer/2"), ["zenocap/demo/viewer/1/bap", "zenocap/demo/viewer/2/bap"])


def test_invalid_rig_name_is_rejected() -> None:
    with pytest.raises(ValueError, match="--rig = 'a/b'"):
        Remapping(rig="a/b")
