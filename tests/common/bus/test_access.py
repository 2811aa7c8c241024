"""Access rules of a secured network, derived from the table of keys."""

import json
from itertools import combinations

import pytest
from hypothesis import given

from tests.support.message_strategies import NAMES
from zenocap.common import topics
from zenocap.common.bus.access import OPERATOR, READER, RECORDER, REPLAY, ROUTER, Member, access_control, keys_of
from zenocap.common.topics import REQUEST, SIGHTING, STATE_RECOVERY, TOPICS, TRACKER_POSE, UNIVERSAL_BAP, service_at

SERVICES = tuple(Member(name) for name in ("integrator", "tracker", "recognizer", "animator"))
VIEWER = Member("viewer", "1")


def settings(rigs: dict[str, list[Member]]) -> dict[str, list[dict[str, object]]]:
    return json.loads(access_control(rigs))  # type: ignore[no-any-return]


def allowed(rig: str, member: Member, message: str, flow: str = "ingress") -> set[str]:
    """Key expressions that the rules allow a member for a kind of message."""
    found = settings({rig: [member]})
    rules = {str(rule["id"]): rule for rule in found["rules"]}
    subject = member.common_name(rig)
    (policy,) = (policy for policy in found["policies"] if policy["subjects"] == [subject])
    names = policy["rules"]
    assert isinstance(names, list)
    keys: set[str] = set()
    for name in names:
        rule = rules[name]
        if message in rule["messages"] and flow in rule["flows"] and rule["permission"] == "allow":  # type: ignore[operator]
            keys |= set(rule["key_exprs"])  # type: ignore[call-overload]
    return keys


def test_default_permission_is_deny() -> None:
    found = settings({})
    assert found["enabled"] is True
    assert found["default_permission"] == "deny"
    assert [subject["cert_common_names"] for subject in found["subjects"]] == [[ROUTER]]


@given(first=NAMES, second=NAMES, rig=NAMES)
def test_two_services_never_publish_on_the_same_key(first: str, second: str, rig: str) -> None:
    members = {Member("viewer", first), Member("viewer", second), *SERVICES}
    for one, other in combinations(members, 2):
        assert not set(keys_of(rig, one).values()) & set(keys_of(rig, other).values())


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_only_the_service_named_in_a_key_publishes_on_it(topic: object) -> None:
    found = next(t for t in TOPICS if t is topic)
    for member in (VIEWER, *SERVICES):
        key = found.at("studio", viewer=member.id, service=member.service, id=member.id)
        published = keys_of("studio", member).get(found) == key
        named = service_at(key) in ((member.service, member.id), None if member.service == "animator" else ("", ""))
        assert published is named, (member, key)


def test_every_topic_has_a_publisher() -> None:
    published = {topic for member in (VIEWER, *SERVICES) for topic in keys_of("studio", member)}
    assert published == set(TOPICS)


def test_reader_role_only_subscribes_and_queries() -> None:
    for message in ("delete", "reply", "declare_queryable", "liveliness_token"):
        assert allowed("studio", Member(READER), message) == set()
    revoked = topics.REVOKED.format(rig="studio")  # the list is signed by the authority
    assert allowed("studio", Member(READER), "put") == {revoked}
    assert allowed("studio", Member(READER), "declare_subscriber")
    assert allowed("studio", Member(READER), "query")


def test_only_the_animator_publishes_requests() -> None:
    requesting = [member for member in (VIEWER, *SERVICES) if REQUEST in keys_of("studio", member)]
    assert requesting == [Member("animator")]


def test_a_viewer_declares_tokens_and_replies_only_for_itself() -> None:
    tokens = allowed("studio", VIEWER, "liveliness_token")
    assert topics.ALIVE.format(rig="studio", service="viewer", id="1") in tokens
    assert not [token for token in tokens if "/viewer/1" not in token]
    replies = allowed("studio", VIEWER, "reply")
    assert not [reply for reply in replies if "/viewer/1" not in reply]
    assert topics.CLOCK.format(rig="studio") not in allowed("studio", VIEWER, "reply")
    assert topics.CLOCK.format(rig="studio") in allowed("studio", Member("integrator"), "reply")


def test_only_the_operator_queries_films_and_only_a_viewer_replies_for_itself() -> None:
    own, every = (topics.FILM.format(rig="studio", viewer=viewer) for viewer in ("1", "*"))
    members = (VIEWER, Member(READER), Member(RECORDER), Member(REPLAY), Member(OPERATOR), *SERVICES)
    asking = {member.service for member in members if {own, every} & allowed("studio", member, "query")}
    assert asking == {OPERATOR}
    for message in ("reply", "declare_queryable"):
        replying = {member.service for member in members if {own, every} & allowed("studio", member, message)}
        assert replying == {"viewer"}
        assert every not in allowed("studio", VIEWER, message)
    assert not allowed("studio", Member(OPERATOR), "put")


def test_only_the_publisher_of_a_topic_queries_its_recovered_state() -> None:
    bap, pose = (STATE_RECOVERY.format(rig="studio", topic=topic.name) for topic in (UNIVERSAL_BAP, TRACKER_POSE))
    queried = {member.service: allowed("studio", member, "query") & {bap, pose} for member in (VIEWER, *SERVICES)}
    assert {service: keys for service, keys in queried.items() if keys} == {"integrator": {bap}, "tracker": {pose}}


def test_neither_viewers_nor_readers_reply_to_state_recovery() -> None:
    recovery = STATE_RECOVERY.format(rig="studio", topic="*")
    members = (VIEWER, Member(READER), Member(RECORDER), Member(REPLAY), *SERVICES)
    for message in ("reply", "declare_queryable"):
        trusted = {member.service for member in members if recovery in allowed("studio", member, message)}
        assert trusted == {"integrator", "tracker", "recognizer", "animator", RECORDER, REPLAY}


def test_replay_role_publishes_on_all_topics_and_recorder_role_on_its_own() -> None:
    assert allowed("studio", Member(REPLAY), "put") >= {topic.on("studio") for topic in TOPICS}
    assert allowed("studio", Member(RECORDER), "put") == {
        "zenocap/studio/recorder/*/health", "zenocap/studio/recorder/*/handled",
    }  # fmt: skip


def test_rigs_on_one_router_have_no_access_to_each_other() -> None:
    found = settings({"studio": [VIEWER], "lab": [VIEWER]})
    for policy in found["policies"]:
        (subject,) = policy["subjects"]  # type: ignore[misc]
        rig = str(subject).partition("/")[0]
        if rig != ROUTER:
            rules = [rule for rule in found["rules"] if rule["id"] in policy["rules"]]  # type: ignore[operator]
            keys = [str(key) for rule in rules for key in rule["key_exprs"]]  # type: ignore[attr-defined]
            assert keys
            assert all(key.startswith(f"zenocap/{rig}/") for key in keys)


def test_names_too_long_for_a_certificate_are_refused() -> None:
    with pytest.raises(ValueError, match="allowed in a certificate: 64"):
        Member("viewer", "x" * 30).common_name("y" * 30)
    assert SIGHTING in keys_of("y" * 30, Member("viewer", "x" * 30))


def test_only_the_recognizer_puts_the_keys_of_commands_and_all_members_may_subscribe() -> None:
    recognizer, reader = Member("recognizer", puts=("lab/next",)), Member(READER)
    rules = {str(rule["id"]): rule for rule in settings({"studio": [recognizer, reader]})["rules"]}
    putting = [name for name, rule in rules.items() if "lab/next" in rule["key_exprs"] and rule["flows"] == ["ingress"]]
    assert putting == ["studio: subscribe", "studio: recognizer: publish"]
    assert "lab/next" in rules["studio: receive"]["key_exprs"]
    assert "lab/next" not in allowed("studio", reader, "put")
