import cv2
import pytest

from zenocap.common.vision.threads import VARIABLE, use_one_thread


@pytest.fixture
def two_threads():
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    yield
    cv2.setNumThreads(before)


def test_opencv_works_in_one_thread(two_threads, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    use_one_thread()
    assert cv2.getNumThreads() == 1


def test_the_environment_variable_overrides_it(two_threads, monkeypatch):
    monkeypatch.setenv(VARIABLE, "2")
    use_one_thread()
    assert cv2.getNumThreads() == 2
