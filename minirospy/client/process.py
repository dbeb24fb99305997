"""The one node of a process, as rospy has it: its name, its life, and how it ends.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import logging
import os
import re
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Coroutine, Mapping, Sequence
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
    UsageError,
)
from minirospy.graph.parameter_cache import ParameterCache
from minirospy.runtime import tcp
from minirospy.runtime.loop import LoopClosedError, LoopThread
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.runtime.node import Node
from minirospy.wire.xmlrpc import serialize_call

if TYPE_CHECKING:
    from minirospy.client.services import Service
    from minirospy.client.topics import _Published, _Subscribed

__all__ = ["NodeProcess", "private_parameters", "process", "warn_of_illegal_name"]

_T = TypeVar("_T")
_UNNAMED = "unnamed"
_LEAVE_SECONDS = 3.0
_HEAR_SECONDS, _ROUND_SECONDS = 0.4, 3.0
"""How long the main thread may take to hear of a shutdown, without and with a loop that asks for it."""
_REQUEST = re.compile(r"external shutdown request from \[.*?\]: \[(.+)\]$", re.DOTALL)
_TOO_LATE = "already shutdown"
_log = logging.getLogger(__name__)


class NodeProcess:
    """What rospy's functions share. One instance, :data:`process`, stands behind the module-level API."""

    def __init__(self) -> None:
        self.node: Node | None = None
        self.remappings: dict[str, str] = {}
        """By resolved names; empty before init_node."""
        self.clock: Clock = WallClock()
        self.has_time = False
        """Whether the time may be asked for: from init_node on, or once a program without a node has said so."""
        self.shutting_down = threading.Event()
        """Set once the shutdown hooks have run: every blocking call ends."""
        self.parameters = ParameterCache()
        self.published: dict[str, _Published] = {}
        self.subscribed: dict[str, _Subscribed] = {}
        self.offered: dict[str, Service[Any]] = {}
        self.lock = threading.RLock()
        """Guards the tables above while they change."""
        self._name: str | None = None
        self._arguments: names.Arguments | None = None
        self._environment: Environment | None = None
        self._init_arguments: tuple[object, ...] | None = None
        self._loop: LoopThread | None = None
        self._master: MasterProxy | None = None
        self._hooks: list[Callable[[], object]] = []
        self._hooks_before: list[Callable[[object], object]] = []
        self._hooks_after: list[Callable[[object], object]] = []
        self._interrupts: list[Callable[[], object]] = []
        self._waiting_for_node: list[Callable[[], object]] = []
        self._shutdown_begun = False
        self._gone = threading.Event()
        self._signals = 0
        self._thread = threading.local()
        self._others_ask = False
        self._main_told = threading.Event()
        self._watches_forks = False
        self._is_forked = False
        self.insisted = False
        """Whether the main thread was interrupted, because it did not end at a signal."""
        self._previous_handlers: dict[int, Any] = {}
        self.late_signal = 0
        """A signal that came while the main thread was sending; who has sent takes it."""
        self._is_retry = False

    # --- what others ask

    @property
    def environment(self) -> Environment:
        """The environment that the process started in."""
        if self._environment is None:
            self._environment = self._read_environment()
        return self._environment

    @property
    def arguments(self) -> names.Arguments:
        """The command line: that of init_node, before it that of the process."""
        if self._arguments is None:
            self._arguments = names.parse_arguments(sys.argv)
        return self._arguments

    @property
    def name(self) -> str:
        """This node's global name; ``/unnamed``, in its namespace, before init_node."""
        if self._name is None:
            self._name = names.join(self.environment.namespace, _UNNAMED)
        return self._name

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

    def resolve(self, name: str, caller_id: str | None = None) -> str:
        """The global name of ``name`` as this node, or the node ``caller_id``, sees it."""
        node_name = caller_id or self.name
        if name and names.is_private(name):
            # As rospy reads it: `~` keeps a slash behind it, and `~/x` is `/x`.
            resolved = names.join(node_name, names.canonicalize(name)[1:])
        else:
            resolved = names.resolve(name, node_name)
        return self.remappings.get(resolved, resolved)

    def resolve_topic(self, name: str) -> str:
        """The same for a topic, which keeps the name that it was made with.

        Before init_node it has the remappings of the process's command line, but cannot be private:
        raises ValueError.
        """
        if self._init_arguments is not None:
            return self.resolve(name)
        if names.is_private(name):
            raise ValueError("~name topics cannot be created before init_node() has been called")
        return names.resolve(name, self.name, self.arguments.resolved_remappings(self.name))

    def remap(self, name: str, caller_id: str | None = None) -> str:
        """What the command line says in place of ``name``, as it is spelt there; else ``name`` itself."""
        mapped = self.arguments.remappings.get(name)
        return name if mapped is None else names.resolve(mapped, caller_id or self.name)

    def parameter_changed(self, key: str) -> None:
        """Somebody has set or deleted the parameter ``key``."""
        with self.lock:
            self.parameters.changed(key)

    def run(self, coroutine: Coroutine[Any, Any, _T]) -> _T:
        """Run ``coroutine`` on the node's loop and wait for it. Raises ROSInterruptException at a shutdown."""
        assert self._loop is not None
        try:
            return self._loop.run(coroutine)
        except LoopClosedError as error:
            self.tell_shutdown()
            raise self.interrupted("rospy shutdown") from error

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
        other arguments, ROSInitException where the node cannot be set up, ROSInterruptException where it is shut
        down while it waits.
        """
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names")
        argv = list(sys.argv if argv is None else argv)
        given = (name, argv, anonymous, log_level, disable_rostime, disable_signals)
        if self._init_arguments is not None:
            if self._init_arguments != given:
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments: "
                    + str(self._init_arguments)
                )
            return
        if not names.is_legal_base_name(name):
            warnings.warn(
                f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
                stacklevel=3,
            )
        self._init_arguments = given
        arguments = self._arguments = names.parse_arguments(argv)
        parameters = private_parameters(arguments)
        special = arguments.special
        self._take_name(name, anonymous, special)
        self.remappings = arguments.resolved_remappings(self.name)

        # Imported here: a tool that needs no log lines need not pay for them.
        from minirospy.client import log

        log.configure(self, log_level, special.get("__log"))
        if not disable_signals:
            self.take_signals()
        self._loop = LoopThread()
        node = Node(
            self.name,
            self.environment,
            on_shutdown=self._asked_to_shut_down,
            on_parameter=lambda key, _: self.parameter_changed(key),
        )
        node.when_registered_again.append(self._subscribe_parameters)
        try:
            self._loop.run(node.start(xmlrpc_port, tcpros_port))
        except OSError as error:
            raise ROSInitException(f"node [{self.name}] cannot listen: {error}") from error
        atexit.register(self._at_exit)
        self._watch_forks()
        sys.excepthook = _EndOfInterrupted(sys.excepthook)
        self._wait_for_master()
        for key, value in parameters.items():
            self.master.set_param(names.resolve("~" + key, self.name), value)
        if not disable_rostime:
            self._start_clock()
        self.has_time = True
        with self.lock:
            self.node = node
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for function in waiting:
            function()
        log.start(self, rosout=not disable_rosout)

    def _take_name(self, name: str, anonymous: bool, special: Mapping[str, str]) -> None:
        """Read the environment, and be the node ``name`` in its namespace."""
        try:
            self._environment = self._read_environment()
        except UsageError as error:
            raise ROSInitException(str(error)) from error
        if "__name" in special:
            name = special["__name"]
        elif anonymous:
            name = f"{name}_{os.getpid()}_{time.time_ns() // 1_000_000}"
        self._name = names.resolve(name, names.join(self.environment.namespace, _UNNAMED))

    def reload_arguments(self, argv: Sequence[str]) -> None:
        """Take ``argv`` for the command line."""
        self._arguments = names.parse_arguments(argv)

    # --- ending

    def on_shutdown(self, hook: Callable[[], object]) -> None:
        """Call ``hook`` when the node shuts down, before it leaves the graph. Raises TypeError."""
        self._add_hook(self._hooks, hook, ())

    def before_shutdown(self, hook: Callable[[object], object]) -> None:
        """Call ``hook(reason)`` after the hooks of :meth:`on_shutdown`, still before is_shutdown() is true."""
        self._add_hook(self._hooks_before, hook, (_TOO_LATE,))

    def after_shutdown(self, hook: Callable[[object], object]) -> None:
        """Call ``hook(reason)`` once is_shutdown() is true, before the node leaves the graph."""
        self._add_hook(self._hooks_after, hook, (_TOO_LATE,))

    def signal_shutdown(self, reason: object) -> None:
        """Shut the node down: hooks run in this thread, blocking calls end, the node leaves the graph."""
        with self.lock:
            if self._shutdown_begun:
                return
            self._shutdown_begun = True
        _log.debug("signal_shutdown [%s]", reason)
        try:
            self._run_hooks(self._hooks, ())
            self._run_hooks(self._hooks_before, (reason,))
            with self.lock:
                # A hook that comes from now on is called at once.
                self.shutting_down.set()
            self._run_hooks(self._hooks_after, (reason,))
        finally:
            # Also where a second Ctrl-C ends a hook.
            self.shutting_down.set()
            self._leave()

    def _leave(self) -> None:
        """End what blocks, and leave the graph."""
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

    @property
    def is_shutdown_requested(self) -> bool:
        """Whether a shutdown has begun: its hooks may still be running."""
        return self._shutdown_begun

    def is_shutdown(self) -> bool:
        """Whether the node has shut down."""
        return self.shutting_down.is_set()

    def tell_shutdown(self) -> bool:
        """The same, for user code: the calling thread counts as one that asks, and then as one that was told."""
        if not self.shutting_down.is_set():
            self._thread.asks = True
            self._others_ask = self._others_ask or threading.current_thread() is not threading.main_thread()
            return False
        self._told()
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
        raise self.interrupted("ROS shutdown request")

    def interrupted(self, text: str) -> ROSInterruptException:
        """The error that tells the calling thread of the shutdown, for it to raise."""
        self._told()
        return ROSInterruptException(text)

    def spin(self) -> None:
        """Wait until the node shuts down. Raises ROSInitException before init_node."""
        if not self.initialized and not self.is_shutdown() and not self._is_forked:
            raise ROSInitException("client code must call rospy.init_node() first")
        try:
            wait_for_event(self.shutting_down, None)
        except KeyboardInterrupt:
            self.signal_shutdown("keyboard interrupt")
        self.tell_shutdown()

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
        for publication in self.node.publications.values() if self.node else ():
            publication.links = ()
        self.node = self._loop = self._master = self._init_arguments = None
        self._is_forked = True
        self.published, self.subscribed = {}, {}
        self.lock = threading.RLock()
        self._thread = threading.local()
        self._others_ask = False
        was_down, self.shutting_down = self.shutting_down.is_set(), threading.Event()
        if was_down:
            self.shutting_down.set()
        self._main_told, self._gone = threading.Event(), threading.Event()
        self._signals = self.late_signal = 0
        # The parent's hooks are for the parent's end.
        self._hooks, self._hooks_before, self._hooks_after = [], [], []
        self._interrupts, self._waiting_for_node = [], []

    def _add_hook(self, hooks: list[Any], hook: Callable[..., object], given: tuple[object, ...]) -> None:
        if not callable(hook):
            raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")
        with self.lock:
            if not self.is_shutdown():
                hooks.append(hook)
                return
        hook(*given)

    @staticmethod
    def _run_hooks(hooks: list[Any], given: tuple[object, ...]) -> None:
        # A hook may add another: it comes last.
        for hook in hooks:
            try:
                hook(*given)
            except (Exception, SystemExit):  # noqa: BLE001 - the user's hook: the others have to run all the same
                traceback.print_exc()

    def _at_exit(self) -> None:
        """The program has ended. Where another thread shuts down, let it take the node out of the graph first."""
        self._main_told.set()
        self.signal_shutdown("atexit")
        self._gone.wait(_LEAVE_SECONDS)

    def _read_environment(self) -> Environment:
        """The environment, and what the process's own command line says in place of it.

        As in rospy, the ``argv`` that a program hands to init_node has no say in this, but for ``__name``.
        """
        special = names.parse_arguments(sys.argv).special
        hosts = [value for key, value in special.items() if key in {"__ip", "__hostname"}]
        return Environment.read(
            master_uri=special.get("__master", ""),
            host=hosts[0] if hosts else "",
            namespace=special.get("__ns", ""),
        )

    def take_signals(self) -> None:
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
        if self._is_forked and self.node is None and not getattr(self._thread, "asks", False):
            # A worker of the program, which never asks is_shutdown(), ends as any child process does.
            signal.signal(number, self._previous_handlers[number])
            signal.raise_signal(number)
            return
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
        self._see_to_the_end(number)

    def _see_to_the_end(self, number: int) -> None:
        """A signal has shut the node down: the program has to end, also where its main thread never hears of it.

        That thread may be in time.sleep(), in input() or in a loop that does not ask is_shutdown(). A loop that
        asks gets the time to come round, since its clean-up often stands behind it.
        """
        seconds = _ROUND_SECONDS if getattr(self._thread, "asks", False) else _HEAR_SECONDS
        watch = threading.Thread(
            target=self._insist, args=(number, seconds), name="minirospy-end", daemon=True
        )
        watch.start()

    def _insist(self, number: int, seconds: float) -> None:
        main = threading.main_thread()
        if self._main_told.wait(seconds) or not main.ident:
            return
        if not main.is_alive() and self._others_ask:
            # The program waits for its other threads, and those will see.
            return
        self.insisted = True
        # A second signal interrupts whatever the main thread does, as in any Python program.
        if sys.platform == "win32":
            signal.raise_signal(number)
        else:
            signal.pthread_kill(main.ident, number)

    def _told(self) -> None:
        self._thread.knows = True
        if threading.current_thread() is threading.main_thread():
            self._main_told.set()

    def _asked_to_shut_down(self, reason: str) -> None:
        """Somebody outside ends this node: as rospy does, say on stdout who and why."""
        print("shutdown request" + (f": {asked[1]}" if (asked := _REQUEST.match(reason)) else ""), flush=True)
        self.signal_shutdown(reason)

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
            except RpcError as error:
                uri = self.environment.master_uri
                raise ROSInitException(f"what answers at {uri} is no ROS master: {error}") from error
            else:
                return
        raise self.interrupted(f"shut down while waiting for the master at {self.environment.master_uri}")

    def _subscribe_parameters(self) -> None:
        """A master that has restarted: what was known of its parameters is old, and it has to be told again."""
        if self.node:
            keys, self.node.parameters = self.node.parameters, set()
            for key in keys:
                self.parameter_changed(key)

    def _start_clock(self) -> None:
        try:
            simulated = self.master.has_param("/use_sim_time") and self.master.get_param("/use_sim_time")
        except RpcError as error:
            raise ROSInitException(f"the master does not tell /use_sim_time: {error}") from error
        if simulated:
            clock = self.clock = SimulatedClock()
            from minirospy.client.time import follow_clock_topic

            self.when_ready(lambda: follow_clock_topic(clock))


def private_parameters(arguments: names.Arguments) -> dict[str, Any]:
    """The values of ``_param:=value``, read as YAML. Raises ROSInitException on what is none."""
    if arguments.wrong:
        raise ROSInitException(
            f"invalid command-line parameters: [{arguments.wrong[0]}] has more than one :="
        )
    if not arguments.parameters:
        return {}
    import yaml

    values = {}
    for key, text in arguments.parameters.items():
        try:
            values[key] = yaml.safe_load(text)
            serialize_call("setParam", (key, values[key]))
        except (yaml.YAMLError, RpcError) as error:
            why = " ".join(str(error).split())
            raise ROSInitException(f"invalid command-line parameters: [_{key}:={text}]: {why}") from error
    return values


def warn_of_illegal_name(name: str, stacklevel: int = 3) -> None:
    """Warn, as rospy does, of a name that is not one of the graph; the master refuses it later, or does not."""
    if not names.is_legal_name(name):
        warnings.warn(
            f"'{name}' is not a legal ROS graph resource name. This may cause problems with other ROS tools",
            stacklevel=stacklevel,
        )


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
        if issubclass(kind, KeyboardInterrupt) and process.insisted:
            raise SystemExit(0)
        self._before(kind, error, trace)


process = NodeProcess()
"""The node of this process."""
