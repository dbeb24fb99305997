"""rosapi's services, provided by a node. Source: http://wiki.ros.org/rosapi."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from rosapi.msg import TypeDef
from rosapi.srv import (
    DeleteParam,
    GetActionServers,
    GetParam,
    GetParamNames,
    GetTime,
    HasParam,
    MessageDetails,
    NodeDetails,
    Nodes,
    Publishers,
    SearchParam,
    ServiceHost,
    ServiceNode,
    ServiceProviders,
    ServiceRequestDetails,
    ServiceResponseDetails,
    Services,
    ServicesForType,
    ServiceType,
    SetParam,
    Subscribers,
    Topics,
    TopicsAndRawTypes,
    TopicsForType,
    TopicType,
)

from minirospy.aio.node import Node
from minirospy.aio.raw import service_header
from minirospy.aio.services import Service, ServiceClass
from minirospy.base.errors import BridgeError, RpcRefused, ServiceException
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.tcpros import ANY
from minirospy.introspect.node_queries import MAX_CONCURRENT
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.web.graph import Filters
from minirospy.web.json_text import load_json
from minirospy.web.rosapi.typedefs import TypeDefinition, describe
from minirospy.web.rosbridge.types import message_class, service_class

if TYPE_CHECKING:
    from rosapi.srv import (
        DeleteParamRequest,
        GetParamRequest,
        HasParamRequest,
        MessageDetailsRequest,
        NodeDetailsRequest,
        PublishersRequest,
        SearchParamRequest,
        ServiceHostRequest,
        ServiceNodeRequest,
        ServiceProvidersRequest,
        ServiceRequestDetailsRequest,
        ServiceResponseDetailsRequest,
        ServicesForTypeRequest,
        ServiceTypeRequest,
        SetParamRequest,
        SubscribersRequest,
        TopicsForTypeRequest,
        TopicTypeRequest,
    )

__all__ = ["Rosapi"]

_Handler = Callable[[Any], Awaitable[object]]

_ACTION_TOPICS = ("cancel", "feedback", "goal", "result", "status")


class Rosapi:
    """Provides the ``/rosapi/...`` services on a node. The services report only names that the filters allow."""

    def __init__(self, node: Node, filters: Filters | None = None) -> None:
        self.node = node
        self._filters = filters or Filters()
        self._probing = asyncio.Semaphore(MAX_CONCURRENT)
        self._served: list[Service] = []
        self._offers: dict[str, tuple[ServiceClass[Message, Message], _Handler]] = {
            "topics": (Topics, self._topics),
            "topics_for_type": (TopicsForType, self._topics_for_type),
            "topics_and_raw_types": (TopicsAndRawTypes, self._topics_and_raw_types),
            "topic_type": (TopicType, self._topic_type),
            "publishers": (Publishers, self._publishers),
            "subscribers": (Subscribers, self._subscribers),
            "services": (Services, self._services),
            "services_for_type": (ServicesForType, self._services_for_type),
            "service_type": (ServiceType, self._service_type),
            "service_providers": (ServiceProviders, self._service_providers),
            "service_node": (ServiceNode, self._service_node),
            "service_host": (ServiceHost, self._service_host),
            "nodes": (Nodes, self._nodes),
            "node_details": (NodeDetails, self._node_details),
            "action_servers": (GetActionServers, self._action_servers),
            "message_details": (MessageDetails, self._message_details),
            "service_request_details": (ServiceRequestDetails, self._request_details),
            "service_response_details": (ServiceResponseDetails, self._response_details),
            "set_param": (SetParam, self._set_param),
            "get_param": (GetParam, self._get_param),
            "has_param": (HasParam, self._has_param),
            "search_param": (SearchParam, self._search_param),
            "delete_param": (DeleteParam, self._delete_param),
            "get_param_names": (GetParamNames, self._get_param_names),
            "get_time": (GetTime, self._get_time),
        }

    async def start(self) -> None:
        """Start offering the services."""
        for name, (class_, handler) in self._offers.items():
            self._served.append(self.node.serve(f"/rosapi/{name}", class_, _guarded(handler)))
        for service in self._served:
            await service

    async def close(self) -> None:
        """Stop offering the services. Idempotent."""
        served, self._served = self._served, []
        for service in served:
            await service.close()

    async def _graph(self) -> Snapshot:
        found = await fetch(self.node.call_master)
        return found.filtered(self._filters.topics, self._filters.services)

    # --- topics

    async def _typed_topics(self) -> tuple[list[str], list[str]]:
        graph = await self._graph()
        types = {topic: _known(graph.types.get(topic)) for topic in graph.topics}
        # Topics of unknown type come last.
        topics = sorted(types, key=lambda topic: (not types[topic], topic))
        return topics, [types[topic] for topic in topics]

    async def _topics(self, _: object) -> object:
        return await self._typed_topics()

    async def _topics_for_type(self, request: TopicsForTypeRequest) -> object:
        topics, types = await self._typed_topics()
        return {
            "topics": [topic for topic, type_ in zip(topics, types, strict=True) if type_ == request.type]
        }

    async def _topics_and_raw_types(self, _: object) -> object:
        topics, types = await self._typed_topics()
        return topics, types, [_text_of(type_) for type_ in types]

    async def _topic_type(self, request: TopicTypeRequest) -> object:
        return {"type": _known((await self._graph()).types.get(self.node.resolve(request.topic)))}

    async def _publishers(self, request: PublishersRequest) -> object:
        return {"publishers": (await self._graph()).publishers.get(request.topic, ())}

    async def _subscribers(self, request: SubscribersRequest) -> object:
        return {"subscribers": (await self._graph()).subscribers.get(request.topic, ())}

    async def _action_servers(self, _: object) -> object:
        topics = (await self._graph()).topics
        names = {topic.rpartition("/")[0] for topic in topics if topic.count("/") > 1}
        servers = [name for name in names if all(f"{name}/{part}" in topics for part in _ACTION_TOPICS)]
        return {"action_servers": sorted(servers)}

    # --- services

    async def _type_of(self, service: str) -> str:
        """Return a service's type, or "" if the service does not respond."""
        if not self._filters.services(service):
            return ""
        async with self._probing:
            try:
                return (await service_header(self.node, service)).get("type", "")
            except ServiceException:
                return ""

    async def _services_of(self, type_: str) -> list[tuple[str, tuple[str, ...]]]:
        services = (await self._graph()).services
        types = await asyncio.gather(*(self._type_of(name) for name in services))
        return [each for each, found in zip(services.items(), types, strict=True) if found == type_]

    async def _services(self, _: object) -> object:
        return {"services": sorted((await self._graph()).services)}

    async def _services_for_type(self, request: ServicesForTypeRequest) -> object:
        return {"services": [name for name, _ in await self._services_of(request.type)]}

    async def _service_type(self, request: ServiceTypeRequest) -> object:
        return {"type": await self._type_of(self.node.resolve(request.service))}

    async def _service_providers(self, request: ServiceProvidersRequest) -> object:
        """Return the nodes that provide services of a type; the request's field for the type is called ``service``."""
        found = await self._services_of(request.service)
        return {"providers": [node for _, nodes in found for node in nodes]}

    async def _service_node(self, request: ServiceNodeRequest) -> object:
        nodes = (await self._graph()).services.get(self.node.resolve(request.service), ())
        return {"node": nodes[0] if nodes else ""}

    async def _service_host(self, request: ServiceHostRequest) -> object:
        try:
            uri = await self.node.call_master("lookupService", self.node.resolve(request.service))
        except RpcRefused:
            return {"host": ""}
        return {"host": urlsplit(uri).hostname or ""}

    # --- nodes and types

    async def _nodes(self, _: object) -> object:
        graph = await fetch(self.node.call_master)
        tables = (graph.publishers, graph.subscribers, graph.services)
        return {"nodes": sorted({node for table in tables for nodes in table.values() for node in nodes})}

    async def _node_details(self, request: NodeDetailsRequest) -> object:
        graph = await self._graph()
        tables = (graph.subscribers, graph.publishers, graph.services)
        return [sorted(name for name, nodes in table.items() if request.node in nodes) for table in tables]

    async def _message_details(self, request: MessageDetailsRequest) -> object:
        return _typedefs(message_class(request.type))

    async def _request_details(self, request: ServiceRequestDetailsRequest) -> object:
        return _typedefs(service_class(request.type)._request_class)

    async def _response_details(self, request: ServiceResponseDetailsRequest) -> object:
        return _typedefs(service_class(request.type)._response_class)

    # --- parameters

    async def _set_param(self, request: SetParamRequest) -> object:
        if self._filters.parameters(request.name):
            try:
                value = load_json(request.value)
            except (ValueError, RecursionError) as error:
                raise BridgeError(
                    "Due to the type flexibility of the ROS parameter server, the value argument to set_param must be a "
                    "JSON-formatted string."
                ) from error
            await self.node.set_param(request.name, value)
        return {}

    async def _get_param(self, request: GetParamRequest) -> object:
        default: object = None
        if request.default:
            try:
                default = load_json(request.default)
            except (ValueError, RecursionError):
                default = request.default
        if not self._filters.parameters(request.name):
            return {"value": "null"}
        return {"value": json.dumps(await self.node.get_param(request.name, default), default=str)}

    async def _has_param(self, request: HasParamRequest) -> object:
        allowed = self._filters.parameters(request.name)
        return {"exists": allowed and await self.node.has_param(request.name)}

    async def _search_param(self, request: SearchParamRequest) -> object:
        if not self._filters.parameters(request.name):
            return {"global_name": ""}
        return {"global_name": await self.node.search_param(request.name) or ""}

    async def _delete_param(self, request: DeleteParamRequest) -> object:
        if self._filters.parameters(request.name) and await self.node.has_param(request.name):
            with contextlib.suppress(KeyError):
                await self.node.delete_param(request.name)
        return {}

    async def _get_param_names(self, _: object) -> object:
        return {
            "names": [name for name in await self.node.get_param_names() if self._filters.parameters(name)]
        }

    async def _get_time(self, _: object) -> object:
        return {"time": self.node.now()}


def _guarded(handler: _Handler) -> _Handler:
    """Wrap a handler: report a BridgeError to the client on one line, without a traceback in the log."""

    async def handle(request: object) -> object:
        try:
            return await handler(request)
        except BridgeError as error:
            raise ServiceException(str(error)) from error

    return handle


def _known(type_: str | None) -> str:
    return "" if type_ in (None, ANY) else str(type_)


def _text_of(type_: str) -> str:
    """Return the full definition of a type, or "" if it is not installed."""
    try:
        text: str = message_class(type_)._full_text
    except BridgeError:
        return ""
    return text


def _typedefs(class_: type[Message]) -> object:
    return {"typedefs": [_typedef(found) for found in describe(class_, message_class)]}


def _typedef(found: TypeDefinition) -> TypeDef:
    return TypeDef(
        type=found.type,
        fieldnames=found.names,
        fieldtypes=found.types,
        fieldarraylen=found.lengths,
        examples=found.examples,
        constnames=[name for name, _ in found.constants],
        constvalues=[value for _, value in found.constants],
    )
