"""The first signal stops the loops, the next one has the system's default effect."""

import faulthandler
import os
import signal

import pytest

from zenocap.common.runtime.signals import STACKS, loading, print_stacks_on_signal, stop_signals


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
