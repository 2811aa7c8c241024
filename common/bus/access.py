"""Access control of a secured network, derived from the table of topics.

Everything that no rule allows is denied.  A member is identified by the common name of its certificate; every router and
every peer that accepts connections checks the messages from and to each member.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from zenocap.common import topics
from zenocap.common.bus.revocations import NO_GENERATIONS
from zenocap.common.topics import TOPICS, Queueing, Topic

Message = Literal[
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
    "declare_liveliness_subscriber", "liveliness_query",
]  # fmt: skip
Flow = Literal["ingress", "egress"]
Rule: TypeAlias = dict[str, object]

EVERY_MESSAGE: tuple[Message, ...] = get_args(Message)
LIVELINESS: tuple[Message, ...] = ("declare_liveliness_subscriber", "liveliness_query")
MAX_COMMON_NAME = 64  # letters, limit of X.509
ROUTER = "router"  # common name of every router; those of other members begin with the name of the rig
READER, RECORDER, REPLAY = "reader", "recorder", "replay"  # members that are not services
OPERATOR = "operator"  # of who may film; is a reader besides
REQUEST_SENDER = "animator"  # its page sends commands to the rig


@dataclass(frozen=True)
class Member:
    """Holder of a certificate: a service of a rig, or one of READER, RECORDER, REPLAY, OPERATOR and ROUTER.

    puts: keys that are no topic's, on which it puts for other programs; every member of the rig may subscribe to them.
    """

    service: str
    id: str = "main"
    puts: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of its files, such as viewer-1."""
        return self.service if self.id == "main" else f"{self.service}-{self.id}"

    def common_name(self, rig: str, generations: Mapping[str, int] = NO_GENERATIONS) -> str:
        """Common name in its certificate.  generations: of the revoked members, see `Revocations`.

        Raises ValueError for more than MAX_COMMON_NAME letters.
        """
        name = ROUTER if self.service == ROUTER else f"{rig}/{self.service}/{self.id}"
        if name in generations:
            name = f"{name}@{generations[name]}"
        if len(name) > MAX_COMMON_NAME:
            raise ValueError(f"{name}: {len(name)} letters: allowed in a certificate: {MAX_COMMON_NAME}; shorten rig or id")
        return name


def access_control(rigs: Mapping[str, Sequence[Member]], generations: Mapping[str, int] = NO_GENERATIONS) -> str:
    """Zenoh's `access_control`, as JSON.  rigs: members by name of the rig, without routers.  Raises ValueError.

    generations: of the revoked members, see `Revocations`; the certificates of earlier ones are denied everything.
    """
    rules: list[Rule] = [_rule("routers", ("ingress", "egress"), EVERY_MESSAGE, ["**", "**/@adv/**"])]
    subjects: list[Rule] = [{"id": ROUTER, "cert_common_names": [ROUTER]}]
    policies: list[Rule] = [{"rules": ["routers"], "subjects": [ROUTER]}]
    for rig, members in rigs.items():
        common = _of_all(rig, [key for member in members for key in member.puts])
        keys = [topics.SILHOUETTE.on(rig), topics.PREVIEW.on(rig)]
        images = _rule(f"{rig}: no images", ("egress",), ("put", "reply"), keys, "deny")
        rules += [*common, images]
        for member in members:
            subject = member.common_name(rig, generations)
            own = _of_one(rig, member)
            rules += own
            subjects.append({"id": subject, "cert_common_names": [subject]})
            denied = [images] if member.service == "viewer" else []
            policies.append({"rules": [rule["id"] for rule in (*common, *denied, *own)], "subjects": [subject]})
    settings = {"enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies}
    return json.dumps(settings)


def keys_of(rig: str, member: Member) -> dict[Topic, str]:
    """Key expressions on which a member may publish, by topic."""
    if member.service == REPLAY:
        return {topic: topic.on(rig) for topic in TOPICS}
    if member.service in (READER, OPERATOR):
        return {}
    found: dict[Topic, str] = {}
    for topic in TOPICS:
        writer = REQUEST_SENDER if topic is topics.REQUEST else topic.key.split("/")[2]
        id = "*" if member.service == RECORDER else member.id
        if writer == member.service:
            found[topic] = topic.on(rig, viewer=id)
        elif writer == "{service}":
            found[topic] = topic.on(rig, service=member.service, id=id)
    return found


def _of_all(rig: str, puts: Sequence[str]) -> list[Rule]:
    """Rules of every member: subscriptions, and the queries that all may send.  puts: keys of no topic."""
    everything, kept = topics.EVERYTHING.format(rig=rig), _advanced(topics.EVERYTHING.format(rig=rig))
    claims = topics.CLAIM.format(rig=rig, service="*", id="*", claim="*")
    queries = [topics.CLOCK.format(rig=rig), topics.SERVICE_INFO.format(rig=rig, service="*", id="*"), claims, kept]
    alive = [topics.ALIVE.format(rig=rig, service="*", id="*"), claims, kept]
    return [
        _rule(f"{rig}: subscribe", ("ingress",), ("declare_subscriber",), [everything, kept, *puts]),
        _rule(f"{rig}: query", ("ingress",), ("query",), queries),
        _rule(f"{rig}: watch liveliness", ("ingress",), LIVELINESS, alive),
        _rule(f"{rig}: receive", ("egress",), EVERY_MESSAGE, [everything, kept, *puts]),
    ]


def _of_one(rig: str, member: Member) -> list[Rule]:
    """Rules of one member: its publications and the queries it replies to."""
    keys = keys_of(rig, member)
    if member.service == READER:  # passes on the list, which the authority has signed
        return [_rule(f"{rig}: revoke", ("ingress",), ("put", "query"), [topics.REVOKED.format(rig=rig)])]
    if member.service == OPERATOR:
        return [_rule(f"{rig}: film", ("ingress",), ("query",), [topics.FILM.format(rig=rig, viewer="*")])]
    if not keys:
        return []
    kept = [expression for topic, expression in keys.items() if topic.queueing is Queueing.LATCHED]
    advanced = [_advanced(expression) for expression in kept]
    service, id = ("*", "*") if member.service == REPLAY else (member.service, member.id)
    id = "*" if member.service == RECORDER else id
    names = {"rig": rig, "service": service, "id": id}
    claims = topics.CLAIM.format_map(names | {"claim": "*"})
    answers = [topics.FLOW_CONTROL.format_map(names), topics.SERVICE_INFO.format_map(names), claims]
    if service == "viewer":
        answers.append(topics.FILM.format(rig=rig, viewer=id))
    if service in ("integrator", "*"):
        answers.append(topics.CLOCK.format(rig=rig))
    tokens = [topics.ALIVE.format_map(names), claims, *advanced]
    name = f"{rig}: {member.name}"
    rules = [
        _rule(f"{name}: publish", ("ingress",), ("put",), [*keys.values(), *advanced, *member.puts]),
        _rule(f"{name}: reply to queries", ("ingress",), ("declare_queryable", "reply"), [*answers, *kept, *advanced]),
        _rule(f"{name}: declare liveliness", ("ingress",), ("liveliness_token",), tokens),
    ]
    # The reply becomes the body and pose of a restarted service: none from the machines of cameras.  Only the publisher of
    # the topic may ask.
    if member.service != "viewer":
        recovery = [topics.STATE_RECOVERY.format(rig=rig, topic="*")]
        rules.append(_rule(f"{name}: reply to state recovery", ("ingress",), ("declare_queryable", "reply"), recovery))
    questions = [topics.STATE_RECOVERY.format(rig=rig, topic=topic.name) for topic in keys if topic.recoverable]
    questions.append(topics.FLOW_CONTROL.format_map(names))
    rules.append(_rule(f"{name}: query services", ("ingress",), ("query",), questions))
    return rules


def _advanced(expression: str) -> str:
    """Key expression on which Zenoh's advanced publishers announce themselves, their progress and their cache."""
    return f"{expression}/@adv/**"


def _rule(
    name: str, flows: Sequence[Flow], messages: Sequence[Message], keys: Sequence[str],
    permission: Literal["allow", "deny"] = "allow",
) -> Rule:  # fmt: skip
    return {
        "id": name, "permission": permission, "flows": list(flows), "messages": list(messages),
        "key_exprs": list(dict.fromkeys(keys)),
    }  # fmt: skip
