"""The shutdown of a node's process, as a state machine. docs/shutdown.md has the diagram.

The machine's inputs are events: a signal, a phase that the node has entered, a clock tick. Its outputs are actions. This
module uses no threads, signals or clocks: :mod:`minirospy.client.signals` performs the actions.
"""

from __future__ import annotations

import enum

__all__ = ["Action", "Awareness", "Phase", "ShutdownMachine", "ThreadState"]

# seconds for the main thread to start the hooks, and then again to notice that is_shutdown() returns True
_GRACE_SECONDS = 0.5
_REPORT_SECONDS = 2.0
# Seconds for the main thread to exit by itself after another process has requested the shutdown.
# The time is longer than after a signal, because no user is waiting at the terminal.
# It is longest for a main thread that polls is_shutdown(), because it may be in a long iteration of its loop.
_REQUEST_GRACE_SECONDS = 2.0
_REQUEST_GRACE_OF_POLLS_SECONDS = 5.0


class Phase(enum.IntEnum):
    """The phase that the shutdown has reached."""

    RUNNING = 0
    HOOKS = 1  # the hooks run; is_shutdown() still returns False
    DOWN = 2  # is_shutdown() returns True, and blocking calls are interrupted
    LEAVING = 3  # the node waits for the master to unregister it
    LEFT = 4  # the master has unregistered the node


class Action(enum.Enum):
    """An action that :mod:`minirospy.client.signals` performs."""

    RUN_HOOKS = "shut down in a thread of the library: the main thread does not run Python code"
    INTERRUPT = "raise ROSInterruptException in the main thread"
    KEYBOARD_INTERRUPT = "raise KeyboardInterrupt in the main thread"
    STOP_LEAVING = "wait for the master no longer"
    REPORT = "print what the process still waits for"
    EXIT = "end the process"


class Awareness(enum.IntEnum):
    """States whether, and how, a thread of the program has been notified of the shutdown."""

    NONE = 0  # the thread has never called is_shutdown()
    POLLS = 1
    CUT_SHORT = 2  # the thread polls, but has not polled since the shutdown interrupted its sleep
    NOTIFIED = 3  # notified by is_shutdown() or an exception; whatever the thread does now is clean-up


class ThreadState:
    """The shutdown state of one thread in the program."""

    __slots__ = ("awareness",)

    def __init__(self) -> None:
        self.awareness = Awareness.NONE


class ShutdownMachine:
    """The rules that decide which actions follow a signal, and when.

    Time is the value that the caller passes as ``now``, in seconds. One thread calls :meth:`signal` and :meth:`tick`; any
    thread may set :attr:`phase`, :attr:`is_requested` and the awareness of :attr:`main`.
    """

    def __init__(self) -> None:
        self.main = ThreadState()
        self.main_has_ended = False
        self.runs_in_main = False  # True if the main thread itself runs the hooks and unregisters the node
        self.phase = Phase.RUNNING
        self.signals = 0
        self.is_requested = False  # True if another process requested the shutdown in progress
        self._signalled = 0.0
        # The earliest time at which the main thread can see that is_shutdown() is true
        self._free: float | None = None
        self._done: set[Action] = set()

    def signal(self, now: float) -> list[Action]:
        """Count a user signal and return the resulting actions, except for the shutdown itself."""
        self.signals += 1
        if self.signals == 1:
            self._signalled = now
            return []
        if self.signals > 2:
            return [Action.EXIT]

        is_leaving = self.phase is Phase.LEAVING
        if is_leaving and self.runs_in_main:
            # The main thread is running the shutdown, not the program's code, so do not raise an exception in it.
            return [Action.STOP_LEAVING]
        self._done.add(Action.INTERRUPT)
        return [Action.STOP_LEAVING, Action.KEYBOARD_INTERRUPT] if is_leaving else [Action.KEYBOARD_INTERRUPT]

    def tick(self, now: float) -> list[Action]:
        """Return the actions that are due after a signal or a request. Each action is returned once."""
        if not self.signals and not self.is_requested:
            return []
        if self._free is None and self.phase >= (Phase.LEFT if self.runs_in_main else Phase.DOWN):
            self._free = now

        due = []
        if self.signals and self.phase is Phase.RUNNING and now >= self._signalled + _GRACE_SECONDS:
            due.append(Action.RUN_HOOKS)
        if self._free is not None and now >= self._free + self._grace and not self.main_ends_by_itself:
            due.append(Action.INTERRUPT)
        if self.signals and now >= self._signalled + _REPORT_SECONDS:
            due.append(Action.REPORT)
        due = [action for action in due if action not in self._done]
        self._done.update(due)
        return due

    def drop_request(self) -> None:
        """Forget the request from another process, so that it does not cause an exception in the main thread.

        A signal from the user may still interrupt the main thread.
        """
        self.is_requested = False
        self._done.discard(Action.INTERRUPT)

    @property
    def main_ends_by_itself(self) -> bool:
        """Return whether the main thread needs no exception to exit: it has exited, was notified or, after a signal, polls."""
        # Trust a main thread that polls to exit by itself.
        # After a request from another process, trust only a notified thread: no user is there to press Ctrl-C again.
        trusted = Awareness.NOTIFIED if self.is_requested else Awareness.POLLS
        return self.main_has_ended or self.main.awareness >= trusted

    @property
    def _grace(self) -> float:
        """Return how many seconds the main thread may run before it is interrupted."""
        if self.main.awareness > Awareness.NONE:
            return _REQUEST_GRACE_OF_POLLS_SECONDS
        return _GRACE_SECONDS if self.signals else _REQUEST_GRACE_SECONDS
