"""Encoding in CDR, the Common Data Representation of ROS 2: XCDR version 1, plain, little-endian.

Every primitive is aligned to its own size, counted from the end of the encapsulation header.  A sequence begins with its
length (uint32); a string is a sequence of bytes with a zero at its end.
"""

import struct
from collections.abc import Iterable

ENCAPSULATION = b"\0\1\0\0"  # CDR_LE, and two bytes of options
NANOSECONDS = 1_000_000_000


class CdrWriter:
    """Appends values in the order of the message's fields.  Raises struct.error for numbers out of range."""

    def __init__(self) -> None:
        self._data = bytearray(ENCAPSULATION)

    def int32(self, *values: int) -> None:
        self._pack(4, "i", values)

    def uint32(self, *values: int) -> None:
        self._pack(4, "I", values)

    def float32(self, values: Iterable[float]) -> None:
        self._pack(4, "f", tuple(values))

    def float64(self, values: Iterable[float]) -> None:
        self._pack(8, "d", tuple(values))

    def bool(self, value: bool) -> None:
        self._data.append(value)

    def string(self, text: str) -> None:
        data = text.encode()
        self.uint32(len(data) + 1)
        self._data += data
        self._data.append(0)

    def time(self, ns: int) -> None:
        """builtin_interfaces/Time or Duration of nanoseconds."""
        self.int32(ns // NANOSECONDS)
        self.uint32(ns % NANOSECONDS)

    def data(self) -> bytes:
        return bytes(self._data)

    def _pack(self, size: int, kind: str, values: tuple[float, ...]) -> None:
        if not values:
            return  # no elements, no padding, as Fast CDR has it
        self._data += bytes((len(ENCAPSULATION) - len(self._data)) % size)
        self._data += struct.pack(f"<{len(values)}{kind}", *values)
