"""SIGINT, SIGTERM, SIGHUP and Windows' SIGBREAK shut the node down: the shell of `minirospy.client.shutdown`.

The handler runs in the main thread and only marks a signal as pending. A watchdog thread, which reads the signals from a
file descriptor also while the main thread is in C code, feeds the state machine and performs its actions.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

from minirospy.base.signal_dispatch import dispatching_signal
from minirospy.client.exit_messages import report_waiting
from minirospy.client.lifecycle import Lifecycle
from minirospy.client.shutdown import Action, Phase

__all__ = ["SignalWatchdog"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_EXIT_STATUS = 130

_DEFER_SECONDS = 0.05
"""How long a signal waits for the main thread's next call of rospy, where a hook is sure to meet no half-done step."""

_TICK_SECONDS = 0.01
_MAX_STEP = 0.05
"""The most that one tick counts for: time in which the process or the machine was stopped is not the program's."""


class SignalWatchdog:
    """The signals of this process, from :meth:`install` on."""

    def __init__(
        self, lifecycle: Lifecycle, stop_leaving: Callable[[], object], is_sending: Callable[[], bool]
    ) -> None:
        """``stop_leaving()`` lets the node leave the graph without the master's answer.

        ``is_sending()``: whether a link's lock is held, so that a hook that publishes might wait for its own thread.
        """
        self._lifecycle = lifecycle
        self._machine = lifecycle.machine
        self._deferral = lifecycle.deferral
        self._deferral.dispatch = self._dispatch
        self._stop_leaving = stop_leaving
        self._is_sending = is_sending
        self._previous: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}
        """The handlers before, by the numbers of the signals."""
        self._number = int(signal.SIGINT)
        self._interrupt: Action | None = None
        """The exception that the main thread is to raise."""
        self._is_nudge = False
        """Whether a nudge is on its way to the handler."""
        self._nudging = threading.Lock()
        self._sending: socket.socket | None = None
        self._arrived = self._handled = self._nudges = 0

    @property
    def is_installed(self) -> bool:
        """Return whether the signals shut the node down."""
        return self._sending is not None

    def install(self) -> None:
        """Let the signals shut the node down. Only the main thread can install handlers; without effect in another."""
        if threading.current_thread() is not threading.main_thread():
            return

        for name in [name for name in _NAMES if hasattr(signal, name)]:
            number = getattr(signal, name)
            handler = signal.getsignal(number)
            # nohup ignores SIGHUP, which stays so.
            if handler != self._on_signal and (name, handler) != ("SIGHUP", signal.SIG_IGN):
                self._previous[number] = handler
                signal.signal(number, self._on_signal)

        if self._sending is None:
            receiving, self._sending = socket.socketpair()
            self._sending.setblocking(False)
            _start(self._watch, receiving, name="minirospy-signals")
        previous = signal.set_wakeup_fd(self._sending.fileno(), warn_on_full_buffer=False)
        if previous != -1:
            # An event loop's, which was installed first.
            signal.set_wakeup_fd(previous)

    def release(self) -> None:
        """Give the signals back to their previous handlers, and end the watchdog thread. In the main thread."""
        for number, handler in self._previous.items():
            if self._is_handled(number):
                signal.signal(number, handler)
        if self._sending is not None:
            with contextlib.suppress(ValueError):
                ours, current = self._sending.fileno(), signal.set_wakeup_fd(-1)
                if current not in (-1, ours):
                    signal.set_wakeup_fd(current)
            self._sending.close()
            self._sending = None

    def flush_at_exit(self) -> None:
        """Write what the program has printed while Ctrl-C still works; from here on the third is the system's business."""
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stdout.flush()
        if self._machine.signals > 1:
            with self._nudging:
                for number in self._previous:
                    signal.signal(number, signal.SIG_DFL)

    # --- the main thread

    def _on_signal(self, number: int, _: FrameType | None) -> None:
        self._number = number
        self._deferral.pending = True
        self._handled += 1
        if self._sending is not None:
            # Wakes the watchdog also if an event loop has taken the file descriptor. No signal has the number 0.
            with contextlib.suppress(OSError):
                self._sending.send(b"\0")

        is_nudge, self._is_nudge = self._is_nudge, False
        if is_nudge and not self._deferral.is_active and not self._is_sending():
            with dispatching_signal():
                self._dispatch()

    def _dispatch(self) -> None:
        self._deferral.pending = False
        previous = self._previous.get(self._number)
        if self._lifecycle.signal_shutdown(f"signal-{self._number}") and callable(previous):
            with contextlib.suppress(KeyboardInterrupt):
                previous(self._number, None)

        action, self._interrupt = self._interrupt, None
        if action is Action.KEYBOARD_INTERRUPT:
            raise KeyboardInterrupt
        # Meanwhile it may have been notified: what would be interrupted now is the program's clean-up.
        if action is Action.INTERRUPT and not self._machine.main_ends_by_itself:
            raise self._lifecycle.interrupted("the program was signalled to end")

    # --- the watchdog thread

    def _watch(self, receiving: socket.socket) -> None:
        """Feed the state machine with signals and time, and perform its actions, until :meth:`release`."""
        machine, deferral = self._machine, self._deferral
        now = deferred_at = 0.0
        with receiving, contextlib.suppress(ConnectionError):
            while True:
                started = time.monotonic()
                was_pending = deferral.pending
                receiving.settimeout(_TICK_SECONDS if machine.signals or was_pending else None)
                with contextlib.suppress(TimeoutError):
                    if not (numbers := receiving.recv(64)):
                        return
                    self._arrived += sum(self._is_handled(number) for number in numbers)
                now += min(time.monotonic() - started, _MAX_STEP)

                machine.main_has_ended = not threading.main_thread().is_alive()
                for _ in range(self._new_signals()):
                    self._perform(machine.signal(now))
                self._perform(machine.tick(now))

                if not (was_pending and deferral.pending):
                    # Whatever passed before the signal does not count.
                    deferred_at = now
                elif now - deferred_at >= _DEFER_SECONDS:
                    self._nudge()

    def _is_handled(self, number: int) -> bool:
        return number in self._previous and signal.getsignal(number) == self._on_signal

    def _new_signals(self) -> int:
        """Return how many signals of the user's have come that the machine has not counted.

        An event loop may have taken the file descriptor: then only the handler reports a signal.
        """
        return max(0, max(self._arrived, self._handled) - self._nudges - self._machine.signals)

    def _perform(self, actions: list[Action]) -> None:
        for action in actions:
            match action:
                case Action.RUN_HOOKS:
                    _start(
                        self._lifecycle.signal_shutdown, f"signal-{self._number}", name="minirospy-shutdown"
                    )
                case Action.INTERRUPT | Action.KEYBOARD_INTERRUPT:
                    self._interrupt = action
                    self._nudge()
                case Action.STOP_LEAVING:
                    self._stop_leaving()
                case Action.REPORT:
                    report_waiting(is_leaving=self._machine.phase is Phase.LEAVING)
                case Action.EXIT:
                    os._exit(_EXIT_STATUS)

    def _nudge(self) -> None:
        """Run the handler in the main thread, and end a system call that it is in."""
        with self._nudging:
            if self._is_nudge or not self._is_handled(self._number):
                # One at a time: the system makes one of two that were not delivered yet, and they have to be counted.
                return
            self._nudges += 1
            self._is_nudge = True
            if sys.platform == "win32":
                # The only signal that ends time.sleep() there.
                signal.raise_signal(signal.SIGINT)
            else:
                signal.pthread_kill(threading.main_thread().ident or 0, self._number)


def _start(target: Callable[..., object], argument: object, name: str) -> None:
    threading.Thread(target=target, args=(argument,), name=name, daemon=True).start()
