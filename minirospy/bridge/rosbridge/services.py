"""Services for clients of rosbridge: calls that they make, and services that they offer."""

from __future__ import annotations

import asyncio
import itertools
from typing import TYPE_CHECKING

from minirospy.aio.handle import serialized
from minirospy.aio.raw import service_header
from minirospy.bridge.graph import SharedGraph
from minirospy.bridge.rosbridge import conversion, protocol
from minirospy.bridge.rosbridge.types import service_class
from minirospy.errors import BridgeError, ServiceException
from minirospy.idl.protocols import Message

if TYPE_CHECKING:
    from minirospy.aio.services import Service
    from minirospy.bridge.rosbridge.session import RosbridgeSession

__all__ = ["ClientService", "call"]


async def call(graph: SharedGraph, name: str, arguments: object) -> Message:
    """Return a service's response. Raises BridgeError, ServiceException, ROSSerializationException."""
    service = graph.node.resolve(name)
    info = graph.service_info(service)
    if info:
        type_ = info.type
    else:
        try:
            type_ = (await service_header(graph.node, service)).get("type", "")
        except ServiceException as error:
            if str(error).endswith("unavailable"):
                raise BridgeError(f"Service {service} does not exist") from error
            raise
    found = service_class(type_)

    request = found._request_class()
    conversion.fill(request, conversion.request_values(request, arguments), graph.node.now)
    response = found._response_class()
    response.deserialize(await graph.call(service, found._md5sum, serialized(request)))
    return response


class ClientService:
    """A service that a client offers: calls of the graph go to it, and its answers back."""

    def __init__(self, session: RosbridgeSession, graph: SharedGraph, name: str, type_: str) -> None:
        """Raise BridgeError where the type is unknown, ServiceException where this node offers the service itself."""
        self.session = session
        self.name = name
        self._graph = graph
        self._class = service_class(type_)
        self._ids = itertools.count(1)
        self._waiting: dict[object, asyncio.Future[Message]] = {}
        self._service: Service = graph.node.serve(name, self._class, self._handle)
        graph.look_soon()

    async def close(self, why: str) -> None:
        """End it; calls under way fail with ``why``."""
        for future in self._waiting.values():
            if not future.done():
                future.set_exception(ServiceException(why))
        self._waiting.clear()
        await self._service.close()
        self._graph.look_soon()

    def answered(self, event: protocol.ServiceResponse) -> None:
        """Take over a client's answer. Raises BridgeError: values that do not fit, or no call waits for it."""
        future = self._waiting.pop(event.id, None)
        if future is None or future.done():
            raise BridgeError(f"no call of service {self.name} with id {event.id} waits for a response")
        if not event.result:
            future.set_exception(ServiceException(str(event.values)))
            return
        response = self._class._response_class()
        try:
            conversion.fill(response, event.values, self._graph.node.now)
        except conversion.ConversionError as error:
            future.set_exception(ServiceException(str(error)))
            raise
        future.set_result(response)

    async def _handle(self, request: Message) -> Message:
        id_ = f"service_request:{self.name}:{next(self._ids)}"
        future = self._waiting[id_] = asyncio.get_running_loop().create_future()
        self.session.send(protocol.service_call(self.name, conversion.values(request), id_))
        try:
            response: Message = await future
            return response
        finally:
            self._waiting.pop(id_, None)
