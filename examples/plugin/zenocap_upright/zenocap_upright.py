"""Two-view method for people who stand upright: `method = "upright"`.  The torso does not lean."""

from dataclasses import replace
from typing import Never

from zenocap.common.rig.methods import TWO_VIEW
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.two_view import IMPROVED
from zenocap.common.runtime.service import Service
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.services.integrator.shell import integrator_service
from zenocap.services.integrator.states import IntegratorSetup, IntegratorState
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.two_view.shell import two_view
from zenocap.services.viewer.two_view.states import TwoViewSetup, TwoViewState

ADDITIONS = IMPROVED - {"tilt"}


def viewer(
    rig: Rig, one: Viewer, people: PeopleSegmenter | None = None, kept: Adaptive | None = None
) -> Service[TwoViewSetup, TwoViewState, Frame]:
    return two_view(replace(rig, additions=ADDITIONS), one, people, kept)


def pose(rig: Rig) -> Service[IntegratorSetup, IntegratorState, Never]:
    return integrator_service(replace(rig, additions=ADDITIONS))


UPRIGHT = replace(
    TWO_VIEW, name="upright", viewer="zenocap_upright:viewer", pose="zenocap_upright:pose", recomputes_viewers=False,
    recomputes_pose=False,
)  # fmt: skip
