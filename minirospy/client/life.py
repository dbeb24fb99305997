"""The life of a node: its hooks, its shutdown, and which threads of the program know of it.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import contextlib
import logging
import sys
import threading
import time
import traceback
from collections.abc import Callable
from types import FrameType
from typing import Any, TypeAlias

from minirospy import errors
from minirospy.clock import SignalSafeEvent, wait_for_event

__all__ = ["Life", "Listener", "ROSInterruptException", "where"]

_TOO_LATE = "already shutdown"
_OURS = frozenset({"minirospy", "rospy", "threading"})
_log = logging.getLogger(__name__)

Place: TypeAlias = "list[tuple[object, int]]"


class ROSInterruptException(errors.ROSInterruptException, KeyboardInterrupt):
    """A blocking call was ended by the node's shutdown; a KeyboardInterrupt, too, as in rospy.

    asyncio would take a KeyboardInterrupt for the end of its loop: `minirospy.aio` raises the plain one, which is this
    one's base and the `minirospy.ROSInterruptException` that catches both.
    """


class Listener:
    """What one thread has heard of the node's end."""

    __slots__ = ("asked", "asks", "knows", "turns")

    def __init__(self) -> None:
        self.asks = False
        """Whether it asks is_shutdown()."""
        self.knows = False
        """Whether it was told: what it does now is its clean-up."""
        self.asked = 0.0
        """When it asked last, of time.monotonic()."""
        self.turns = (0.0, 0.0)
        """How long the last two turns of its loop took, in seconds; a loop may ask twice a turn."""

    def ask(self) -> None:
        """It asks whether the node has shut down, and is told that it has not."""
        now = time.monotonic()
        if self.asks:
            self.turns = (self.turns[1], now - self.asked)
        self.asks = True
        self.asked = now


class Life:
    """From the first hook to the last: what runs when the node ends, and in which order."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.listeners: dict[int, Listener] = {}
        """By the identifiers of threads."""
        self.begin_new_life()

    def begin_new_life(self) -> None:
        """Nothing has happened yet, and nobody has heard of anything."""
        self.shutting_down = SignalSafeEvent()
        """Set once the shutdown hooks have run: every blocking call ends."""
        self.gone = SignalSafeEvent()
        """Set once the node has left the graph."""
        self.is_leaving = False
        """Whether a shutdown is under way where no signal may interrupt it: not in a hook."""
        self.told_at: Place = []
        """Where the main thread was when a ROSInterruptException told it."""
        self.listeners.clear()
        self._thread = threading.local()
        self._begun = False
        self.hooks: list[Callable[[], object]] = []
        """What on_shutdown has been given."""
        self._hooks_before: list[Callable[[object], object]] = []
        self._hooks_after: list[Callable[[object], object]] = []
        self._interrupts: list[Callable[[], object]] = []

    # --- the end

    def on_shutdown(self, hook: Callable[[], object]) -> None:
        """Call ``hook`` when the node shuts down, before it leaves the graph. Raises TypeError."""
        self._add_hook(self.hooks, hook, ())

    def before_shutdown(self, hook: Callable[[object], object]) -> None:
        """Call ``hook(reason)`` after the hooks of :meth:`on_shutdown`, still before is_shutdown() is true."""
        self._add_hook(self._hooks_before, hook, (_TOO_LATE,))

    def after_shutdown(self, hook: Callable[[object], object]) -> None:
        """Call ``hook(reason)`` once is_shutdown() is true, before the node leaves the graph."""
        self._add_hook(self._hooks_after, hook, (_TOO_LATE,))

    def signal_shutdown(self, reason: object) -> None:
        """Shut the node down: hooks run in this thread, blocking calls end, the node leaves the graph."""
        with self.lock:
            if self._begun:
                return
            self.is_leaving = self._begun = True
        _log.debug("signal_shutdown [%s]", reason)
        try:
            self._run_hooks(self.hooks, ())
            self._run_hooks(self._hooks_before, (reason,))
            with self.lock:
                # A hook that comes from now on is called at once.
                self.shutting_down.set()
            self._run_hooks(self._hooks_after, (reason,))
        finally:
            # Also where a second Ctrl-C ends a hook.
            self.shutting_down.set()
            for interrupt in list(self._interrupts):
                with contextlib.suppress(Exception):
                    interrupt()
            try:
                self.leave()
            finally:
                self.is_leaving = False
                self.gone.set()

    def leave(self) -> None:
        """Leave the graph."""

    def interrupting(self, interrupt: Callable[[], object]) -> _Interrupting:
        """``with process.interrupting(f):`` while the block runs, a shutdown calls ``f`` to end what blocks in it.

        A signal's handler may call it, in any moment of the main thread: the events that it sets are SignalSafeEvents.
        """
        return _Interrupting(self._interrupts, interrupt, self.shutting_down)

    def spin(self) -> None:
        """Wait until the node shuts down."""
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            self.signal_shutdown("keyboard interrupt")
        self.tell_shutdown()

    # --- who knows of it

    @property
    def is_shutdown_requested(self) -> bool:
        """Whether a shutdown has begun: its hooks may still be running."""
        return self._begun

    def is_shutdown(self) -> bool:
        """Whether the node has shut down."""
        return self.shutting_down.is_set()

    def tell_shutdown(self) -> bool:
        """The same, for user code: the calling thread counts as one that asks, and then as one that was told."""
        if not self.shutting_down.is_set():
            self.listener().ask()
            return False
        self.listener().knows = True
        return True

    def check_interrupted_sleep(self) -> None:
        """Tell the calling thread, whose sleep a shutdown has cut short. Raises ROSInterruptException.

        A loop that asks is_shutdown() just gets its sleep back early, as with rospy: it will ask, and what
        stands behind the loop still runs. The exception is for a thread that never asks, or that sleeps again
        without having asked.
        """
        listener = self.listener()
        if listener.asks:
            listener.asks = False
            return
        raise self.interrupted("ROS shutdown request")

    def interrupted(self, text: str) -> ROSInterruptException:
        """The error that tells the calling thread of the shutdown, for it to raise."""
        self.listener().knows = True
        if threading.current_thread() is threading.main_thread():
            self.told_at = where(sys._getframe())
        return ROSInterruptException(text)

    def listener(self) -> Listener:
        """What the calling thread has heard."""
        try:
            found: Listener = self._thread.listener
        except AttributeError:
            found = self._thread.listener = self.listeners[threading.get_ident()] = Listener()
        return found

    def knows_of_shutdown(self) -> bool:
        """Whether the calling thread was told of the shutdown: what it does now is its clean-up."""
        return self.listener().knows

    # --- helpers

    def begin_life_in_fork(self) -> None:
        """This process is a copy, with one thread and a life of its own. The hooks are for the parent's end."""
        was_down = self.is_shutdown()
        self.lock = threading.RLock()
        self.begin_new_life()
        if was_down:
            self.shutting_down.set()

    def _add_hook(self, hooks: list[Any], hook: Callable[..., object], given: tuple[object, ...]) -> None:
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        with self.lock:
            if not self.is_shutdown():
                hooks.append(hook)
                return
        hook(*given)

    def _run_hooks(self, hooks: list[Any], given: tuple[object, ...]) -> None:
        # A hook may add another: it comes last.
        for hook in hooks:
            try:
                self.is_leaving = False
                hook(*given)
                self.is_leaving = True
            except (Exception, SystemExit, KeyboardInterrupt) as error:  # noqa: BLE001 - the others have to run
                self.is_leaving = True
                # A second Ctrl-C has ended it. And the terminal may be gone.
                if type(error) is not KeyboardInterrupt:
                    with contextlib.suppress(OSError, ValueError):
                        traceback.print_exc()


def where(frame: FrameType | None) -> Place:
    """What the program is about: its functions and where in them it is, down to what it calls of the library."""
    place: Place = []
    while frame is not None:
        place.append((frame.f_code, frame.f_lasti))
        if str(frame.f_globals.get("__name__")).partition(".")[0] in _OURS:
            place.clear()
        frame = frame.f_back
    return place


class _Interrupting:
    """The block of :meth:`Life.interrupting`; a class, since each service call passes through it."""

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
