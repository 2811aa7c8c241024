"""The first signal stops the loops, the next one has the system's default effect."""

import faulthandler
import os
import signal
import subprocess
import sys
from unittest.mock import Mock

import pytest

from zenocap.common.runtime.signals import (
    HANGS_S,
    STACKS,
    come_round,
    loading,
    print_stacks_on_signal,
    stop_signals,
    watched,
)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_sets_stopped_and_the_handler_is_restored(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_signals() as stopped:
        assert not stopped()
        os.kill(os.getpid(), number)
        assert stopped()
        assert signal.getsignal(number) is signal.SIG_DFL
    assert signal.getsignal(number) is before


@pytest.mark.skipif(STACKS is None, reason="the signal is one of POSIX")
def test_a_process_that_hangs_prints_the_stacks_of_its_threads(capfd: pytest.CaptureFixture[str]) -> None:
    assert STACKS is not None
    print_stacks_on_signal()
    try:
        os.kill(os.getpid(), STACKS)
    finally:
        faulthandler.unregister(STACKS)
    assert "in test_a_process_that_hangs" in capfd.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("before", [False, True], ids=["while", "before"])
def test_a_process_that_still_loads_ends_at_once(
    monkeypatch: pytest.MonkeyPatch, number: signal.Signals, before: bool
) -> None:
    def left(status: int) -> None:
        raise SystemExit(status)

    def start() -> None:
        with stop_signals() as stopped:
            if before:
                os.kill(os.getpid(), number)
            with loading(stopped):
                assert not before
                os.kill(os.getpid(), number)

    monkeypatch.setattr(os, "_exit", left)
    with pytest.raises(SystemExit, match="0"):
        start()
    with stop_signals() as stopped:
        with loading(stopped):
            pass
        os.kill(os.getpid(), number)  # of what has begun, the end is its own
        assert stopped()


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="the signal is one of POSIX")
@pytest.mark.parametrize(("code", "status"), [("while True: come_round(0.2)", 0), ("come_round(0.2); Event().wait()", -14)])
def test_a_service_whose_loop_comes_round_no_more_is_ended(code: str, status: int) -> None:
    """Without memory the start of a thread waited for ever, and nothing was started again."""
    begin = (
        "import os\nfrom threading import Event, Timer\nfrom zenocap.common.runtime.signals import come_round, watched\n"
    )
    text = f"{begin}Timer(1.0, os._exit, (0,)).start()\nwith watched():\n    {code}\n"
    assert subprocess.run([sys.executable, "-c", text], check=False).returncode == status


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="the signal is one of POSIX")
def test_the_timer_of_another_program_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    timer = Mock()
    monkeypatch.setattr(signal, "setitimer", timer)
    come_round()
    assert timer.call_args_list == []
    with watched():
        come_round()
    come_round()
    assert [call.args[1] for call in timer.call_args_list] == [HANGS_S, 0.0]
