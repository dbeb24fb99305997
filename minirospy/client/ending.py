"""A signal has asked the program to end: what sees to it that it does, whatever its threads are about.

Who asks rospy.is_shutdown(), or waits in a function of rospy, hears of the shutdown by itself, and takes the time for its
clean-up that it needs. A main thread that does not hear is interrupted where it is, by ROSInterruptException; by
KeyboardInterrupt, where it swallows that and goes on as before. What is deaf to both, such as a library's call that
never returns or another thread of the program, ends with the process, after the functions of atexit. All within a second.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import math
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from minirospy.client.life import Life, ROSInterruptException, where

__all__ = ["EndWatch", "is_over"]

_TICK, _LATE_TICK = 0.02, 0.002
_LOOK_SECONDS = 2 * _TICK
"""The watch looks at the time at least so often, where the process runs."""
_MOST_STALLED = 1.0
"""What is granted for all stalls together."""
_BEGIN_SECONDS = 0.1
"""How long the main thread may take to run its handler, before another runs the hooks."""
_HEAR_SECONDS, _TURN_SECONDS, _LONG_TURN_SECONDS = 0.4, 0.7, 1.2
"""How long a thread may take to hear; one that asks; and one whose loop is known to ask once a second."""
_TURN_MARGIN = 0.1
"""How much longer than those before a turn may take."""
_CHILDREN_SECONDS = 0.5
_ANSWER_TICKS = 8
"""Ticks, not seconds: on a machine that is busy the watch is slow, too."""
_SAME_PLACE_TICKS = 3
_SECOND_SIGNAL_SECONDS = 0.5
_LAST_SECONDS = 0.3
_HANDLED, _NUMBER = 0x80, 0x7F
_LAST_FUNCTIONS = {("threading", "_shutdown"), ("minirospy.client.signals", "end_of_main")}
"""What Python calls when the program has ended."""


class EndWatch:
    """A thread that waits for signals; begins when it is made.

    ``late`` tells of a signal whose handler has to run once more (see :class:`minirospy.client.signals.Signals`).
    """

    def __init__(self, life: Life, late: Callable[[], int]) -> None:
        self._life = life
        self._late = late
        self._receiving, self._sending = socket.socketpair()
        self._sending.setblocking(False)
        self._numbers: frozenset[int] = frozenset()
        self._handler: object = None
        self._order: BaseException | None = None
        self._has_nudged = False
        self._first = 0
        self._arrived = self._handled = self._own = 0
        self._limit = math.inf
        self._looked = (0.0, 0.0)
        self._stalled = 0.0
        threading.Thread(target=self._run, name="minirospy-end", daemon=True).start()

    def listen(self, numbers: frozenset[int], handler: object) -> None:
        """Hear of these signals when they arrive, while ``handler`` is theirs. In the main thread."""
        self._numbers, self._handler = numbers, handler
        before = signal.set_wakeup_fd(self._sending.fileno(), warn_on_full_buffer=False)
        if before != -1:
            # An event loop's, which has been here first.
            signal.set_wakeup_fd(before)

    def let_go(self) -> None:
        """Watch no more. In the main thread."""
        with contextlib.suppress(ValueError):
            ours, before = self._sending.fileno(), signal.set_wakeup_fd(-1)
            if before not in (-1, ours):
                signal.set_wakeup_fd(before)
        self._sending.close()

    def handled(self, number: int) -> None:
        """A handler has run for a signal that came from outside; 0 wakes the watch only."""
        with contextlib.suppress(OSError):
            self._sending.send(bytes([_HANDLED | number]))

    def take_order(self) -> BaseException | None:
        """What a handler is to raise, or None where the signal is none of the watch's."""
        order, self._order = self._order, None
        return order

    def take_nudge(self) -> bool:
        """Whether a handler runs only to look at the late signal once more."""
        has_nudged, self._has_nudged = self._has_nudged, False
        return has_nudged

    @contextlib.contextmanager
    def at_once(self) -> Any:
        """What the block does has to be done in a moment, or the process ends."""
        now = time.monotonic() - self._stalled
        self._limit, before = min(self._limit, now + _LAST_SECONDS), self._limit
        try:
            yield
        finally:
            self._limit = before

    # --- the thread

    def _run(self) -> None:
        while not self._first:
            if not self._take(None):
                self._receiving.close()
                return
        begun = self._now()
        life = self._life
        if not self._wait(lambda: life.is_shutdown_requested, begun + _BEGIN_SECONDS):
            reason = f"signal-{self._first}"
            threading.Thread(target=life.signal_shutdown, args=(reason,), daemon=True).start()
        self._wait(life.gone.is_set)
        self._see_that_main_hears(begun)
        self._wait(is_over)
        self._see_that_others_end(begun)
        self._wait(lambda: False)

    def _see_that_main_hears(self, begun: float) -> None:
        main = threading.main_thread()
        until = max(self._patience(main, begun), self._now() + 2 * _TICK)
        told = self._wait(lambda: self._knows(main) or is_over(), until)
        if not told and not self._interrupt(ROSInterruptException("the program was asked to end")):
            end_process()
        if self._goes_on_as_before(main) and (
            not self._interrupt(KeyboardInterrupt()) or self._goes_on_as_before(main)
        ):
            end_process()

    def _see_that_others_end(self, begun: float) -> None:
        """The main thread has ended. What else keeps the process: threads, and processes of multiprocessing."""

        def are_gone() -> bool:
            return not _other_threads() and not _children()

        self._wait(are_gone, begun + _CHILDREN_SECONDS)
        for child in _children():
            child.terminate()
        patience = [self._patience(thread, begun) for thread in _other_threads()]
        self._wait(are_gone, max([begun + _TURN_SECONDS, *patience]))
        # Their clean-up.
        self._wait(lambda: not any(map(self._knows, _other_threads())))
        for child in _children():
            child.kill()
        if _other_threads():
            end_process()

    def _patience(self, thread: threading.Thread, begun: float) -> float:
        """Until when a thread may go without having heard."""
        listener = self._life.listeners.get(thread.ident or 0)
        if not listener or not listener.asks:
            return begun + _HEAR_SECONDS
        # What stands behind a loop is often its clean-up: one that sleeps for a second gets that second. A turn in which
        # the machine stood still tells nothing.
        rests = [listener.asked + turn + _TURN_MARGIN - begun for turn in listener.turns]
        return begun + max([_TURN_SECONDS, *(rest for rest in rests if rest < _LONG_TURN_SECONDS)])

    def _knows(self, thread: threading.Thread) -> bool:
        listener = self._life.listeners.get(thread.ident or 0)
        return listener is not None and listener.knows

    def _interrupt(self, error: BaseException) -> bool:
        """Raise ``error`` in the main thread; False where that thread runs no handler, since it is in C code."""
        self._send(error)
        ticks = 0
        while self._order is not None and ticks < _ANSWER_TICKS:
            self._wait(lambda: self._order is None, self._now() + _TICK)
            ticks += 1
        return self._order is None

    def _goes_on_as_before(self, main: threading.Thread) -> bool:
        """Whether the main thread was told by an exception, and is back where it was then."""
        same = 0
        for _ in range(_ANSWER_TICKS):
            if not self._life.told_at or is_over():
                return False
            frame = sys._current_frames().get(main.ident or 0)
            same = same + 1 if where(frame) == self._life.told_at else 0
            if same == _SAME_PLACE_TICKS:
                return True
            self._wait(is_over, self._now() + _TICK)
        return False

    def _now(self) -> float:
        """Seconds, by a clock that stands still while the process is stopped or the machine gives it no time.

        What the program is granted to hear, and to clean up, is time in which it can run. A look that comes late while
        the process used the processor is no stall: C code held Python's lock. C code that sleeps with it looks like one.
        """
        wall, cpu = time.monotonic(), time.process_time()
        idle = (wall - self._looked[0]) - (cpu - self._looked[1])
        self._stalled = min(self._stalled + max(0.0, idle - _LOOK_SECONDS), _MOST_STALLED)
        self._looked = (wall, cpu)
        return wall - self._stalled

    def _wait(self, is_done: Callable[[], bool], until: float = math.inf) -> bool:
        """Wait; False where the time is up. Ends the process some time after a second signal."""
        while not is_done():
            now = self._now()
            if now >= self._limit:
                end_process()
            if now >= until:
                return False
            if late := self._late():
                number = signal.Signals(late)
                self._own += 1
                # Nothing between the two: the handler of the nudge before may run, and take this one's flag.
                self._has_nudged = True
                _thread.interrupt_main(number)
                self._take(_LATE_TICK)
            else:
                self._take(_TICK)
        return True

    def _take(self, seconds: float | None) -> bool:
        """Take what signals have written; False at the end."""
        self._receiving.settimeout(seconds)
        try:
            data = self._receiving.recv(64)
        except TimeoutError:
            return True
        except OSError:
            return False
        if seconds is None:
            # Not a look that comes late.
            self._looked = (time.monotonic(), time.process_time())
        for byte in data:
            number = byte & _NUMBER
            if byte & _HANDLED:
                self._handled += number > 0
                self._first = self._first or number
            elif number in self._numbers and signal.getsignal(number) == self._handler:
                self._arrived += 1
                self._first = self._first or number
        if max(self._arrived - self._own, self._handled) > 1:
            self._limit = min(self._limit, self._now() + _SECOND_SIGNAL_SECONDS)
        return bool(data)

    def _send(self, order: BaseException) -> None:
        """Run the handler of the main thread with an order, and end a system call that it is in."""
        self._order = order
        self._own += 1
        if sys.platform == "win32":
            # The only one that ends time.sleep() there.
            signal.raise_signal(signal.SIGINT)
        else:
            signal.pthread_kill(threading.main_thread().ident or 0, self._first)


def is_over(frame: FrameType | None = None) -> bool:
    """Whether the main thread has come to its end, and only waits for others.

    ``frame``: where it is, for a caller that knows.
    """
    main = threading.main_thread()
    if not main.is_alive():
        return True
    frame = frame or sys._current_frames().get(main.ident or 0)
    while frame is not None and frame.f_back is not None:
        frame = frame.f_back
    return frame is not None and (frame.f_globals.get("__name__"), frame.f_code.co_name) in _LAST_FUNCTIONS


def end_process() -> None:
    """End without the main thread: the functions of atexit, what is printed, and out."""
    last = threading.Thread(target=_last_words, daemon=True)
    last.start()
    for _ in range(round(_LAST_SECONDS / _TICK)):
        last.join(_TICK)
    os._exit(0)


def _last_words() -> None:
    try:
        atexit._run_exitfuncs()
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):
                stream.flush()


def _other_threads() -> list[threading.Thread]:
    main = threading.main_thread()
    return [thread for thread in threading.enumerate() if thread is not main and not thread.daemon]


def _children() -> list[Any]:
    loaded = sys.modules.get("multiprocessing")
    return loaded.active_children() if loaded else []
