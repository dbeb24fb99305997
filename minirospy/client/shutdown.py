"""The shutdown of a process that is a node, as a state machine; docs/shutdown.md draws it.

Events come in: a signal, a phase that the node has entered, a tick of the clock. Actions come out. No thread, signal or clock
is touched here: :mod:`minirospy.client.signals` is the shell that performs the actions.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping

__all__ = ["Action", "Phase", "ShutdownMachine", "ThreadState"]


class Phase(enum.IntEnum):
    """The phase of the shutdown."""

    RUNNING = 0
    HOOKS = 1
    """The shutdown hooks run; is_shutdown() is still false."""
    DOWN = 2
    """is_shutdown() is true, blocking calls end."""
    LEAVING = 3
    """The node waits for the master to unregister it."""
    LEFT = 4
    """The master does not know the node any more."""


class Action(enum.Enum):
    """An action for the shell to perform."""

    RUN_HOOKS = enum.auto()
    """Shut down in a thread of the library: the main thread does not run Python code."""
    INTERRUPT = enum.auto()
    """Raise ROSInterruptException in the main thread."""
    KEYBOARD_INTERRUPT = enum.auto()
    """Raise KeyboardInterrupt in the main thread."""
    STOP_LEAVING = enum.auto()
    """Wait for the master no longer."""
    REPORT = enum.auto()
    """Print what the process still waits for."""
    EXIT = enum.auto()
    """End the process."""


class ThreadState:
    """The shutdown as one thread of the program sees it."""

    __slots__ = ("notified", "polled", "polls")

    def __init__(self) -> None:
        self.polls = False
        """Whether the thread has ever called is_shutdown()."""
        self.polled = False
        """Whether it has called is_shutdown() since a shutdown last cut its sleep short."""
        self.notified = False
        """Whether it was notified, by is_shutdown() or an exception: what it does now is its clean-up."""


_DELAYS: Mapping[Action, float] = {Action.RUN_HOOKS: 0.5, Action.INTERRUPT: 0.5, Action.REPORT: 2.0}
"""Seconds between the cause of an action and the action."""


class ShutdownMachine:
    """The rules: what is done about a signal, and how long after it.

    Time is whatever the caller passes as ``now``, in seconds. One thread calls :meth:`signal` and :meth:`tick`; any thread
    may set :attr:`phase` and the attributes of :attr:`main`.
    """

    def __init__(self, main: ThreadState) -> None:
        self.main = main
        self.main_has_ended = False
        self.runs_in_main = False
        """Whether the main thread itself runs the hooks, and leaves the graph."""
        self.phase = Phase.RUNNING
        self.signals = 0
        self._signalled: float | None = None
        self._free: float | None = None
        """When the main thread could first notice that is_shutdown() is true."""
        self._taken: set[Action] = set()

    def signal(self, now: float) -> list[Action]:
        """Count a signal of the user's and return what it causes beyond the shutdown."""
        self.signals += 1
        if self._signalled is None:
            self._signalled = now

        if self.signals == 1:
            return []
        if self.signals > 2:
            return [Action.EXIT]
        actions = [Action.STOP_LEAVING] if self.phase is Phase.LEAVING else []
        if not (actions and self.runs_in_main):
            # Else the main thread is in no code of the program's.
            actions.append(Action.KEYBOARD_INTERRUPT)
        self._taken.update(actions)
        return actions

    def tick(self, now: float) -> list[Action]:
        """Return what is due; each action once."""
        if self._free is None and self.phase >= (Phase.LEFT if self.runs_in_main else Phase.DOWN):
            self._free = now

        due = [action for action, cause in self._expected() if now >= cause + _DELAYS[action]]
        self._taken.update(due)
        return due

    @property
    def is_settled(self) -> bool:
        """Whether no tick will bring an action any more."""
        return not self.signals or (self.phase is Phase.LEFT and not self._expected())

    def _expected(self) -> list[tuple[Action, float]]:
        """Return the timed actions that are still to come, each with the time of its cause."""
        if self._signalled is None:
            return []

        expected: list[tuple[Action, float]] = []
        if self.phase is Phase.RUNNING:
            expected.append((Action.RUN_HOOKS, self._signalled))
        expected.append((Action.REPORT, self._signalled))
        if self._free is not None and not self._main_ends_by_itself():
            expected.append((Action.INTERRUPT, max(self._signalled, self._free)))
        return [(action, cause) for action, cause in expected if action not in self._taken]

    def _main_ends_by_itself(self) -> bool:
        was_interrupted = Action.KEYBOARD_INTERRUPT in self._taken
        return self.main.polls or self.main.notified or self.main_has_ended or was_interrupted
