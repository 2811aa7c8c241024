"""`zenocap track` as a process: an interruption ends it and its threads."""

import signal
from pathlib import Path

import pytest

from tests.support.processes import ended, output_of, started, wait_until
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import demo_rig_file
from zenocap.services.recognizer.model_file import find_model

pytestmark = pytest.mark.nightly
MODEL_BYTES = find_model("fifteen").stat().st_size  # a take begins with the posture model


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_interruption_leaves_a_readable_take_and_no_process(tmp_path: Path, jobs: int) -> None:
    take = tmp_path / "a.mcap"
    arguments = ["track", demo_rig_file(), "-o", take, "--jobs", jobs]
    with started(arguments, tmp_path) as process:
        wait_until(lambda: take.is_file() and take.stat().st_size > 150_000 + MODEL_BYTES, tmp_path)
        assert process.poll() is None, output_of(tmp_path)
        assert ended(process, signal.SIGINT) != 0
    assert not Path(f"/proc/{process.pid}").exists()
    assert "Traceback" not in output_of(tmp_path)
    assert sum(1 for _ in TakeReader(take).messages()) > 100
