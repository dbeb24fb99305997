"""A node's services in an event loop, and calls to services."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import itertools
import traceback
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from minirospy.aio.handle import Handle, registered, serialized
from minirospy.base.errors import (
    CallFailed,
    HandshakeRefused,
    MasterUnreachableError,
    RpcError,
    RpcRefused,
    ServiceException,
    WireError,
)
from minirospy.core.idl.message import args_kwds_to_message, number_header
from minirospy.core.idl.protocols import Message
from minirospy.core.idl.service import to_response
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.services import AsyncServiceClient, LoopServiceServer, ServiceServer

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Service", "ServiceClass", "ServiceProxy"]

_Request_co = TypeVar("_Request_co", bound=Message, covariant=True)
_Response_co = TypeVar("_Response_co", bound=Message, covariant=True)


class ServiceClass(Protocol[_Request_co, _Response_co]):
    """The interface of a service class, such as ``std_srvs.srv.SetBool``: the classes of its request and response."""

    @property
    def _md5sum(self) -> str: ...

    @property
    def _request_class(self) -> type[_Request_co]: ...

    @property
    def _response_class(self) -> type[_Response_co]: ...


class ServiceProxy(Generic[_Response_co]):
    """Calls a service; created by :meth:`Node.service_proxy`. With ``persistent``, concurrent calls run one at a time."""

    def __init__(
        self,
        node: Node,
        name: str,
        service_class: ServiceClass[Message, _Response_co],
        persistent: bool,
        headers: Mapping[str, str] | None,
    ) -> None:
        self.name = name
        self._node = node
        self._service_class = service_class
        self._persistent = persistent
        self._headers = dict(headers or {})
        self._sequence = itertools.count(1)
        self._client: AsyncServiceClient | None = None
        self._lock = asyncio.Lock()

    async def __call__(self, *args: object, **kwds: object) -> _Response_co:
        """Call the service. Raise the same exceptions as :meth:`Node.call`."""
        message = args_kwds_to_message(self._service_class._request_class, args, kwds)
        number_header(message, next(self._sequence))
        request = serialized(message)
        if not self._persistent:
            client = await self._connect()
            try:
                return await self._exchange(client, request)
            finally:
                client.close()

        async with self._lock:
            if self._client and self._client.has_ended():
                self._disconnect()
            if self._client is None:
                self._client = await self._connect()
            keeping = False
            try:
                response = await self._exchange(self._client, request)
                keeping = True
            except ServiceException as error:
                keeping = isinstance(error.__cause__, CallFailed)
                raise
            finally:
                # Close the connection after a cancelled call: the next call would otherwise read the cancelled call's response.
                if not keeping:
                    self._disconnect()

        return response

    def close(self) -> None:
        """Close a persistent connection. If another task's call is using the connection, that call fails. Idempotent."""
        if self._lock.locked() and self._client:
            # Let the call in progress close the socket; closing it here would not wake that call.
            self._client.hang_up()
        else:
            self._disconnect()

    def _disconnect(self) -> None:
        client, self._client = self._client, None
        if client:
            client.close()

    async def _connect(self) -> AsyncServiceClient:
        node = self._node
        try:
            uri = await node._node.master("lookupService", self.name)
        except RpcRefused:
            raise ServiceException(f"service [{self.name}] unavailable") from None
        except (MasterUnreachableError, RpcError) as error:
            raise ServiceException(f"unable to contact master: {error}") from error

        try:
            return await AsyncServiceClient.connect(
                uri,
                self.name,
                self._service_class._md5sum,
                node.name,
                persistent=self._persistent,
                headers=self._headers,
                same_host=node._node.environment.same_host,
            )
        except HandshakeRefused as error:
            raise ServiceException(f"unable to connect to service: remote error reported: {error}") from None
        except (OSError, WireError) as error:
            raise ServiceException(f"unable to connect to service: {error}") from error

    async def _exchange(self, client: AsyncServiceClient, request: bytes) -> _Response_co:
        try:
            body = await client.call(request)
        except CallFailed as error:
            raise ServiceException(
                f"service [{self.name}] responded with an error: {error.text!r}"
            ) from error
        except (OSError, WireError) as error:
            raise ServiceException(f"transport error completing service call: {error}") from error
        response = self._service_class._response_class()
        try:
            response.deserialize(body)
        except Exception as error:  # any error that a third-party message class raises on invalid bytes
            raise ServiceException(f"transport error completing service call: {error}") from error
        response._connection_header = client.header
        return response


class Service(Handle):
    """A service that a node offers; created by :meth:`Node.serve`."""

    def __init__(
        self,
        node: Node,
        name: str,
        service_class: ServiceClass[Message, Message],
        handler: Callable[[Any], Any],
    ) -> None:
        self.name = name
        self._node = node
        self._request_class = service_class._request_class
        self._response_class = service_class._response_class
        self._handler = handler
        self._sequence = itertools.count(1)

        runtime = node._node
        is_async = inspect.iscoroutinefunction(handler) or inspect.iscoroutinefunction(
            getattr(handler, "__call__", None)  # noqa: B004 - an object whose __call__ is a coroutine function
        )
        type_ = InterfaceType.of(service_class)
        types = {"request_type": self._request_class._type, "response_type": self._response_class._type}

        self._server: ServiceServer
        if is_async:
            self._server = LoopServiceServer(
                name, type_, node.name, self._handle_on_loop, workers=runtime.workers, **types
            )
        else:
            self._server = runtime.make_service(name, type_, self._handle_in_worker, **types)

        node._served.add(name)
        self._registration = node._spawn(
            registered(runtime.serve, self._server, f"service [{name}]", node.registration_faults)
        )

    async def close(self) -> None:
        """Stop offering the service; calls in progress still get their responses. Idempotent."""
        await asyncio.wait([self._registration])
        if self._node._node.services.get(self.name) is self._server:
            self._node._served.discard(self.name)
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._node._node.unserve(self._server)

    async def _handle_on_loop(self, body: bytes, header: Header) -> bytes:
        try:
            return self._response(await self._handler(self._request(body, header)))
        except Exception as error:
            raise self._failure(error) from error

    def _handle_in_worker(self, body: memoryview, header: Header) -> bytes:
        try:
            return self._response(self._handler(self._request(bytes(body), header)))
        except Exception as error:
            raise self._failure(error) from error

    def _request(self, body: bytes, header: Header) -> Message:
        request = self._request_class()
        request.deserialize(body)
        request._connection_header = header
        return request

    def _response(self, returned: object) -> bytes:
        response = to_response(self._response_class, returned)
        number_header(response, next(self._sequence))
        return serialized(response)

    def _failure(self, error: Exception) -> ServiceException:
        if isinstance(error, ServiceException):
            return ServiceException(f"service cannot process request: {error}")
        text = "".join(traceback.format_exception(type(error), error, error.__traceback__))
        self._node.log.error("Error processing request: %s\n%s", error, text)
        return ServiceException(f"error processing request: {error}")
