"""The animator's service: with smoothing, page and outputs get the same smoothed poses."""

from dataclasses import replace

import numpy as np
import pytest

from tests.common.formats.test_smoothing import gentle
from tests.common.formats.test_take_poses import messages_of_track
from tests.support.animator_stand_in import received
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import angles_by_name
from zenocap.common.rig.animator import AnimatorTable
from zenocap.common.rig.rig import demo_rig
from zenocap.services.animator.shell import animator_service


@pytest.mark.parametrize("smooth", ["off", "one-euro"])
def test_page_and_outputs_get_the_same_poses(smooth: str) -> None:
    raw = messages_of_track(gentle(30))
    rig = replace(demo_rig("two-view"), animator=AnimatorTable(smooth=smooth))
    seen: list[Envelope] = []
    service = animator_service(rig, on_event=seen.append)
    state, changed = service.initial(), 0
    for message in raw:
        state, published = service.step(service.setup, state, received(message, message.captured_ns))
        assert list(published) == []
        if not isinstance(message, m.UniversalBap):
            continue
        output, page = seen[-1].message, state.actors["two-view"]
        assert angles_by_name(TEN_PARTS, page.pose.angles) == output.angles
        np.testing.assert_array_equal(page.pose.position, output.position)
        changed += output.angles != message.angles
    assert changed == (29 if smooth == "one-euro" else 0)
