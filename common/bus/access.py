"""Who may do what on a secured network: Zenoh's access control, made of the table of keys.

Nothing is allowed but what is said here.  A member is known by the common name of its certificate; every router and
every peer that others connect to checks what comes in from each of them, and what goes out to it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from common.topics import (
    ABOUT,
    ALIVE,
    CLAIM,
    CLOCK,
    EVERYTHING,
    PACE,
    PREVIEW,
    RECALL,
    REQUEST,
    SILHOUETTE,
    TOPICS,
    Queueing,
    Topic,
)

Message = Literal[
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
    "declare_liveliness_subscriber", "liveliness_query",
]  # fmt: skip
Flow = Literal["ingress", "egress"]
Rule: TypeAlias = dict[str, object]

EVERY_MESSAGE: tuple[Message, ...] = (
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
    "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
LIVELINESS: tuple[Message, ...] = ("declare_liveliness_subscriber", "liveliness_query")
MAX_COMMON_NAME = 64  # of X.509
ROUTER = "router"  # the common name of every router; all others have their rig's name before theirs
READER, RECORDER, REPLAY = "reader", "recorder", "replay"  # beside the services
ASKER = "animator"  # whose page asks things of the rig


@dataclass(frozen=True)
class Member:
    """Who has a certificate: a service of a rig, by its name and id, or one of READER, RECORDER, REPLAY and ROUTER."""

    service: str
    id: str = "main"

    @property
    def name(self) -> str:
        """As its files are called, such as viewer-1."""
        return self.service if self.id == "main" else f"{self.service}-{self.id}"

    def common_name(self, rig: str) -> str:
        """In its certificate.  Raises ValueError where that is longer than a certificate may have."""
        name = ROUTER if self.service == ROUTER else f"{rig}/{self.service}/{self.id}"
        if len(name) > MAX_COMMON_NAME:
            raise ValueError(f"{name}: {len(name)} letters: allowed in a certificate: {MAX_COMMON_NAME}; shorten rig or id")
        return name


def access_control(rigs: Mapping[str, Sequence[Member]]) -> str:
    """Zenoh's `access_control`, as JSON.  rigs: the members by the rig's name, routers left out.  Raises ValueError."""
    rules: list[Rule] = [_rule("routers", ("ingress", "egress"), EVERY_MESSAGE, ["**", "**/@adv/**"])]
    subjects: list[Rule] = [{"id": ROUTER, "cert_common_names": [ROUTER]}]
    policies: list[Rule] = [{"rules": ["routers"], "subjects": [ROUTER]}]
    for rig, members in rigs.items():
        common = _of_all(rig)
        pictures = _rule(
            f"{rig}: no pictures", ("egress",), ("put", "reply"), [SILHOUETTE.on(rig), PREVIEW.on(rig)], "deny"
        )
        rules += [*common, pictures]
        for member in members:
            subject = member.common_name(rig)
            own = _of_one(rig, member)
            rules += own
            subjects.append({"id": subject, "cert_common_names": [subject]})
            kept_from = [pictures] if member.service == "viewer" else []
            policies.append({"rules": [rule["id"] for rule in (*common, *kept_from, *own)], "subjects": [subject]})
    settings = {"enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies}
    return json.dumps(settings)


def keys_of(rig: str, member: Member) -> dict[Topic, str]:
    """On which key expression of each topic a member may publish; a topic that is not its own is left out."""
    if member.service == REPLAY:
        return {topic: topic.on(rig) for topic in TOPICS}
    if member.service == READER:
        return {}
    found: dict[Topic, str] = {}
    for topic in TOPICS:
        writer = ASKER if topic is REQUEST else topic.key.split("/")[2]
        id = "*" if member.service == RECORDER else member.id
        if writer == member.service:
            found[topic] = topic.on(rig, viewer=id)
        elif writer == "{service}":
            found[topic] = topic.on(rig, service=member.service, id=id)
    return found


def _of_all(rig: str) -> list[Rule]:
    """Listening, and the questions that anybody of the rig may ask."""
    everything, kept = EVERYTHING.format(rig=rig), _advanced(EVERYTHING.format(rig=rig))
    asked = [CLOCK.format(rig=rig), ABOUT.format(rig=rig, service="*", id="*"), kept]
    alive = [ALIVE.format(rig=rig, service="*", id="*"), CLAIM.format(rig=rig, service="*", id="*", claim="*"), kept]
    return [
        _rule(f"{rig}: hear", ("ingress",), ("declare_subscriber",), [everything, kept]),
        _rule(f"{rig}: ask", ("ingress",), ("query",), asked),
        _rule(f"{rig}: see who is there", ("ingress",), LIVELINESS, alive),
        _rule(f"{rig}: be told", ("egress",), EVERY_MESSAGE, [everything, kept]),
    ]


def _of_one(rig: str, member: Member) -> list[Rule]:
    """What a member says, and what it answers."""
    keys = keys_of(rig, member)
    if not keys:
        return []
    kept = [expression for topic, expression in keys.items() if topic.queueing is Queueing.KEPT]
    advanced = [_advanced(expression) for expression in kept]
    service, id = ("*", "*") if member.service == REPLAY else (member.service, member.id)
    id = "*" if member.service == RECORDER else id
    who = {"rig": rig, "service": service, "id": id}
    answers = [PACE.format_map(who), ABOUT.format_map(who)]
    if service in ("integrator", "*"):
        answers.append(CLOCK.format(rig=rig))
    tokens = [ALIVE.format_map(who), CLAIM.format_map(who | {"claim": "*"}), *advanced]
    name = f"{rig}: {member.name}"
    rules = [
        _rule(f"{name} says", ("ingress",), ("put",), [*keys.values(), *advanced]),
        _rule(f"{name} answers", ("ingress",), ("declare_queryable", "reply"), [*answers, *kept, *advanced]),
        _rule(f"{name} is there", ("ingress",), ("liveliness_token",), tokens),
    ]
    # Whoever listens may tell a service what it had said before it was restarted; only that one may ask.
    rules.append(
        _rule(f"{name} remembers", ("ingress",), ("declare_queryable", "reply"), [RECALL.format(rig=rig, topic="*")])
    )
    questions = [RECALL.format(rig=rig, topic=topic.name) for topic in keys if topic.recalled]
    rules.append(_rule(f"{name} asks", ("ingress",), ("query",), [*questions, PACE.format_map(who)]))
    return rules


def _advanced(expression: str) -> str:
    """Where Zenoh's advanced publishers of a key say that they are there, how far they are, and what they keep."""
    return f"{expression}/@adv/**"


def _rule(
    name: str,
    flows: Sequence[Flow],
    messages: Sequence[Message],
    keys: Sequence[str],
    permission: Literal["allow", "deny"] = "allow",
) -> Rule:
    return {
        "id": name,
        "permission": permission,
        "flows": list(flows),
        "messages": list(messages),
        "key_exprs": list(dict.fromkeys(keys)),
    }
