"""The lifecycle of a node: its hooks, its shutdown, and the threads notified of the shutdown.

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
    """The node's shutdown interrupted a blocking call; as in rospy, this is also a KeyboardInterrupt.

    asyncio would treat a KeyboardInterrupt as a request to stop its loop, so `minirospy.aio` raises the base class.
    `minirospy.ROSInterruptException` is that base class, so catching it covers both.
    """


class _ThisThread(threading.local):
    def __init__(self, main: ThreadState) -> None:
        self.state = main if is_main_thread() else ThreadState()


class _Interrupting:
    """The context manager that :meth:`Lifecycle.interrupting` returns.

    This is a class, because every service call uses it and a generator-based context manager is slower.
    """

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
    """Runs the node's shutdown: calls the registered functions in a fixed order."""

    def __init__(self, leave: Callable[[], object]) -> None:
        """Create the lifecycle. A shutdown calls ``leave()`` to remove the node from the graph."""
        self._leave = leave
        self._lock = threading.RLock()
        self._claim = threading.Lock()
        """Locked once the shutdown has started.

        This is a lock and not a flag, because a signal handler may run between a test and an assignment.
        """
        # Set once the shutdown hooks have run; every blocking call then returns
        self.shutting_down = SignalSafeEvent()
        self.left = SignalSafeEvent()  # set once the node has left the graph
        self.reason: object = None  # the reason passed with the shutdown request

        self.hooks: list[Callable[[], object]] = []  # called while is_shutdown() still returns False
        # Called after ``hooks``, including hooks added by other hooks
        self.late_hooks: list[Callable[[], object]] = []
        self.interrupts: list[Callable[[], object]] = []
        """Called after is_shutdown() has become true and before the node leaves the graph, to end blocking calls."""

        self.spin_shuts_down = True  # False in a notebook: there, an interrupt ends spin(), but not the node
        self.has_waited = False  # True after a thread has waited or slept in a rospy call
        self.deferral = Deferral()
        self.machine = ShutdownMachine()
        self._this_thread = _ThisThread(self.machine.main)

    def add_hook(self, hook: Callable[[], object], hooks: list[Callable[[], object]] | None = None) -> None:
        """Call ``hook`` when the node shuts down, or now if it has already shut down.

        ``hooks`` is one of the lists above, by default the first.

        Raise TypeError if ``hook`` is not callable.
        """
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        # Without the deferral, a signal dispatched here could shut the node down without calling this hook.
        with self.deferral, self._lock:
            if not self.is_shutdown():
                (self.hooks if hooks is None else hooks).append(hook)
                return
        hook()

    def signal_shutdown(self, reason: object) -> bool:
        """Shut the node down: hooks run in this thread, blocking calls are interrupted, the node leaves the graph.

        Return False, without waiting, if a shutdown is already in progress.
        """
        with self.deferral:
            # Defer signals before acquiring ``_claim``. Otherwise a second signal right after it could interrupt this
            # call, and the shutdown would never be performed.
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
        """Call ``interrupt`` if the node shuts down during a block, so that blocking calls in the block return.

        A signal handler may call ``interrupt`` at any point in the main thread, so the events that it sets are
        SignalSafeEvents.
        """
        self.has_waited = True
        return _Interrupting(self, interrupt)

    def spin(self) -> None:
        """Wait until the node shuts down. Ctrl-C shuts it down, except in a notebook, where KeyboardInterrupt is only raised."""
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            if not self.spin_shuts_down:
                raise
            self.signal_shutdown("keyboard interrupt")
        self.poll_shutdown()

    @property
    def is_shutdown_requested(self) -> bool:
        """Return whether a shutdown has started; the hooks may still be running."""
        return self._claim.locked()

    def is_shutdown(self) -> bool:
        """Return whether the node has shut down. Unlike :meth:`poll_shutdown`, do not record that the calling thread polls."""
        return self.shutting_down.is_set()

    # --- notified threads

    @property
    def is_notified(self) -> bool:
        """Return whether the calling thread was notified of the shutdown."""
        return self._this_thread.state.awareness is Awareness.NOTIFIED

    @property
    def main_polls(self) -> bool:
        """Return whether the main thread has called is_shutdown()."""
        return self.machine.main.awareness is not Awareness.NONE

    def poll_shutdown(self) -> bool:
        """Return whether the node has shut down, and record that the calling thread has asked.

        If the node has shut down, the thread then counts as notified, otherwise as polling.
        """
        self.deferral.poll()
        is_shutdown = self.shutting_down.is_set()
        self._this_thread.state.awareness = Awareness.NOTIFIED if is_shutdown else Awareness.POLLS
        return is_shutdown

    def check_interrupted_sleep(self) -> None:
        """Raise ROSInterruptException after a shutdown interrupted this thread's sleep, unless the thread polls is_shutdown().

        In a loop that polls is_shutdown() the sleep just returns early, as in rospy: the loop polls next, and the code
        after the loop still runs. The exception is raised in a thread that never polls, or that sleeps again without
        having polled.
        """
        state = self._this_thread.state
        if state.awareness is not Awareness.POLLS:
            raise self.interrupted("ROS shutdown request")
        state.awareness = Awareness.CUT_SHORT

    def interrupted(self, text: str) -> ROSInterruptException:
        """Mark the calling thread as notified of the shutdown; return the exception that it should raise."""
        self._this_thread.state.awareness = Awareness.NOTIFIED
        return ROSInterruptException(text)

    def is_interrupt(self, error: BaseException) -> bool:
        """Return whether the error that ended a thread is the interrupt that was raised in that thread."""
        if isinstance(error, KeyboardInterrupt) and self.machine.signals:
            return True
        return isinstance(error, errors.ROSInterruptException) and self.is_shutdown_requested

    def _run_hooks(self) -> None:
        """Run the hooks, including those added in the meantime by hooks or other threads; then set ``shutting_down``."""
        while not self.shutting_down.is_set():
            for hooks in (self.hooks, self.late_hooks):
                while hooks:
                    self._run(hooks.pop(0))
            with self._lock:
                if not self.hooks and not self.late_hooks:
                    # From now on, newly added hooks are called immediately.
                    self.shutting_down.set()

    def _run(self, hook: Callable[[], object]) -> None:
        try:
            with self.deferral.lifted():
                hook()
        except (Exception, SystemExit, KeyboardInterrupt) as error:  # noqa: BLE001 - the others have to run
            # A KeyboardInterrupt here is the second Ctrl-C. Ignore write errors, because the terminal may be closed.
            if type(error) is not KeyboardInterrupt:
                with contextlib.suppress(OSError, ValueError):
                    traceback.print_exc()
