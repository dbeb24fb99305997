"""The shutdown of a process that is a node, as a state machine; docs/shutdown.md draws it.

Events come in: a signal, a phase that the node has entered, a tick of the clock. Actions come out. No thread, signal or clock
is touched here: :mod:`minirospy.client.signals` is the shell that performs the actions.
"""

from __future__ import annotations

import enum
import math

__all__ = ["Action", "Phase", "ShutdownMachine"]

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
    STOP_LEAVING = "wait for the master no longer, if the node does"
    REPORT = "print what the process still waits for"
    EXIT = "end the process"


class ShutdownMachine:
    """The rules: what is done about a signal, and how long after it.

    Time is whatever the caller passes as ``now``, in seconds. One thread calls :meth:`signal` and :meth:`tick`; any thread
    may set the public attributes.
    """

    def __init__(self) -> None:
        self.phase = Phase.RUNNING
        self.runs_in_main = False
        """Whether the main thread itself runs the hooks, and leaves the graph."""
        self.main_ends_by_itself = False
        """Whether the main thread needs no exception: it has ended, or does what it does in view of the shutdown."""
        self.signals = 0
        self._signalled = math.inf
        self._free = math.inf
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

        if self.phase is Phase.LEAVING and self.runs_in_main:
            # It is in no code of the program's.
            return [Action.STOP_LEAVING]
        self._done.add(Action.INTERRUPT)
        return [Action.STOP_LEAVING, Action.KEYBOARD_INTERRUPT]

    def tick(self, now: float) -> list[Action]:
        """Return what is due after a signal; each action once."""
        if self.signals and self.phase >= (Phase.LEFT if self.runs_in_main else Phase.DOWN):
            self._free = min(self._free, now)

        is_due = {
            Action.RUN_HOOKS: now >= self._signalled + _GRACE_SECONDS and self.phase is Phase.RUNNING,
            Action.INTERRUPT: now >= self._free + _GRACE_SECONDS and not self.main_ends_by_itself,
            Action.REPORT: now >= self._signalled + _REPORT_SECONDS,
        }
        due = [action for action in is_due if is_due[action] and action not in self._done]
        self._done.update(due)
        return due
