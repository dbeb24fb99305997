"""The one node of a process, as rospy has it: its name, its life, and how it ends.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import logging
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Coroutine, Sequence
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from minirospy import names
from minirospy.clock import Clock, SimulatedClock, WallClock, wait_for_event
from minirospy.environment import Environment
from minirospy.errors import (
    MasterUnreachableError,
    ROSException,
    ROSInitException,
    ROSInterruptException,
    RpcError,
)
from minirospy.runtime import tcp
from minirospy.runtime.loop import LoopClosedError, LoopThread
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.runtime.node import Node

if TYPE_CHECKING:
    from minirospy.client.topics import _Published, _Subscribed

__all__ = ["NodeProcess", "process"]

_T = TypeVar("_T")
_UNNAMED = "/unnamed"
_LEAVE_SECONDS = 3.0
_log = logging.getLogger(__name__)


class NodeProcess:
    """What rospy's functions share. One instance, :data:`process`, stands behind the module-level API."""

    def __init__(self) -> None:
        self.node: Node | None = None
        self.name = _UNNAMED
        self.remappings: dict[str, str] = {}
        self.clock: Clock = WallClock()
        self.shutting_down = threading.Event()
        """Set once the shutdown hooks have run: every blocking call ends."""
        self.published: dict[str, _Published] = {}
        self.subscribed: dict[str, _Subscribed] = {}
        self.lock = threading.RLock()
        """Guards the tables above while they change."""
        self._arguments: names.Arguments | None = None
        self._environment: Environment | None = None
        self._init_arguments: tuple[object, ...] | None = None
        self._loop: LoopThread | None = None
        self._master: MasterProxy | None = None
        self._hooks: list[Callable[[], object]] = []
        self._interrupts: list[Callable[[], object]] = []
        self._waiting_for_node: list[Callable[[], object]] = []
        self._shutdown_begun = False
        self._gone = threading.Event()
        self._signals = 0
        self._thread = threading.local()
        self._previous_handlers: dict[int, Any] = {}
        self.late_signal = 0
        """A signal that came while the main thread was sending; who has sent takes it."""
        self._is_retry = False

    # --- what others ask

    @property
    def environment(self) -> Environment:
        """The environment that the process started in."""
        if self._environment is None:
            self._environment = Environment.read()
        return self._environment

    @property
    def master(self) -> MasterProxy:
        """The master, called from the caller's own thread."""
        if self._master is None or self._master.caller_id != self.name:
            self._master = MasterProxy(self.environment.master_uri, self.name)
        return self._master

    @property
    def initialized(self) -> bool:
        """Whether init_node has been called."""
        return self.node is not None

    def resolve(self, name: str) -> str:
        """The global name of ``name`` as this node sees it."""
        if self.node is None and not self.remappings:
            arguments = self._parsed_arguments()
            self.remappings = arguments.resolved_remappings(self.name)
        return names.resolve(name, self.name, self.remappings)

    def run(self, coroutine: Coroutine[Any, Any, _T]) -> _T:
        """Run ``coroutine`` on the node's loop and wait for it. Raises ROSInterruptException at a shutdown."""
        assert self._loop is not None
        try:
            return self._loop.run(coroutine)
        except LoopClosedError as error:
            self.tell_shutdown()
            raise ROSInterruptException("rospy shutdown") from error

    def post(self, function: Callable[..., object], *args: object) -> None:
        """Call ``function`` on the node's loop soon."""
        if self._loop:
            self._loop.post(function, *args)

    def when_ready(self, function: Callable[[], object]) -> None:
        """Call ``function`` now, or in init_node where that has not been called yet."""
        with self.lock:
            if self.node is None:
                self._waiting_for_node.append(function)
                return
        function()

    def interrupting(self, interrupt: Callable[[], object]) -> _Interrupting:
        """``with process.interrupting(f):`` while the block runs, a shutdown calls ``f`` to end what blocks in it."""
        return _Interrupting(self._interrupts, interrupt, self.shutting_down)

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
        other arguments, ROSInitException where the node cannot be set up.
        """
        argv = list(sys.argv if argv is None else argv)
        given = (name, argv, anonymous, log_level, disable_rostime, disable_signals)
        if self._init_arguments is not None:
            if self._init_arguments != given:
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments: "
                    + str(self._init_arguments)
                )
            return
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names")
        if not names.is_legal_base_name(name):
            warnings.warn(
                f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
                stacklevel=3,
            )
        self._init_arguments = given
        arguments = self._arguments = names.parse_arguments(argv)
        special = arguments.special
        self._environment = Environment.read(
            master_uri=special.get("__master", ""),
            host=special.get("__hostname") or special.get("__ip", ""),
            namespace=special.get("__ns", ""),
        )
        if "__name" in special:
            name = special["__name"]
        elif anonymous:
            name = names.anonymous_name(name)
        self.name = names.canonicalize(self.environment.namespace + "/" + name)
        self.remappings = arguments.resolved_remappings(self.name)

        # Imported here: a tool that needs no log lines need not pay for them.
        from minirospy.client import log

        log.configure(self, log_level, special.get("__log"))
        if not disable_signals:
            self._take_signals()
        self._loop = LoopThread()
        node = Node(
            self.name,
            self.environment,
            on_shutdown=self.signal_shutdown,
        )
        try:
            self._loop.run(node.start(xmlrpc_port, tcpros_port))
        except OSError as error:
            raise ROSInitException(f"node [{self.name}] cannot listen: {error}") from error
        atexit.register(self._at_exit)
        sys.excepthook = _EndOfInterrupted(sys.excepthook)
        self._wait_for_master()
        self._set_private_parameters(arguments)
        if not disable_rostime:
            self._start_clock()
        with self.lock:
            self.node = node
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for function in waiting:
            function()
        if not disable_rosout:
            log.start_rosout(self)
        _log.debug("init_node, name[%s], pid[%s]", self.name, os.getpid())

    # --- ending

    def on_shutdown(self, hook: Callable[[], object]) -> None:
        """Call ``hook`` when the node shuts down, before it leaves the graph. Raises TypeError."""
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        with self.lock:
            if not self._shutdown_begun:
                self._hooks.append(hook)
                return
        hook()

    def signal_shutdown(self, reason: object) -> None:
        """Shut the node down: hooks run in this thread, blocking calls end, the node leaves the graph."""
        with self.lock:
            if self._shutdown_begun:
                return
            self._shutdown_begun = True
            hooks = list(self._hooks)
        _log.debug("signal_shutdown [%s]", reason)
        for hook in hooks:
            try:
                hook()
            except Exception:  # noqa: BLE001 - the user's hook: the others have to run all the same
                traceback.print_exc()
        self.shutting_down.set()
        for interrupt in list(self._interrupts):
            with contextlib.suppress(Exception):
                interrupt()
        if self.node and self._loop:
            try:
                self._loop.run(self.node.close(), _LEAVE_SECONDS)
            except (TimeoutError, RuntimeError) as error:
                _log.debug("closing the node: %s", error)
            self._loop.close()
        if self._master:
            self._master.close()
        self._gone.set()

    def is_shutdown(self) -> bool:
        """Whether the node has shut down."""
        return self.shutting_down.is_set()

    def tell_shutdown(self) -> bool:
        """The same, for user code: the calling thread counts as one that asks, and then as one that was told."""
        if not self.shutting_down.is_set():
            self._thread.asks = True
            return False
        self._thread.knows = True
        return True

    def knows_of_shutdown(self) -> bool:
        """Whether the calling thread was told of the shutdown: what it does now is its clean-up."""
        return getattr(self._thread, "knows", False)

    def check_interrupted_sleep(self) -> None:
        """Tell the calling thread, whose sleep a shutdown has cut short. Raises ROSInterruptException.

        A loop that asks is_shutdown() just gets its sleep back early, as with rospy: it will ask, and what
        stands behind the loop still runs. The exception is for a thread that never asks, or that sleeps again
        without having asked.
        """
        if getattr(self._thread, "asks", False):
            self._thread.asks = False
            return
        self._thread.knows = True
        raise ROSInterruptException("ROS shutdown request")

    def spin(self) -> None:
        """Wait until the node shuts down. Raises ROSInitException before init_node."""
        if not self.initialized and not self.is_shutdown():
            raise ROSInitException("client code must call rospy.init_node() first")
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            self.signal_shutdown("keyboard interrupt")
        self.tell_shutdown()

    # --- helpers

    def _at_exit(self) -> None:
        """The program has ended. Where another thread shuts down, let it take the node out of the graph first."""
        self.signal_shutdown("atexit")
        self._gone.wait(_LEAVE_SECONDS)

    def _parsed_arguments(self) -> names.Arguments:
        if self._arguments is None:
            self._arguments = names.parse_arguments(sys.argv)
        return self._arguments

    def _take_signals(self) -> None:
        """SIGINT and SIGTERM shut down; only the main thread may take signals."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous_handlers[number] = signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        is_retry, self._is_retry = self._is_retry, False
        if is_retry and not self.late_signal:
            return
        if tcp.is_sending(frame):
            # A hook that publishes would wait for the lock that this very thread holds. publish() takes the
            # signal when it has sent; the timer is for the other senders. A loop that only publishes is
            # nearly always caught in the sending: the timer alone would try for seconds.
            self.late_signal = number
            retry = threading.Timer(0.002, self._retry_signal, [number])
            retry.daemon = True
            retry.start()
            return
        self.late_signal = 0
        self._signals += 1
        if self._shutdown_begun:
            if self._signals > 1:
                # The program did not end at the first: now it is interrupted as any Python program.
                raise KeyboardInterrupt
            return
        self.signal_shutdown(f"signal-{number}")
        previous = self._previous_handlers.get(number)
        if callable(previous):
            with contextlib.suppress(KeyboardInterrupt):
                previous(number, frame)

    def take_late_signal(self) -> None:
        """Act on a signal that came while the main thread was sending."""
        if threading.current_thread() is threading.main_thread() and self.late_signal:
            self._on_signal(self.late_signal, None)

    def _retry_signal(self, number: int) -> None:
        if self.late_signal:
            self._is_retry = True
            _thread.interrupt_main(signal.Signals(number))

    def _wait_for_master(self) -> None:
        """Return when the master answers; says once that it waits. A shutdown ends the wait."""
        told = False
        while not self._shutdown_begun:
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
            else:
                return
        raise ROSInitException(f"shut down while waiting for the master at {self.environment.master_uri}")

    def _set_private_parameters(self, arguments: names.Arguments) -> None:
        if not arguments.parameters:
            return
        import yaml

        for key, text in arguments.parameters.items():
            self.master.set_param(names.resolve("~" + key, self.name), yaml.safe_load(text) if text else "")

    def _start_clock(self) -> None:
        try:
            simulated = self.master.has_param("/use_sim_time") and self.master.get_param("/use_sim_time")
        except RpcError as error:
            raise ROSInitException(f"the master does not tell /use_sim_time: {error}") from error
        if simulated:
            clock = self.clock = SimulatedClock()
            from minirospy.client.time import follow_clock_topic

            self.when_ready(lambda: follow_clock_topic(clock))


class _Interrupting:
    """The block of :meth:`NodeProcess.interrupting`; a class, since each service call passes through it."""

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


class _EndOfInterrupted:
    """Lets a program end in peace that did not catch the ROSInterruptException of its own shutdown."""

    def __init__(self, before: Callable[..., Any]) -> None:
        self._before = before

    def __call__(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, ROSInterruptException) and process.is_shutdown():
            raise SystemExit(0)
        self._before(kind, error, trace)


process = NodeProcess()
"""The node of this process."""
