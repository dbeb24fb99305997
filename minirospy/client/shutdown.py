"""The shutdown of a process that is a node, as a state machine; docs/shutdown.md draws it.

Events come in: a signal, a phase that the node has entered, a tick of the clock. Actions come out. No thread, signal or clock
is touched here: :mod:`minirospy.client.signals` is the shell that performs the actions.
"""

from __future__ import annotations

import enum

__all__ = ["Action", "Awareness", "Phase", "ShutdownMachine", "ThreadState"]

_GRACE_SECONDS = 0.5
"""How long the main thread has to start the hooks, and again to notice that is_shutdown() is true."""
_REPORT_SECONDS = 2.0


class Phase(enum.IntEnum):
    """The phase of the shutdown."""

    RUNNING = 0
    HOOKS = 1  # is_shutdown() is still false
    DOWN = 2  # is_shutdown() is true, blocking calls end
    LEAVING = 3  # the node waits for the master to unregister it
    LEFT = 4  # the master does not know the node any more


class Action(enum.Enum):
    """An action for the shell to perform."""

    RUN_HOOKS = "shut down in a thread of the library: the main thread does not run Python code"
    INTERRUPT = "raise ROSInterruptException in the main thread"
    KEYBOARD_INTERRUPT = "raise KeyboardInterrupt in the main thread"
    STOP_LEAVING = "wait for the master no longer"
    REPORT = "print what the process still waits for"
    EXIT = "end the process"


class Awareness(enum.IntEnum):
    """The knowledge that a thread of the program has of the shutdown."""

    NONE = 0  # it has never called is_shutdown()
    POLLS = 1
    CUT_SHORT = 2  # it polls; since the shutdown ended its sleep it has not yet
    NOTIFIED = 3  # by is_shutdown() or an exception: what it does now is its clean-up


class ThreadState:
    """The shutdown as one thread of the program sees it."""

    __slots__ = ("awareness",)

    def __init__(self) -> None:
        self.awareness = Awareness.NONE


class ShutdownMachine:
    """The rules: what is done about a signal, and how long after it.

    Time is whatever the caller passes as ``now``, in seconds. One thread calls :meth:`signal` and :meth:`tick`; any thread
    may set :attr:`phase` and the awareness of :attr:`main`.
    """

    def __init__(self) -> None:
        self.main = ThreadState()
        self.main_has_ended = False
        self.runs_in_main = False
        """Whether the main thread itself runs the hooks, and leaves the graph."""
        self.phase = Phase.RUNNING
        self.signals = 0
        self._signalled = 0.0
        self._free: float | None = None
        """When the main thread could first notice that is_shutdown() is true."""
        self._done: set[Action] = set()

    def signal(self, now: float) -> list[Action]:
        """Count a signal of the user's and return what it causes beyond the shutdown."""
        self.signals += 1
        if self.signals == 1:
            self._signalled = now
            return []
        if self.signals > 2:
            return [Action.EXIT]

        is_leaving = self.phase is Phase.LEAVING
        if is_leaving and self.runs_in_main:
            # It is in no code of the program's.
            return [Action.STOP_LEAVING]
        self._done.add(Action.INTERRUPT)
        return [Action.STOP_LEAVING, Action.KEYBOARD_INTERRUPT] if is_leaving else [Action.KEYBOARD_INTERRUPT]

    def tick(self, now: float) -> list[Action]:
        """Return what is due after a signal; each action once."""
        if not self.signals:
            return []
        if self._free is None and self.phase >= (Phase.LEFT if self.runs_in_main else Phase.DOWN):
            self._free = now

        due = []
        if self.phase is Phase.RUNNING and now >= self._signalled + _GRACE_SECONDS:
            due.append(Action.RUN_HOOKS)
        if self._free is not None and now >= self._free + _GRACE_SECONDS and not self.main_ends_by_itself:
            due.append(Action.INTERRUPT)
        if now >= self._signalled + _REPORT_SECONDS:
            due.append(Action.REPORT)
        due = [action for action in due if action not in self._done]
        self._done.update(due)
        return due

    @property
    def main_ends_by_itself(self) -> bool:
        """Return whether the main thread needs no exception: it has ended, or does what it does in view of the shutdown."""
        return self.main_has_ended or self.main.awareness > Awareness.NONE
