import cv2
import pytest

from zenocap.common.vision.threads import VARIABLE, use_one_thread


@pytest.mark.parametrize(("variable", "threads"), [("", 1), ("2", 2)])
def test_opencv_works_in_one_thread_unless_the_environment_variable_says_otherwise(monkeypatch, variable, threads):
    monkeypatch.setenv(VARIABLE, variable)
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        use_one_thread()
        assert cv2.getNumThreads() == threads
    finally:
        cv2.setNumThreads(before)
