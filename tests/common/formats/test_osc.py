"""OSC messages and bundles equal those of python-osc."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.osc_packet import OscPacket

from zenocap.common.formats.osc import osc_bundles, osc_message

TEXTS = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=20)
ARGUMENTS = st.one_of(TEXTS, st.integers(-(2**31), 2**31 - 1), st.floats(width=32, allow_nan=False))


@given(st.lists(ARGUMENTS, max_size=9))
def test_messages_equal_those_of_python_osc(arguments: list[str | int | float]) -> None:
    builder = OscMessageBuilder("/VMC/Ext/Any")
    for argument in arguments:
        builder.add_arg(argument, {str: "s", int: "i", float: "f"}[type(argument)])
    assert osc_message("/VMC/Ext/Any", *arguments) == builder.build().dgram


@given(st.lists(st.integers(0, 60), max_size=30), st.integers(100, 1500))
def test_bundles_keep_all_messages_in_order_and_within_the_limit(lengths: list[int], largest: int) -> None:
    messages = [osc_message("/a", k, "x" * length) for k, length in enumerate(lengths)]
    found = osc_bundles(messages, largest)
    assert all(len(bundle) <= largest for bundle in found)
    numbers = [timed.message.params[0] for bundle in found for timed in OscPacket(bundle).messages]
    assert numbers == list(range(len(lengths)))


def test_a_bundle_equals_that_of_python_osc_with_the_time_tag_immediately() -> None:
    first, second = OscMessageBuilder("/a").build(), OscMessageBuilder("/b").build()
    builder = OscBundleBuilder(IMMEDIATELY)
    builder.add_content(first)
    builder.add_content(second)
    assert list(osc_bundles([osc_message("/a"), osc_message("/b")], 1400)) == [builder.build().dgram]


def test_a_message_beyond_the_limit_has_its_own_bundle() -> None:
    large = osc_message("/large", "x" * 200)
    found = osc_bundles([osc_message("/a"), large, osc_message("/b")], 100)
    assert [len(bundle) > 100 for bundle in found] == [False, True, False]
    assert list(osc_bundles([], 100)) == []


def test_a_number_beyond_32_bits_is_refused() -> None:
    with pytest.raises(Exception, match="format requires"):
        osc_message("/a", 2**40)
