"""A node: its servers, its registrations with the master, and what arrives for it.

Everything here runs on one event loop; a process may hold several nodes. The blocking API of
``minirospy.client`` stands in front of it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable
from typing import Any

from minirospy.environment import Environment
from minirospy.errors import MasterUnreachableError, RpcError, RpcRefused, RpcUnreachable
from minirospy.runtime import tcp
from minirospy.runtime.rpc_async import AsyncRpcClient
from minirospy.runtime.rpc_server import RpcServer
from minirospy.runtime.services import Handler, ServiceServer
from minirospy.runtime.slave import SlaveApi
from minirospy.runtime.topics import Deliver, Publication, Subscription
from minirospy.runtime.workers import Workers
from minirospy.wire.tcpros import InterfaceType

__all__ = ["Node"]

_log = logging.getLogger(__name__)
_FLUSH_SECONDS = 0.5
_UNREGISTER_SECONDS = 1.0


class Node:
    """A node of the computation graph, named globally (``/talker``).

    ``await start()`` opens its servers; ``advertise``, ``subscribe`` and ``serve`` register with the master
    and raise MasterUnreachableError or RpcRefused where that fails, with the topic or service in place all
    the same, so that a retry or a later registration finds it. Methods are called on the loop, unless they
    say otherwise.
    """

    def __init__(
        self,
        name: str,
        environment: Environment,
        *,
        on_shutdown: Callable[[str], None] | None = None,
        on_parameter: Callable[[str, Any], None] | None = None,
    ) -> None:
        """``on_shutdown(reason)`` and ``on_parameter(key, value)`` are called in a worker."""
        self.name = name
        self.environment = environment
        self.workers = Workers()
        self.publications: dict[str, Publication] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.services: dict[str, ServiceServer] = {}
        self.uri = ""
        self._on_shutdown = on_shutdown
        self._on_parameter = on_parameter
        self._rpc = AsyncRpcClient()
        self._server: RpcServer | None = None
        self._listener = tcp.Listener(self._accept)
        self._closed = False

    @property
    def tcpros_port(self) -> int:
        """The port where topics and services of this node are served."""
        return self._listener.port

    async def start(self, xmlrpc_port: int = 0, tcpros_port: int = 0) -> None:
        """Open the node's servers; port 0 takes a free one. Raises OSError."""
        host = self.environment.bind_host
        self._listener.open(host, tcpros_port)
        self._server = RpcServer(SlaveApi(self).dispatch, bind_host=host, port=xmlrpc_port)
        await self._server.start()
        self.uri = f"http://{self.environment.host}:{self._server.port}/"

    async def close(self) -> None:
        """Leave the graph: what is written goes out, the master is told, links end. Idempotent."""
        if self._closed:
            return
        self._closed = True
        links = [link for publication in self.publications.values() for link in publication.links]
        await asyncio.gather(
            asyncio.wait_for(self._unregister_all(), _UNREGISTER_SECONDS),
            *(link.drain(_FLUSH_SECONDS) for link in links),
            return_exceptions=True,
        )
        await self._listener.close()
        for table in (self.publications, self.subscriptions, self.services):
            for part in table.values():
                part.close()
        if self._server:
            await self._server.close()
        await self._rpc.close()

    async def master(self, method: str, *args: Any) -> Any:
        """Call the master as this node; the value of its answer.

        Raises MasterUnreachableError, or RpcRefused with the master's text.
        """
        uri = self.environment.master_uri
        try:
            answer = await self._rpc.call(uri, method, self.name, *args)
        except RpcUnreachable as error:
            raise MasterUnreachableError(uri) from error
        match answer:
            case [1, _, value]:
                return value
            case [int(code), str(text), *_]:
                raise RpcRefused(method, code, text)
            case _:
                raise RpcRefused(method, -1, f"the master answered {answer!r}")

    async def advertise(self, publication: Publication) -> None:
        """Publish a topic from now on. One publication a topic: a second is a ValueError."""
        if self.publications.setdefault(publication.topic, publication) is not publication:
            raise ValueError(f"{self.name} publishes {publication.topic} already")
        await self.master("registerPublisher", publication.topic, publication.type.name, self.uri)

    async def unadvertise(self, publication: Publication) -> None:
        """Stop publishing."""
        if self.publications.get(publication.topic) is publication:
            del self.publications[publication.topic]
            try:
                await self.master("unregisterPublisher", publication.topic, self.uri)
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
        """A :class:`Subscription` for this node, for :meth:`subscribe`."""
        return Subscription(
            topic,
            type_,
            self.name,
            deliver,
            rpc=self._rpc,
            workers=self.workers,
            newest=newest,
            tcp_nodelay=tcp_nodelay,
            on_loop=on_loop,
        )

    async def subscribe(self, subscription: Subscription) -> None:
        """Listen to a topic from now on. One subscription a topic: a second is a ValueError."""
        topic = subscription.topic
        if self.subscriptions.setdefault(topic, subscription) is not subscription:
            raise ValueError(f"{self.name} subscribes to {topic} already")
        uris = await self.master("registerSubscriber", topic, subscription.type.name, self.uri)
        subscription.publishers_changed(uris)

    async def unsubscribe(self, subscription: Subscription) -> None:
        """Stop listening."""
        if self.subscriptions.get(subscription.topic) is subscription:
            del self.subscriptions[subscription.topic]
            subscription.close()
            await self.master("unregisterSubscriber", subscription.topic, self.uri)

    def make_service(
        self, name: str, type_: InterfaceType, handler: Handler, *, request_type: str, response_type: str
    ) -> ServiceServer:
        """A :class:`ServiceServer` for this node, for :meth:`serve`."""
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
        """Offer a service from now on. One of a name: a second is a ValueError."""
        if self.services.setdefault(server.name, server) is not server:
            raise ValueError(f"service [{server.name}] already registered")
        await self.master("registerService", server.name, self.service_uri, self.uri)

    async def unserve(self, server: ServiceServer) -> None:
        """Stop offering a service; calls under way are ended."""
        if self.services.get(server.name) is server:
            del self.services[server.name]
            server.close()
            await self.master("unregisterService", server.name, self.service_uri)

    @property
    def service_uri(self) -> str:
        """Where this node's services are called: ``rosrpc://host:port``."""
        return f"rosrpc://{self.environment.host}:{self.tcpros_port}"

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """The master's list of a topic's publishers has come."""
        subscription = self.subscriptions.get(topic)
        if subscription:
            subscription.publishers_changed(uris)

    def parameter_changed(self, key: str, value: Any) -> None:
        """The master told of a parameter's new value."""
        if self._on_parameter:
            self.workers.start(self._on_parameter, key, value)

    def request_shutdown(self, reason: str) -> None:
        """Somebody outside asks this node to stop."""
        if self._on_shutdown:
            self.workers.start(self._on_shutdown, reason)

    async def _accept(self, sock: socket.socket, address: str) -> None:
        """A peer has connected: its header says which topic or service it wants."""
        fields = await tcp.receive_header(sock)
        if "service" in fields:
            server = self.services.get(fields["service"])
            if server:
                why = await server.accept(sock, fields)
            else:
                why = f"[{fields['service']}] is not a provided service"
        elif "topic" in fields:
            publication = self.publications.get(fields["topic"])
            if publication:
                why = await publication.accept(sock, fields, self.name, address)
            else:
                why = f"[{fields['topic']}] is not a published topic of {self.name}"
        else:
            why = "no topic or service name detected"
        if why:
            _log.warning("connection from %s refused: %s", fields.get("callerid", address), why)
            await tcp.send_header(sock, {"error": why})
            sock.close()

    async def _unregister_all(self) -> None:
        calls = [
            *(("unregisterPublisher", topic, self.uri) for topic in self.publications),
            *(("unregisterSubscriber", topic, self.uri) for topic in self.subscriptions),
            *(("unregisterService", name, self.service_uri) for name in self.services),
        ]
        with contextlib.suppress(MasterUnreachableError):
            for call in calls:
                # One that the master never accepted must not keep the others registered.
                with contextlib.suppress(RpcError):
                    await self.master(*call)
