"""CDR against rosbags, an independent encoder of ROS 2 messages."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from zenocap.common.formats.cdr import CdrWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
NUMBERS = st.floats(-1e6, 1e6, width=32)


@given(
    text=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20), values=st.lists(NUMBERS, max_size=4)
)
def test_alignment_strings_and_sequences_are_those_of_rosbags(text: str, values: list[float]) -> None:
    """A JointState has a header, sequences of strings, and sequences of doubles behind odd lengths."""
    types = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](5, 7), text)
    empty = np.zeros(0)
    message = types["sensor_msgs/msg/JointState"](header, [text, "b"], np.array(values), empty, np.array([1.0]))
    out = CdrWriter()
    out.time(5_000_000_007)
    out.string(text)
    out.uint32(2)
    out.string(text)
    out.string("b")
    for row in (values, [], [1.0]):
        out.uint32(len(row))
        out.float64(row)
    assert out.data() == bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def test_smaller_values_are_aligned_to_their_own_size() -> None:
    out = CdrWriter()
    out.bool(True)
    out.float32([0.5])
    out.bool(False)
    out.int32(-2)
    out.float64([2.0])
    expected = struct.pack("<4x?3xf?3xi", True, 0.5, False, -2) + struct.pack("<d", 2.0)
    assert out.data() == b"\0\1\0\0" + expected[4:]


def test_numbers_out_of_range_are_errors() -> None:
    with pytest.raises(struct.error):
        CdrWriter().uint32(-1)
    with pytest.raises(struct.error):
        CdrWriter().time(2**31 * 1_000_000_000)
