"""Text of a camera's faults, and the faults of a take."""

from zenocap.common import camera_advice
from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault


def fault(code: AdviceCode = AdviceCode.HOLES, value: float = 20.0, limit: float = 10.0) -> CameraFault:
    return CameraFault(code=code, value=value, limit=limit, unit="%")


def advice(*faults: CameraFault, viewer: str = "1") -> CameraAdvice:
    return CameraAdvice(frame=0, captured_ns=0, viewer=viewer, faults=list(faults))


def collected(*messages: CameraAdvice) -> camera_advice.TakeAdvice:
    found = camera_advice.TakeAdvice()
    for message in messages:
        found.add(message)
    return found


def test_every_code_has_text_with_its_value_and_a_change() -> None:
    assert set(camera_advice.WORDINGS) == set(AdviceCode)
    for code in AdviceCode:
        one = fault(code, value=37.0)
        assert "37" in camera_advice.found_text(one)
        assert camera_advice.change_text(one)
        assert "{" not in camera_advice.sentence(one)


def test_a_small_person_is_advised_from_what_height_on_it_works() -> None:
    found = camera_advice.found_text(CameraFault(code=AdviceCode.SMALL, value=55.0, limit=100.0, unit="px"))
    assert found == "the person is only 55 px tall; from about 100 px on it works"


def test_marks_are_short_and_empty_without_faults() -> None:
    assert camera_advice.marks(advice()) == ""
    assert camera_advice.marks(advice(fault(), fault(AdviceCode.FOCUS))) == "holes, focus"


def test_a_fault_of_a_moment_is_no_fault_of_the_take() -> None:
    assert collected(*[advice()] * 20, *[advice(fault())] * (camera_advice.LEAST_REPORTS - 1)).faults() == []


def test_faults_of_a_take_are_ordered_by_time_and_size() -> None:
    small = CameraFault(code=AdviceCode.SMALL, value=10.0, limit=50.0, unit="px")
    found = collected(*[advice(fault(), small)] * 4, *[advice(fault(value=11.0), viewer="2")] * 4).faults()
    assert [(one.viewer, one.fault.code, one.share) for one in found] == [
        ("1", AdviceCode.SMALL, 1.0),
        ("1", AdviceCode.HOLES, 1.0),
        ("2", AdviceCode.HOLES, 1.0),
    ]


def test_lines_name_camera_and_share() -> None:
    faults = collected(*[advice(fault())] * 4, *[advice()] * 4).faults()
    head, line = camera_advice.take_lines(faults)
    assert head == "cameras: what to improve first"
    assert line.startswith("  camera 1: 20 % of the silhouette")
    assert line.endswith("(50% of the time)")
    assert list(camera_advice.take_lines([])) == []
    assert len(list(camera_advice.take_lines(faults * 5))) == 1 + camera_advice.SHOWN
