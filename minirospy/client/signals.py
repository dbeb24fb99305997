"""Let SIGINT, SIGTERM, SIGHUP and Windows' SIGBREAK shut the node down, by the rules in `minirospy.client.shutdown`.

The handler runs in the main thread and only marks a signal as pending. A watchdog thread reads the signals from a
file descriptor, even while the main thread is in C code, feeds the state machine and performs its actions.
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
from minirospy.client.exit_messages import report_interrupt, report_waiting
from minirospy.client.lifecycle import Lifecycle
from minirospy.client.shutdown import Action, Phase

__all__ = ["SignalWatchdog"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_EXIT_STATUS = 130

_DEFER_SECONDS = 0.05
"""Seconds to wait for the main thread to reach its next rospy call; running the hooks there does not interrupt a
half-finished operation.
"""

_TICK_SECONDS = 0.01
# Maximum seconds counted per tick. This excludes time for which the process or the machine was suspended
_MAX_STEP = 0.05


class SignalWatchdog:
    """Handles this process's signals after :meth:`install`."""

    def __init__(
        self, lifecycle: Lifecycle, stop_leaving: Callable[[], object], is_sending: Callable[[], bool]
    ) -> None:
        """Create the watchdog. ``stop_leaving()`` lets the node leave the graph without waiting for the master.

        ``is_sending()`` returns whether a link's lock is held; if it is, a hook that publishes could deadlock.
        """
        self._lifecycle = lifecycle
        self._machine = lifecycle.machine
        self._deferral = lifecycle.deferral
        self._deferral.dispatch = self._dispatch
        self._stop_leaving = stop_leaving
        self._is_sending = is_sending
        # Dict from signal number to the previous handler
        self._previous: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}
        self._number = int(signal.SIGINT)
        # the action that requires an exception in the main thread; the next call of the signal handler raises it
        self._interrupt: Action | None = None
        self._is_nudge = False  # True if _nudge() has sent a signal that has not reached the handler yet
        self._nudging = threading.Lock()
        self._sending: socket.socket | None = None
        self._arrived = self._handled = self._nudges = 0

    @property
    def is_installed(self) -> bool:
        """Return whether the watchdog handles the signals."""
        return self._sending is not None

    def install(self) -> None:
        """Make the signals shut the node down. No effect outside the main thread, because Python installs handlers only there."""
        if threading.current_thread() is not threading.main_thread():
            return

        for name in [name for name in _NAMES if hasattr(signal, name)]:
            number = getattr(signal, name)
            handler = signal.getsignal(number)
            # If SIGHUP is ignored because of nohup, keep ignoring it.
            if handler != self.on_signal and (name, handler) != ("SIGHUP", signal.SIG_IGN):
                self._previous[number] = handler
                signal.signal(number, self.on_signal)

        if self._sending is None:
            receiving, self._sending = socket.socketpair()
            self._sending.setblocking(False)
            _start(self._watch, receiving, name="minirospy-signals")
        previous = signal.set_wakeup_fd(self._sending.fileno(), warn_on_full_buffer=False)
        if previous != -1:
            # Restore the previous wakeup descriptor, because it belongs to an event loop that was installed first.
            signal.set_wakeup_fd(previous)

    def release(self) -> None:
        """Restore the previous handlers and stop the watchdog thread. Call this in the main thread."""
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
        """Flush the program's output while Ctrl-C is still handled. If it was pressed twice, let a third one end the process."""
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stdout.flush()
        if self._machine.signals > 1:
            with self._nudging:
                for number in self._previous:
                    signal.signal(number, signal.SIG_DFL)

    def interrupt_later(self) -> None:
        """Interrupt the main thread if it does not exit by itself after another process has shut the node down.

        Has no effect if the program handles the signals itself.
        """
        if self._sending is not None:
            self._machine.is_requested = True
            with contextlib.suppress(OSError):
                self._sending.send(b"\0")

    # --- main thread

    def on_signal(self, number: int, _: FrameType | None) -> None:
        """Handle a signal in the main thread, with the arguments of a handler in Python's `signal` module."""
        self._number = number
        self._deferral.pending = True
        self._handled += 1
        if self._sending is not None:
            # Wake the watchdog, even if an event loop has replaced the file descriptor. Send 0, which is not a signal number.
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
        # If the main thread has been notified in the meantime, an exception would interrupt the program's clean-up.
        if action is Action.INTERRUPT and not self._machine.main_ends_by_itself:
            raise self._lifecycle.interrupted("the program was signalled to end")

    # --- watchdog thread

    def _watch(self, receiving: socket.socket) -> None:
        """Until :meth:`release`, pass signals and timeouts to the state machine and perform the actions that it returns."""
        machine, deferral = self._machine, self._deferral
        now = deferred_at = 0.0
        with receiving, contextlib.suppress(ConnectionError):
            while True:
                started = time.monotonic()
                was_pending = deferral.pending
                receiving.settimeout(
                    _TICK_SECONDS if machine.signals or machine.is_requested or was_pending else None
                )
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
                    # Measure the delay from the signal's arrival.
                    deferred_at = now
                elif now - deferred_at >= _DEFER_SECONDS:
                    self._nudge()

    def _is_handled(self, number: int) -> bool:
        return number in self._previous and signal.getsignal(number) == self.on_signal

    def _new_signals(self) -> int:
        """Return the number of user signals that the state machine has not counted yet.

        If an event loop has replaced the file descriptor, only the handler reports signals.
        """
        return max(0, max(self._arrived, self._handled) - self._nudges - self._machine.signals)

    def _perform(self, actions: list[Action]) -> None:
        for action in actions:
            match action:
                case Action.RUN_HOOKS:
                    _start(
                        self._lifecycle.signal_shutdown, f"signal-{self._number}", name="minirospy-shutdown"
                    )
                case Action.INTERRUPT if not self._machine.signals:
                    self._interrupt_after_request()
                case Action.INTERRUPT | Action.KEYBOARD_INTERRUPT:
                    self._interrupt = action
                    self._nudge()
                case Action.STOP_LEAVING:
                    self._stop_leaving()
                case Action.REPORT:
                    report_waiting(is_leaving=self._machine.phase is Phase.LEAVING)
                case Action.EXIT:
                    os._exit(_EXIT_STATUS)

    def _interrupt_after_request(self) -> None:
        """Interrupt the main thread as Ctrl-C does, and print the reason."""
        self._number = int(signal.SIGINT)
        handler = signal.getsignal(self._number)
        if hasattr(sys, "ps1") or not callable(handler):
            # Do not interrupt an interactive session: the user would lose its variables.
            # Do not send a signal that is ignored or that would terminate the process.
            self._machine.drop_request()
            return

        report_interrupt(str(self._lifecycle.reason))
        if handler == self.on_signal:
            self._interrupt = Action.INTERRUPT
            self._nudge()
        else:
            # The program, or a library such as IPython, has replaced the handler; let the new handler decide what to do.
            _send_to_main(self._number)

    def _nudge(self) -> None:
        """Send the main thread a signal that runs the handler there and interrupts any blocking system call."""
        with self._nudging:
            if self._is_nudge or not self._is_handled(self._number):
                # Do not send a second nudge before the first has arrived.
                # The system would merge the two signals into one, and the handler, which counts signals, would miss one.
                return
            self._nudges += 1
            self._is_nudge = True
            _send_to_main(self._number)


def _send_to_main(number: int) -> None:
    if sys.platform == "win32":
        # Always send SIGINT on Windows, because only SIGINT interrupts time.sleep() there.
        signal.raise_signal(signal.SIGINT)
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)


def _start(target: Callable[..., object], argument: object, name: str) -> None:
    threading.Thread(target=target, args=(argument,), name=name, daemon=True).start()
