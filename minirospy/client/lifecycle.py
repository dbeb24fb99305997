"""The lifecycle of a node: its hooks, its shutdown, and which threads of the program were notified of it.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import contextlib
import enum
import logging
import threading
import traceback
from collections.abc import Callable, Iterator
from typing import TypeAlias

from minirospy import errors
from minirospy.client.shutdown import Phase, ShutdownMachine, ThreadState
from minirospy.clock import SignalSafeEvent, wait_for_event

__all__ = ["Deferral", "Lifecycle", "ROSInterruptException", "Stage"]

_Hook: TypeAlias = Callable[..., object]
_log = logging.getLogger(__name__)


class ROSInterruptException(errors.ROSInterruptException, KeyboardInterrupt):
    """A blocking call was ended by the node's shutdown; a KeyboardInterrupt, too, as in rospy.

    asyncio would take a KeyboardInterrupt for the end of its loop: `minirospy.aio` raises the plain one, which is this
    one's base and the `minirospy.ROSInterruptException` that catches both.
    """


class Deferral:
    """A critical section of the main thread: ``with deferral:`` a signal is dispatched when the block ends.

    A hook may publish, log or register, and so must not run while the main thread is half way through such a thing. In
    other threads, where no signal arrives, without effect.
    """

    def __init__(self) -> None:
        self.pending = False
        """Whether a signal waits for the main thread. Set by the signal's handler."""
        self.dispatch: Callable[[], object] = lambda: None
        """Dispatch the pending signal. In the main thread."""
        self._depth = 0

    @property
    def is_active(self) -> bool:
        """Whether the main thread is inside a critical section."""
        return self._depth > 0

    def __enter__(self) -> None:
        if _is_main():
            self._depth += 1

    def __exit__(self, *_: object) -> None:
        if _is_main():
            self._depth -= 1
            self.poll()

    def poll(self) -> None:
        """Dispatch a pending signal, where this is the main thread and outside of a critical section."""
        if self.pending and not self._depth and _is_main():
            self.dispatch()

    @contextlib.contextmanager
    def lifted(self) -> Iterator[None]:
        """Leave the critical section for the length of a block: for the user's code."""
        if not _is_main():
            yield
            return
        depth, self._depth = self._depth, 0
        try:
            yield
        finally:
            self._depth = depth


class Stage(enum.Enum):
    """When a shutdown hook runs."""

    FIRST = enum.auto()
    """While is_shutdown() is false; without an argument."""
    BEFORE = enum.auto()
    """After those, still before is_shutdown() is true; with the reason of the shutdown."""
    AFTER = enum.auto()
    """Once is_shutdown() is true, before the node leaves the graph; with the reason."""


class Lifecycle:
    """From the first hook to the last: what runs when the node shuts down, and in which order."""

    def __init__(
        self,
        leave: Callable[[], object],
        stop_leaving: Callable[[], object] = lambda: None,
        *,
        is_down: bool = False,
    ) -> None:
        """``leave()`` takes the node out of the graph, ``stop_leaving()`` lets it return without the master's answer.

        ``is_down``: in a fork of a process that has shut down.
        """
        self._leave = leave
        self.stop_leaving = stop_leaving
        self._lock = threading.RLock()
        self.shutting_down = SignalSafeEvent()
        """Set once the shutdown hooks have run: every blocking call ends."""
        if is_down:
            self.shutting_down.set()
        self.left = SignalSafeEvent()
        """Set once the node has left the graph."""

        self.deferral = Deferral()
        self.hooks: list[_Hook] = []
        """What on_shutdown was given."""
        self._hooks: dict[Stage, list[_Hook]] = {Stage.FIRST: self.hooks, Stage.BEFORE: [], Stage.AFTER: []}
        self._interrupts: list[Callable[[], object]] = []

        self._main = ThreadState()
        self._thread = threading.local()
        self.machine = ShutdownMachine(self._main)
        # A lock, since it is claimed in one step: a signal's handler may come between any two.
        self._claim = threading.Lock()

    def add_hook(self, hook: _Hook, stage: Stage = Stage.FIRST) -> None:
        """Call ``hook`` when the node shuts down, or now where it has. Raises TypeError."""
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        with self._lock:
            if not self.is_shutdown():
                self._hooks[stage].append(hook)
                return
        hook(*(() if stage is Stage.FIRST else ("already shutdown",)))

    def signal_shutdown(self, reason: object) -> bool:
        """Shut the node down: hooks run in this thread, blocking calls end, the node leaves the graph.

        Return False, without waiting, where a shutdown is under way already.
        """
        if not self._claim.acquire(blocking=False):
            return False
        _log.debug("signal_shutdown [%s]", reason)

        with self.deferral:
            try:
                self.machine.runs_in_main = _is_main()
                self.machine.phase = Phase.HOOKS
                self._run_hooks(Stage.FIRST)
                self._run_hooks(Stage.BEFORE, reason)
                with self._lock:
                    # A hook that is added from now on is called immediately.
                    self.shutting_down.set()
                self.machine.phase = Phase.DOWN
                self._run_hooks(Stage.AFTER, reason)
            finally:
                # Also where an exception ends a hook.
                self.shutting_down.set()
                self._finish()
        return True

    def interrupting(self, interrupt: Callable[[], object]) -> _Interrupting:
        """``with lifecycle.interrupting(f):`` while the block runs, a shutdown calls ``f`` to end what blocks in it.

        A signal's handler may call it, in any moment of the main thread: the events that it sets are SignalSafeEvents.
        """
        return _Interrupting(self._interrupts, interrupt, self.shutting_down)

    def spin(self) -> None:
        """Wait until the node shuts down."""
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            self.signal_shutdown("keyboard interrupt")
        self.poll_shutdown()

    # --- which threads were notified

    @property
    def is_shutdown_requested(self) -> bool:
        """Whether a shutdown has started: its hooks may still be running."""
        return self._claim.locked()

    def is_shutdown(self) -> bool:
        """Return whether the node has shut down."""
        return self.shutting_down.is_set()

    def poll_shutdown(self) -> bool:
        """Return whether the node has shut down, and record that the calling thread polls, or was notified."""
        state = self.thread_state
        state.polls = state.polled = True
        if self.deferral.pending:
            self.deferral.poll()
        state.notified = state.notified or self.shutting_down.is_set()
        return self.shutting_down.is_set()

    def check_interrupted_sleep(self) -> None:
        """Notify the calling thread, whose sleep a shutdown has cut short. Raises ROSInterruptException.

        In a loop that polls is_shutdown() the sleep just ends early, as with rospy: the loop will poll, and what follows
        it still runs. The exception is for a thread that never polls, or that sleeps again without having polled.
        """
        state = self.thread_state
        if not state.polled:
            raise self.interrupted("ROS shutdown request")
        state.polled = False

    def interrupted(self, text: str) -> ROSInterruptException:
        """Return the error that notifies the calling thread of the shutdown, for it to raise."""
        self.thread_state.notified = True
        return ROSInterruptException(text)

    def is_interrupt(self, error: BaseException) -> bool:
        """Return whether an error that ends the program, or a thread of it, is the one that was to interrupt it."""
        if isinstance(error, KeyboardInterrupt) and self.machine.signals:
            return True
        return isinstance(error, errors.ROSInterruptException) and self.is_shutdown()

    @property
    def thread_state(self) -> ThreadState:
        """What the calling thread knows of the shutdown."""
        try:
            found: ThreadState = self._thread.state
        except AttributeError:
            found = self._thread.state = self._main if _is_main() else ThreadState()
        return found

    # --- helpers

    def _run_hooks(self, stage: Stage, *reason: object) -> None:
        # A hook may add another: it runs last.
        for hook in self._hooks[stage]:
            try:
                with self.deferral.lifted():
                    hook(*reason)
            except (Exception, SystemExit, KeyboardInterrupt) as error:  # noqa: BLE001 - the others have to run
                # A KeyboardInterrupt is the second Ctrl-C. And there may be no terminal any more.
                if type(error) is not KeyboardInterrupt:
                    with contextlib.suppress(OSError, ValueError):
                        traceback.print_exc()

    def _finish(self) -> None:
        """End what blocks, and leave the graph."""
        for interrupt in list(self._interrupts):
            with contextlib.suppress(Exception):
                interrupt()
        try:
            self.machine.phase = Phase.LEAVING
            self._leave()
        finally:
            self.machine.phase = Phase.LEFT
            self.left.set()


class _Interrupting:
    """The block of :meth:`Lifecycle.interrupting`; a class, since each service call passes through it."""

    def __init__(
        self, interrupts: list[Callable[[], object]], interrupt: Callable[[], object], down: threading.Event
    ) -> None:
        self._interrupts = interrupts
        self._interrupt = interrupt
        self._down = down

    def __enter__(self) -> None:
        self._interrupts.append(self._interrupt)
        if self._down.is_set():
            self._interrupt()

    def __exit__(self, *_: object) -> None:
        self._interrupts.remove(self._interrupt)


def _is_main() -> bool:
    return threading.current_thread() is threading.main_thread()
