"""The moments between a signal and what the main thread has heard of it, one by one."""

from __future__ import annotations

import _thread
import logging
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, SimpleNamespace
from typing import cast

import pytest

from minirospy.client.ending import EndWatch
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


@pytest.mark.parametrize("turns", [(0.9, 30.0), (30.0, 0.9)])
def test_a_turn_in_which_the_machine_stood_still_tells_nothing(turns: tuple[float, float]) -> None:
    life = Life()
    watch = EndWatch(life, lambda: 0)
    listener = life.listener()
    listener.asks, listener.asked, listener.turns = True, 100.0, turns
    try:
        assert watch._patience(threading.current_thread(), 100.0) == pytest.approx(101.0)
    finally:
        watch.let_go()


@pytest.mark.parametrize("is_logging", [False, True])
def test_a_late_signal_is_acted_on_once(is_logging: bool) -> None:
    """Though the watch sends it again, to arrive when the program has just taken it, and a hook logs."""
    life = Life()
    signals = Signals(life)
    nudges: list[bool] = []
    handled: list[int] = []
    signals._watch = cast(
        EndWatch,
        SimpleNamespace(
            take_nudge=lambda: bool(nudges and nudges.pop()), take_order=lambda: None, handled=handled.append
        ),
    )

    class Nudged(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            nudges.append(True)
            signals._on_signal(signal.SIGINT, sys._getframe() if is_logging else None)

    record = logging.LogRecord("test", logging.INFO, "", 1, "a line", None, None)
    life.on_shutdown(lambda: Nudged().handle(record))
    signals.late = signal.SIGINT
    signals.take_late()
    assert (handled, signals.late) == ([signal.SIGINT], 0)
    assert life.is_shutdown()


def with_handler(handler: Callable[[int, FrameType | None], None], run: Callable[[], None]) -> None:
    """Have ``handler`` called while ``run`` runs a program of exec()."""
    before = signal.signal(signal.SIGINT, handler)
    main = threading.get_ident()

    def interrupt() -> None:
        while sys._current_frames()[main].f_code.co_filename != "<string>":
            time.sleep(0.01)
        _thread.interrupt_main()

    interrupting = threading.Thread(target=interrupt)
    interrupting.start()
    try:
        run()
    finally:
        interrupting.join()
        signal.signal(signal.SIGINT, before)
