"""TCPROS connections for programs that make their own: the classes of rospy.impl.tcpros_base and tcpros_service.

minirospy's own connections are in ``runtime/`` and do not use these classes. Source: http://wiki.ros.org/ROS/TCPROS, and
the behaviour of rospy.impl.
"""

from __future__ import annotations

import contextlib
import itertools
import socket
import struct
from collections.abc import Callable, Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any

from minirospy.base.errors import (
    DeserializationError,
    ServiceException,
    TransportException,
    TransportInitError,
    TransportTerminated,
    WireError,
)
from minirospy.client.length_prefix import deserialize_messages, serialize_message
from minirospy.client.session import current_session
from minirospy.core.wire.header import parse_header, serialize_header

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "DEFAULT_BUFF_SIZE",
    "DeadTransport",
    "ProtocolHandler",
    "ResponseTransport",
    "TCPROSServiceClient",
    "TCPROSTransport",
    "TCPROSTransportProtocol",
    "TCPService",
    "Transport",
    "recv_buff",
]

DEFAULT_BUFF_SIZE = 65536
BIDIRECTIONAL = "b"
_LENGTH = struct.Struct("<I")
_OK_LENGTH = struct.Struct("<BI")
_NOT_INITIALIZED = "TCPROS transport was not successfully initialized"
_numbers = itertools.count(1)


def recv_buff(sock: socket.socket, b: BytesIO, buff_size: int) -> int:
    """Append received bytes to ``b``; return the number of bytes.

    Raise TransportTerminated if the peer has closed the connection.
    """
    data = sock.recv(buff_size)
    if not data:
        raise TransportTerminated("unable to receive data from sender, check sender's logs for details")
    b.write(data)
    return len(data)


class TCPROSTransportProtocol:
    """Describes the data on a connection: its header's fields, and the class of the received messages."""

    def __init__(
        self,
        resolved_name: str,
        recv_data_class: type[Message] | None,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
    ) -> None:
        self.resolved_name = resolved_name
        self.recv_data_class = recv_data_class
        self.queue_size = queue_size
        self.buff_size = buff_size
        self.direction = BIDIRECTIONAL

    def read_messages(self, b: BytesIO, msg_queue: list[Message], sock: socket.socket) -> None:
        """Move the complete messages in ``b`` to ``msg_queue``."""
        assert self.recv_data_class
        deserialize_messages(b, msg_queue, self.recv_data_class, queue_size=self.queue_size)

    def get_header_fields(self) -> dict[str, str]:
        """Return the fields of the connection header to send."""
        return {}


class TCPROSServiceClient(TCPROSTransportProtocol):
    """The client side of a connection to a service."""

    def __init__(
        self,
        resolved_name: str,
        service_class: Any,
        headers: Mapping[str, str] | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
    ) -> None:
        super().__init__(resolved_name, service_class._response_class, buff_size=buff_size)
        self.service_class = service_class
        self.headers = headers or {}

    def get_header_fields(self) -> dict[str, str]:
        """Return the fields of the connection header to send."""
        return {
            "service": self.resolved_name,
            "md5sum": self.service_class._md5sum,
            "callerid": current_session().name,
            **self.headers,
        }

    def read_messages(self, b: BytesIO, msg_queue: list[Message], sock: socket.socket) -> None:
        """Move a complete response in ``b`` to ``msg_queue``. Raise ServiceException if the response is an error."""
        size = b.tell()
        if size < _OK_LENGTH.size:
            return
        ok, length = _OK_LENGTH.unpack_from(b.getvalue())
        if size < _OK_LENGTH.size + length:
            return
        if ok:
            assert self.recv_data_class
            deserialize_messages(b, msg_queue, self.recv_data_class, max_msgs=1, start=1)
            return
        data = b.getvalue()[:size]
        text = data[_OK_LENGTH.size : _OK_LENGTH.size + length]
        b.seek(0)
        b.truncate()
        b.write(data[_OK_LENGTH.size + length :])
        raise ServiceException(f"service [{self.resolved_name}] responded with an error: {text!r}")


class TCPService(TCPROSTransportProtocol):
    """The server's side of a connection to a service."""

    def __init__(self, resolved_name: str, service_class: Any, buff_size: int = DEFAULT_BUFF_SIZE) -> None:
        super().__init__(resolved_name, service_class._request_class, buff_size=buff_size)
        self.service_class = service_class

    def get_header_fields(self) -> dict[str, str]:
        """Return the fields of the connection header to send."""
        return {
            "service": self.resolved_name,
            "type": self.service_class._type,
            "md5sum": self.service_class._md5sum,
            "callerid": current_session().name,
        }


class Transport:
    """The base class of connections; ``direction`` is "i", "o" or "b"."""

    transport_type = "UNKNOWN"

    def __init__(self, direction: str, name: str = "unnamed") -> None:
        self.name = name
        self.direction = direction
        self.id = next(_numbers)
        self.done = False  # set by close()
        self.cleanup_cb: Callable[[Any], object] | None = None
        # The peer: its URI, and the addresses of both ends of the socket
        self.endpoint_id = ""
        self.local_endpoint: Any = (0, 0)
        self.remote_endpoint: Any = (0, 0)
        # The total number of bytes and messages that were received and sent
        self.stat_bytes = self.stat_num_msg = 0

    def fileno(self) -> int | None:
        """Return the socket's file descriptor, or None if there is none."""
        return None

    def set_cleanup_callback(self, cleanup_callback: Callable[[Any], object]) -> None:
        """Register a function that is called with this object when the connection is closed."""
        self.cleanup_cb = cleanup_callback

    def close(self) -> None:
        """Close the connection."""
        self.done = True
        if self.cleanup_cb:
            self.cleanup_cb(self)

    def write_data(self, data: bytes) -> None:
        """Send bytes; a subclass overrides this."""
        raise Exception("not implemented")

    def get_transport_info(self) -> str:
        """Return a description of the connection, for getBusInfo; a subclass overrides this."""
        raise NotImplementedError


class DeadTransport(Transport):
    """What remains of a closed connection: its addresses and statistics."""

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport.direction, transport.name)
        self.transport_type = transport.transport_type
        self.id = transport.id
        self.done = True
        self.endpoint_id = transport.endpoint_id
        self.local_endpoint, self.remote_endpoint = transport.local_endpoint, transport.remote_endpoint
        self.stat_bytes, self.stat_num_msg = transport.stat_bytes, transport.stat_num_msg

    def get_transport_info(self) -> str:
        """Return a description of the connection, for getBusInfo."""
        host, port = (*self.remote_endpoint, None)[:2]
        return f"Closed {self.transport_type} connection on port {self.local_endpoint[1]} to [{host}:{port}]"


class ProtocolHandler:
    """The base class of handlers for a transport."""

    def shutdown(self) -> None:
        """Stop; a subclass overrides this."""

    def create_transport(self, topic: str, pub_uri: str, protocol_params: list[Any]) -> Any:
        """Connect to a publisher; a subclass overrides this."""
        raise Exception("interface impl")

    def supports(self, protocol: str) -> bool:
        """Return whether ``protocol`` is supported."""
        return False

    def get_supported(self) -> list[Any]:
        """Return the protocols to offer, each with its parameters."""
        return []

    def init_publisher(self, topic: str, protocol: list[Any]) -> Any:
        """Accept connections from subscribers; a subclass overrides this."""
        raise Exception("interface impl")


class TCPROSTransport(Transport):
    """A connection that blocks the calling thread: :meth:`connect`, :meth:`send_message`, :meth:`receive_once`, :meth:`close`.

    Raise TransportInitError if ``name`` is empty.
    """

    transport_type = "TCPROS"

    def __init__(
        self, protocol: TCPROSTransportProtocol, name: str, header: Mapping[str, str] | None = None
    ) -> None:
        if not name:
            raise TransportInitError("Unable to initialize transport: name is not set")
        super().__init__(protocol.direction, name)
        self.protocol = protocol
        self.buff_size = protocol.buff_size
        # The peer's connection header, None until it has been received, and the fields copied from it
        self.header: Mapping[str, str] | None = header
        self.type: str | None = None
        self.md5sum: str | None = None
        self.callerid_pub = "unknown"
        self.is_latched = False
        self.latch: str | None = None

        # The socket while the connection is open, and the buffers for received data and for data to send
        self.socket: socket.socket | None = None
        self.read_buff, self.write_buff = BytesIO(), BytesIO()
        self.endpoint_id = "unknown"
        self.dest_address: tuple[str, int] | None = None  # the address that connect() was called with
        self.local_endpoint = self.remote_endpoint = (None, None)

    def fileno(self) -> int | None:
        """Return the socket's file descriptor, or None if the connection is not open."""
        return self.socket.fileno() if self.socket else None

    def set_endpoint_id(self, endpoint_id: str) -> None:
        """Set the URI that names the peer."""
        self.endpoint_id = endpoint_id

    def set_socket(self, sock: socket.socket, endpoint_id: str) -> None:
        """Use an open socket. Raise TransportInitError if the connection already has a socket."""
        if self.socket is not None:
            raise TransportInitError("socket already initialized")
        self.socket = sock
        self.endpoint_id = endpoint_id
        with contextlib.suppress(OSError):
            self.local_endpoint, self.remote_endpoint = sock.getsockname(), sock.getpeername()

    def get_transport_info(self) -> str:
        """Return a description of the connection, for getBusInfo."""
        here, there = self.local_endpoint, self.remote_endpoint
        port, (host, other) = here[1] if len(here) > 1 else here, (*there, None)[:2]
        return (
            f"{self.transport_type} connection on port {port} to [{host}:{other} on socket {self.fileno()}]"
        )

    def connect(self, dest_addr: str, dest_port: int, endpoint_id: str, timeout: float | None = None) -> None:
        """Connect to a server and exchange headers. An open connection is replaced.

        ``timeout``: the limit for connecting and for each wait for the header, in seconds. Raise TransportInitError if the
        server is unreachable or refuses.
        """
        self.endpoint_id = endpoint_id
        self.dest_address = (dest_addr, dest_port)
        before, self.socket = self.socket, None
        if before is not None:
            before.close()
        self.read_buff, self.write_buff = BytesIO(), BytesIO()
        self.done = False
        try:
            sock = socket.create_connection((dest_addr, dest_port), timeout)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.set_socket(sock, endpoint_id)
            self.write_header()
            self.read_header()
            sock.settimeout(None)
        except TransportInitError:
            # As in rospy, the connection stays open if the server refuses.
            raise
        except OSError as error:
            self.close()
            raise TransportInitError(str(error)) from error

    def write_header(self) -> None:
        """Send this side's connection header."""
        data = serialize_header(self.protocol.get_header_fields())
        self._open_socket().sendall(data)
        self.stat_bytes += len(data)

    def read_header(self) -> None:
        """Receive the peer's connection header. Raise TransportInitError if it is invalid or contains an error."""
        b, sock = self.read_buff, self._open_socket()
        try:
            while b.tell() < _LENGTH.size or b.tell() < _LENGTH.size + _LENGTH.unpack_from(b.getvalue())[0]:
                self.stat_bytes += recv_buff(sock, b, self.protocol.buff_size)
            data = b.getvalue()[: b.tell()]
            end = _LENGTH.size + _LENGTH.unpack_from(data)[0]
            header = parse_header(data[_LENGTH.size : end])
        except (WireError, TransportTerminated) as error:
            raise TransportInitError(str(error)) from error
        b.seek(0)
        b.truncate()
        b.write(data[end:])
        if "error" in header:
            raise TransportInitError(f"remote error reported: {header['error']}")
        self.use_header(header)

    def use_header(self, header: Mapping[str, str]) -> None:
        """Set the peer's name and type from its header. Raise TransportInitError if the header has no type or md5sum."""
        for field in ("md5sum", "type"):
            if field not in header:
                raise TransportInitError(f"header missing required field [{field}]")
        self.header = header
        self.type, self.md5sum = header["type"], header["md5sum"]
        self.callerid_pub = header.get("callerid", "unknown")
        self.latch = header.get("latching")
        self.is_latched = self.latch == "1"

    def send_message(self, msg: Message, seq: int) -> None:
        """Send the contents of ``write_buff`` and then a message. Raise TransportInitError if the transport is not connected."""
        serialize_message(self.write_buff, seq, msg)
        data = self.write_buff.getvalue()
        self.write_buff.seek(0)
        self.write_buff.truncate()
        self.write_data(data)

    def write_data(self, data: bytes) -> None:
        """Send bytes. Raise TransportInitError if there is no connection, TransportException if the peer has closed it."""
        sock = self._open_socket()
        try:
            sock.sendall(data)
        except OSError as error:
            self.close()
            raise TransportException(str(error)) from error
        self.stat_bytes += len(data)
        self.stat_num_msg += 1

    def receive_once(self) -> list[Message]:
        """Wait for messages and return them.

        Raise TransportException if the connection is not open or fails, ServiceException if a service responds with an error.
        """
        sock, b, messages = self.socket, self.read_buff, list[Any]()
        if sock is None:
            raise TransportException("connection not initialized")
        try:
            while not messages and not self.done:
                self.protocol.read_messages(b, messages, sock)
                if not messages:
                    self.stat_bytes += recv_buff(sock, b, self.protocol.buff_size)
        except DeserializationError as error:
            raise TransportException(f"receive_once[{self.name}]: DeserializationError {error}") from error
        except (OSError, TransportTerminated) as error:
            self.close()
            raise TransportTerminated(f"receive_once[{self.name}]: {error}") from error
        self.stat_num_msg += len(messages)
        for message in messages:
            message._connection_header = self.header
        return messages

    def receive_loop(self, msgs_callback: Callable[[list[Message], TCPROSTransport], object]) -> None:
        """Call a function with received messages until the connection is closed."""
        while not self.done:
            try:
                messages = self.receive_once()
            except TransportException:
                self.close()
                return
            if not self.done:
                msgs_callback(messages, self)

    def close(self) -> None:
        """Close the connection. Idempotent."""
        if self.done:
            return
        sock, self.socket = self.socket, None
        if sock is not None:
            with contextlib.suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sock.close()
        super().close()

    def _open_socket(self) -> socket.socket:
        if self.socket is None:
            raise TransportInitError(_NOT_INITIALIZED)
        return self.socket


class ResponseTransport(TCPROSTransport):
    """Collects in ``sent`` the bytes of the response that a program's ``_handle_request`` sends."""

    def __init__(self, service_name: str, service_class: Any, header: Mapping[str, str]) -> None:
        super().__init__(TCPService(service_name, service_class), service_name, header)
        self.sent = b""

    def write_data(self, data: bytes) -> None:
        """Collect bytes."""
        self.sent += data
