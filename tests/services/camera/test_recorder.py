"""Video of a film on a disk that does not respond."""

import threading
from pathlib import Path

import numpy as np
import pytest

from zenocap.services.camera import recorder as recorder_module
from zenocap.services.camera.recorder import Recorder


def test_frames_that_wait_for_a_disk_that_hangs_at_the_end_are_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They were in no count, and there was no failure; with a full queue the film did not end."""
    monkeypatch.setattr(recorder_module, "ENDS_S", 0.01)
    recorder, disk, hangs = (
        Recorder(tmp_path / "a.mkv", tmp_path / "a.csv", (64, 48), 30.0),
        threading.Event(),
        threading.Event(),
    )
    monkeypatch.setattr(recorder.writer, "write", lambda *_: (hangs.set(), disk.wait(60.0)))
    recorder.begin(0, 0)
    for k in range(3):
        recorder.offer(np.zeros((48, 64, 3), np.uint8), k)
    assert hangs.wait(60.0)
    recorder.end()
    assert "the disk does not respond" in recorder.failure
    assert recorder.lost == 3
    disk.set()
