"""Who a service is, said when it is asked: an answer over Zenoh, and the question to all of a rig."""

import logging

import zenoh

from common import codec
from common.about import About
from common.bus.zenoh_clock import ENCODING
from common.topics import ABOUT

logger = logging.getLogger(__name__)

MOST = 256  # answers that are read


def tell(session: zenoh.Session, rig: str, about: About) -> zenoh.Queryable[None]:
    """Answer until what is returned is undeclared."""
    payload = codec.encode(about)

    def answer(query: zenoh.Query) -> None:
        with query:
            try:
                query.reply(key, payload, encoding=ENCODING)
            except zenoh.ZError as error:
                logger.debug("%s: the asker is gone: %s", key, error)

    key = ABOUT.format(rig=rig, service=about.service, id=about.id)
    return session.declare_queryable(key, answer, complete=True)


def ask_everybody(session: zenoh.Session, rig: str, timeout_s: float) -> dict[tuple[str, str], About | str]:
    """The answers of all services of a rig within `timeout_s`, by name and id; a text where one cannot be read."""
    found: dict[tuple[str, str], About | str] = {}
    everybody = ABOUT.format(rig=rig, service="*", id="*")
    for reply in session.get(everybody, timeout=timeout_s, consolidation=zenoh.ConsolidationMode.NONE):
        if reply.ok is None or len(found) >= MOST:
            continue
        *_, service, id = str(reply.ok.key_expr).split("/")
        try:
            about = codec.decode(reply.ok.payload.to_bytes(), About)
        except codec.BadMessage as error:
            found[(service, id)] = str(error)
            continue
        agrees = (about.service, about.id) == (service, id)
        found[(service, id)] = about if agrees else f"it says that it is {about.service} {about.id}"
    return found
