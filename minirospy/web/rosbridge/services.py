"""Services for rosbridge clients: calls from clients, and services that clients offer."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar

from minirospy.aio.handle import serialized
from minirospy.aio.raw import service_header
from minirospy.base.errors import BridgeError, HandshakeRefused, ServiceException
from minirospy.core.idl.protocols import Message
from minirospy.web.graph import SharedGraph
from minirospy.web.rosbridge import conversion, protocol
from minirospy.web.rosbridge.types import service_class

if TYPE_CHECKING:
    from minirospy.aio.services import Service

__all__ = ["ClientService", "InThread", "Response", "call"]

_T = TypeVar("_T")


class InThread(Protocol):
    """A function that processes a large message in a thread."""

    async def __call__(self, work: Callable[[], _T]) -> _T: ...


class Response(NamedTuple):
    """The serialized response of a service, and the response's class."""

    message_class: type[Message]
    data: bytes

    def message(self) -> Message:
        """Deserialize the response. If its bytes are invalid, raise the exceptions of the message class."""
        message = self.message_class()
        message.deserialize(self.data)
        return message


async def call(
    graph: SharedGraph, name: str, arguments: object, in_thread: InThread | None = None
) -> Response:
    """Call a service; return the response.

    Raise BridgeError, ServiceException or ROSSerializationException if the call fails. With ``in_thread`` the arguments
    are converted in a thread, because they are large.
    """
    service = graph.node.resolve(name)
    info = graph.service_info(service)
    if info:
        try:
            return await _call(graph, service, info.type, arguments, in_thread)
        except (BridgeError, ServiceException) as error:
            # The node may have offered the service again with another type. These errors show that the call was not executed.
            is_other = isinstance(error, BridgeError) or isinstance(error.__cause__, HandshakeRefused)
            if not is_other or (type_ := await _type_of(graph, service)) == info.type:
                raise
            graph.check_service(service)
    else:
        type_ = await _type_of(graph, service)
    return await _call(graph, service, type_, arguments, in_thread)


async def _type_of(graph: SharedGraph, service: str) -> str:
    """Query the type of a service. Raise BridgeError if the service does not exist, ServiceException if it cannot be reached."""
    try:
        return (await service_header(graph.node, service)).get("type", "")
    except ServiceException as error:
        if str(error).endswith("unavailable"):
            raise BridgeError(f"Service {service} does not exist") from error
        raise


async def _call(
    graph: SharedGraph, service: str, type_: str, arguments: object, in_thread: InThread | None
) -> Response:
    found = service_class(type_)

    def body() -> bytes:
        request = found._request_class()
        conversion.fill(request, conversion.request_values(request, arguments), graph.node.now)
        return serialized(request)

    data = await in_thread(body) if in_thread else body()
    return Response(found._response_class, await graph.call(service, found._md5sum, data))


class ClientService:
    """A service offered by a client: forwards calls from the graph to the client, and responses from the client."""

    def __init__(
        self,
        owner: object,
        send: Callable[[Mapping[str, object]], None],
        graph: SharedGraph,
        name: str,
        type_: str,
    ) -> None:
        """Offer the service. ``owner`` is the client's session, and ``send`` sends a message to the client.

        Raise BridgeError if the type is unknown, ServiceException if this node already offers the service.
        """
        self.owner = owner
        self.name = name
        self._send = send
        self._graph = graph
        self._class = service_class(type_)
        self._ids = itertools.count(1)
        self._waiting: dict[object, asyncio.Future[Message]] = {}
        self._service: Service = graph.node.serve(name, self._class, self._handle)
        graph.refresh_soon()

    async def close(self, why: str) -> None:
        """Stop offering the service. Calls in progress fail with ``why`` as the error."""
        for future in self._waiting.values():
            if not future.done():
                future.set_exception(ServiceException(why))
        self._waiting.clear()
        await self._service.close()
        self._graph.refresh_soon()

    def answered(self, event: protocol.ServiceResponse) -> None:
        """Process a client's response. Raise BridgeError if its values do not match the type, or there is no such call."""
        future = self._taken(event)
        if not event.result:
            future.set_exception(ServiceException(str(event.values)))
            return
        try:
            response = self._response(event)
        except conversion.ConversionError as error:
            future.set_exception(ServiceException(str(error)))
            raise
        future.set_result(response)

    async def answered_large(self, event: protocol.ServiceResponse, in_thread: InThread) -> None:
        """Process a large response like :meth:`answered`, but convert it in a thread."""
        future = self._taken(event)
        try:
            response = await in_thread(lambda: self._response(event)) if event.result else None
        except conversion.ConversionError as error:
            if not future.done():
                future.set_exception(ServiceException(str(error)))
            raise
        if future.done():
            return  # the call was cancelled meanwhile
        if response is None:
            future.set_exception(ServiceException(str(event.values)))
        else:
            future.set_result(response)

    def _taken(self, event: protocol.ServiceResponse) -> asyncio.Future[Message]:
        future = self._waiting.pop(event.id, None)
        if future is None or future.done():
            raise BridgeError(f"no call of service {self.name} with id {event.id} waits for a response")
        return future

    def _response(self, event: protocol.ServiceResponse) -> Message:
        response: Message = self._class._response_class()
        conversion.fill(response, event.values, self._graph.node.now)
        return response

    async def _handle(self, request: Message) -> Message:
        id_ = f"service_request:{self.name}:{next(self._ids)}"
        future = self._waiting[id_] = asyncio.get_running_loop().create_future()
        self._send(protocol.service_call(self.name, conversion.values(request), id_))
        try:
            response: Message = await future
            return response
        finally:
            self._waiting.pop(id_, None)
