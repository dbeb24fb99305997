"""The moments between a signal and what the main thread has heard of it, one by one."""

from __future__ import annotations

import signal

import pytest

from minirospy.client.life import Life, ROSInterruptException
from minirospy.client.signals import Signals


@pytest.mark.parametrize("has_heard", [False, True])
def test_who_has_heard_meanwhile_is_not_interrupted(has_heard: bool) -> None:
    life = Life()
    signals = Signals(life)
    watch = signals._watching()
    try:
        life.signal_shutdown("test")
        # The watch gives its order; before the main thread gets it, it asks is_shutdown(), and goes to its clean-up.
        watch._order = ROSInterruptException("the program was asked to end")
        if has_heard:
            assert life.tell_shutdown()
            signals._on_signal(signal.SIGINT, None)
        else:
            with pytest.raises(ROSInterruptException):
                signals._on_signal(signal.SIGINT, None)
        assert life.knows_of_shutdown()
    finally:
        watch.let_go()
