"""Ctrl-C while several threads agree comes afterwards, once, and to whom it is for."""

import signal

import pytest

from carom.simulation.workers.thread_pool import SIGNALS, signals_held


@pytest.mark.parametrize("number", SIGNALS)
def test_a_handler_of_one_s_own_hears_the_signal_once_and_is_there_again(number):
    heard = []
    before = signal.signal(number, lambda number, frame: heard.append(number))
    try:
        own = signal.getsignal(number)
        with signals_held():
            signal.raise_signal(number)
            signal.raise_signal(number)
            assert heard == []
        assert heard == [number]
        assert signal.getsignal(number) is own
    finally:
        signal.signal(number, before)


def test_what_is_raised_meanwhile_is_raised_and_ctrl_c_after_it():
    with pytest.raises(ValueError, match="no such type"), signals_held():
        raise ValueError("no such type")
    with pytest.raises(KeyboardInterrupt), signals_held():
        signal.raise_signal(signal.SIGINT)
