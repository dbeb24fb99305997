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
from types import FrameType, TracebackType

from minirospy.client.lifecycle import Lifecycle, ROSInterruptException
from minirospy.client.shutdown import Action
from minirospy.errors import ROSInterruptException as PlainInterruptException

__all__ = ["SignalWatchdog", "suppress_interrupt_tracebacks"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_HANDLED, _NUMBER = 0x80, 0x7F
_EXIT_STATUS = 130

_DEFER_SECONDS = 0.05
"""How long a signal waits for the main thread's next call of rospy, where a hook is sure to meet no half-done step."""

_TICK_SECONDS = 0.01
_MAX_STEP = 0.05
"""The most that one tick counts for: time in which the process or the machine was stopped is not the program's."""


class SignalWatchdog:
    """The signals of this process, from :meth:`install` on."""

    def __init__(self, lifecycle: Lifecycle, is_sending: Callable[[], bool]) -> None:
        """``is_sending()``: whether a link's lock is held, so that a hook that publishes might wait for its own thread."""
        self._lifecycle = lifecycle
        self._machine = lifecycle.machine
        self._deferral = lifecycle.deferral
        self._deferral.dispatch = self._dispatch
        self._is_sending = is_sending
        self._previous: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}
        """The handlers before, by the numbers of the signals."""
        self._number = int(signal.SIGINT)
        self._error: BaseException | None = None
        self._is_nudge = False
        """Whether a nudge is on its way to the handler."""
        self._nudging = threading.Lock()
        self._sending: socket.socket | None = None
        self._arrived = self._handled = self._nudges = 0

    def install(self) -> None:
        """Let the signals shut the node down. Only the main thread can install handlers; without effect in another."""
        if threading.current_thread() is not threading.main_thread():
            return

        for name in _NAMES:
            number = getattr(signal, name, None)
            if number is None or (handler := signal.getsignal(number)) == self._on_signal:
                continue
            if name == "SIGHUP" and handler == signal.SIG_IGN:
                # As nohup has it.
                continue
            self._previous[number] = handler
            signal.signal(number, self._on_signal)

        if self._sending is None:
            receiving, self._sending = socket.socketpair()
            self._sending.setblocking(False)
            threading.Thread(
                target=self._run, args=(receiving,), name="minirospy-signals", daemon=True
            ).start()
        previous = signal.set_wakeup_fd(self._sending.fileno(), warn_on_full_buffer=False)
        if previous != -1:
            # An event loop's, which was installed first.
            signal.set_wakeup_fd(previous)

    def release(self) -> None:
        """Give the signals back to their previous handlers, and end the watchdog thread. In the main thread."""
        for number, handler in self._previous.items():
            if signal.getsignal(number) == self._on_signal:
                signal.signal(number, handler)
        if self._sending is not None:
            with contextlib.suppress(ValueError):
                ours, current = self._sending.fileno(), signal.set_wakeup_fd(-1)
                if current not in (-1, ours):
                    signal.set_wakeup_fd(current)
            self._sending.close()
            self._sending = None

    @property
    def is_installed(self) -> bool:
        """Whether the signals shut the node down."""
        return self._sending is not None

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
        self._send(_HANDLED | number)
        is_nudge, self._is_nudge = self._is_nudge, False
        if is_nudge and not self._deferral.is_active and not self._is_sending():
            self._dispatch()

    def _dispatch(self) -> None:
        self._deferral.pending = False
        previous = self._previous.get(self._number)
        if self._lifecycle.signal_shutdown(f"signal-{self._number}") and callable(previous):
            with contextlib.suppress(KeyboardInterrupt):
                previous(self._number, None)

        error, self._error = self._error, None
        if isinstance(error, ROSInterruptException):
            state = self._lifecycle.thread_state
            if state.notified:
                # Meanwhile: what would be interrupted now is the program's clean-up.
                return
            state.notified = True
        if error is not None:
            raise error

    # --- the watchdog thread

    def _run(self, receiving: socket.socket) -> None:
        perform: dict[Action, Callable[[], object]] = {
            Action.RUN_HOOKS: self._run_hooks,
            Action.INTERRUPT: lambda: self._interrupt(
                ROSInterruptException("the program was signalled to end")
            ),
            Action.KEYBOARD_INTERRUPT: lambda: self._interrupt(KeyboardInterrupt()),
            Action.REPORT: self._report,
            Action.EXIT: lambda: os._exit(_EXIT_STATUS),
        }
        machine, deferral = self._machine, self._deferral
        now = deferred_at = 0.0
        with receiving:
            while True:
                started = time.monotonic()
                is_idle = machine.is_settled and not deferral.pending
                receiving.settimeout(None if is_idle else _TICK_SECONDS)
                if not self._receive(receiving):
                    return
                now += min(time.monotonic() - started, _MAX_STEP)

                machine.main_has_ended = not threading.main_thread().is_alive()
                actions = [machine.signal(now) for _ in range(self._new_signals())]
                for action in [*actions, *machine.tick(now)]:
                    if action is not None:
                        perform[action]()

                if not deferral.pending:
                    deferred_at = now
                elif now - deferred_at >= _DEFER_SECONDS:
                    self._nudge()

    def _receive(self, receiving: socket.socket) -> bool:
        """Count what signals have written; return False at the end."""
        try:
            data = receiving.recv(64)
        except TimeoutError:
            return True
        except OSError:
            return False
        for byte in data:
            number = byte & _NUMBER
            if byte & _HANDLED:
                self._handled += 1
            elif number in self._previous and signal.getsignal(number) == self._on_signal:
                self._arrived += 1
        return bool(data)

    def _new_signals(self) -> int:
        """Return how many signals of the user's have come that the machine has not counted.

        An event loop may have taken the file descriptor: then only the handler reports a signal.
        """
        return max(0, max(self._arrived, self._handled) - self._nudges - self._machine.signals)

    def _run_hooks(self) -> None:
        reason = f"signal-{self._number}"
        threading.Thread(
            target=self._lifecycle.signal_shutdown, args=(reason,), name="minirospy-shutdown", daemon=True
        ).start()

    def _interrupt(self, error: BaseException) -> None:
        self._error = error
        self._nudge()

    def _nudge(self) -> None:
        """Run the handler in the main thread, and end a system call that it is in."""
        with self._nudging:
            if self._is_nudge or signal.getsignal(self._number) != self._on_signal:
                # One at a time: the system makes one of two that were not delivered yet, and they have to be counted.
                return
            self._nudges += 1
            self._is_nudge = True
            if sys.platform == "win32":
                # The only signal that ends time.sleep() there.
                signal.raise_signal(signal.SIGINT)
            else:
                signal.pthread_kill(threading.main_thread().ident or 0, self._number)

    def _report(self) -> None:
        text = f"shutdown: still waiting for {_what_runs()}. Press Ctrl-C again to interrupt it, and a third time to end"
        # There may be no terminal any more.
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stderr.write(f"{text} the process\n")
            sys.stderr.flush()

    def _send(self, byte: int) -> None:
        if self._sending is not None:
            with contextlib.suppress(OSError):
                self._sending.send(bytes([byte]))


def suppress_interrupt_tracebacks(lifecycle: Callable[[], Lifecycle]) -> None:
    """Let a program, or a thread of it, that does not catch what interrupts it end without a traceback, with status 0.

    ``lifecycle()`` is that of the process at the time.
    """
    hooks = sys.excepthook, threading.excepthook, sys.unraisablehook

    def is_expected(error: BaseException | None) -> bool:
        # An interrupted wait may find its lock not acquired, which is a RuntimeError.
        while error is not None:
            if isinstance(error, PlainInterruptException) and lifecycle().is_shutdown():
                return True
            if isinstance(error, KeyboardInterrupt) and lifecycle().machine.signals:
                return True
            error = error.__context__ if isinstance(error, RuntimeError) else None
        return False

    def of_main(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if is_expected(error):
            raise SystemExit(0)
        hooks[0](kind, error, trace)

    def of_thread(arguments: threading.ExceptHookArgs) -> None:
        if not is_expected(arguments.exc_value):
            hooks[1](arguments)

    def of_exit(arguments: sys.UnraisableHookArgs) -> None:
        if not is_expected(arguments.exc_value):
            hooks[2](arguments)

    sys.excepthook, threading.excepthook, sys.unraisablehook = of_main, of_thread, of_exit


def _what_runs() -> str:
    """Return the thread or process that keeps this process, and where it is."""
    main = threading.main_thread()
    threads = [main, *(t for t in threading.enumerate() if t is not main and not t.daemon)]
    frames = sys._current_frames()
    for thread in threads:
        if thread.is_alive() and (place := _place(frames.get(thread.ident or 0))):
            return f"thread {thread.name} at {place}"
    # A main thread that runs no code of the program's waits at its exit.
    if len(threads) > 1:
        return f"thread {threads[1].name}"
    loaded = sys.modules.get("multiprocessing")
    children = loaded.active_children() if loaded else []
    return f"process {children[0].name} ({children[0].pid})" if children else "the exit of the program"


def _place(frame: FrameType | None) -> str:
    """Return file:line of the program's own code that is innermost; "" where there is none."""
    libraries = (os.path.dirname(os.__file__), os.path.dirname(os.path.dirname(__file__)), "<frozen")
    while frame is not None and frame.f_code.co_filename.startswith(libraries):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
