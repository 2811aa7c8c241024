"""Table of methods: every row has services, a rig that uses it, and published topics."""

import pytest

from zenocap.common.rig.methods import METHODS, Method, method_of, tracker_methods
from zenocap.common.rig.rig import demo_rig, demo_rig_file, load_rig
from zenocap.common.rig.services import SERVICES, services_of
from zenocap.common.runtime.service import new_pose_service
from zenocap.common.table import attribute
from zenocap.common.topics import SIGHTING, SILHOUETTE
from zenocap.services.viewer.parameters import SMALL_PERSON, SMALL_TRACKED
from zenocap.services.viewer.shell import service_of


@pytest.mark.parametrize("name", METHODS.names())
def test_a_rig_of_each_method_has_its_services(name: str) -> None:
    rig = load_rig(demo_rig_file(), name)
    method = method_of(rig.method)
    assert method.name == name
    assert (method.pose_service, "main") in services_of(rig)
    assert new_pose_service(method, rig).name == method.pose_service
    for viewer in rig.viewers:
        service = service_of(rig, viewer)
        assert service.name == "viewer"
        assert service.setup.small_px == (SMALL_PERSON if method.exchange else SMALL_TRACKED)
    assert (rig.tracker is not None) == (method.table == "tracker")


@pytest.mark.parametrize("method", METHODS.rows().values(), ids=METHODS.names())
def test_a_row_names_what_exists(method: Method) -> None:
    assert callable(attribute(method.viewer))
    assert callable(attribute(method.pose))
    assert method.pose_service in [kind.name for kind in SERVICES]
    assert method.poses.recoverable
    assert method.body.recoverable
    assert 2 <= method.views[0] <= method.views[1]
    assert method.sends[0] is (SIGHTING if method.exchange else SILHOUETTE)  # sent also without a person in the picture


def test_the_methods_with_a_tracker_are_named_in_errors() -> None:
    assert tracker_methods() == ("hybrid", "image-force", "particle-filter", "both")
    assert demo_rig("two-view").method not in tracker_methods()
