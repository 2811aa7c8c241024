"""Encoding of Open Sound Control (OSC) 1.0 messages and bundles."""

import struct
from collections.abc import Iterable, Sequence

OSC_BUNDLE_HEADER = b"#bundle\0" + (1).to_bytes(8, "big")  # with OSC's time tag for "immediately"


def osc_string(value: str) -> bytes:
    """OSC string: UTF-8, terminated by one to four zero bytes up to a multiple of four bytes."""
    data = value.encode()
    return data + b"\0" * (4 - len(data) % 4)


def osc_message(address: str, *arguments: str | int | float) -> bytes:
    """One OSC message; int: 32 bits, float: single precision.  Raises struct.error for numbers outside these."""
    tags, data = ",", b""
    for argument in arguments:
        match argument:
            case str():
                tags, data = tags + "s", data + osc_string(argument)
            case int():
                tags, data = tags + "i", data + struct.pack(">i", argument)
            case _:
                tags, data = tags + "f", data + struct.pack(">f", argument)
    return osc_string(address) + osc_string(tags) + data


def osc_bundles(messages: Iterable[bytes], max_bytes: int) -> Sequence[bytes]:
    """The messages in order, in bundles of at most `max_bytes`; a larger message gets a bundle of its own."""
    found: list[bytes] = []
    parts, size = [OSC_BUNDLE_HEADER], len(OSC_BUNDLE_HEADER)
    for message in messages:
        if len(parts) > 1 and size + 4 + len(message) > max_bytes:
            found.append(b"".join(parts))
            parts, size = [OSC_BUNDLE_HEADER], len(OSC_BUNDLE_HEADER)
        parts += [len(message).to_bytes(4, "big"), message]
        size += 4 + len(message)
    return [*found, b"".join(parts)] if len(parts) > 1 else found
