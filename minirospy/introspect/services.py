"""Services: list and call them, and find their types and providers.

Source: http://wiki.ros.org/rosservice, http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import (
    SUSPENDED,
    CallFailed,
    HandshakeRefused,
    NodeUnreachableError,
    RpcRefused,
    ServiceException,
    WireError,
)
from minirospy.introspect.graph import Graph, in_namespace, unknown_service

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from minirospy.core.idl.protocols import Message
    from minirospy.core.wire.header import Header
    from minirospy.runtime.node.service_client import ServiceClient

__all__ = [
    "ServiceOffer",
    "ServiceProviders",
    "call_service",
    "fill_request",
    "find_services_of_type",
    "list_services",
    "service_arguments",
    "service_header",
    "service_offer",
    "service_type",
    "service_uri",
    "wait_for_service",
]

_POLL_SECONDS = 0.1
_PROBE_SECONDS = 5.0
_ANY = "*"


class ServiceProviders(NamedTuple):
    """A service and the nodes that provide it. The node that registered it last receives the calls."""

    name: str
    nodes: tuple[str, ...]


class ServiceOffer(NamedTuple):
    """A registered service: the node that provides it, and the service's URI."""

    node: str
    uri: str


def list_services(graph: Graph, namespace: str = "/") -> list[ServiceProviders]:
    """Return the services at or below ``namespace``, each with its nodes, sorted by name."""
    state = graph.state()
    return [
        ServiceProviders(name, tuple(state.services[name]))
        for name in sorted(state.services)
        if in_namespace(name, namespace)
    ]


def service_uri(graph: Graph, service: str) -> str:
    """Return a service's URI (``rosrpc://host:port``). Raise NotFoundError if the service does not exist."""
    try:
        return graph.master.lookup_service(service)
    except RpcRefused:
        raise unknown_service(graph, service) from None


def service_type(graph: Graph, service: str) -> str:
    """Return the type of a service, as reported by its provider.

    Raise NotFoundError if the service does not exist, or NodeUnreachableError if its node does not respond.
    """
    return _probe(graph, service, service_uri(graph, service))


def service_offer(graph: Graph, service: str) -> ServiceOffer:
    """Return the node that provides a service, and its URI. Raise NotFoundError if the service does not exist."""
    nodes = graph.state().services.get(service)
    if not nodes:
        raise unknown_service(graph, service)
    return ServiceOffer(nodes[0], service_uri(graph, service))


def service_arguments(type_: str) -> list[str]:
    """Return the request field names of a service type. Raise NotFoundError if the type is not installed."""
    from minirospy.core.idl.load import service_class

    return list(service_class(type_)._request_class.__slots__)


def find_services_of_type(graph: Graph, type_: str) -> list[str]:
    """Return the sorted names of all services of a type. Omit services that do not respond."""
    return [service.name for service in list_services(graph) if _probed_type(graph, service.name) == type_]


def wait_for_service(graph: Graph, service: str, on_waiting: Callable[[], object]) -> None:
    """Wait until a service is registered and responds. Call ``on_waiting`` once if it is not available immediately."""
    if _probed_type(graph, service):
        return
    on_waiting()
    while not _probed_type(graph, service):
        time.sleep(_POLL_SECONDS)


def fill_request(type_: str, arguments: Sequence[object]) -> Message:
    """Create a service request from YAML values: one dictionary, or all fields in order.

    ``now`` represents the current time, ``auto`` a stamped header. The header's ``seq`` is 1, as in a proxy's first call.
    Raise NotFoundError if the type is not installed, MessageException if the values do not match the fields.
    """
    from minirospy.core.idl.load import service_class
    from minirospy.core.idl.message import number_header
    from minirospy.introspect.messages import fill, words_of

    request = fill(service_class(type_)._request_class(), arguments, words_of(time.time_ns()))
    number_header(request, 1)
    return request


def call_service(graph: Graph, service: str, type_: str, request: Message) -> Message:
    """Call a service and return the response.

    Raise NotFoundError if the service does not exist, NodeUnreachableError if its node does not respond, or ServiceException,
    with the server's message, if the call fails.
    """
    from minirospy.core.idl.load import service_class
    from minirospy.introspect.messages import check, serialize

    cls = service_class(type_)
    check(request)
    uri = service_uri(graph, service)
    try:
        client = _connect(graph, service, uri, cls._md5sum)
    except HandshakeRefused as error:
        raise ServiceException(f"service [{service}] refused the connection: {error}") from error
    except (OSError, WireError) as error:
        raise NodeUnreachableError(service, uri, _why(error), kind="service") from error
    try:
        body = client.call(serialize(request))
    except CallFailed as error:
        raise ServiceException(f"service [{service}] responded with an error: {error}") from error
    except (OSError, WireError) as error:
        raise ServiceException(
            f"service [{service}] ended the connection during the call: {error}"
        ) from error
    finally:
        client.close()
    response = cls._response_class()
    response.deserialize(body)
    return response


def _probed_type(graph: Graph, service: str) -> str | None:
    """Return a service's type, or None if it does not exist or does not respond."""
    try:
        return _probe(graph, service, graph.master.lookup_service(service))
    except (RpcRefused, NodeUnreachableError):
        return None


def service_header(graph: Graph, service: str, uri: str) -> Header:
    """Return the connection header of the service at ``uri``. Raise NodeUnreachableError if the node does not respond."""
    try:
        client = _connect(graph, service, uri, _ANY, probe=True)
    except (OSError, WireError) as error:
        raise NodeUnreachableError(service, uri, _why(error), kind="service") from error
    client.close()
    return client.header


def _probe(graph: Graph, service: str, uri: str) -> str:
    type_ = service_header(graph, service, uri).get("type")
    if not type_:
        raise NodeUnreachableError(service, uri, "it does not send its type", kind="service")
    return type_


def _why(error: Exception) -> str:
    """Return an error's message without its error number, or a timeout's likely cause."""
    if isinstance(error, TimeoutError):
        return f"timed out; {SUSPENDED}"
    return getattr(error, "strerror", None) or str(error)


def _connect(graph: Graph, service: str, uri: str, md5sum: str, *, probe: bool = False) -> ServiceClient:
    # Import this module here, because listing services does not need it.
    from minirospy.runtime.node.service_client import ServiceClient

    return ServiceClient(uri, service, md5sum, "/" + graph.tool, probe=probe, timeout=_PROBE_SECONDS)
