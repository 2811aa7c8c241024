"""Open Sound Control 1.0: messages and bundles as bytes.  Everything is big-endian and in steps of four bytes."""

import struct
from collections.abc import Iterable, Sequence

BUNDLE = b"#bundle\0" + (1).to_bytes(8, "big")  # with the time that means "at once"


def text(value: str) -> bytes:
    """A string: UTF-8, closed by one zero or up to four."""
    data = value.encode()
    return data + b"\0" * (4 - len(data) % 4)


def message(address: str, *arguments: str | int | float) -> bytes:
    """One message; int: 32 bits, float: single precision.  Raises struct.error for numbers beyond those."""
    tags, data = ",", b""
    for argument in arguments:
        match argument:
            case str():
                tags, data = tags + "s", data + text(argument)
            case int():
                tags, data = tags + "i", data + struct.pack(">i", argument)
            case _:
                tags, data = tags + "f", data + struct.pack(">f", argument)
    return text(address) + text(tags) + data


def bundles(messages: Iterable[bytes], largest: int) -> Sequence[bytes]:
    """The messages in order, as bundles of at most `largest` bytes, where one message fits at all."""
    found: list[bytes] = []
    parts, size = [BUNDLE], len(BUNDLE)
    for one in messages:
        if len(parts) > 1 and size + 4 + len(one) > largest:
            found.append(b"".join(parts))
            parts, size = [BUNDLE], len(BUNDLE)
        parts += [len(one).to_bytes(4, "big"), one]
        size += 4 + len(one)
    return [*found, b"".join(parts)] if len(parts) > 1 else found
