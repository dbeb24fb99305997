"""rospy's ServiceProxy, and wait_for_service. Source: http://wiki.ros.org/rospy/Overview/Services."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from minirospy.base.clock import wait_for_event
from minirospy.base.environment import split_uri
from minirospy.base.errors import (
    CallFailed,
    DeserializationError,
    HandshakeRefused,
    MasterUnreachableError,
    ROSException,
    RpcError,
    RpcRefused,
    SerializationError,
    ServiceException,
    TransportException,
    WireError,
)
from minirospy.base.notes import noted
from minirospy.base.times import Duration
from minirospy.client.session import Session, current_session
from minirospy.client.type_advice import advice_for_service_class
from minirospy.core.idl.message import args_kwds_to_message, number_header
from minirospy.core.idl.protocols import declared
from minirospy.core.wire.tcpros import ANY

if TYPE_CHECKING:
    from minirospy.client.tcpros import TCPROSServiceClient, TCPROSTransport
    from minirospy.core.idl.protocols import Message
    from minirospy.runtime.node.service_client import ServiceClient

__all__ = ["ServiceProxy", "wait_for_service"]

_log = logging.getLogger("rosout")
_S_co = TypeVar("_S_co", bound=Any, covariant=True)
_POLL_SECONDS = 0.1
_PROBE_SECONDS = 5.0
_SILENT_SECONDS = 5.0
_NO_CONTACT = "failed to contact, will keep trying"


class ServiceProxy(Generic[_S_co]):
    """Calls a service: ``proxy(request)``, or with the request's fields as arguments.

    ``persistent`` uses one connection for all calls, and reconnects after the server has closed it. Several threads
    may use a proxy; with ``persistent``, their calls run one at a time. ``headers`` are added to the
    connection header, which the handler can read from ``request._connection_header``.
    """

    def __init__(
        self,
        name: str,
        service_class: type[_S_co],
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        # If the name was never set (None), only calls raise an error, not the constructor.
        self.resolved_name = current_session().resolve(str(name) if name else "")
        self.service_class = service_class
        try:
            self.request_class: type[Message] = service_class._request_class
        except AttributeError as error:
            noted(error, advice_for_service_class(service_class))
            raise
        self.response_class: type[Message] = service_class._response_class
        self.type: str = service_class._type
        self.md5sum: str = service_class._md5sum
        self.buff_size = 65536
        self.persistent = persistent
        self.uri: str | None = None  # last known URI of the service, ``rosrpc://host:port``

        self._headers = dict(headers or {})
        self._takes_memoryview = bool(declared(self.response_class, "deserialize", "_takes_memoryview"))
        self._client: ServiceClient | None = None
        self._client_session: Session | None = None
        # Number of calls that reached the service; it becomes ``seq`` in requests that start with a header.
        self._calls = 0
        self._transport: TCPROSTransport | None = (
            None  # the connection that the program has set, or has read, through ``transport``
        )
        self._transport_is_own = False  # True if the proxy, not the program, opened the connection
        self._protocol: TCPROSServiceClient | None = None
        # Held during calls that share a connection.
        # Reentrant, because a signal may run a shutdown hook during this thread's call, and the hook may call the service.
        self._lock = threading.RLock()
        self._is_calling = False  # True while a thread makes a call on a shared connection
        # Held while the connection is handed to another owner. Not held during calls, so that threads can read ``transport``.
        # Reentrant, because a signal may run a shutdown hook that also reads ``transport``.
        self._handover = threading.RLock()

    def __call__(self, *args: object, **kwds: object) -> Any:
        """Call the service and return its response.

        Raise ServiceException if the call fails, TypeError or AttributeError if the arguments do not
        match the request, SerializationError if a value does not.
        """
        return self.call(*args, **kwds)

    def call(self, *args: object, **kwds: object) -> Any:
        """Call the service; the same as calling the proxy itself."""
        request = args_kwds_to_message(self.request_class, args, kwds)
        if not hasattr(type(request), "_type"):
            raise TypeError("request object is not a valid request message instance")
        if not self.persistent and self._transport is None:
            body = self._serialize(request)
            return self._exchange(self._connect(body), body, keep=False)
        with self._lock:
            if self._is_calling:
                # Use a new connection: a shutdown hook interrupted this thread's call, whose response is still to be read.
                body = self._serialize(request)
                return self._exchange(self._connect(body), body, keep=False)
            self._is_calling = True
            try:
                return self._call_in_turn(request)
            finally:
                self._is_calling = False

    def _call_in_turn(self, request: Message) -> Message:
        """Call the service through the transport, the persistent connection or else a new one; return the response."""
        # Check for a transport only now: another thread may have taken or closed it while this one waited.
        transport = self._usable_transport()
        if transport is not None:
            return self._call_through(transport, request)
        body = self._serialize(request)
        client = self._kept_client(body) if self.persistent else self._connect(body)
        return self._exchange(client, body, keep=self.persistent)

    @property
    def seq(self) -> int:
        """The number of calls that reached the service."""
        return self._calls

    @property
    def protocol(self) -> TCPROSServiceClient:
        """The fields of the connection header, and the response class, for programs that create a TCPROSTransport."""
        if self._protocol is None:
            from minirospy.client.tcpros import TCPROSServiceClient

            headers = {**self._headers, "persistent": "1"} if self.persistent else self._headers
            self._protocol = TCPROSServiceClient(self.resolved_name, self.service_class, headers)
        return self._protocol

    @property
    def transport(self) -> TCPROSTransport | None:
        """The persistent connection, or None. A program may set its own connection, which calls then use."""
        with self._handover:
            client = self._client
            if self._transport is None and client is not None:
                from minirospy.client.tcpros import TCPROSTransport

                # From here on, the connection belongs to the transport, which the program may use or close.
                # A call in progress still receives its response. The next call waits for that call, and then uses the transport.
                transport = TCPROSTransport(self.protocol, self.resolved_name)
                transport.set_socket(client.detach(), client.uri)
                transport.dest_address = split_uri(client.uri, "rosrpc")[:2]
                with contextlib.suppress(TransportException):  # some servers send no type
                    transport.use_header(client.header)
                self._client, self._transport, self._transport_is_own = None, transport, True
            return self._transport

    @transport.setter
    def transport(self, transport: TCPROSTransport | None) -> None:
        with self._handover:
            self._end_client()
            self._transport, self._transport_is_own = transport, False

    def _get_service_uri(self, request: object) -> str:
        """Return the service's URI. ``request`` has no effect here. Raise ServiceException if the service is not registered."""
        return self._find_uri()

    def wait_for_service(self, timeout: float | None = None) -> None:
        """Wait until the service is available. Raise ROSException after ``timeout`` seconds."""
        wait_for_service(self.resolved_name, timeout)

    def close(self) -> None:
        """Close a persistent connection. If another thread's call is using the connection, that call fails."""
        with self._handover:
            self._end_client()
            transport, self._transport = self._transport, None
        if transport:
            transport.close()

    def _end_client(self) -> None:
        """Close the persistent connection; abort the call of another thread that uses it."""
        client = self._client
        if client and self._is_calling:
            # Do not close the socket here: that would not wake a thread that is reading from it.
            # After a shutdown of the socket, the reading thread wakes up and closes it.
            client.hang_up()
        else:
            self._disconnect()

    def _usable_transport(self) -> TCPROSTransport | None:
        """Return the transport for the next call; drop it if it is the proxy's own connection and has ended.

        A program's own connection is kept: it may lead to a different server than the one that the master knows.
        """
        transport = self._transport
        if transport is None or not self._transport_is_own:
            return transport

        from minirospy.runtime.transport.sockets import is_readable

        sock = transport.socket
        if sock is not None and sock.fileno() >= 0 and not is_readable(sock):
            return transport
        self._drop_transport(transport)
        return None

    def _drop_transport(self, transport: TCPROSTransport) -> None:
        """Close ``transport``; calls no longer use it."""
        with self._handover:
            if self._transport is transport:
                self._transport = None
        transport.close()

    def _call_through(self, transport: TCPROSTransport, request: Message) -> Message:
        """Call the service through ``transport``, and return the response."""
        is_kept = False
        self._calls += 1
        try:
            with current_session().lifecycle.interrupting(transport.close):
                transport.send_message(request, self._calls)
                responses = transport.receive_once()
            if not responses:  # another thread closed the transport between two reads
                if current_session().is_shutdown():
                    raise TransportException("connection closed")
                raise ServiceException(f"service [{self.resolved_name}] returned no response")
            is_kept = self.persistent
        except ServiceException:
            is_kept = self.persistent
            raise
        except TransportException as error:
            raise _broken_call(error) from error
        finally:
            if not is_kept:
                self._drop_transport(transport)
        return responses[0]

    def _kept_client(self, request: bytes) -> ServiceClient:
        """Return the persistent connection for sending ``request``; connect if there is none, or if it has ended."""
        client = self._client
        if client and (client.has_ended() or self._client_session is not current_session()):
            # In a fork, do not use the parent's connection: the two processes would read each other's responses.
            with self._handover:
                self._disconnect()
            client = None
        if client is None:
            client = self._client = self._connect(request)
            self._client_session = current_session()
        return client

    def _drop_client(self, client: ServiceClient) -> None:
        """Close ``client``, and the transport that took over its connection during the call."""
        with self._handover:
            if self._client is client:
                self._client = None
            transport = self._transport if self._transport_is_own else None
        if transport is not None and transport.socket is client.detach():
            self._drop_transport(transport)
        client.close()

    def _disconnect(self) -> None:
        client, self._client = self._client, None
        if client:
            client.close()

    def _serialize(self, request: Message) -> bytes:
        buffer = BytesIO()
        number_header(request, self._calls + 1)
        try:
            request.serialize(buffer)
        except (SerializationError, OverflowError):
            # Connect first, as rospy does: a missing service or a wrong type is reported before a serialization error.
            if self._client is None:
                self._connect_by_master(None, b"").close()
            self._calls += 1
            raise
        return buffer.getvalue()

    def _connect(self, request: bytes) -> ServiceClient:
        """Return a new connection, on which to make the call with ``request``. It may already have sent the request."""
        ahead = self._connect_ahead()
        try:
            return self._connect_by_master(ahead, request)
        finally:
            if ahead and not ahead.header:
                ahead.close()

    def _connect_ahead(self) -> ServiceClient | None:
        """Connect to the service's last known address while the master is queried for the current one.

        Do this only for addresses on this machine, because connecting to other hosts may take long.
        """
        from minirospy.runtime.node.service_client import parse_service_uri

        node = current_session().node
        if self.uri and node:
            with contextlib.suppress(OSError, WireError):
                if parse_service_uri(self.uri)[0] in ("127.0.0.1", node.environment.host):
                    return self._client_of(self.uri, waits=False)
        return None

    def _client_of(self, uri: str, *, waits: bool) -> ServiceClient:
        from minirospy.runtime.node.service_client import ServiceClient

        return ServiceClient(
            uri,
            self.resolved_name,
            self.md5sum,
            current_session().name,
            persistent=self.persistent,
            headers=self._headers,
            waits=waits,
            same_host=current_session().identity.environment.same_host,
        )

    def _find_uri(self) -> str:
        try:
            self.uri = current_session().master.lookup_service(self.resolved_name)
        except RpcRefused:
            raise ServiceException(f"service [{self.resolved_name}] unavailable") from None
        except (MasterUnreachableError, RpcError) as error:
            raise ServiceException(f"unable to contact master: {error}") from error
        return self.uri

    def _connect_by_master(self, ahead: ServiceClient | None, request: bytes) -> ServiceClient:
        uri = self._find_uri()
        try:
            if ahead and ahead.uri == uri:
                # If the connection breaks, connect again: the server may have been about to exit when it accepted the connection.
                # Do not retry if the server does not respond, because it may have received the request.
                with contextlib.suppress(ConnectionError, WireError):
                    ahead.finish(request)
                    return ahead
            return self._client_of(uri, waits=True)
        except HandshakeRefused as error:
            raise ServiceException(f"unable to connect to service: remote error reported: {error}") from None
        except (OSError, WireError) as error:
            raise ServiceException(f"unable to connect to service: {error}") from error

    def _exchange(self, client: ServiceClient, request: bytes, *, keep: bool) -> Message:
        keeping = False
        self._calls += 1
        try:
            with current_session().lifecycle.interrupting(client.hang_up):
                body = client.call(request)
            keeping = keep
        except CallFailed as error:
            keeping = keep
            raise ServiceException(
                f"service [{self.resolved_name}] responded with an error: {error.text!r}"
            ) from None
        except (OSError, WireError) as error:
            raise _broken_call(error) from error
        finally:
            if not keeping:
                self._drop_client(client)

        response: Message = self.response_class()
        try:
            response.deserialize(memoryview(body) if self._takes_memoryview else body)
        except (DeserializationError, SerializationError) as error:
            raise ServiceException(
                f"transport error completing service call: receive_once[{self.resolved_name}]: "
                f"DeserializationError cannot deserialize: {error}"
            ) from error

        response._connection_header = client.header
        return response


def wait_for_service(service: str, timeout: float | Duration | None = None) -> None:
    """Wait until a service is registered and responds.

    Raise ROSException after ``timeout`` seconds, ROSInterruptException if the node shuts down, ValueError
    if the timeout is 0.
    """
    session = current_session()
    name = session.resolve(str(service) if service else "")
    seconds = timeout.to_sec() if isinstance(timeout, Duration) else timeout
    if seconds == 0:
        raise ValueError("timeout must be non-zero")

    start = time.monotonic()
    end = None if seconds is None else start + seconds
    reported: set[str] = set()
    while not session.is_shutdown():
        rest = _PROBE_SECONDS if end is None else end - time.monotonic()
        if rest <= 0:
            raise ROSException(f"timeout exceeded while waiting for service {name}")
        why = _probe(name, min(rest, _PROBE_SECONDS))
        if why is None:
            return
        if why is _NO_CONTACT and why not in reported:
            _log.warning("wait_for_service(%s): %s", name, why)
            reported.add(why)
        elif not reported and time.monotonic() - start > _SILENT_SECONDS:
            # rospy logs nothing here, so users would not notice a misspelled name.
            _log.info("wait_for_service(%s): %s, waiting...", name, why)
            reported.add(why)
        pause = _POLL_SECONDS if end is None else min(_POLL_SECONDS, max(0.0, end - time.monotonic()))
        wait_for_event(session.lifecycle.shutting_down, pause)
    raise session.lifecycle.interrupted("rospy shutdown")


def _probe(name: str, timeout: float) -> str | None:
    """Return the reason why the service cannot be called yet, or None if it can be called."""
    from minirospy.runtime.node.service_client import ServiceClient

    session = current_session()
    try:
        uri = session.master.lookup_service(name)
    except RpcRefused:
        return "not registered yet"
    except (MasterUnreachableError, RpcError) as error:
        return f"the master does not answer ({error})"
    try:
        same_host = session.identity.environment.same_host
        ServiceClient(uri, name, ANY, session.name, probe=True, timeout=timeout, same_host=same_host).close()
    except (OSError, WireError):
        return _NO_CONTACT
    return None


def _broken_call(error: Exception) -> Exception:
    """Return the exception for a call whose connection failed: because of the node's shutdown, or of ``error``."""
    session = current_session()
    if session.is_shutdown():
        return session.lifecycle.interrupted("node shutdown interrupted service call")
    return ServiceException(f"transport error completing service call: {error}")
