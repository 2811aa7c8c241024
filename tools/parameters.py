"""Parameters of the services of a rig, as its takes carry them (attachment `parameters.json`)."""

from collections.abc import Mapping
from types import ModuleType

from zenocap.common.recording.setup_file import Parameters
from zenocap.common.rig.services import RigLike, kinds_of
from zenocap.services.integrator import parameters as integrator
from zenocap.services.recognizer import parameters as recognizer
from zenocap.services.tracker import parameters as tracker
from zenocap.services.viewer import parameters as viewer

EPOCH_NS = 1_072_915_200_000_000_000  # of tracked takes: 2004-01-01, of [Two-view]: results do not depend on the date
SHOWN_PICTURE_PX, SHOWN_PICTURE_QUALITY = 640, 75  # longer side (px), JPEG quality; chosen by hand
SOUGHT_S = 2.0  # s ahead up to which a video is decoded rather than sought, and of the nearest frame; chosen by hand

OF_SERVICES = {"viewer": viewer, "integrator": integrator, "tracker": tracker, "recognizer": recognizer}
"""By service: the module of its behavioural constants."""


def service_parameters(rig: RigLike) -> Parameters:
    """Parameters of the services whose messages a rig's take has, by service and name."""
    runs = {kind.name for kind in kinds_of(rig)}
    return {service: constants(module) for service, module in OF_SERVICES.items() if service in runs}


def constants(module: ModuleType) -> Mapping[str, object]:
    return {name: value for name, value in vars(module).items() if name.isupper()}
