"""Other names: in keys and in messages alike, so that every renamed message is one its new key may carry."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common import messages as m
from common.bus.inbox import disagreeing_name
from common.topics import TOPICS, Topic
from services.takes.replay.renaming import Rename, Renaming, parsed_rename, renamed_keys
from tests.message_strategies import NAMES, messages_of

ASSIGNMENT, BAP = "zenocap/demo/integrator/assignment", "zenocap/demo/integrator/bap"


def renaming(*texts: str, rig: str | None = None) -> Renaming:
    return Renaming(tuple(map(parsed_rename, texts)), rig)


@pytest.mark.parametrize(
    ("rename", "new"),
    [
        (renaming("viewer/1:=viewer/3"), "zenocap/demo/viewer/3/bap"),
        (renaming("zenocap/demo:=zenocap/lab"), "zenocap/lab/viewer/1/bap"),
        (renaming(rig="lab"), "zenocap/lab/viewer/1/bap"),
        (renaming("viewer/1:=viewer/left", rig="lab"), "zenocap/lab/viewer/left/bap"),
        (renaming("zenocap/demo/viewer/1:=zenocap/demo/viewer/9"), "zenocap/demo/viewer/9/bap"),
        (renaming("viewer/11:=viewer/3", "zenocap/de:=zenocap/lab"), "zenocap/demo/viewer/1/bap"),
    ],
)
def test_keys_are_renamed_by_whole_parts(rename: Renaming, new: str) -> None:
    assert rename.key("zenocap/demo/viewer/1/bap") == new


@given(st.sampled_from(TOPICS).flatmap(lambda t: st.tuples(st.just(t), messages_of(t.message))), NAMES, NAMES)
def test_a_renamed_message_agrees_with_its_new_key(found: tuple[Topic, m.Message], viewer: str, rig: str) -> None:
    topic, message = found
    key = topic.at("demo", **({"viewer": "1"} | topic.names_of(message)))
    own = topic.names_of(message).get("viewer", "1")
    both = Renaming((Rename(f"viewer/{own}", f"viewer/{viewer}"),), rig)
    new = both.key(key)
    renamed = both.message(topic, message, key)
    assert topic.names(new)["rig"] == rig
    assert disagreeing_name(topic, new, renamed) is None
    back = Renaming((Rename(f"viewer/{viewer}", f"viewer/{own}"),), "demo")
    assert back.key(new) == key


@given(messages_of(m.Assignment), messages_of(m.UniversalBap))
def test_the_integrator_speaks_of_renamed_viewers(assignment: m.Assignment, bap: m.UniversalBap) -> None:
    swap = renaming("viewer/1:=viewer/2", "viewer/2:=viewer/1")
    names = {"1": "2", "2": "1"}
    found = swap.message(next(t for t in TOPICS if t.name == "assignment"), assignment, ASSIGNMENT)
    assert isinstance(found, m.Assignment)
    assert found.views == {names.get(viewer, viewer): view for viewer, view in assignment.views.items()}
    told = swap.message(next(t for t in TOPICS if t.name == "universal_bap"), bap, BAP)
    assert isinstance(told, m.UniversalBap)
    assert told.scores == {names.get(viewer, viewer): score for viewer, score in bap.scores.items()}
    assert told.views == {names.get(viewer, viewer): view for viewer, view in bap.views.items()}
    assert told.stale == [names.get(viewer, viewer) for viewer in bap.stale]


def test_a_viewer_renamed_in_full_is_renamed_inside_messages_too() -> None:
    rename = renaming("zenocap/demo/viewer/1:=zenocap/demo/viewer/3")
    topic = next(t for t in TOPICS if t.name == "universal_bap")
    bap = m.UniversalBap(
        frame=0, captured_ns=0, position=(0.0, 0.0, 0.0), angles={}, scores={"1": 0.5}, views={}, stale=[], lost=[]
    )
    told = rename.message(topic, bap, BAP)
    assert isinstance(told, m.UniversalBap)
    assert told.scores == {"3": 0.5}


@pytest.mark.parametrize("text", ["viewer/1", "viewer/1:=", ":=viewer/1", "viewer/*:=viewer/1", "zenocap/a:=viewer/1"])
def test_what_is_no_rename_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="--remap"):
        parsed_rename(text)


@pytest.mark.parametrize("text", ["viewer/1/bap:=viewer/1/sighting", "viewer:=camera", "zenocap/demo:=zenocap/a/b"])
def test_a_key_does_not_become_one_of_another_topic(text: str) -> None:
    with pytest.raises(ValueError, match=r"would become zenocap/.*, which is no key of partial_bap"):
        renaming(text).key("zenocap/demo/viewer/1/bap")


def test_two_keys_do_not_become_one() -> None:
    with pytest.raises(ValueError, match="would both become zenocap/demo/viewer/2/bap"):
        renamed_keys(renaming("viewer/1:=viewer/2"), ["zenocap/demo/viewer/1/bap", "zenocap/demo/viewer/2/bap"])


def test_a_bad_rig_name_is_refused() -> None:
    with pytest.raises(ValueError, match="--rig = 'a/b'"):
        Renaming(rig="a/b")
