"""The moments between a signal and what the main thread has heard of it, one by one."""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Callable
from types import FrameType

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


LOOP = "while not seen: pass"


@pytest.mark.parametrize(
    ("program", "module", "too_early"),
    [
        (LOOP, "__main__", True),
        ("while not seen: sleep(0.01)", "__main__", False),
        (LOOP, "minirospy.client.time", False),
    ],
    ids=["loop", "sleep", "rospy"],
)
def test_a_signal_waits_at_the_turn_of_a_loop(program: str, module: str, *, too_early: bool) -> None:
    """There the program may have asked its flag, and be about to use what a hook takes away."""
    signals = Signals(Life())
    seen: list[bool] = []

    def on_signal(_: int, frame: FrameType | None) -> None:
        seen.append(signals._is_too_early(frame))

    with_handler(on_signal, lambda: exec(program, {"__name__": module, "seen": seen, "sleep": time.sleep}))
    assert seen == [too_early]


def test_it_does_not_wait_for_ever() -> None:
    signals = Signals(Life())
    answers: list[bool] = []

    def on_signal(_: int, frame: FrameType | None) -> None:
        answers.extend(signals._is_too_early(frame) for _ in range(20))

    with_handler(on_signal, lambda: exec(LOOP, {"__name__": "__main__", "seen": answers}))
    assert answers[0]
    assert not answers[-1]


def with_handler(handler: Callable[[int, FrameType | None], None], run: Callable[[], None]) -> None:
    """Have ``handler`` called while ``run`` runs."""
    before = signal.signal(signal.SIGINT, handler)
    timer = threading.Timer(0.05, _thread.interrupt_main)
    timer.start()
    try:
        run()
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
