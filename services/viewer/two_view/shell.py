"""Service of a two-view viewer."""

import logging
from functools import partial

import numpy as np

from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.runtime.compiled import compiling
from zenocap.common.runtime.service import Service, TopicSubscription
from zenocap.common.topics import ASSIGNMENT, FRAME_RATE, UNIVERSAL_BAP, UNIVERSAL_BDP
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.shell import plate_of
from zenocap.services.viewer.two_view.jit_warmup import load_compiled
from zenocap.services.viewer.two_view.states import TwoViewSetup, TwoViewState
from zenocap.services.viewer.two_view.step import answered_frame, describe, initial_state, phase_of, step

logger = logging.getLogger(__name__)


def two_view(
    rig: Rig, viewer: Viewer, people: PeopleSegmenter | None = None, kept: Adaptive | None = None
) -> Service[TwoViewSetup, TwoViewState, Frame]:
    """Viewer of method two-view, with the additions of the rig.  people: see `silhouette_service`.  kept: always None.

    Raises as `silhouette_service` does.
    """
    used = viewer.background_in_use
    setup = TwoViewSetup(
        viewer.id, viewer.camera, used, viewer.preview, plate_of(viewer, used), people,
        publish_silhouette=viewer.silhouette, additions=rig.additions,
    )  # fmt: skip
    setup.level.warp(np.zeros(viewer.camera.size[::-1], np.uint8))  # its tables are made now, not at the first frame

    def load() -> None:
        with compiling(logger, "viewer-service", "tracking"):
            load_compiled(setup)

    subscriptions = tuple(map(TopicSubscription, (ASSIGNMENT, UNIVERSAL_BDP, UNIVERSAL_BAP, FRAME_RATE)))
    return Service(
        "viewer", viewer.id, setup, partial(initial_state, setup), step, subscriptions, describe, phase=phase_of,
        answers=partial(answered_frame, viewer.id), load=load,
    )  # fmt: skip
