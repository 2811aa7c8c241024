"""Messages that all pages have, as JSON; `static/*.js` is the other side."""

from typing import Generic, TypeVar

import msgspec

C = TypeVar("C")
encode = msgspec.json.Encoder().encode


class NoticeUpdate(msgspec.Struct, frozen=True, tag="notice", tag_field="type"):
    """A line of text for the user."""

    text: str


class Acknowledge(msgspec.Struct, frozen=True, tag="acknowledge", tag_field="type", forbid_unknown_fields=True):
    """The page has shown one list of updates, and may be sent another."""


class Decoder(Generic[C]):
    """Decoder of the commands of a page.  kinds: their union."""

    def __init__(self, kinds: object) -> None:
        self._decoder: msgspec.json.Decoder[C | Acknowledge] = msgspec.json.Decoder(Acknowledge | kinds)

    def __call__(self, text: str | bytes) -> C | Acknowledge:
        """Raises ValueError for anything else than a command."""
        try:
            return self._decoder.decode(text)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"invalid command from a page: {error}") from error
