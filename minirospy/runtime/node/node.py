"""A node: its servers, its registrations with the master, and the connections of its peers.

Everything here runs on one event loop; a process may hold several nodes. ``minirospy.client`` is the blocking
API in front of it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias
from weakref import WeakValueDictionary

from minirospy.environment import Environment
from minirospy.errors import (
    MasterUnreachableError,
    RpcError,
    RpcFault,
    RpcProtocolError,
    RpcRefused,
    RpcUnreachable,
    WireError,
)
from minirospy.runtime.node.services import Handler, ServiceServer
from minirospy.runtime.node.slave import SlaveApi
from minirospy.runtime.node.topics import Deliver, Publication, Subscription
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.master_proxy import master_unreachable, unwrap
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport import local, tcp
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.links import ReaderSet
from minirospy.runtime.transport.workers import InOrder, Workers
from minirospy.wire.tcpros import InterfaceType

__all__ = ["Node"]

_log = logging.getLogger(__name__)
_FLUSH_SECONDS = 0.5
_CALL_SECONDS = 30.0
"""How long a call of the master may take: one of many nodes that start at once on a small computer waits for its turn."""

_LOOK_SECONDS = 5.0
"""How long the master may take to answer whether it knows this node: it is asked again soon."""

_SILENT_SECONDS, _STILL_SILENT_SECONDS = 10.0, 2.0
"""A closing node gives up on a master that answers nothing for this long; the shorter limit is for one that was already
silent before. There is no limit on the whole: a busy master that answers call after call is waited for."""

_CLOSING_CALL_SECONDS = 3600.0
_PROBE_SECONDS = 3.0
"""How often a closing node checks that the master answers anything."""

_NOTICE_SECONDS = 3.0
"""A node that is still waiting for the master after this says so."""

_CALLS_AT_ONCE = 100
"""Unregistrations in one system.multicall."""

_MOST_IDLE = 200
"""Idle connections to the Slave API; a graph has about as many as this node has peers."""

_STALE_SECONDS = 5.0
"""How long a master may still send a list of publishers to a node that has unsubscribed."""

_REQUEST_AGAIN_SECONDS = 0.5

_Part: TypeAlias = Publication | Subscription | ServiceServer
_Key: TypeAlias = tuple[str, str]
"""The kind of a part, as in the names of the master's calls ("Publisher"), and its topic or name."""
_Call: TypeAlias = tuple[str, tuple[Any, ...]]
"""A method of the Master API, and its arguments after the caller's name."""


class Node:
    """A node of the computation graph, named globally (``/talker``).

    ``await start()`` opens its servers; ``advertise``, ``subscribe`` and ``serve`` register with the master
    and raise MasterUnreachableError or RpcRefused where that fails, with the topic or service in place all
    the same: it is registered later. Methods are called on the loop, unless they say otherwise.
    """

    def __init__(
        self,
        name: str,
        environment: Environment,
        *,
        on_shutdown: Callable[[str], None] | None = None,
        on_parameter: Callable[[str, Any], None] | None = None,
        watch_seconds: float = 2.0,
    ) -> None:
        """``on_shutdown(reason)`` and ``on_parameter(key, value)`` are called in a worker.

        Every ``watch_seconds`` the node checks whether the master still knows it.
        """
        self.name = name
        self.environment = environment
        self.workers = Workers()
        self.publications: dict[str, Publication] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.services: dict[str, ServiceServer] = {}
        self.parameters: set[str] = set()
        """The parameters that this node has subscribed to at the master; the caller that subscribes adds them."""

        self._tables: Mapping[str, dict[str, Any]] = {
            "Publisher": self.publications,
            "Subscriber": self.subscriptions,
            "Service": self.services,
        }
        self._known: dict[_Key, _Part | None] = {}
        """What is registered with the master; None where a call failed, or has no answer yet."""
        self._turns: WeakValueDictionary[_Key, asyncio.Lock] = WeakValueDictionary()
        self._registering: set[asyncio.Task[None]] = set()
        self._left: dict[str, asyncio.TimerHandle] = {}
        """Topics with a subscription that has ended recently."""
        self._requesting: dict[str, asyncio.TimerHandle] = {}
        """Topics whose publishers are to be requested from the master again."""

        self.uri = ""
        self._on_shutdown = on_shutdown
        self._on_parameter = on_parameter
        self._parameter_updates = InOrder(self.workers)
        self._watch_seconds = watch_seconds
        self.when_registered_again: list[Callable[[], object]] = []
        """Called in workers when the master had forgotten this node: to register what else it needs."""

        self._readers = ReaderSet()
        self._rpc = AsyncRpcClient(same_host=environment.same_host)
        self._server: RpcServer | None = None
        self._access = Access.parse(environment.allow) if environment.allow else None
        self._listener = tcp.Listener(self._accept, self._access.allows if self._access else None)
        self._unix_listener = tcp.Listener(self._accept)
        self.this_host = ""
        """The value of :func:`local.this_host`, where this node uses Unix sockets too."""
        self.unix_name = ""
        """Where topics are served to processes of this machine; "" where they are not."""

        self._watching: asyncio.Task[None] | None = None
        self._is_master_silent = False
        self._answered = 0.0
        """When the master answered last, in seconds of the loop's clock."""
        self._closed = False
        self._unregistering: asyncio.Task[None] | None = None

    @property
    def tcpros_port(self) -> int:
        """The port where topics and services of this node are served."""
        return self._listener.port

    @property
    def is_sending(self) -> bool:
        """Whether a thread is publishing, and holds a lock. From any thread."""
        return any(publication.is_sending for publication in list(self.publications.values()))

    async def start(self, xmlrpc_port: int = 0, tcpros_port: int = 0) -> None:
        """Open the node's servers; port 0 takes a free one. Raises OSError."""
        host = self.environment.bind_host
        ports = self.environment.ports
        self._listener.open(host, tcpros_port, ports)
        if self.environment.same_host:
            self._open_unix_listener()

        self._server = RpcServer(
            SlaveApi(self).dispatch,
            bind_host=host,
            port=xmlrpc_port,
            ports=ports,
            most_idle=_MOST_IDLE,
            access=self._access,
            known_as=(self.environment.uri_host,) if self.environment.same_host else (),
        )
        try:
            await self._server.start()
        except BaseException:
            await self.close()
            raise

        self.uri = f"http://{self.environment.uri_host}:{self._server.port}/"
        self._watching = asyncio.ensure_future(self._watch_master())
        if host in {"127.0.0.1", "::1"} and not _is_loopback(self.environment.master_address[0]):
            # Resolving a name may wait for a server.
            await asyncio.get_running_loop().run_in_executor(None, self._check_own_address)

    async def close(self, *, announces: bool = True) -> None:
        """Leave the graph: unregister from the master, flush the links, close everything. Idempotent.

        Takes as long as the master answers. One that refuses connections is not waited for; one that answers nothing is
        given up after ``_SILENT_SECONDS``, or when :meth:`stop_unregistering` is called, and keeps the registrations that
        it has. ``announces``: whether a line is logged when it takes long.
        """
        if self._closed:
            return
        self._closed = True
        self._unregistering = asyncio.ensure_future(self._unregister_all(announces=announces))
        # Its first call is sent before anything else is done.
        await asyncio.sleep(0)

        watching = [self._watching] if self._watching else []
        for task in watching:
            task.cancel()
        for timer in [*self._left.values(), *self._requesting.values()]:
            timer.cancel()
        links = [link for publication in self.publications.values() for link in publication.links]
        await asyncio.gather(
            self._unregistering,
            *(link.drain(_FLUSH_SECONDS) for link in links),
            *watching,
            return_exceptions=True,
        )

        # Its name goes before the port, which the next server takes with a name of its own.
        await self._unix_listener.close()
        await self._listener.close()
        for table in (self.publications, self.subscriptions, self.services):
            for part in table.values():
                part.close()
        if self._server:
            await self._server.close()
        await self._rpc.close()

        # Calls that the master has not answered.
        for task in self._registering:
            task.cancel()
        await asyncio.gather(*self._registering, return_exceptions=True)

    def stop_unregistering(self) -> None:
        """Let :meth:`close` return although the master has not answered (on the loop)."""
        if self._unregistering:
            self._unregistering.cancel()

    async def master(self, method: str, *args: Any) -> Any:
        """Call the master as this node; the value of its answer.

        Raises MasterUnreachableError, or RpcRefused with the master's text.
        """
        return unwrap(method, await self._call_master(method, self.name, *args))

    async def _call_master(self, method: str, *args: Any) -> Any:
        """Call any method of the master. Raises MasterUnreachableError, RpcError."""
        uri = self.environment.master_uri
        # Of a node that closes _wait_for_answers() decides.
        seconds = _CLOSING_CALL_SECONDS if self._closed else _CALL_SECONDS
        try:
            answer = await self._rpc.call(uri, method, *args, timeout=seconds)
        except RpcUnreachable as error:
            self._is_master_silent = True
            raise master_unreachable(error) from error
        self._is_master_silent = False
        self._answered = asyncio.get_running_loop().time()
        return answer

    async def _look(self, method: str, name: str) -> None:
        """Look up this node, or one of its services. Raises MasterUnreachableError, RpcError."""
        try:
            await asyncio.wait_for(self.master(method, name), _LOOK_SECONDS)
        except asyncio.TimeoutError as error:
            self._is_master_silent = True
            raise MasterUnreachableError(self.environment.master_uri) from error
        if self._closed:
            # asyncio.wait_for before Python 3.12 may lose the cancelling that came with the answer.
            raise asyncio.CancelledError

    async def advertise(self, publication: Publication) -> None:
        """Publish a topic. One publication a topic: a second is a ValueError."""
        if self.publications.setdefault(publication.topic, publication) is not publication:
            raise ValueError(f"{self.name} publishes {publication.topic} already")
        await self._update(("Publisher", publication.topic))

    async def unadvertise(self, publication: Publication) -> None:
        """Stop publishing a topic."""
        if self.publications.get(publication.topic) is publication:
            del self.publications[publication.topic]
            try:
                await self._update(("Publisher", publication.topic))
            finally:
                publication.close()

    def make_subscription(
        self,
        topic: str,
        type_: InterfaceType,
        deliver: Deliver,
        *,
        newest: int = 0,
        tcp_nodelay: bool = False,
        on_loop: bool = False,
    ) -> Subscription:
        """Return a :class:`Subscription` for this node, for :meth:`subscribe`."""
        return Subscription(
            topic,
            type_,
            self.name,
            deliver,
            rpc=self._rpc,
            workers=self.workers,
            readers=self._readers,
            newest=newest,
            tcp_nodelay=tcp_nodelay,
            on_loop=on_loop,
            this_host=self.this_host,
        )

    async def subscribe(self, subscription: Subscription) -> None:
        """Subscribe to a topic. One subscription a topic: a second is a ValueError."""
        topic = subscription.topic
        if self.subscriptions.setdefault(topic, subscription) is not subscription:
            raise ValueError(f"{self.name} subscribes to {topic} already")
        await self._update(("Subscriber", topic))

    async def unsubscribe(self, subscription: Subscription) -> None:
        """Unsubscribe from a topic."""
        topic = subscription.topic
        if self.subscriptions.get(topic) is subscription:
            del self.subscriptions[topic]
            subscription.close()
            if topic in self._left:
                self._left[topic].cancel()
            loop = asyncio.get_running_loop()
            self._left[topic] = loop.call_later(_STALE_SECONDS, self._left.pop, topic)
            await self._update(("Subscriber", topic))

    def make_service(
        self, name: str, type_: InterfaceType, handler: Handler, *, request_type: str, response_type: str
    ) -> ServiceServer:
        """Return a :class:`ServiceServer` for this node, for :meth:`serve`."""
        return ServiceServer(
            name,
            type_,
            self.name,
            handler,
            request_type=request_type,
            response_type=response_type,
            workers=self.workers,
        )

    async def serve(self, server: ServiceServer) -> None:
        """Offer a service. One of a name: a second is a ValueError."""
        if self.services.setdefault(server.name, server) is not server:
            raise ValueError(f"service [{server.name}] already registered")
        await self._update(("Service", server.name))

    async def unserve(self, server: ServiceServer) -> None:
        """Stop offering a service; calls under way are ended."""
        if self.services.get(server.name) is server:
            del self.services[server.name]
            server.close()
            await self._update(("Service", server.name))

    @property
    def service_uri(self) -> str:
        """Where this node's services are called: ``rosrpc://host:port``."""
        return f"rosrpc://{self.environment.uri_host}:{self.tcpros_port}"

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Take over the master's list of a topic's publishers."""
        subscription = self.subscriptions.get(topic)
        if subscription:
            subscription.publishers_changed(uris)
            if topic in self._left and topic not in self._requesting:
                # It may have been meant for the subscription before: rosmaster's lists wait in a queue.
                loop = asyncio.get_running_loop()
                self._requesting[topic] = loop.call_later(_REQUEST_AGAIN_SECONDS, self._request_again, topic)

    def parameter_changed(self, key: str, value: Any) -> None:
        """Pass on a parameter's new value, of which the master has notified this node."""
        if self._on_parameter:
            self._parameter_updates.start(self._on_parameter, key, value)

    def request_shutdown(self, reason: str) -> None:
        """Stop on the request of another process."""
        if self._on_shutdown:
            self.workers.start(self._on_shutdown, reason)

    def _request_again(self, topic: str) -> None:
        del self._requesting[topic]
        key = ("Subscriber", topic)
        if self._known.get(key):
            self._known[key] = None
            self._start_registering(key)

    async def _accept(self, sock: socket.socket, address: str) -> None:
        """Serve a peer that has connected: its header names a topic or service."""
        try:
            fields = await tcp.receive_header(sock)
        except (OSError, WireError):
            if not self._closed:
                raise
            sock.close()  # the master has notified the peer that this node leaves
            return

        if "service" in fields:
            server = self.services.get(fields["service"])
            if server:
                why = await server.accept(sock, fields)
            else:
                why = f"[{self.name}] is not a provider of  [{fields['service']}]"
        elif "topic" in fields:
            publication = self.publications.get(fields["topic"])
            if publication:
                why = publication.accept(sock, fields, self.name, address)
            else:
                topics = [[each.topic, each.type.name] for each in self.publications.values()]
                why = f"[{self.name}] is not a publisher of [{fields['topic']}]. Topics are {topics}"
        else:
            why = "no topic or service name detected"

        if why:
            self._listener.log_refusal(f"Could not process inbound connection: {why}{fields}")
            await tcp.send_header(sock, {"error": why})
            sock.close()

    def _open_unix_listener(self) -> None:
        """Serve topics and services by a Unix socket too, where there are such sockets."""
        sock = local.bind(self.environment.uri_host, self.tcpros_port)
        if sock:
            self.this_host = local.this_host()
            self.unix_name = local.name_of(self.environment.uri_host, self.tcpros_port)
            self._unix_listener.listen(sock)

    def _check_own_address(self) -> None:
        environment = self.environment
        if not environment.master_is_local:
            _log.warning(
                "this node is registered at '%s', but the master is on another machine (%s): set ROS_IP "
                "to the address by which that one reaches this one",
                environment.host,
                environment.master_uri,
            )

    async def _update(self, key: _Key, *, again: bool = False) -> None:
        """Register what this node has of one name, a part or nothing, where the master does not know it.

        One call after the other for each name, and none is cancelled half way: a registration could overtake the
        unregistration before it, which would undo it, or the shutdown of the node could overtake a registration.
        """
        task = self._start_registering(key, again=again)
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            if not task.cancelled():
                raise
            # close() has given up.
            raise MasterUnreachableError(self.environment.master_uri) from error

    def _start_registering(self, key: _Key, *, again: bool = False) -> asyncio.Task[None]:
        task = asyncio.ensure_future(self._register_in_turn(key, again=again))
        self._registering.add(task)
        task.add_done_callback(self._has_registered)
        return task

    def _has_registered(self, task: asyncio.Task[None]) -> None:
        self._registering.discard(task)
        if not task.cancelled():
            # A caller that waits gets its error; nobody has to, since it is tried again.
            task.exception()

    async def _register_in_turn(self, key: _Key, *, again: bool) -> None:
        async with self._turns.setdefault(key, asyncio.Lock()):
            part = self._wanted(key)
            if part is not None and self._known.get(key) is not part:
                self._known[key] = None
                await self._register(part, again=again)
                self._known[key] = part
            elif part is None and key in self._known:
                self._known[key] = None
                method, args = self._unregistration(key)
                await self.master(method, *args)
                # A check of a master that has restarted may have come first.
                self._known.pop(key, None)

    def _wanted(self, key: _Key) -> _Part | None:
        """Return what is to be registered for one name."""
        kind, name = key
        return None if self._closed else self._tables[kind].get(name)

    def _unregistration(self, key: _Key) -> _Call:
        kind, name = key
        return f"unregister{kind}", (name, self.service_uri if kind == "Service" else self.uri)

    async def _register(self, part: _Part, *, again: bool) -> None:
        if isinstance(part, Publication):
            subscribers = await self.master("registerPublisher", part.topic, part.type.name, self.uri)
            part.expected = len(subscribers)
        elif isinstance(part, Subscription):
            uris = await self._register_subscription(part)
            (part.registered_again if again else part.publishers_changed)(uris)
        else:
            await self.master("registerService", part.name, self.service_uri, self.uri)

    async def _register_subscription(self, subscription: Subscription) -> list[str]:
        """Register a subscription; return its publishers.

        A publisherUpdate comes by another connection, and may overtake the answer, which is then the older list.
        Where one came, the call is made again.
        """
        while True:
            lists = subscription.lists
            uris: list[str] = await self.master(
                "registerSubscriber", subscription.topic, subscription.type.name, self.uri
            )
            is_wanted = self._wanted(("Subscriber", subscription.topic)) is subscription
            if subscription.lists == lists or not is_wanted:
                return uris

    async def _watch_master(self) -> None:
        """Notice a master that has restarted and forgotten this node, and register again.

        It looks up a service of this node, or else its name, which the master may know again by a topic that is newer
        than the restart. The master's process id says nothing in a container, where each has the same, nor about a
        master that kept its tables.
        """
        failures = 0
        while not self._closed:
            await asyncio.sleep(self._watch_seconds)
            if not (self._known or any(self._tables.values())):
                continue

            known = [key for key, part in self._known.items() if part]
            asked = next((key for key in known if key[0] == "Service"), known[0] if known else None)
            has_forgotten = False
            try:
                if asked and asked[0] == "Service":
                    await self._look("lookupService", asked[1])
                else:
                    await self._look("lookupNode", self.name)
            except MasterUnreachableError as error:
                failures += 1
                if failures == 2:
                    _log.warning("%s. What is connected goes on; will keep trying.", error)
                continue
            except RpcRefused:
                # What was unregistered meanwhile is unknown for good reason.
                has_forgotten = asked is not None and self._known.get(asked) is not None
            except RpcError as error:
                _log.debug("looking up this node: %s", error)
                continue

            failures = 0
            if has_forgotten:
                self._known.clear()
            with contextlib.suppress(MasterUnreachableError):
                await self._register_all(again=has_forgotten)
            if has_forgotten and any(self._known.values()):
                _log.warning("the master at %s has restarted: registered again", self.environment.master_uri)
                for function in self.when_registered_again:
                    self.workers.start(function)
            elif has_forgotten:
                # Once: this master does not count as one that knows this node any more.
                _log.warning("the master does not know this node, and refuses to")

    async def _register_all(self, *, again: bool = False) -> None:
        """Register all that the master does not know. Raises MasterUnreachableError."""
        keys = [(kind, name) for kind, table in self._tables.items() for name in table]
        for key in dict.fromkeys([*keys, *self._known]):
            # One that the master never accepts must not block the others.
            try:
                await self._update(key, again=again)
            except RpcError as error:
                _log.debug("registering %s: %s", key, error)

    async def _unregister_all(self, *, announces: bool) -> None:
        """Unregister everything that the master has of this node, in as few calls as it allows."""
        # A name with a call under way comes after that call, which would undo its unregistration.
        under_way = {key for key, turn in self._turns.items() if turn.locked()}
        calls = [self._unregistration(key) for key in self._known if key not in under_way]
        calls += [("unsubscribeParam", (self.uri, parameter)) for parameter in self.parameters]
        for key in self._known.keys() - under_way:
            del self._known[key]

        tasks = [asyncio.ensure_future(self._call_all(calls))]
        tasks += [asyncio.ensure_future(self._update(key)) for key in under_way]
        try:
            await self._wait_for_answers(tasks, announces=announces)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _wait_for_answers(self, tasks: Sequence[asyncio.Task[None]], *, announces: bool) -> None:
        """Wait for the last calls of the master, for as long as it answers anything.

        Of many nodes that shut down at once each waits for its turn: a short call, which a busy master answers in between,
        shows that it is alive.
        """
        loop = asyncio.get_running_loop()
        uri = self.environment.master_uri
        patience = _STILL_SILENT_SECONDS if self._is_master_silent else _SILENT_SECONDS
        text = "waiting for the master at %s to unregister this node; it is given up when it answers nothing for %g s"
        notice = loop.call_later(_NOTICE_SECONDS, _log.warning, text, uri, patience) if announces else None

        self._answered = loop.time()
        pending = set(tasks)
        probe: asyncio.Task[None] | None = None
        try:
            while pending and (left := self._answered + patience - loop.time()) > 0:
                done, pending = await asyncio.wait(
                    pending, timeout=min(left, _PROBE_SECONDS), return_when=asyncio.FIRST_EXCEPTION
                )
                if any(isinstance(task.exception(), MasterUnreachableError) for task in done):
                    break
                if pending and (probe is None or probe.done()):
                    probe = asyncio.ensure_future(self._probe_master())
        finally:
            for waiting in (notice, probe):
                if waiting:
                    waiting.cancel()

    async def _probe_master(self) -> None:
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._call_master("getPid", self.name)

    async def _call_all(self, calls: Sequence[_Call]) -> None:
        """Make all calls, whatever is answered; many in one where the master has system.multicall (not all masters do).

        Raises MasterUnreachableError.
        """
        for start in range(0, len(calls), _CALLS_AT_ONCE):
            part = calls[start : start + _CALLS_AT_ONCE]
            batch = [{"methodName": method, "params": [self.name, *args]} for method, args in part]
            answers: Any = None
            if len(part) > 1:
                with contextlib.suppress(RpcFault, RpcProtocolError):
                    answers = await self._call_master("system.multicall", batch)
            if not isinstance(answers, list) or len(answers) != len(part):
                answers = [None] * len(part)
            for (method, args), answer in zip(part, answers, strict=True):
                # What the master has not answered as one of many, such as a fault for a batch that is too long.
                if not isinstance(answer, list):
                    with contextlib.suppress(RpcFault, RpcProtocolError, RpcRefused):
                        await self.master(method, *args)


def _is_loopback(host: str) -> bool:
    return host in {"localhost", "::1"} or host.startswith("127.")
