"""A node: its servers, its registrations with the master, and its connections to peers.

Everything here runs on one event loop; a process may have several nodes. ``minirospy.client`` is the blocking
API for it.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Mapping
from typing import Any

from minirospy.base.closing import close_all, close_each
from minirospy.base.environment import Environment
from minirospy.base.errors import WireError
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.registration import Registrations
from minirospy.runtime.node.services import Handler, ServiceServer
from minirospy.runtime.node.slave import SlaveApi
from minirospy.runtime.node.subscription import Deliver, InTurns, Subscription
from minirospy.runtime.node.unreachable import Unreachable
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport import local, tcp
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.readers import ReaderSet
from minirospy.runtime.transport.workers import InOrder, Workers

__all__ = ["Node"]

_log = logging.getLogger(__name__)
_FLUSH_SECONDS = 0.5
# maximum number of idle connections to the Slave API; each of a node's peers keeps about one
MAX_IDLE = 200

# seconds after an unsubscription during which the master may still send lists of publishers
_STALE_SECONDS = 5.0

_REQUEST_AGAIN_SECONDS = 0.5


class Node:
    """A node in the computation graph, with a global name (``/talker``).

    ``await start()`` opens its servers. ``advertise``, ``subscribe`` and ``serve`` register with the master. If that
    fails, they raise MasterUnreachableError or RpcRefused, but the topic or service remains and is registered later.
    Call the methods on the loop, unless stated otherwise.
    """

    def __init__(
        self,
        name: str,
        environment: Environment,
        *,
        on_shutdown: Callable[[str], None] | None = None,
        on_parameter: Callable[[str, object], None] | None = None,
        watch_seconds: float = 2.0,
    ) -> None:
        """Create the node. ``on_shutdown(reason)`` and ``on_parameter(key, value)`` are called in a worker.

        Every ``watch_seconds`` the node checks whether it is still registered with the master.
        """
        self.name = name
        self.environment = environment
        self.workers = Workers()
        self.publications: dict[str, Publication] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.services: dict[str, ServiceServer] = {}
        # topics unsubscribed from recently, each with its timer
        self._left: dict[str, asyncio.TimerHandle] = {}
        # Topics whose publishers will be requested from the master again
        self._requesting: dict[str, asyncio.TimerHandle] = {}

        self.uri = ""
        self._on_shutdown = on_shutdown
        self._on_parameter = on_parameter
        self._parameter_updates = InOrder(self.workers)

        self._readers = ReaderSet()
        self._header_memory = tcp.HeaderMemory()
        self._unreachable = Unreachable()
        self.rpc = AsyncRpcClient(same_host=environment.same_host)
        tables: Mapping[str, Mapping[str, Publication | Subscription | ServiceServer]] = {
            "Publisher": self.publications,
            "Subscriber": self.subscriptions,
            "Service": self.services,
        }
        self.registrations = Registrations(name, environment, tables, self.rpc, self.workers, watch_seconds)
        self.parameters = self.registrations.parameters
        """The parameters that this node has subscribed to, added by the code that subscribes."""
        self.when_registered_again = self.registrations.when_registered_again
        """Functions that register additional state.

        The functions are called in workers when the node registers again with a master that had lost it.
        """

        self.server: RpcServer | None = None
        self._access = Access.parse(environment.allow) if environment.allow else None
        self.listener = tcp.Listener(self._accept, self._access.allows if self._access else None)
        self.unix_listener = tcp.Listener(self._accept)
        # The value of :func:`local.this_host` if this node also uses Unix sockets, else ""
        self.this_host = ""
        self._shares_memory = environment.shares_memory
        # Name of the Unix socket that serves topics to processes on this machine, or "" if there is none.
        self.unix_name = ""

        self._closed = False
        self._unregistering: asyncio.Task[None] | None = None

    @property
    def tcpros_port(self) -> int:
        """The port that serves this node's topics and services."""
        return self.listener.port

    @property
    def is_sending(self) -> bool:
        """Return whether a thread is publishing, and therefore holds a lock. Thread-safe."""
        return any(publication.is_sending for publication in list(self.publications.values()))

    async def start(self, xmlrpc_port: int = 0, tcpros_port: int = 0) -> None:
        """Open the node's servers; port 0 means any free port. Raise OSError if a server cannot listen."""
        host = self.environment.bind_host
        ports = self.environment.ports
        self.listener.open(host, tcpros_port, ports)
        if self.environment.same_host:
            self._open_unix_listener()

        self.server = RpcServer(
            SlaveApi(self).dispatch,
            bind_host=host,
            port=xmlrpc_port,
            ports=ports,
            max_idle=MAX_IDLE,
            access=self._access,
            known_as=(self.environment.uri_host,) if self.environment.same_host else (),
        )
        try:
            await self.server.start()
        except BaseException:
            await self.close()
            raise

        self.uri = f"http://{self.environment.uri_host}:{self.server.port}/"
        self.registrations.uri, self.registrations.service_uri = self.uri, self.service_uri
        self.registrations.watch()
        if host in {"127.0.0.1", "::1"} and not _is_loopback(self.environment.master_address[0]):
            # Run this in a thread, because resolving a host name can block.
            await asyncio.get_running_loop().run_in_executor(None, self._check_own_address)

    async def close(self, *, announces: bool = True) -> None:
        """Leave the graph: unregister from the master, flush the links, close everything. Idempotent.

        Waits for the master (see :meth:`Registrations.close`), or until :meth:`stop_unregistering` is called. If the master
        does not respond, the remaining registrations stay in it. With ``announces``, a line is logged if this is slow.
        """
        if self._closed:
            return
        self._closed = True
        self._unregistering = asyncio.ensure_future(self.registrations.close(announces=announces))
        # Let the task above send its first call to the master before this closes any connection.
        await asyncio.sleep(0)

        for timer in [*self._left.values(), *self._requesting.values()]:
            timer.cancel()
        links = [link for publication in self.publications.values() for link in publication.links]
        await asyncio.gather(
            self._unregistering,
            *(link.drain(_FLUSH_SECONDS) for link in links),
            return_exceptions=True,
        )

        # Close the Unix socket before the port: the socket's name is derived from the port, so the next server on this port
        # could not bind it.
        await close_all([self.unix_listener.close, self.listener.close])
        tables = (self.publications, self.subscriptions, self.services)
        close_each([part.close for table in tables for part in table.values()])
        waits = [subscription.wait_closed for subscription in self.subscriptions.values()]
        servers = [self.server.close] if self.server else []
        await close_all([*waits, *servers, self.rpc.close, self.registrations.cancel])

    def stop_unregistering(self) -> None:
        """Let :meth:`close` return even if the master has not responded. Call this on the loop."""
        if self._unregistering:
            self._unregistering.cancel()

    async def master(self, method: str, *args: object) -> Any:
        """Call the master as this node and return the value in its response.

        Raise MasterUnreachableError if it does not respond, RpcRefused with the master's message if it refuses the call.
        """
        return await self.registrations.call(method, *args)

    async def advertise(self, publication: Publication) -> None:
        """Publish a topic. Raise ValueError if this node already publishes it."""
        if self.publications.setdefault(publication.topic, publication) is not publication:
            raise ValueError(f"{self.name} publishes {publication.topic} already")
        await self.registrations.update(("Publisher", publication.topic))

    async def unadvertise(self, publication: Publication) -> None:
        """Stop publishing a topic."""
        if self.publications.get(publication.topic) is publication:
            del self.publications[publication.topic]
            try:
                await self.registrations.update(("Publisher", publication.topic))
                await asyncio.gather(*(link.drain(_FLUSH_SECONDS) for link in publication.links))
            finally:
                publication.close()

    def make_subscription(
        self,
        topic: str,
        type_: InterfaceType,
        deliver: Deliver | InTurns,
        *,
        newest: int = 0,
        tcp_nodelay: bool = False,
        on_loop: bool = False,
    ) -> Subscription:
        """Create a :class:`Subscription` for this node, to pass to :meth:`subscribe`."""
        return Subscription(
            topic,
            type_,
            self.name,
            deliver,
            rpc=self.rpc,
            workers=self.workers,
            readers=self._readers,
            newest=newest,
            tcp_nodelay=tcp_nodelay,
            on_loop=on_loop,
            header_memory=self._header_memory,
            this_host=self.this_host,
            shares_memory=self._shares_memory,
            unreachable=self._unreachable,
        )

    async def subscribe(self, subscription: Subscription) -> None:
        """Subscribe to a topic. Raise ValueError if this node already subscribes to it."""
        topic = subscription.topic
        if self.subscriptions.setdefault(topic, subscription) is not subscription:
            raise ValueError(f"{self.name} subscribes to {topic} already")
        await self.registrations.update(("Subscriber", topic))

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
            await self.registrations.update(("Subscriber", topic))

    def make_service(
        self, name: str, type_: InterfaceType, handler: Handler, *, request_type: str, response_type: str
    ) -> ServiceServer:
        """Create a :class:`ServiceServer` for this node, to pass to :meth:`serve`."""
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
        """Offer a service. Raise ValueError if this node already offers it."""
        if self.services.setdefault(server.name, server) is not server:
            raise ValueError(f"service [{server.name}] already registered")
        await self.registrations.update(("Service", server.name))

    async def unserve(self, server: ServiceServer) -> None:
        """Stop offering a service. Calls in progress still get their responses."""
        if self.services.get(server.name) is server:
            del self.services[server.name]
            server.close()
            await self.registrations.update(("Service", server.name))

    @property
    def service_uri(self) -> str:
        """The address of this node's services: ``rosrpc://host:port``."""
        return f"rosrpc://{self.environment.uri_host}:{self.tcpros_port}"

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Apply the master's new list of a topic's publishers."""
        subscription = self.subscriptions.get(topic)
        if subscription:
            subscription.publishers_changed(uris)
            if topic in self._left and topic not in self._requesting:
                # Request the list again: this one may be for an earlier subscription, because rosmaster queues its updates.
                loop = asyncio.get_running_loop()
                self._requesting[topic] = loop.call_later(_REQUEST_AGAIN_SECONDS, self._request_again, topic)

    def parameter_changed(self, key: str, value: object) -> None:
        """Pass a parameter's new value, received from the master, to ``on_parameter``."""
        if self._on_parameter:
            self._parameter_updates.start(self._on_parameter, key, value)

    def request_shutdown(self, reason: str) -> None:
        """Shut down because another process requested it."""
        if self._on_shutdown:
            self.workers.start(self._on_shutdown, reason)

    def _request_again(self, topic: str) -> None:
        del self._requesting[topic]
        self.registrations.request_again(topic)

    async def _accept(self, sock: socket.socket, address: str) -> None:
        """Serve a peer that has connected; its header names a topic or service."""
        try:
            fields = await tcp.receive_header(sock, memory=self._header_memory)
        except (OSError, WireError):
            if not self._closed:
                raise
            sock.close()  # the master has already notified the peer that this node is leaving
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
                why = publication.accept(sock, fields, self.name, address, shares_memory=self._shares_memory)
            else:
                topics = [[each.topic, each.type.name] for each in self.publications.values()]
                why = f"[{self.name}] is not a publisher of [{fields['topic']}]. Topics are {topics}"
        else:
            why = "no topic or service name detected"

        if why:
            self.listener.log_refusal(f"Could not process inbound connection: {why}{fields}")
            await tcp.send_header(sock, {"error": why})
            sock.close()

    def _open_unix_listener(self) -> None:
        """Also serve topics and services through a Unix socket, if the system supports it."""
        sock = local.bind(self.environment.uri_host, self.tcpros_port)
        if sock:
            self.this_host = local.this_host()
            self.unix_name = local.name_of(self.environment.uri_host, self.tcpros_port)
            self.unix_listener.listen(sock)

    def _check_own_address(self) -> None:
        environment = self.environment
        if not environment.master_is_local:
            _log.warning(
                "this node is registered at '%s', but the master is on another machine (%s): set ROS_IP "
                "to the address by which that one reaches this one",
                environment.host,
                environment.master_uri,
            )


def _is_loopback(host: str) -> bool:
    return host in {"localhost", "::1"} or host.startswith("127.")
