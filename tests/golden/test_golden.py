"""The golden takes: what is in them is in the text beside each, and today's steps still say the same, byte for byte.

On another kind of processor than the take was made on, the last digits may differ.
"""

import pytest

from common.runtime.versions import processor
from services.takes.verify.recompute import verify
from tests.golden.make import HERE, NAMES, readable

OTHER_PROCESSOR = 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_the_text_says_what_is_in_the_take(name: str) -> None:
    assert readable(HERE / f"{name}.mcap") == (HERE / f"{name}.txt").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_the_steps_of_today_say_what_is_in_the_take(name: str) -> None:
    found = verify([HERE / f"{name}.mcap"])
    if found.versions["processor"] != processor():
        found = verify([HERE / f"{name}.mcap"], OTHER_PROCESSOR)
    assert found.first is None
    assert (found.different.total(), found.unlogged.total(), found.unchecked.total()) == (0, 0, 0)
    assert found.reasons == []
    assert found.equal["zenocap/demo/integrator/bap"] > 90
