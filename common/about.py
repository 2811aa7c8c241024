"""What a service says of itself to whoever asks: not a message that is sent, but an answer."""

from typing import Annotated

from msgspec import Meta

from common.messages import Message, Name, Text


class About(Message, frozen=True, tag="about"):
    """What a service is.  digest: of its rig file and calibration, equal on every machine of a rig."""

    service: Name
    id: Name
    host: Text  # its machine's name
    digest: Text
    versions: Annotated[dict[Name, Text], Meta(max_length=32)]  # of zenocap, Python and packages
