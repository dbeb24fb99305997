"""SIGINT, SIGTERM, SIGHUP and Windows' SIGBREAK: the node shuts down, and its process ends.

The handler runs in the main thread. Beside it a thread watches (:mod:`minirospy.client.ending`), which hears of a
signal also where the main thread is in C code and runs no handler.
"""

from __future__ import annotations

import contextlib
import logging
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from opcode import opname
from types import FrameType, TracebackType
from typing import Any

from minirospy.client.ending import EndWatch, is_over
from minirospy.client.life import Life, where
from minirospy.errors import ROSInterruptException

__all__ = ["Signals"]

_ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_TURNED_BACK_AT_MOST = 5
_OWN = "minirospy.client."
_TURNS = ("RESUME", "JUMP", "POP_JUMP")


class Signals:
    """The signals of this process, once :meth:`take` was called in its main thread."""

    def __init__(self, life: Life) -> None:
        self._life = life
        self._before: dict[int, Any] = {}
        self._is_inherited = False
        self._left_to_system: list[int] = []
        self._count = 0
        self._turned_back = 0
        self._watch: EndWatch | None = None
        self._is_sending: Callable[[FrameType | None], bool] = lambda _: False
        self.late = 0
        """A signal that came while the main thread was sending or logging; who has sent or logged takes it."""

    @property
    def is_ended(self) -> bool:
        """Whether a signal has asked the program to end."""
        return self._count > 0

    def take(self) -> None:
        """Let the signals shut the node down. Only the main thread may take signals; without effect in another."""
        if threading.current_thread() is not threading.main_thread():
            return
        self._is_inherited = False
        for name in _ENDING:
            number = getattr(signal, name, None)
            if number is None or (handler := signal.getsignal(number)) == self._on_signal:
                continue
            if name == "SIGHUP" and handler == signal.SIG_IGN:
                # As nohup has it.
                continue
            self._before[number] = handler
            signal.signal(number, self._on_signal)
        self._watching().listen(frozenset(self._before), self._on_signal)

    def mind(self, is_sending: Callable[[FrameType | None], bool]) -> None:
        """A signal that comes while the main thread ``is_sending`` waits until it has sent."""
        self._is_sending = is_sending

    def take_late(self) -> None:
        """Act on a signal that came while the main thread was sending or logging."""
        if threading.current_thread() is not threading.main_thread():
            return
        late, self.late = self.late, 0
        if late:
            self._act_on(late, None)

    def end_quietly(self) -> None:
        """A program, or a thread of it, that does not catch what tells it of its end, ends without a traceback."""
        before, before_in_thread = sys.excepthook, threading.excepthook

        def end_of_main(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
            if self._is_end(error):
                raise SystemExit(0)
            before(kind, error, trace)

        def end_of_thread(arguments: Any) -> None:
            if not self._is_end(arguments.exc_value):
                before_in_thread(arguments)

        sys.excepthook, threading.excepthook = end_of_main, end_of_thread

    def at_exit(self) -> None:
        """The program has ended: what it has printed goes out now, or, to a reader that does not read, never."""
        if not self._watch:
            return
        if not self._count:
            self._watch.let_go()
            return
        with self._watch.at_once(), contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stdout.flush()

    def begin_in_fork(self) -> None:
        """This process is a copy: its signals are its own.

        Until it asks is_shutdown() the system ends it, as any child process: a handler of Python's would wait for the C
        code that a worker is in, such as a lock that another worker holds.
        """
        self._is_inherited = True
        for number, before in self._before.items():
            if before == signal.SIG_DFL and signal.getsignal(number) == self._on_signal:
                signal.signal(number, signal.SIG_DFL)
                self._left_to_system.append(number)
        self._count = self._turned_back = self.late = 0
        if self._watch:
            self._watch.let_go()
            self._watch = None

    def take_in_fork(self) -> None:
        """The copy asks is_shutdown(): it is to hear of its end."""
        if threading.current_thread() is threading.main_thread():
            while self._left_to_system:
                number = self._left_to_system.pop()
                if signal.getsignal(number) == signal.SIG_DFL:
                    signal.signal(number, self._on_signal)

    def _is_end(self, error: BaseException | None) -> bool:
        """Whether it told of the end, or came of that: an interrupted wait may find its lock not taken."""
        while error is not None:
            if isinstance(error, ROSInterruptException) and self._life.is_shutdown():
                return True
            if isinstance(error, KeyboardInterrupt) and self._count:
                return True
            error = error.__context__ if isinstance(error, RuntimeError) else None
        return False

    def _is_too_early(self, frame: FrameType | None) -> bool:
        """Whether the program has just asked its own flag, and is about to act on the answer.

        A hook that takes its hardware away at this moment would be a traceback. So a signal that comes at the turn of a
        loop or at the first step of a function, where Python runs handlers, waits a moment for a better place.
        """
        if frame is None or self._life.is_shutdown_requested or self._turned_back >= _TURNED_BACK_AT_MOST:
            return False
        inside = list(_stack(frame))
        # The watch may be so quick that the handler which turned back has not returned yet. A call of rospy's is a good
        # place.
        too_early = Signals._on_signal.__code__ in [each.f_code for each in inside] or (
            _is_at_turn(frame)
            and not any(each.f_globals.get("__name__", "").startswith(_OWN) for each in inside)
        )
        self._turned_back += too_early
        return too_early

    def _watching(self) -> EndWatch:
        if self._watch is None:
            self._watch = EndWatch(self._life, lambda: self.late)
        return self._watch

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        watch = self._watching()
        if watch.take_nudge() and not self.late:
            # The program has taken it while the watch was on its way: a second one would end its clean-up.
            return
        if self._is_sending(frame) or _is_logging(frame) or self._is_too_early(frame):
            # A hook that publishes, or logs, would need what this very thread holds. publish() takes the signal when it
            # has sent, loginfo() when it has written; for all others the watch sends it again. A loop that only
            # publishes is nearly always caught in the sending: the watch alone would try for seconds.
            self.late = number
            watch.handled(0)
            return
        self.late = 0
        self._act_on(number, frame)

    def _act_on(self, number: int, frame: FrameType | None) -> None:
        watch = self._watching()
        order = watch.take_order()
        if self._is_inherited and not self._life.listener().asks:
            # A worker of the program, which never asks is_shutdown(), ends as any child process does.
            signal.signal(number, self._before[number])
            signal.raise_signal(number)
            return
        if order is not None:
            if isinstance(order, ROSInterruptException) and self._life.knows_of_shutdown():
                # It has heard while the order was on its way: what would be interrupted now is its clean-up.
                return
            self._life.listener().knows = True
            self._life.told_at = where(frame)
            raise order
        self._count += 1
        watch.handled(number)
        if not self._life.is_shutdown_requested:
            self._life.signal_shutdown(f"signal-{number}")
            previous = self._before.get(number)
            if callable(previous):
                with contextlib.suppress(KeyboardInterrupt):
                    previous(number, frame)
        elif self._count == 2 and not self._life.is_leaving and not is_over(frame):
            # The program did not end at the first: now it is interrupted as any Python program. Once: another
            # would come into the clean-up of the library's own functions. If it does not help, the watch ends it.
            raise KeyboardInterrupt


def _is_logging(frame: FrameType | None) -> bool:
    """Whether the stack at ``frame`` is inside a handler of Python's logging, which writes to what is not re-entrant."""
    return any(each.f_code is logging.Handler.handle.__code__ for each in _stack(frame))


def _is_at_turn(frame: FrameType) -> bool:
    """Whether the program is at the turn of a loop or begins a function; elsewhere it may be in C code that waits."""
    return frame.f_lasti <= 0 or opname[frame.f_code.co_code[frame.f_lasti]].startswith(_TURNS)


def _stack(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
