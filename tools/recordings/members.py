"""The services of a rig that make its poses and postures, for a session."""

from typing import cast

from zenocap.common.messages import CameraInfo
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.service import Service
from zenocap.services.recognizer.shell import model_of, recognizer_service
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.shell import camera_info, people_of, service_of


def members(rig: Rig) -> list[Service[object, object, Frame]]:
    """The service of the poses, the viewers in the rig's order, and the recognizer if the rig has one.

    Raises as the services of the rig's method, `people_of` and `model_of` do.
    """
    services: list[object] = [method_of(rig.method).new_pose_service(rig)]
    services += [service_of(rig, viewer, people_of(viewer, threaded=False)) for viewer in rig.viewers]
    if rig.recognizer is not None:
        services.append(recognizer_service(rig, model_of(rig)))
    return cast("list[Service[object, object, Frame]]", services)


def cameras(rig: Rig, epoch_ns: int) -> list[CameraInfo]:
    """The camera of every viewer.  epoch_ns: capture time of frame 0."""
    return [camera_info(viewer, epoch_ns) for viewer in rig.viewers]
