"""The first signal stops the loops, the next one has the system's default effect."""

import faulthandler
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from zenocap.common.runtime.signals import (
    STACKS,
    GivenUp,
    come_round,
    loading,
    print_stacks_on_signal,
    stop_signals,
    until_stopped,
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


def test_a_computation_is_given_up_at_a_stop_before_and_while_it_runs_and_not_afterwards() -> None:
    begun = list[str]()

    def stopped_in(when: str) -> None:
        begun.append(when)
        os.kill(os.getpid(), signal.SIGTERM)

    with stop_signals() as stopped:
        with until_stopped(stopped):
            pass
        for when in ("while", "before"):
            with pytest.raises(GivenUp), until_stopped(stopped):
                stopped_in(when)
        assert begun == ["while"]
    with stop_signals() as stopped:
        with until_stopped(stopped):
            pass
        os.kill(os.getpid(), signal.SIGTERM)
        assert stopped()


def test_a_stop_gives_up_nothing_in_another_thread() -> None:
    begun, goes_on, done = threading.Event(), threading.Event(), list[bool]()

    def compute() -> None:
        with until_stopped(stopped):
            begun.set()
            done.append(goes_on.wait(5.0))

    with stop_signals() as stopped:
        thread = threading.Thread(target=compute)
        thread.start()
        begun.wait(5.0)
        os.kill(os.getpid(), signal.SIGTERM)
        goes_on.set()
        thread.join(5.0)
        assert stopped()
        assert done == [True]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="the signal is one of POSIX")
@pytest.mark.parametrize(
    ("code", "status"),
    [
        ("while True: come_round(); time.sleep(0.05)", 0),
        ("come_round(); time.sleep(60)", -14),
        ("come_round(); come_round(loops=False); time.sleep(60)", 0),
        ("time.sleep(60)", 0),  # has no loop yet
        ("come_round(); os.kill(os.getpid(), signal.SIGSTOP); come_round(); time.sleep(0.1); os._exit(0)", 0),
    ],
)
def test_a_service_whose_loop_comes_round_no_more_is_ended_with_its_stacks(code: str, status: int) -> None:
    """Without memory the start of a thread waited for ever, and nothing was started again."""
    text = f"""import os, signal, time
from threading import Timer
from zenocap.common.runtime.signals import come_round, watched
Timer(3.0, os._exit, (0,)).start()
with watched(0.5):
    {code}
"""
    process = subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE, text=True)
    if "SIGSTOP" in code:
        os.waitpid(process.pid, os.WUNTRACED)
        time.sleep(1.5)
        process.send_signal(signal.SIGCONT)
    _, errors = process.communicate()
    assert process.returncode == status
    assert ("time.sleep" in errors or "File" in errors) == (status != 0), errors


def test_a_loop_without_a_watch_is_not_ended() -> None:
    come_round()
    assert [thread.name for thread in threading.enumerate() if thread.name == "watch"] == []
