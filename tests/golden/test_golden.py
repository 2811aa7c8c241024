"""Golden takes: the content equals the text beside each, and the current steps recompute it byte for byte.

On another type of processor than that of the recording, the last digits may differ.
"""

import pytest

from tests.golden.make import HERE, NAMES, readable
from zenocap.common.runtime.service_info import processor
from zenocap.tools.verify.recompute import verify

pytestmark = pytest.mark.slow

OTHER_PROCESSOR = 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_the_text_equals_the_content_of_the_take(name: str) -> None:
    assert readable(HERE / f"{name}.mcap") == (HERE / f"{name}.txt").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_the_current_steps_recompute_the_take(name: str) -> None:
    found = verify([HERE / f"{name}.mcap"])
    if found.versions["processor"] != processor():
        found = verify([HERE / f"{name}.mcap"], OTHER_PROCESSOR)
    assert found.first is None
    assert (found.different.total(), found.unlogged.total(), found.unchecked.total()) == (0, 0, 0)
    assert found.reasons == []
    assert found.equal["zenocap/demo/integrator/bap"] > 90
