"""Access rules of a secured network, derived from the table of keys."""

import json
from itertools import combinations

import pytest
import zenoh
from hypothesis import given

from tests.support.message_strategies import NAMES
from zenocap.common import topics
from zenocap.common.bus.access import OPERATOR, READER, RECORDER, REPLAY, ROUTER, Member, access_control, keys_of
from zenocap.common.topics import REQUEST, SIGHTING, STATE_RECOVERY, TOPICS, Topic, service_at

SERVICES = tuple(Member(name) for name in ("integrator", "tracker", "recognizer", "animator"))
VIEWER = Member("viewer", "1")
MEMBERS = (VIEWER, Member(READER), Member(RECORDER), Member(REPLAY), Member(OPERATOR), *SERVICES)
EVERY = {member.service for member in MEMBERS}
RUNNING = EVERY - {READER, OPERATOR}
# Who may do what on each key of no topic, the member's own where the key has a name.  reply: also to declare it.
KEYS: dict[str, dict[str, set[str]]] = {
    "ALIVE": {"liveliness_token": RUNNING},
    "CLAIM": {"query": EVERY, "liveliness_token": RUNNING, "reply": RUNNING},
    "CLOCK": {"query": EVERY, "reply": {"integrator", REPLAY}},
    "SERVICE_INFO": {"query": EVERY, "reply": RUNNING},
    "FLOW_CONTROL": {"query": RUNNING, "reply": RUNNING},
    "STATE_RECOVERY": {"query": {"integrator", REPLAY}, "reply": RUNNING - {"viewer"}},
    "REVOKED": {"put": {READER}, "query": {READER}},  # the list is signed by the authority
    "FILM": {"query": {OPERATOR}, "reply": {"viewer"}},
} | {name: {} for name in ("HOST_ALIVE", "HOST_CAMERAS", "HOST_FILM", "HOST_ASSIGN")}  # of no rig, in open networks only


def settings(rigs: dict[str, list[Member]]) -> dict[str, list[dict[str, object]]]:
    return json.loads(access_control(rigs))


def allowed(member: Member, message: str) -> set[str]:
    """Key expressions on which the rules of the rig studio admit a kind of message from a member."""
    found = settings({"studio": [member]})
    rules = {rule["id"]: rule for rule in found["rules"] if rule["permission"] == "allow" and "ingress" in rule["flows"]}
    (policy,) = (policy for policy in found["policies"] if policy["subjects"] == [member.common_name("studio")])
    own = (rules[name] for name in policy["rules"] if name in rules)
    return {key for rule in own if message in rule["messages"] for key in rule["key_exprs"]}


def services_with(keys: set[str], *messages: str) -> set[str]:
    """Services and roles whose members may send any of these messages on any of these keys."""
    return {member.service for member in MEMBERS for message in messages if keys & allowed(member, message)}


def may(member: Member, message: str, key: str) -> bool:
    return any(zenoh.KeyExpr(rule).includes(zenoh.KeyExpr(key)) for rule in allowed(member, message))


def test_every_key_of_no_topic_is_in_the_table() -> None:
    templates = {name for name, value in vars(topics).items() if name.isupper() and isinstance(value, str) and "/" in value}
    assert templates - {"EVERYTHING"} == KEYS.keys()


@pytest.mark.parametrize("name", KEYS)
def test_a_member_sends_on_its_own_keys_what_the_table_says_and_on_those_of_others_nothing(name: str) -> None:
    template: str = getattr(topics, name)
    names = {"rig": "studio", "claim": "5", "topic": "universal_bap", "machine": "lab0", "camera": "cam01"}
    for message in ("put", "query", "delete", "liveliness_token", "reply", "declare_queryable"):
        own = {
            member.service
            for member in MEMBERS
            if may(member, message, template.format(**names, service=member.service, id=member.id, viewer=member.id))
        }
        assert own == KEYS[name].get("reply" if message == "declare_queryable" else message, set()), message
        if ("{id}" in template or "{viewer}" in template) and message != "query":
            other = template.format(**names, service="viewer", id="2", viewer="2")
            assert {member.service for member in MEMBERS if may(member, message, other)} <= {REPLAY}, message


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
def test_only_the_service_named_in_a_key_publishes_on_it(topic: Topic) -> None:
    for member in (VIEWER, *SERVICES):
        key = topic.at("studio", viewer=member.id, service=member.service, id=member.id)
        published = keys_of("studio", member).get(topic) == key
        named = service_at(key) in ((member.service, member.id), None if member.service == "animator" else ("", ""))
        assert published is named, (member, key)


def test_every_topic_has_a_publisher() -> None:
    published = {topic for member in (VIEWER, *SERVICES) for topic in keys_of("studio", member)}
    assert published == set(TOPICS)


def test_reader_role_only_subscribes_and_queries() -> None:
    for message in ("delete", "reply", "declare_queryable", "liveliness_token"):
        assert allowed(Member(READER), message) == set()
    revoked = topics.REVOKED.format(rig="studio")  # the list is signed by the authority
    assert allowed(Member(READER), "put") == {revoked}
    assert allowed(Member(READER), "declare_subscriber")
    assert allowed(Member(READER), "query")


def test_only_the_animator_publishes_requests() -> None:
    requesting = [member for member in (VIEWER, *SERVICES) if REQUEST in keys_of("studio", member)]
    assert requesting == [Member("animator")]


def test_a_viewer_declares_tokens_and_replies_only_for_itself() -> None:
    tokens = allowed(VIEWER, "liveliness_token")
    assert topics.ALIVE.format(rig="studio", service="viewer", id="1") in tokens
    assert all("/viewer/1" in key for key in tokens | allowed(VIEWER, "reply"))
    assert topics.CLOCK.format(rig="studio") in allowed(Member("integrator"), "reply")


def test_only_the_publisher_of_a_topic_queries_its_recovered_state_and_neither_viewers_nor_readers_reply() -> None:
    bap, pose, every = (STATE_RECOVERY.format(rig="studio", topic=name) for name in ("universal_bap", "tracker_pose", "*"))
    assert services_with({bap}, "query") == {"integrator", REPLAY}
    assert services_with({pose}, "query") == {"tracker", REPLAY}
    trusted = {"integrator", "tracker", "recognizer", "animator", RECORDER, REPLAY}
    assert services_with({every}, "reply") == services_with({every}, "declare_queryable") == trusted


def test_replay_role_publishes_on_all_topics_and_recorder_role_on_its_own() -> None:
    assert allowed(Member(REPLAY), "put") >= {topic.on("studio") for topic in TOPICS}
    own = {f"zenocap/studio/recorder/*/{topic}" for topic in ("health", "handled")}
    assert allowed(Member(RECORDER), "put") == own


def test_rigs_on_one_router_have_no_access_to_each_other() -> None:
    found = settings({"studio": [VIEWER], "lab": [VIEWER]})
    for policy in found["policies"]:
        (subject,) = policy["subjects"]
        rig = subject.partition("/")[0]
        if rig != ROUTER:
            keys = [key for rule in found["rules"] if rule["id"] in policy["rules"] for key in rule["key_exprs"]]
            assert keys
            assert all(key.startswith(f"zenocap/{rig}/") for key in keys)


def test_names_too_long_for_a_certificate_are_refused() -> None:
    with pytest.raises(ValueError, match="allowed in a certificate: 64"):
        Member("viewer", "x" * 30).common_name("y" * 30)
    assert SIGHTING in keys_of("y" * 30, Member("viewer", "x" * 30))


def test_only_the_recognizer_puts_the_keys_of_commands_and_all_members_may_subscribe() -> None:
    recognizer, reader = Member("recognizer", puts=("lab/next",)), Member(READER)
    rules = {rule["id"]: rule for rule in settings({"studio": [recognizer, reader]})["rules"]}
    putting = [name for name, rule in rules.items() if "lab/next" in rule["key_exprs"] and rule["flows"] == ["ingress"]]
    assert putting == ["studio: subscribe", "studio: recognizer: publish"]
    assert "lab/next" in rules["studio: receive"]["key_exprs"]
    assert "lab/next" not in allowed(reader, "put")
