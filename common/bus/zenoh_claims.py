"""Claims: one process runs each service of a rig, the one that started first.

A claim is a liveliness token whose key has the start time and the session of its process.  Any program can declare a token,
so that a claim counts only if its own session answers a query on its key: a token alone stops no service.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

import zenoh

from zenocap.common.topics import CLAIM

QUERY_TIMEOUT_S = 1.0  # chosen by hand
LONGEST_RUN_NS = 366 * 86_400 * 10**9  # an older claim is invalid; chosen by hand
FIRST_PAUSE_S, CHECKS = 0.25, 7  # of one claim, at doubling pauses: its queryable may arrive after its token; by hand
MAX_CLAIMS = 64  # that are checked at a time; chosen by hand
FORM = re.compile(r"([0-9]{20})-([0-9a-f]{1,32})")  # start time, nanoseconds; session


@dataclass
class _Check:
    """An older claim that is to be confirmed.  checks: number so far.  due_s: time of the next."""

    checks: int
    due_s: float


class Claims:
    """The claim of one service.  names: rig, service, id.  start_ns: when this process started.

    on_older: called on a thread of Zenoh's when an older instance has answered.
    """

    def __init__(self, session: zenoh.Session, names: dict[str, str], start_ns: int, on_older: Callable[[], None]) -> None:
        self._session, self._names, self._start_ns, self._on_older = session, names, start_ns, on_older
        self.own = f"{start_ns:020d}-{session.zid()}"
        self._unconfirmed: dict[str, _Check] = {}

    def taken(self) -> bool:
        """Whether a running process answers for this service; waits QUERY_TIMEOUT_S at most for the tokens, and answers."""
        claims = self._key("*")
        tokens = self._session.liveliness().get(claims, timeout=QUERY_TIMEOUT_S)
        if not any(reply.ok is not None for reply in tokens):
            return False
        everyone = zenoh.QueryTarget.ALL
        replies = self._session.get(
            claims, target=everyone, consolidation=zenoh.ConsolidationMode.NONE, timeout=QUERY_TIMEOUT_S, express=True
        )
        return any(self._is_confirmed(reply) for reply in replies)

    def declare(self) -> list[zenoh.Queryable[None] | zenoh.LivelinessToken | zenoh.Subscriber[None]]:
        """Claim the service until the returned entities are undeclared."""
        key, liveliness = self._key(self.own), self._session.liveliness()

        def answer(query: zenoh.Query) -> None:
            with query:
                query.reply(key, b"", express=True)

        return [
            self._session.declare_queryable(key, answer, complete=True),  # before the token, which it confirms
            liveliness.declare_token(key),
            liveliness.declare_subscriber(self._key("*"), self._on_token, history=True),
        ]

    def check(self) -> None:
        """Query the holders of older claims that are due; called by the thread of the bus, several times a second."""
        now_s = monotonic()
        for claim, check in list(self._unconfirmed.items()):
            if now_s >= check.due_s:
                check.checks += 1
                check.due_s = now_s + FIRST_PAUSE_S * 2 ** (check.checks - 1)
                if check.checks > CHECKS:
                    self._unconfirmed.pop(claim, None)
                    continue
                self._session.get(
                    self._key(claim), zenoh.handlers.Callback(self._on_reply), target=zenoh.QueryTarget.ALL,
                    timeout=QUERY_TIMEOUT_S, express=True,
                )  # fmt: skip

    def _on_token(self, sample: zenoh.Sample) -> None:
        claim = str(sample.key_expr).rpartition("/")[2]
        if sample.kind != zenoh.SampleKind.PUT:
            self._unconfirmed.pop(claim, None)
        elif self._is_older(claim) and len(self._unconfirmed) < MAX_CLAIMS:
            self._unconfirmed[claim] = _Check(0, 0.0)

    def _on_reply(self, reply: zenoh.Reply) -> None:
        if self._is_confirmed(reply):
            self._on_older()

    def _is_older(self, claim: str) -> bool:
        """Whether a well-formed claim of a plausible time precedes this one."""
        match = FORM.fullmatch(claim)
        return match is not None and claim < self.own and self._start_ns - int(match[1]) < LONGEST_RUN_NS

    def _is_confirmed(self, reply: zenoh.Reply) -> bool:
        """Whether the session in a claim has answered for it itself."""
        if reply.ok is None or reply.replier_id is None:
            return False
        match = FORM.fullmatch(str(reply.ok.key_expr).rpartition("/")[2])
        return match is not None and match[2] == str(reply.replier_id.zid)

    def _key(self, claim: str) -> str:
        return CLAIM.format(**self._names, claim=claim)
