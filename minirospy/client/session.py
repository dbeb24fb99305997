"""The process's single node: the state shared by rospy's functions. The object is replaced, never reset.

Publishers, services, time and log register with the session; this module imports none of them.
"""

from __future__ import annotations

import contextlib
import logging
import re
import sys
import threading
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, TypeVar

from minirospy.base.clock import Clock, WallClock, wait_for_event
from minirospy.base.errors import ROSInitException
from minirospy.client.callback_errors import CallbackErrors
from minirospy.client.identity import Identity
from minirospy.client.lifecycle import Lifecycle
from minirospy.client.signals import SignalWatchdog
from minirospy.core.graph.parameter_cache import ParameterCache
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    # For type checking only: a program without a node does not import asyncio.
    from minirospy.client.publisher import PublishedTopic
    from minirospy.client.service import Service
    from minirospy.client.subscriber import SubscribedTopic
    from minirospy.runtime.node.node import Node
    from minirospy.runtime.transport.loop import LoopThread

__all__ = ["NEW_SECONDS", "Session", "current_session", "replace_session", "replace_session_in_fork"]

NEW_SECONDS = 2.0  # seconds; a program that exits this soon after subscribing probably lacks spin()

_T = TypeVar("_T")
_MASTER_SECONDS = 30.0
"""Time limit for a call to the master, in seconds. It is long because many nodes that start together delay each other on a
small computer.
"""
_REQUEST = re.compile(r"external shutdown request from \[.*?\]: \[(.+)\]$", re.DOTALL)
_log = logging.getLogger(__name__)
_SERVICES_OF_NODES = ("/get_loggers", "/set_logger_level")


class Session:
    """The process's node before, during and after its lifetime: its name, lifecycle, clock, tables and event loop."""

    def __init__(self, previous: Session | None = None, *, is_fork: bool = False) -> None:
        """Create the session after ``previous``, whose name, clock and listeners remain in use until init_node is called."""
        self.is_fork = is_fork
        self.is_abandoned = False  # True if this process is a fork, and the session belongs to its parent
        self._forked_from = previous.name if previous and is_fork else ""
        self._reported: set[str] = set()  # names of handles that :meth:`report_fork` has already reported
        self.identity: Identity = Identity(previous.identity if previous else None)
        self.lifecycle = Lifecycle(self._leave)
        if previous:
            self.lifecycle.spin_shuts_down = previous.lifecycle.spin_shuts_down
        self.signals = SignalWatchdog(self.lifecycle, self._stop_leaving, self._is_sending)

        self.callback_errors = CallbackErrors()
        self.lifecycle.late_hooks.append(self.callback_errors.close)
        self.lock = threading.RLock()  # orders registrations, and guards the tables of topics and services
        self.clock: Clock = previous.clock if previous else WallClock()
        # Notified whenever the simulated time changes
        self.time_changed: threading.Condition = previous.time_changed if previous else threading.Condition()
        # True once the time is available: after init_node, or once a program without a node has set the time
        self.has_time: bool = bool(previous and previous.has_time)

        self.published: dict[str, PublishedTopic] = {}
        self.subscribed: dict[str, SubscribedTopic] = {}
        self.offered: dict[str, Service[object]] = {}
        self.parameters = ParameterCache()
        self.parameter_listeners: list[Callable[[str, object], object]] = (
            previous.parameter_listeners if previous else []
        )
        """Functions to call with the name and the value of each parameter that the master reports as changed."""
        self.on_replaced: list[Callable[[], object]] = previous.on_replaced if previous else []
        """Functions for the next init_node to call; each one removes something that this session installed in the process."""
        # The arguments of init_node; None before it is called
        self.init_arguments: tuple[object, ...] | None = None
        self.node: Node | None = None  # set when init_node is done

        self._opened: Node | None = None
        self._loop: LoopThread | None = None
        self._master: MasterProxy | None = None
        self._waiting_for_node: list[Callable[[], object]] = []
        self._installs_signals = is_fork and previous is not None and previous.signals.is_installed

    # --- node

    @property
    def name(self) -> str:
        """This node's global name. Before init_node, it is ``unnamed`` in the node's namespace."""
        return self.identity.name

    def resolve(self, name: str, caller_id: str | None = None) -> str:
        """Return ``name`` as a global name, resolved relative to this node or the node ``caller_id``."""
        return self.identity.resolve(name, caller_id)

    @property
    def initialized(self) -> bool:
        """Return whether init_node has finished."""
        return self.node is not None

    @property
    def master(self) -> MasterProxy:
        """The proxy for the master; calls run in the caller's thread."""
        if self._master is None or self._master.caller_id != self.name:
            environment = self.identity.environment
            self._master = MasterProxy(
                environment.master_uri, self.name, _MASTER_SECONDS, same_host=environment.same_host
            )
        return self._master

    def open_node(self, xmlrpc_port: int, tcpros_port: int) -> None:
        """Start the loop and the node's servers. Raise ROSInitException if a server cannot listen."""
        # Import this here, because a program without a node need not import asyncio.
        from minirospy.runtime.node.node import Node
        from minirospy.runtime.transport.loop import LoopThread

        with self.lifecycle.deferral:
            # Defer Ctrl-C: asyncio's loops do not shut down properly if they are interrupted while starting.
            self._loop = LoopThread()
        self._opened = Node(
            self.name,
            self.identity.environment,
            on_shutdown=self._on_shutdown_request,
            on_parameter=self._on_parameter,
        )
        self._opened.when_registered_again.append(self._forget_parameters)
        try:
            self.run(self._opened.start(xmlrpc_port, tcpros_port))
        except OSError as error:
            raise ROSInitException(f"node [{self.name}] cannot listen: {error}") from error

    def publish_node(self) -> None:
        """Make the opened node the process's node, and register everything that was created before it."""
        with self.lock:
            self.node = self._opened
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for function in waiting:
            function()

    def when_ready(self, function: Callable[[], object], handle: str = "") -> None:
        """Call ``function`` now, or from init_node if that has not been called yet.

        ``handle`` is the name of the handle that ``function`` registers, for :meth:`report_fork`.
        """
        with self.lock:
            is_ready = self.node is not None
            if not is_ready:
                self._waiting_for_node.append(function)
        if is_ready:
            function()
        elif self.is_fork and handle:
            self.report_fork(handle)

    @property
    def is_fork_without_node(self) -> bool:
        """Return whether this process is a fork of a node and has not called init_node since."""
        return self.is_fork and self.node is None and not self.is_shutdown()

    def why_fork_has_no_effect(self, handle: str) -> str:
        """Return the error message for using a handle that has no effect, because this process is a fork."""
        return (
            f"{handle} has no effect in this process, which is a fork of node [{self._forked_from}]: call "
            "rospy.init_node() in the child process, and create it after that"
        )

    def report_fork(self, handle: str) -> None:
        """Log, once per handle, that the handle has no effect in this fork of a node."""
        if handle not in self._reported:
            self._reported.add(handle)
            logging.getLogger("rosout").error("%s", self.why_fork_has_no_effect(handle))

    def run(self, coroutine: Coroutine[object, object, _T]) -> _T:
        """Run ``coroutine`` on the node's loop and wait for it. Raise ROSInterruptException if the node shuts down first."""
        return self.start(coroutine)()

    def start(self, coroutine: Coroutine[object, object, _T]) -> Callable[[], _T]:
        """Start ``coroutine`` on the node's loop; return a function that waits for its result.

        Coroutines are started one at a time, in the order of the calls.

        Raise ROSInterruptException if the node shuts down first.
        """
        assert self._loop is not None
        loop = self._loop
        with self.lifecycle.deferral:
            # Defer a shutdown: it would wait for the loop to close, which needs a lock that this thread holds.
            wait = self._or_interrupted(lambda: loop.start(coroutine))
        return lambda: self._or_interrupted(lambda: wait(None))

    def post(self, function: Callable[..., object], *args: object) -> None:
        """Schedule a call to ``function`` on the node's loop; return immediately."""
        if self._loop:
            self._loop.post(function, *args)

    def parameter_changed(self, key: str) -> None:
        """Discard the cached value of the parameter ``key``, which was set or deleted."""
        with self.lock:
            self.parameters.changed(key)

    # --- shutdown

    def is_shutdown(self) -> bool:
        """Return whether the node has shut down."""
        return self.lifecycle.is_shutdown()

    def poll_shutdown(self) -> bool:
        """Return whether the node has shut down, and record that the calling thread has asked.

        If the node has shut down, the thread then counts as notified, otherwise as polling.
        """
        if self._installs_signals:
            # Install the handlers now: a fork keeps the default signal handling until it first calls is_shutdown().
            self._installs_signals = False
            self.signals.install()
        return self.lifecycle.poll_shutdown()

    def spin(self) -> None:
        """Wait until the node shuts down. Raise ROSInitException if init_node has not been called."""
        if not self.initialized and not self.is_shutdown() and not self.is_fork:
            raise ROSInitException("client code must call rospy.init_node() first")
        if self.is_fork_without_node:
            self.report_fork("rospy.spin()")
        self.lifecycle.spin()

    def shut_down_at_exit(self) -> None:
        """Shut down when the program exits. If another thread is already shutting down, wait for it."""
        if self._opened or self.is_fork:
            if not self.lifecycle.is_shutdown_requested:
                self._warn_of_missing_spin()
            self.lifecycle.signal_shutdown("atexit")
            wait_for_event(self.lifecycle.left, None)
        self.signals.flush_at_exit()

    def _warn_of_missing_spin(self) -> None:
        """Log a warning if the program ends without an error right after it has subscribed, or offered a service."""
        waiting = {topic: state for topic, state in self.subscribed.items() if state.has_callback}
        # Ignore the two logger services, which every node offers.
        own = {name: each for name, each in self.offered.items() if not name.endswith(_SERVICES_OF_NODES)}
        # Do not warn if the program polls or has waited, or in an interactive session: they exit on purpose.
        is_meant = self.lifecycle.has_waited or self.lifecycle.main_polls or hasattr(sys, "ps1")
        topics = sorted(topic for topic in waiting if topic != "/clock")
        if is_meant or hasattr(sys, "last_value") or not all(state.is_new for state in waiting.values()):
            return
        if topics:
            logging.getLogger("rosout").warning(
                "the program ends while it subscribes to %s, before any message has arrived. rospy.spin() at its end keeps it "
                "running",
                ", ".join(topics),
            )
        elif own and all(service.is_new for service in own.values()):
            logging.getLogger("rosout").warning(
                "the program ends while it offers the service %s, before any call. rospy.spin() at its end keeps it running",
                ", ".join(sorted(own)),
            )

    def abandon_in_fork(self) -> None:
        """In a fork, drop the references to the node, its sockets and its locks, which belong to the parent."""
        self.is_abandoned = True
        for published in self.published.values():
            published.forget_subscribers()
        self.published, self.subscribed, self.offered = {}, {}, {}
        self.node = None
        # Replace the lock, because another thread in the parent may have held it during the fork.
        self.lock = threading.RLock()
        self.signals.release()

    # --- helpers

    def _leave(self) -> None:
        """Leave the graph. Waits for the master's responses, within Node.close()'s time limits."""
        if self._opened and self._loop:
            try:
                # After a signal, print nothing here, because the watchdog prints what the process is waiting for.
                self._loop.run(self._opened.close(announces=not self.lifecycle.machine.signals))
            except RuntimeError as error:
                _log.debug("closing the node: %s", error)
            finally:
                self._loop.close()
        if self._master:
            self._master.close()

    def _stop_leaving(self) -> None:
        if self._opened:
            self.post(self._opened.stop_unregistering)

    def _is_sending(self) -> bool:
        return self._opened is not None and self._opened.is_sending

    def _or_interrupted(self, function: Callable[[], _T]) -> _T:
        from minirospy.runtime.transport.loop import LoopClosedError

        try:
            return function()
        except LoopClosedError as error:
            self.poll_shutdown()
            raise self.lifecycle.interrupted("rospy shutdown") from error

    def _on_shutdown_request(self, reason: str) -> None:
        """Shut down at another process's request. Like rospy, print the reason."""
        # Ignore errors, because the terminal may have been closed.
        with contextlib.suppress(OSError, ValueError):
            print(
                "shutdown request" + (f": {request[1]}" if (request := _REQUEST.match(reason)) else ""),
                flush=True,
            )
        if not self.lifecycle.is_shutdown_requested:
            # The interrupts are called after the hooks, once is_shutdown() has become true.
            self.lifecycle.interrupts.append(self.signals.interrupt_later)
        self.lifecycle.signal_shutdown(reason)

    def _on_parameter(self, key: str, value: object) -> None:
        self.parameter_changed(key)
        for listener in self.parameter_listeners:
            listener(key, value)

    def _forget_parameters(self) -> None:
        """Discard all cached parameters: the master has restarted, and no longer knows the node's subscriptions to them."""
        if self.node:
            keys = list(self.node.parameters)
            self.node.parameters.clear()
            for key in keys:
                self.parameter_changed(key)


class _Process:
    session = Session()


def current_session() -> Session:
    """Return the session of this process."""
    return _Process.session


def replace_session() -> None:
    """Let init_node create another node if the current one has left the graph. Otherwise, or after a signal, do nothing.

    Objects that the program created for the old node, such as publishers, remain attached to it.
    """
    session = _Process.session
    if session.lifecycle.left.is_set() and not session.lifecycle.machine.signals:
        session.signals.release()
        _Process.session = Session(session)


def replace_session_in_fork() -> None:
    """In a fork, replace the parent's session with a new one.

    The new session keeps the name, the time and the logging, but not the node, which belongs to the parent.
    """
    session = _Process.session
    _Process.session = Session(session, is_fork=True)
    if session.is_shutdown():
        _Process.session.lifecycle.shutting_down.set()
    session.abandon_in_fork()
