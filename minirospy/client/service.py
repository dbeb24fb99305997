"""rospy's Service. Source: http://wiki.ros.org/rospy/Overview/Services."""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Callable
from io import BytesIO
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import (
    CallFailed,
    MasterUnreachableError,
    RpcError,
    RpcRefused,
    ServiceException,
)
from minirospy.base.notes import noted
from minirospy.base.numpy_names import add_numpy_note
from minirospy.client.identity import warn_of_illegal_name
from minirospy.client.session import NEW_SECONDS, current_session
from minirospy.client.topic import unregister_from_master
from minirospy.client.type_advice import advice_for_service_class
from minirospy.core.idl.message import number_header
from minirospy.core.idl.protocols import declared
from minirospy.core.idl.service import to_response
from minirospy.core.wire.header import Header
from minirospy.core.wire.service import RESPONSE_HEAD, parse_response_head, serialize_failure
from minirospy.core.wire.tcpros import InterfaceType

if TYPE_CHECKING:
    from types import TracebackType

    from minirospy.client.tcpros import TCPROSTransport
    from minirospy.core.idl.protocols import Message
    from minirospy.runtime.node.services import ServiceServer

__all__ = ["Service"]

_log = logging.getLogger("rosout")
_S_co = TypeVar("_S_co", bound=Any, covariant=True)


class Service(Generic[_S_co]):
    """Offers a service. ``handler(request)`` returns the response.

    The handler may return a response, a dictionary of some of its fields, a list or tuple of all its field values, or
    the value of its only field. If the handler raises, the client's call fails with that error, and
    ``error_handler(error, type, error, traceback)``, if given, is called, and the error is not logged. Each connection
    has a separate thread, so a handler may run several times concurrently. ``buff_size`` is accepted for compatibility.
    Raise ValueError if the name is empty, ServiceException if this node already offers the service.
    """

    def __init__(
        self,
        name: str,
        service_class: type[_S_co],
        handler: Callable[[Any], object],
        buff_size: int = 65536,
        error_handler: Callable[[Exception, type[Exception], Exception, Any], object] | None = None,
    ) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("service name is not a non-empty string")
        warn_of_illegal_name(name)

        self._session = current_session()
        self.resolved_name = self._session.resolve(name)
        self.service_class = service_class
        try:
            self.request_class: type[Message] = service_class._request_class
        except AttributeError as error:
            noted(error, advice_for_service_class(service_class))
            raise
        self.response_class: type[Message] = service_class._response_class
        self.type: str = service_class._type
        self.md5sum: str = service_class._md5sum
        self.buff_size = buff_size
        self.handler = handler
        self.error_handler = error_handler or self._log_error
        self._takes_memoryview = bool(declared(self.request_class, "deserialize", "_takes_memoryview"))
        self._since = time.monotonic()
        self.seq = 0  # number of responses so far; it becomes ``seq`` in responses that start with a header
        self._server: ServiceServer | None = None
        self._ended = SignalSafeEvent()

        with self._session.lock:
            if self._session.offered.setdefault(self.resolved_name, self) is not self:
                raise ServiceException(f"service [{self.resolved_name}] already registered")
        self._session.when_ready(self._register, f"the service {self.resolved_name}")

    @property
    def uri(self) -> str | None:
        """The URI of the service, ``rosrpc://host:port``; None before init_node."""
        return self._session.node.service_uri if self._session.node else None

    @property
    def is_new(self) -> bool:
        """Return whether the service was created only a moment ago and has not answered a call yet."""
        return not self.seq and time.monotonic() - self._since < NEW_SECONDS

    @property
    def done(self) -> bool:
        """Return whether the service has been shut down."""
        return self._ended.is_set()

    def shutdown(self, reason: str = "") -> None:
        """Stop offering the service; a call in progress still gets its response."""
        self._ended.set()
        with self._session.lock:
            server, self._server = self._server, None
            if self._session.offered.get(self.resolved_name) is not self:
                return
            del self._session.offered[self.resolved_name]
            if not server or not self._session.node or self._session.is_shutdown():
                return
            # Start unregistering now, before another thread can offer the service again.
            wait = self._session.start(self._session.node.unserve(server))
        unregister_from_master(wait)

    def spin(self) -> None:
        """Wait until the service or the node shuts down."""
        with self._session.lifecycle.interrupting(self._ended.set):
            try:
                wait_for_event(self._ended, None)
            except KeyboardInterrupt:
                self._session.lifecycle.signal_shutdown("keyboard interrupt")

    def _register(self) -> None:
        with self._session.lock:
            node = self._session.node
            if node is None or self.done or self._session.is_shutdown():
                return
            self._server = node.make_service(
                self.resolved_name,
                InterfaceType(self.type, self.md5sum),
                self._handle,
                request_type=self.request_class._type,
                response_type=self.response_class._type,
            )
            wait = self._session.start(node.serve(self._server))
        try:
            wait()
        except (MasterUnreachableError, RpcError) as error:
            why = error.text if isinstance(error, RpcRefused) else error
            _log.critical("unable to register service [%s] with master: %s", self.resolved_name, why)

    def _handle(self, body: memoryview, header: Header) -> bytes:
        """Handle a serialized request and return the serialized response. Runs in a worker thread."""
        try:
            request = self.request_class()
            request.deserialize(body if self._takes_memoryview else bytes(body))
            request._connection_header = header
            if getattr(self._handle_request, "__func__", None) is not _HANDLE_REQUEST:
                return self._handle_by_program(request, header)
            response = to_response(self.response_class, self.handler(request))
            self.seq += 1
            number_header(response, self.seq)
            buffer = BytesIO()
            response.serialize(buffer)
            return buffer.getvalue()
        except CallFailed as error:  # the program's _handle_request() sent an error response
            raise ServiceException(str(error)) from None
        except ServiceException as error:
            raise ServiceException(f"service cannot process request: {error}") from error
        except Exception as error:  # an error in the user's handler; it is sent to the client
            self._report(error)
            raise ServiceException(f"error processing request: {error}") from error

    def _handle_by_program(self, request: Message, header: Header) -> bytes:
        """Call the ``_handle_request`` that the program defines, and return the response that it sends.

        Raise CallFailed if the response is an error.
        """
        from minirospy.client.tcpros import ResponseTransport

        transport = ResponseTransport(self.resolved_name, self.service_class, header)
        self._handle_request(transport, request)
        if not transport.sent:
            raise RuntimeError("_handle_request has sent no response")
        ok, length = parse_response_head(transport.sent[:RESPONSE_HEAD])
        body = transport.sent[RESPONSE_HEAD : RESPONSE_HEAD + length]
        if not ok:
            raise CallFailed(body)
        return body

    def _handle_request(self, transport: TCPROSTransport, request: Message) -> None:
        """Call the handler and send its response, or its error, through ``transport``.

        This method exists only so that a program can replace it, in a subclass or on the class. It is called only if it is
        replaced.
        """
        try:
            response = to_response(self.response_class, self.handler(request))
            self.seq += 1
            transport.write_buff.write(b"\1")
            transport.send_message(response, self.seq)
        except ServiceException as error:
            self._write_service_error(transport, f"service cannot process request: {error}")
        except Exception as error:  # noqa: BLE001 - an error in the user's handler; it is sent to the client
            self._report(error)
            self._write_service_error(transport, f"error processing request: {error}")

    def _write_service_error(self, transport: TCPROSTransport, err_msg: str) -> None:
        """Send an error response to the client."""
        transport.write_data(serialize_failure(ServiceException(err_msg)))

    def _report(self, error: Exception) -> None:
        add_numpy_note(error)
        try:
            self.error_handler(error, type(error), error, error.__traceback__)
        except Exception:  # noqa: BLE001 - the user's too; rospy ends the connection, and the client never sees why
            _log.exception("the error handler of service [%s] failed", self.resolved_name)

    @staticmethod
    def _log_error(error: Exception, _: type[Exception], __: Exception, tb: TracebackType | None) -> None:
        text = "".join(traceback.format_exception(type(error), error, tb))
        _log.error("Error processing request: %s\n%s", error, text)


_HANDLE_REQUEST = Service._handle_request
