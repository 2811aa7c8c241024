"""A signal is heeded by loops, and the next one by the system."""

import os
import signal

import pytest

from common.runtime.signals import stop_signals


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_signals() as stopped:
        assert not stopped()
        os.kill(os.getpid(), number)
        assert stopped()
        assert signal.getsignal(number) is signal.SIG_DFL
    assert signal.getsignal(number) is before
