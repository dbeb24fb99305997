"""A node in an event loop: its lifetime, and its topics, services, parameters and time."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import re
import sys
import time
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from types import TracebackType
from typing import Any, TypeVar

from minirospy.aio.log import RosoutHandler, TerminalHandler
from minirospy.aio.parameters import ParameterWatch
from minirospy.aio.raw import ANY_CLASS, RawSubscription, raw_class
from minirospy.aio.services import Service, ServiceClass, ServiceProxy
from minirospy.aio.time import Rate, SimulatedTime
from minirospy.aio.topics import PublishedTopic, Publisher, SubscribedTopic, Subscription
from minirospy.base import names
from minirospy.base.clock import SILENT_CLOCK
from minirospy.base.environment import Environment
from minirospy.base.errors import (
    MasterUnreachableError,
    ROSInitException,
    ROSInterruptException,
    RpcError,
    RpcFault,
    RpcRefused,
    ServiceException,
    WireError,
)
from minirospy.base.ros1_imports import prefer_ros1
from minirospy.base.times import Duration, Time
from minirospy.base.yaml_text import one_line, safe_load
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.node.node import Node as RuntimeNode
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.services import AsyncServiceClient, LoopServiceServer
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["Node"]

_M = TypeVar("_M", bound=Message)
_T = TypeVar("_T")
_Request = TypeVar("_Request", bound=Message)
_Response = TypeVar("_Response", bound=Message)
_POLL_SECONDS = 0.1
_PROBE_SECONDS = 5.0
# maximum log lines per ten seconds about refused registrations; a bridge may register thousands of topics
MAX_REGISTRATION_FAULTS = 5
_BILLION = 1_000_000_000
_REQUEST = re.compile(r"external shutdown request from \[.*?\]: \[(.+)\]$", re.DOTALL)
"""Matches the message that the Slave API logs when `shutdown` is called."""


class _Unspecified:
    """The type of the sentinel that means "no default given", because None is a valid default."""


_UNSPECIFIED = _Unspecified()


class Node:
    """A node in the computation graph, used as ``async with Node("name") as node:``.

    ``name`` has no namespace; ``anonymous`` appends a number to it. ``argv`` contains remappings, private parameters
    and special names as on a command line (pass ``sys.argv`` in a program that roslaunch starts; the default is empty,
    because a process may have several nodes). ``master_uri``, ``host`` and ``namespace`` replace ROS_MASTER_URI,
    ROS_HOSTNAME and ROS_NAMESPACE. With ``rosout``, log lines are published to /rosout. With ``simulated_time``, the
    node follows /clock if /use_sim_time is set. ``registration_fault_lines``: maximum number of log lines in ten
    seconds about registrations that the master refused.

    Entering the block waits for a master. Call all methods except :meth:`shutdown` in the event loop that entered it.
    Source: http://wiki.ros.org/Nodes.
    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str = "",
        anonymous: bool = False,
        argv: Sequence[str] = (),
        master_uri: str = "",
        host: str = "",
        rosout: bool = True,
        simulated_time: bool = True,
        registration_fault_lines: int = MAX_REGISTRATION_FAULTS,
    ) -> None:
        """Create the node. Raise ValueError if the name is empty or has a namespace."""
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names: give namespace=")

        self._arguments = names.parse_arguments(argv)
        special = self._arguments.special
        self._environment = Environment.read(
            master_uri=special.get("__master") or master_uri,
            host=special.get("__hostname") or special.get("__ip") or host,
            namespace=special.get("__ns") or namespace,
        )

        name = special.get("__name") or (names.anonymous_name(name) if anonymous else name)
        self.name = names.canonicalize(self._environment.namespace + "/" + name)
        self.log = logging.getLogger("rosout" + self.name.replace("/", "."))
        """The node's logger. It writes to the terminal, as rospy does, and to /rosout."""
        # Logs registrations that the master refused
        self.registration_faults = RateLimitedLogger(self.log, registration_fault_lines)

        # The reason for a shutdown that another process requested, for example the master because a new node has this name
        self.shutdown_request = ""

        self._remappings = self._arguments.resolved_remappings(self.name)
        self._rosout = rosout
        self._simulated_time = simulated_time
        self._handlers: list[logging.Handler] = []
        self._runtime: RuntimeNode | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopping = asyncio.Event()
        self._published: dict[str, PublishedTopic] = {}
        self._kept: dict[str, tuple[Publisher[Message], asyncio.Task[None]]] = {}
        self._served: set[str] = set()
        self._subscribed: dict[str, SubscribedTopic] = {}
        self._tasks: set[asyncio.Task[object]] = set()
        self._simulated: SimulatedTime | None = None
        self._is_started = False
        self._is_closed = False

    # --- lifetime

    async def __aenter__(self) -> Node:
        await self.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def start(self) -> None:
        """Open the node's servers and wait for a master; ``async with`` calls this on entry.

        Raise ROSInitException if the node cannot listen, or has been started before.
        """
        if self._runtime or self._is_closed:
            raise ROSInitException(f"node [{self.name}] has been started before: make another one")
        loop = asyncio.get_running_loop()
        if sys.platform == "win32" and isinstance(loop, asyncio.ProactorEventLoop):
            raise ROSInitException(
                "this event loop cannot watch sockets: use "
                "asyncio.run(main(), loop_factory=asyncio.SelectorEventLoop), or before Python 3.12 "
                "asyncio.set_event_loop_policy(asyncio.WindowsSelectorEventLoopPolicy())"
            )
        self._loop = loop
        self.parameters = ParameterWatch(self, loop)
        runtime = RuntimeNode(
            self.name,
            self._environment,
            on_shutdown=self.shutdown,
            on_parameter=self.parameters.changed_in_worker,
        )
        runtime.when_registered_again.append(self.parameters.forgotten_in_worker)

        try:
            await runtime.start()
        except OSError as error:
            raise ROSInitException(f"node [{self.name}] cannot listen: {error}") from error
        self._runtime = runtime
        try:
            self.start_logging()
            await self._wait_for_master()
            await self._set_private_parameters()
            if self._simulated_time or self._rosout:
                prefer_ros1()
            if self._simulated_time and await self.get_param("/use_sim_time", False):
                self._simulated = SimulatedTime(
                    self._stopping, on_silence=lambda: self.log.warning("%s", SILENT_CLOCK)
                )
                self._spawn(self._follow_clock(self._simulated))
            if self._rosout:
                self._start_rosout()
            self._is_started = True
        except BaseException:
            await self.close()
            raise

    def start_logging(self) -> None:
        """Print log lines on the terminal, unless the program has configured logging. :meth:`start` calls this."""
        if self.log.level == logging.NOTSET:
            self.log.setLevel(logging.INFO)
        # If the program has configured logging, its own handlers print the lines.
        if not self.log.hasHandlers():
            self._add_handler(TerminalHandler(self))

    async def close(self) -> None:
        """Leave the graph: close all topics and services, and unregister the node. Idempotent."""
        if self._is_closed:
            return
        self._is_closed = True
        self._stop()
        self.registration_faults.close()
        for handler in self._handlers:
            self.log.removeHandler(handler)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._runtime:
            servers = list(self._runtime.services.values())
            await self._runtime.close()
            for server in servers:
                if isinstance(server, LoopServiceServer):
                    await server.cancel()

    def shutdown(self, reason: object = "") -> None:
        """Ask the node to shut down: :meth:`spin` returns, loops over messages end, sleeps are interrupted. Thread-safe.

        The node leaves the graph at the end of its ``async with`` block. `rosnode kill` calls this too.
        """
        request = _REQUEST.match(str(reason))
        if request:
            self.shutdown_request = request[1]
        if self._loop:
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stop)

    @property
    def is_started(self) -> bool:
        """Return whether the node has connected to a master and joined the graph."""
        return self._is_started

    @property
    def simulated(self) -> bool:
        """Return whether the node follows /clock."""
        return self._simulated is not None

    @property
    def is_shutdown(self) -> bool:
        """Return whether the node is shutting down, or has shut down."""
        return self._stopping.is_set()

    async def spin(self) -> None:
        """Wait until the node is asked to shut down."""
        await self._stopping.wait()

    @property
    def uri(self) -> str:
        """The URI of this node's Slave API. Raise ROSInitException before the node has been started."""
        return self._node.uri

    def resolve(self, name: str) -> str:
        """Return ``name`` as a global name, resolved relative to this node."""
        return names.resolve(name, self.name, self._remappings)

    # --- topics

    def subscribe(self, topic: str, message_class: type[_M], *, queue_size: int = 10) -> Subscription[_M]:
        """Subscribe to ``topic``; iterate over the result with ``async for`` to receive the messages.

        While the program is busy, the newest ``queue_size`` messages are queued; older ones are dropped and counted
        (``dropped``). The subscription starts immediately, in the background; ``await node.subscribe(...)`` waits until
        it is registered with the master. It is closed by :meth:`Subscription.close`, or when it is garbage-collected.
        Raise ValueError if ``queue_size`` is below 1.
        """
        if queue_size < 1:
            raise ValueError(f"queue_size is {queue_size}: a subscription keeps at least one message")
        resolved = self.resolve(topic)
        state = self._subscribed.get(resolved)
        if state is None:
            state = self._subscribed[resolved] = SubscribedTopic(self, resolved, message_class)
        return Subscription(self, state, message_class, queue_size)

    def subscribe_raw(
        self,
        topic: str,
        deliver: Callable[[Frame, Header], object],
        *,
        type_: InterfaceType | None = None,
        on_change: Callable[[], object] | None = None,
    ) -> RawSubscription:
        """Subscribe to ``topic`` and receive its messages as bytes. Without ``type_``, accept any type.

        ``deliver(data, header)``, with the publisher's connection header, is called on the loop; so is ``on_change``,
        when a publisher has connected. Both must return quickly. ``deliver`` may keep the data. ``await
        node.subscribe_raw(...)`` waits until the subscription is registered with the master.
        """
        resolved = self.resolve(topic)
        state = self._subscribed.get(resolved)
        if state is None:
            message_class = ANY_CLASS if type_ is None else raw_class(type_)
            state = self._subscribed[resolved] = SubscribedTopic(self, resolved, message_class)
        return RawSubscription(state, deliver, on_change)

    async def wait_for_message(self, topic: str, message_class: type[_M], timeout: float | None = None) -> _M:
        """Return the next message on ``topic``.

        Raise TimeoutError after ``timeout`` seconds, ROSInterruptException if the node shuts down first.
        """
        async with self.subscribe(topic, message_class, queue_size=1) as subscription:
            return await subscription.next(timeout)

    def advertise(
        self,
        topic: str,
        message_class: type[_M],
        *,
        queue_size: int | None = 10,
        latch: bool = False,
        headers: Mapping[str, str] | None = None,
        tcp_nodelay: bool = False,
        on_change: Callable[[], object] | None = None,
    ) -> Publisher[_M]:
        """Return a publisher for ``topic``. ``await node.advertise(...)`` waits until it is registered with the master.

        ``queue_size``: maximum number of messages queued for a slow subscriber; beyond that the oldest is dropped (0:
        no limit; None: ``publish`` itself waits until all are written). ``latch``: a subscriber that connects later
        receives the last message. ``headers``: fields for the connection header. ``on_change`` is called on the loop
        when a subscriber has connected or disconnected. Raise ValueError if this node already publishes the topic with
        another type.
        """
        resolved = self.resolve(topic)
        state = self._published.get(resolved)
        if state is None:
            publication = Publication(
                resolved,
                InterfaceType.of(message_class),
                queue_size=queue_size or 0,
                latch=latch,
                headers=headers,
                tcp_nodelay=tcp_nodelay,
                on_link=lambda *_: state.links_changed() if state else None,
            )
            state = self._published[resolved] = PublishedTopic(self, publication, message_class)
        elif state.publication.type.md5sum != message_class._md5sum:
            raise ValueError(f"{self.name} publishes {resolved} as {state.publication.type.name} already")
        state.publication.latch = state.publication.latch or latch
        if on_change is not None:
            state.on_change.append(on_change)
        return Publisher(self, state, message_class, waits=queue_size is None)

    async def publish(self, topic: str, message: Message) -> None:
        """Publish one message; the topic stays advertised.

        Before the first message on a topic, wait up to a second for subscribers to connect: those registered with the master.
        """
        resolved = self.resolve(topic)
        kept = self._kept.get(resolved)
        if kept is None:
            publisher: Publisher[Message] = self.advertise(resolved, type(message))
            kept = self._kept[resolved] = (publisher, self._spawn(publisher.wait_for_expected()))
        publisher, expected = kept
        # Concurrent calls that publish on the topic also wait here.
        await asyncio.wait([expected])
        await publisher.publish(message)

    # --- services

    async def call(
        self, service: str, service_class: ServiceClass[Message, _Response], *args: object, **kwds: object
    ) -> _Response:
        """Call a service, with a request or its fields, and return its response.

        Raise ServiceException if the call fails, TypeError or AttributeError if the arguments do not
        match the request, SerializationError if a value does not. Cancelling the call closes its connection.
        """
        return await self.service_proxy(service, service_class)(*args, **kwds)

    def service_proxy(
        self,
        service: str,
        service_class: ServiceClass[Message, _Response],
        *,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
    ) -> ServiceProxy[_Response]:
        """Return a function for repeated calls: ``await proxy(...)``. ``persistent`` keeps one connection for all calls."""
        return ServiceProxy(self, self.resolve(service), service_class, persistent, headers)

    def serve(
        self,
        service: str,
        service_class: ServiceClass[_Request, _Response],
        handler: Callable[[_Request], Awaitable[object]] | Callable[[_Request], object],
    ) -> Service:
        """Offer a service. ``await node.serve(...)`` waits until it is registered with the master.

        ``handler(request)`` returns a response, a dictionary of some of its fields, a list or tuple of all
        its field values, or the value of its only field. An ``async def`` handler runs as a task on the loop, any
        other in a worker thread. If the handler raises, the client's call fails with that error.
        Raise ServiceException if this node already offers the service.
        """
        resolved = self.resolve(service)
        if resolved in self._served:
            raise ServiceException(f"service [{resolved}] already registered")
        return Service(self, resolved, service_class, handler)

    async def wait_for_service(self, service: str, timeout: float | None = None) -> None:
        """Wait until a service is registered and responds.

        Raise TimeoutError after ``timeout`` seconds, ROSInterruptException if the node shuts down first.
        """
        name = self.resolve(service)
        try:
            await asyncio.wait_for(self._wait_for_service(name), timeout)
        except asyncio.TimeoutError:
            raise TimeoutError(f"timeout exceeded while waiting for service {name}") from None

    # --- parameters

    async def get_param(self, name: str, default: object = _UNSPECIFIED) -> Any:
        """Return a parameter's value, or ``default`` if it is not set.

        Raise KeyError if the parameter is not set and there is no default, MasterUnreachableError if the master does not
        respond.
        """
        try:
            return await self._node.master("getParam", self.resolve(name))
        except RpcRefused as error:
            if default is _UNSPECIFIED:
                raise KeyError(name) from error
            return default

    async def set_param(self, name: str, value: object) -> None:
        """Set a parameter; a dictionary sets a whole namespace. Raise RpcError if XML-RPC has no type for the value."""
        await self._node.master("setParam", self.resolve(name), value)

    async def has_param(self, name: str) -> bool:
        """Return whether a parameter or a namespace with that name is set."""
        return bool(await self._node.master("hasParam", self.resolve(name)))

    async def delete_param(self, name: str) -> None:
        """Delete a parameter, or a whole namespace. Raise KeyError if it is not set."""
        try:
            await self._node.master("deleteParam", self.resolve(name))
        except RpcRefused as error:
            raise KeyError(name) from error

    async def search_param(self, name: str) -> str | None:
        """Search for a parameter from this node's namespace upwards; return the full name of the first match, or None."""
        try:
            return str(await self._node.master("searchParam", name))
        except RpcRefused:
            return None

    async def get_param_names(self) -> list[str]:
        """Return the names of all parameters."""
        return list(await self._node.master("getParamNames"))

    # --- master and loop

    @property
    def master_uri(self) -> str:
        """The URI of the node's master."""
        return self._environment.master_uri

    async def call_master(self, method: str, *arguments: object) -> Any:
        """Call a method of the Master API as this node and return the value of the response.

        Raise MasterUnreachableError if the master does not respond, RpcRefused with its message if it refuses the call,
        or another RpcError if the call fails. Source: http://wiki.ros.org/ROS/Master_API.
        """
        return await self._node.master(method, *arguments)

    def run_threadsafe(self, work: Coroutine[object, object, _T]) -> concurrent.futures.Future[_T]:
        """Start a coroutine on the node's loop from another thread; return its future.

        Raise ROSInitException before the node has been started.
        """
        if self._loop is None:
            work.close()
            raise ROSInitException(f"node [{self.name}] has not been started: use it inside `async with`")
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    # --- time

    def now(self) -> Time:
        """Return the current time: system time or, if /use_sim_time is set, simulated time (zero until the first /clock)."""
        now = self._simulated.now if self._simulated else time.time_ns()
        return Time(*divmod(now, _BILLION))

    async def sleep(self, duration: float | Duration) -> None:
        """Sleep for ``duration`` seconds of the node's time.

        Raise ROSInterruptException if the node shuts down during the sleep, ROSTimeMovedBackwardsException if
        simulated time jumps back.
        """
        seconds = duration.to_sec() if isinstance(duration, Duration) else duration
        if self._simulated:
            await self._simulated.sleep(int(seconds * 1e9))
        else:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), max(0.0, seconds))
        if self.is_shutdown:
            raise ROSInterruptException("ROS shutdown request")

    def rate(self, hz: float) -> Rate:
        """Return a rate. ``async for _ in node.rate(10): ...`` iterates ten times per second, until the node shuts down."""
        return Rate(self, hz)

    # --- internals

    @property
    def _node(self) -> RuntimeNode:
        if self._runtime is None:
            raise ROSInitException(f"node [{self.name}] has not been started: use it inside `async with`")
        return self._runtime

    def _stop(self) -> None:
        self._stopping.set()
        for state in self._subscribed.values():
            state.end()
        for published in self._published.values():
            published.links_changed()

    def _spawn(self, work: Coroutine[object, object, _T]) -> asyncio.Task[_T]:
        """Start a task that is cancelled when the node closes."""
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def _later(self, work: Callable[[], Coroutine[object, object, None]]) -> None:
        """Run ``work`` on the loop, from any thread. Do nothing if the node is closed."""
        if self._loop and not self._is_closed:
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(lambda: None if self._is_closed else self._spawn(work()))

    async def _wait_for_master(self) -> None:
        is_reported = False
        while True:
            try:
                await self._node.master("getPid")
            except MasterUnreachableError as error:
                if not is_reported:
                    self.log.warning("%s. Will keep trying.", error)
                    is_reported = True
                await self.sleep(0.25)
            except RpcFault:
                return  # some masters, such as @foxglove/ros1's, do not support this call
            else:
                return

    async def _set_private_parameters(self) -> None:
        if not self._arguments.parameters:
            return
        import yaml

        for key, text in self._arguments.parameters.items():
            try:
                value = safe_load(text)
            except yaml.YAMLError as error:
                why = one_line(error)
                raise ROSInitException(f"invalid command-line parameters: [_{key}:={text}]: {why}") from error
            await self.set_param("~" + key, value)

    async def _follow_clock(self, simulated: SimulatedTime) -> None:
        from rosgraph_msgs.msg import Clock

        async for message in self.subscribe("/clock", Clock, queue_size=1):
            simulated.set(message.clock.to_nsec())

    def _start_rosout(self) -> None:
        from rosgraph_msgs.msg import Log

        self._add_handler(
            RosoutHandler(self, self.advertise("/rosout", Log, queue_size=100, latch=True), Log)
        )

    def _add_handler(self, handler: logging.Handler) -> None:
        self._handlers.append(handler)
        self.log.addHandler(handler)

    async def _wait_for_service(self, name: str) -> None:
        is_reported = False
        while not self.is_shutdown:
            try:
                uri = await self._node.master("lookupService", name)
                client = await AsyncServiceClient.connect(
                    uri,
                    name,
                    ANY,
                    self.name,
                    probe=True,
                    timeout=_PROBE_SECONDS,
                    same_host=self._node.environment.same_host,
                )
            except (RpcError, MasterUnreachableError):
                pass
            except (OSError, WireError):
                if not is_reported:
                    self.log.warning("wait_for_service(%s): failed to contact, will keep trying", name)
                    is_reported = True
            else:
                client.close()
                return

            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), _POLL_SECONDS)

        raise ROSInterruptException("rospy shutdown")
