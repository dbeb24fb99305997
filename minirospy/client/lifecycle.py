"""The lifecycle of a node: its hooks, its shutdown, and which threads of the program were notified of it.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import traceback
from collections.abc import Callable

from minirospy.base import errors
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.client.deferral import Deferral, is_main_thread
from minirospy.client.shutdown import Awareness, Phase, ShutdownMachine, ThreadState

__all__ = ["Lifecycle", "ROSInterruptException"]

_log = logging.getLogger(__name__)


class ROSInterruptException(errors.ROSInterruptException, KeyboardInterrupt):
    """A blocking call was ended by the node's shutdown; a KeyboardInterrupt, too, as in rospy.

    asyncio would take a KeyboardInterrupt for the end of its loop: `minirospy.aio` raises the plain one, which is this
    one's base and the `minirospy.ROSInterruptException` that catches both.
    """


class _ThisThread(threading.local):
    def __init__(self, main: ThreadState) -> None:
        self.state = main if is_main_thread() else ThreadState()


class _Interrupting:
    """The block of :meth:`Lifecycle.interrupting`; a class, since each service call passes through it."""

    __slots__ = ("_interrupt", "_lifecycle")

    def __init__(self, lifecycle: Lifecycle, interrupt: Callable[[], object]) -> None:
        self._lifecycle = lifecycle
        self._interrupt = interrupt

    def __enter__(self) -> None:
        self._lifecycle.interrupts.append(self._interrupt)
        if self._lifecycle.shutting_down.is_set():
            self._interrupt()

    def __exit__(self, *_: object) -> None:
        self._lifecycle.interrupts.remove(self._interrupt)


class Lifecycle:
    """From the first hook to the last: what runs when the node shuts down, and in which order."""

    def __init__(self, leave: Callable[[], object]) -> None:
        """``leave()`` takes the node out of the graph."""
        self._leave = leave
        self._lock = threading.RLock()
        self._claim = threading.Lock()
        """Held from the start of the shutdown on. A lock, since a signal's handler may come between any two steps."""
        self.shutting_down = SignalSafeEvent()
        """Set once the shutdown hooks have run: every blocking call ends."""
        self.left = SignalSafeEvent()
        """Set once the node has left the graph."""
        self.reason: object = None
        """What the shutdown was requested with."""

        self.hooks: list[Callable[[], object]] = []
        """Called while is_shutdown() is false."""
        self.late_hooks: list[Callable[[], object]] = []
        """Called after those, also after the ones that a hook has added."""
        self.interrupts: list[Callable[[], object]] = []
        """Called once is_shutdown() is true, before the node leaves the graph: they end what blocks."""

        self.deferral = Deferral()
        self.machine = ShutdownMachine()
        self._this_thread = _ThisThread(self.machine.main)

    def add_hook(self, hook: Callable[[], object], hooks: list[Callable[[], object]] | None = None) -> None:
        """Call ``hook`` when the node shuts down, or now where it has; ``hooks``: a list above, by default the first.

        Raise TypeError.
        """
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        # A signal that is dispatched in between would shut down without this hook.
        with self.deferral, self._lock:
            if not self.is_shutdown():
                (self.hooks if hooks is None else hooks).append(hook)
                return
        hook()

    def signal_shutdown(self, reason: object) -> bool:
        """Shut the node down: hooks run in this thread, blocking calls end, the node leaves the graph.

        Return False, without waiting, where a shutdown is under way already.
        """
        with self.deferral:
            # Entered first: a second signal that interrupts what is claimed and not yet done would leave it so.
            if not self._claim.acquire(blocking=False):
                return False
            _log.debug("signal_shutdown [%s]", reason)
            self.reason = reason

            self.machine.runs_in_main = is_main_thread()
            self.machine.phase = Phase.HOOKS
            try:
                self._run_hooks()
            finally:
                self.shutting_down.set()
                self.machine.phase = Phase.DOWN
                for interrupt in list(self.interrupts):
                    self._run(interrupt)

                self.machine.phase = Phase.LEAVING
                try:
                    self._leave()
                finally:
                    self.machine.phase = Phase.LEFT
                    self.left.set()
        return True

    def interrupting(self, interrupt: Callable[[], object]) -> contextlib.AbstractContextManager[None]:
        """While a block runs, have a shutdown call ``interrupt`` to end what blocks in it.

        A signal's handler may call it, in any moment of the main thread: the events that it sets are SignalSafeEvents.
        """
        return _Interrupting(self, interrupt)

    def spin(self) -> None:
        """Wait until the node shuts down."""
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            self.signal_shutdown("keyboard interrupt")
        self.poll_shutdown()

    @property
    def is_shutdown_requested(self) -> bool:
        """Return whether a shutdown has started: its hooks may still be running."""
        return self._claim.locked()

    def is_shutdown(self) -> bool:
        """Return whether the node has shut down."""
        return self.shutting_down.is_set()

    # --- which threads were notified

    @property
    def is_notified(self) -> bool:
        """Return whether the calling thread was notified of the shutdown."""
        return self._this_thread.state.awareness is Awareness.NOTIFIED

    def poll_shutdown(self) -> bool:
        """Return whether the node has shut down, and record that the calling thread polls, or was notified."""
        self.deferral.poll()
        is_shutdown = self.shutting_down.is_set()
        self._this_thread.state.awareness = Awareness.NOTIFIED if is_shutdown else Awareness.POLLS
        return is_shutdown

    def check_interrupted_sleep(self) -> None:
        """Notify the calling thread, whose sleep a shutdown has cut short. Raise ROSInterruptException.

        In a loop that polls is_shutdown() the sleep just ends early, as with rospy: the loop will poll, and what follows
        it still runs. The exception is for a thread that never polls, or that sleeps again without having polled.
        """
        state = self._this_thread.state
        if state.awareness is not Awareness.POLLS:
            raise self.interrupted("ROS shutdown request")
        state.awareness = Awareness.CUT_SHORT

    def interrupted(self, text: str) -> ROSInterruptException:
        """Return the error that notifies the calling thread of the shutdown, for it to raise."""
        self._this_thread.state.awareness = Awareness.NOTIFIED
        return ROSInterruptException(text)

    def is_interrupt(self, error: BaseException) -> bool:
        """Return whether an error that ends the program, or a thread of it, is the one that was to interrupt it."""
        if isinstance(error, KeyboardInterrupt) and self.machine.signals:
            return True
        return isinstance(error, errors.ROSInterruptException) and self.is_shutdown_requested

    def _run_hooks(self) -> None:
        """Run the hooks until none is left, also of those that a hook, or meanwhile another thread, adds; then be shut down."""
        while not self.shutting_down.is_set():
            for hooks in (self.hooks, self.late_hooks):
                while hooks:
                    self._run(hooks.pop(0))
            with self._lock:
                if not self.hooks and not self.late_hooks:
                    # A hook that is added from now on is called immediately.
                    self.shutting_down.set()

    def _run(self, hook: Callable[[], object]) -> None:
        try:
            with self.deferral.lifted():
                hook()
        except (Exception, SystemExit, KeyboardInterrupt) as error:  # noqa: BLE001 - the others have to run
            # A KeyboardInterrupt is the second Ctrl-C. And there may be no terminal any more.
            if type(error) is not KeyboardInterrupt:
                with contextlib.suppress(OSError, ValueError):
                    traceback.print_exc()
