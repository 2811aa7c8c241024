"""Golden takes: content and readers' results equal the texts, steps recompute the bytes.

They were recorded on AMD EPYCs, and are recomputed to the same bytes on an Intel Xeon.  Where a take was recorded with
AVX-512, or a processor has no AVX2, the last digits of the steps may differ.
"""

import pytest

from tests.golden.make import HERE, TAKES, readable
from tests.golden.texts import TEXTS
from zenocap.common.processor import AVX2, instructions
from zenocap.tools.takes.verify.recompute import verify

pytestmark = pytest.mark.slow

OTHER_DIGITS = 1e-6
LONG = ("paper", "follow")
WITH_AVX512 = ("arms", "live")  # recorded so, by 0.2.0
NAMES = [pytest.param(name, marks=pytest.mark.nightly if name in LONG else ()) for name in TAKES]


@pytest.mark.parametrize("name", TAKES)
def test_the_text_equals_the_content_of_the_take(name: str) -> None:
    assert readable(HERE / f"{name}.mcap") == (HERE / f"{name}.txt").read_text()


@pytest.mark.parametrize("reader", TEXTS)
@pytest.mark.parametrize("name", NAMES)
def test_a_reader_finds_what_it_found(name: str, reader: str) -> None:
    assert TEXTS[reader](HERE / f"{name}.mcap") == (HERE / "texts" / f"{name}-{reader}.txt").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_the_current_steps_recompute_the_take(name: str) -> None:
    exact = instructions() == AVX2 and name not in WITH_AVX512
    found = verify([HERE / f"{name}.mcap"], 0.0 if exact else OTHER_DIGITS)
    assert found.first is None
    assert (found.different.total(), found.unlogged.total(), found.unchecked.total()) == (0, 0, 0)
    assert found.reasons == []
    assert max(found.equal.values()) > 90
