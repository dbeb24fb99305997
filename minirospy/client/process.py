"""The one node of a process, as rospy has it: what rospy's functions share.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from minirospy import names
from minirospy.client.identity import Identity, private_parameters
from minirospy.client.lifecycle import Lifecycle
from minirospy.client.signals import SignalWatchdog, suppress_interrupt_tracebacks
from minirospy.clock import Clock, SimulatedClock, WallClock, wait_for_event
from minirospy.errors import MasterUnreachableError, ROSException, ROSInitException, RpcError, RpcFault
from minirospy.graph.parameter_cache import ParameterCache
from minirospy.runtime.master_proxy import MasterProxy

if TYPE_CHECKING:
    # Whoever has no node yet does not pay for asyncio.
    from minirospy.client.publisher import Published
    from minirospy.client.services import Service
    from minirospy.client.subscriber import Subscribed
    from minirospy.runtime.loop import LoopThread
    from minirospy.runtime.node import Node

__all__ = ["NodeProcess", "process"]

_T = TypeVar("_T")
_MASTER_SECONDS = 30.0
"""How long the master may take to answer: one of many nodes that start at once on a small computer waits for its turn."""
_REQUEST = re.compile(r"external shutdown request from \[.*?\]: \[(.+)\]$", re.DOTALL)
_log = logging.getLogger(__name__)


class NodeProcess(Identity, Lifecycle):
    """What rospy's functions share. One instance, :data:`process`, stands behind the module-level API."""

    def __init__(self) -> None:
        Identity.__init__(self)
        Lifecycle.__init__(self)
        self.node: Node | None = None
        self.signals = SignalWatchdog(self, self._is_sending)
        self.clock: Clock = WallClock()
        self.time_changed = threading.Condition()
        """Notified of each simulated time."""
        self.has_time = False
        """Whether the time may be asked for: from init_node on, or once a program without a node has said so."""
        self.parameters = ParameterCache()
        self.published: dict[str, Published] = {}
        self.subscribed: dict[str, Subscribed] = {}
        self.offered: dict[str, Service[Any]] = {}
        self.init_arguments: tuple[object, ...] | None = None
        """What init_node was called with; None before."""
        self.parameter_listeners: list[Callable[[str, Any], object]] = []
        """Called with the name and the value of each parameter that the master tells of."""
        self.before_new_life: list[Callable[[], object]] = []
        """What takes back what init_node has set up in the process."""
        self._loop: LoopThread | None = None
        self._made: Node | None = None
        """The node, from before it is ready."""
        self._master: MasterProxy | None = None
        self._waiting_for_node: list[Callable[[], object]] = []
        self._watches_forks = False
        self._is_forked = self._installs_signals_in_fork = self._suppresses_tracebacks = False

    # --- what others ask

    @property
    def master(self) -> MasterProxy:
        """The master, called from the caller's own thread."""
        if self._master is None or self._master.caller_id != self.name:
            environment = self.environment
            self._master = MasterProxy(
                environment.master_uri, self.name, _MASTER_SECONDS, nearby=environment.nearby
            )
        return self._master

    @property
    def initialized(self) -> bool:
        """Whether init_node has been called."""
        return self.node is not None

    def parameter_changed(self, key: str) -> None:
        """Somebody has set or deleted the parameter ``key``."""
        with self.lock:
            self.parameters.changed(key)

    def run(self, coroutine: Coroutine[Any, Any, _T]) -> _T:
        """Run ``coroutine`` on the node's loop and wait for it. Raises ROSInterruptException at a shutdown."""
        return self.begin(coroutine)()

    def begin(self, coroutine: Coroutine[Any, Any, _T]) -> Callable[[], _T]:
        """The first half of :meth:`run`, which does not wait, under a lock that orders who begins. What is returned waits.

        Raises as that does.
        """
        assert self._loop is not None
        loop = self._loop
        wait = self._or_interrupted(lambda: loop.begin(coroutine))
        return lambda: self._or_interrupted(lambda: wait(None))

    def _or_interrupted(self, function: Callable[[], _T]) -> _T:
        from minirospy.runtime.loop import LoopClosedError

        try:
            return function()
        except LoopClosedError as error:
            self.poll_shutdown()
            raise self.interrupted("rospy shutdown") from error

    def _told_of_parameter(self, key: str, value: Any) -> None:
        self.parameter_changed(key)
        for listener in self.parameter_listeners:
            listener(key, value)

    def post(self, function: Callable[..., object], *args: object) -> None:
        """Call ``function`` on the node's loop soon."""
        if self._loop:
            self._loop.post(function, *args)

    def poll_shutdown(self) -> bool:
        """Return whether the node has shut down, and record that the calling thread polls, or was notified."""
        if self._installs_signals_in_fork:
            # A copy of the node's process is left to the system until it polls.
            self._installs_signals_in_fork = False
            self.signals.install()
        return super().poll_shutdown()

    def when_ready(self, function: Callable[[], object]) -> None:
        """Call ``function`` now, or in init_node where that has not been called yet."""
        with self.lock:
            if self.node is None:
                self._waiting_for_node.append(function)
                return
        function()

    # --- beginning

    def init_node(
        self,
        name: str,
        argv: Sequence[str] | None = None,
        anonymous: bool = False,
        log_level: int | None = None,
        disable_rostime: bool = False,
        disable_rosout: bool = False,
        disable_signals: bool = False,
        xmlrpc_port: int = 0,
        tcpros_port: int = 0,
    ) -> None:
        """Make this process the node ``name``; waits for a master.

        Raises ValueError on a name that is empty or has a namespace, ROSException when called again with
        other arguments, ROSInitException where the node cannot be set up, ROSInterruptException where it is shut
        down while it waits.
        """
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names")
        argv = list(sys.argv if argv is None else argv)
        given = (name, argv, anonymous, log_level, disable_rostime, disable_signals)
        if self.init_arguments is not None:
            if self.init_arguments != given:
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments: "
                    + str(self.init_arguments)
                )
            return
        if not names.is_legal_base_name(name):
            warnings.warn(
                f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
                stacklevel=3,
            )
        self.init_arguments = given
        self.take_name(name, argv, anonymous)
        parameters = private_parameters(self.arguments)

        for take_back in self.before_new_life:
            take_back()
        self.before_new_life.clear()
        if not self._suppresses_tracebacks:
            self._suppresses_tracebacks = True
            suppress_interrupt_tracebacks(self)
        if not disable_signals:
            self.signals.install()
        # Imported here: a program that has no node need not pay for them.
        from minirospy.client import log
        from minirospy.runtime.loop import LoopThread
        from minirospy.runtime.node import Node

        if self.is_shutdown():
            raise self.interrupted("rospy shutdown")
        log.configure(self, log_level, self.arguments.special.get("__log"))
        self._loop = LoopThread()
        self._made = node = Node(
            self.name,
            self.environment,
            on_shutdown=self._asked_to_shut_down,
            on_parameter=self._told_of_parameter,
        )
        node.when_registered_again.append(self._forget_parameters)
        atexit.register(self._at_exit)
        try:
            self.run(node.start(xmlrpc_port, tcpros_port))
        except OSError as error:
            raise ROSInitException(f"node [{self.name}] cannot listen: {error}") from error
        self._watch_forks()
        self._wait_for_master()
        for key, value in parameters.items():
            self.master.set_param(names.resolve("~" + key, self.name), value)
        if not disable_rostime:
            self.start_clock()
        self.has_time = True
        with self.lock:
            self.node = node
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for function in waiting:
            function()
        log.start(self, rosout=not disable_rosout)

    def begin_again(self) -> None:
        """Once the node has left the graph, init_node may make another. Before, and without a node, without effect.

        What the program made for the old node, such as its publishers, stays with that.
        """
        if not self.left.is_set() or self.machine.signals:
            return
        self._forget_node()
        self.signals.release()
        self.begin_lifecycle()
        self.signals = SignalWatchdog(self, self._is_sending)

    # --- ending

    def spin(self) -> None:
        """Wait until the node shuts down. Raises ROSInitException before init_node."""
        if not self.initialized and not self.is_shutdown() and not self._is_forked:
            raise ROSInitException("client code must call rospy.init_node() first")
        super().spin()

    def leave(self) -> None:
        """Leave the graph. Takes as long as the master answers: see Node.close(), which sets the limits."""
        if self._made and self._loop:
            try:
                self._loop.run(self._made.close())
            except RuntimeError as error:
                _log.debug("closing the node: %s", error)
            self._loop.close()
        if self._master:
            self._master.close()

    # --- helpers

    def _watch_forks(self) -> None:
        """See to what a fork needs, once; a fork inherits it."""
        if sys.platform == "win32" or self._watches_forks:
            return
        self._watches_forks = True
        mask: list[set[signal.Signals | int]] = []

        # Python throws away a signal that comes to the child before it is set up: Pool.terminate() would wait forever.
        def hold_signals() -> None:
            mask.append(signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM}))

        def release_signals() -> None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask.pop())

        def begin_child() -> None:
            self._after_fork()
            release_signals()

        os.register_at_fork(before=hold_signals, after_in_parent=release_signals, after_in_child=begin_child)

    def _after_fork(self) -> None:
        """This process is a copy of the node's, without its threads: the node stays the parent's.

        The name, the time and log lines go on; topics of the parent's connect nobody here; the child may become a
        node of its own by init_node. Locks that another thread held are free, sockets are not shared.
        """
        for published in self.published.values():
            published.forget_subscribers()
        self._is_forked = True
        self._forget_node()
        self._installs_signals_in_fork = self.signals.is_installed
        self.signals.release()
        self.begin_lifecycle_in_fork()
        self.signals = SignalWatchdog(self, self._is_sending)

    def _forget_node(self) -> None:
        self.node = self._made = self._loop = self._master = self.init_arguments = None
        self.published, self.subscribed, self.offered = {}, {}, {}
        self.parameters = ParameterCache()
        self._waiting_for_node = []
        self.forget_name()

    def _at_exit(self) -> None:
        """The program has ended. Where another thread shuts down, let it take the node out of the graph first."""
        self.signal_shutdown("atexit")
        wait_for_event(self.left, None)
        self.signals.flush_at_exit()

    def _is_sending(self) -> bool:
        return self._made is not None and self._made.is_sending

    def _asked_to_shut_down(self, reason: str) -> None:
        """Somebody outside ends this node: as rospy does, say on stdout who and why."""
        # Nobody may be there to read it.
        with contextlib.suppress(OSError, ValueError):
            print(
                "shutdown request" + (f": {asked[1]}" if (asked := _REQUEST.match(reason)) else ""),
                flush=True,
            )
        self.signal_shutdown(reason)

    def _wait_for_master(self) -> None:
        """Return when the master answers; says once that it waits. A shutdown ends the wait."""
        told = False
        while not self.is_shutdown_requested:
            try:
                self.master.get_pid()
            except MasterUnreachableError:
                if not told:
                    print(
                        f"Unable to register with master node [{self.environment.master_uri}]: master may "
                        "not be running yet. Will keep trying. (Start one with `roscore`.)",
                        file=sys.stderr,
                        flush=True,
                    )
                    told = True
                if wait_for_event(self.shutting_down, 0.25):
                    break
            except RpcFault:
                return  # a master that lacks this call, as that of @foxglove/ros1
            except RpcError as error:
                uri = self.environment.master_uri
                raise ROSInitException(f"what answers at {uri} is no ROS master: {error}") from error
            else:
                return
        raise self.interrupted(f"shut down while waiting for the master at {self.environment.master_uri}")

    def _forget_parameters(self) -> None:
        """A master that has restarted: what was known of its parameters is old, and it has to be told again."""
        if self.node:
            keys, self.node.parameters = self.node.parameters, set()
            for key in keys:
                self.parameter_changed(key)

    def start_clock(self) -> None:
        """Go by /clock where the master says so. Raises ROSInitException where it says nothing."""
        try:
            simulated = self.master.has_param("/use_sim_time") and self.master.get_param("/use_sim_time")
        except RpcError as error:
            raise ROSInitException(f"the master does not tell /use_sim_time: {error}") from error
        if simulated:
            clock = self.clock = SimulatedClock(changed=self.time_changed)
            from minirospy.client.time import follow_clock_topic

            self.when_ready(lambda: follow_clock_topic(clock))


process = NodeProcess()
"""The node of this process."""
