"""rosservice: calls services, and provides information about them. Source: http://wiki.ros.org/rosservice."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from minirospy.base.errors import (
    MasterUnreachableError,
    MessageException,
    MinirospyError,
    NodeUnreachableError,
    NotFoundError,
    ServiceException,
)
from minirospy.client.params import check_sendable
from minirospy.introspect import services
from minirospy.introspect.graph import Graph
from minirospy.ros.rosgraph.rosgraph import masterapi

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message, ServiceClass

__all__ = [
    "NAME",
    "ROSServiceException",
    "ROSServiceIOException",
    "_fullusage",
    "_get_master",
    "_rosservice_cmd_args",
    "_rosservice_cmd_call",
    "_rosservice_cmd_find",
    "_rosservice_cmd_info",
    "_rosservice_cmd_list",
    "_rosservice_cmd_node",
    "_rosservice_cmd_type",
    "_rosservice_cmd_uri",
    "call_service",
    "get_service_args",
    "get_service_class_by_name",
    "get_service_headers",
    "get_service_list",
    "get_service_node",
    "get_service_type",
    "get_service_uri",
    "has_service_args",
    "rosservice_find",
    "rosservicemain",
]

NAME = "rosservice"


class ROSServiceException(Exception):
    """A request about a service failed."""


class ROSServiceIOException(ROSServiceException):
    """The master or the service does not respond."""


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[Any]:
    """Return the services' names, optionally only those of one node or in one namespace.

    With ``include_nodes``, return [name, [nodes]] for each service.
    """
    with _graph() as graph:
        found = services.list_services(graph, graph.resolve(namespace) if namespace else "/")
        owner = _resolved(graph, node) if node else None
    found = [each for each in found if owner is None or owner in each.nodes]
    return [[each.name, list(each.nodes)] if include_nodes else each.name for each in found]


def get_service_type(service_name: str) -> str | None:
    """Return a service's type, or None if the service does not exist.

    Raise ROSServiceIOException if the service does not respond.
    """
    with _graph() as graph:
        try:
            return services.service_type(graph, _sent(graph, service_name))
        except NotFoundError:
            return None


def get_service_uri(service_name: str) -> str | None:
    """Return a service's URI, or None if the service does not exist."""
    with _graph() as graph:
        try:
            return services.service_uri(graph, _sent(graph, service_name))
        except NotFoundError:
            return None


def get_service_node(service_name: str) -> str | None:
    """Return the node that provides a service, or None if the service does not exist."""
    with _graph() as graph:
        nodes = graph.state().services.get(_resolved(graph, service_name))
    return nodes[0] if nodes else None


def get_service_args(service_name: str) -> str:
    """Return the field names of a service's request, separated by spaces.

    Raise ROSServiceException if the service or its type is not found.
    """
    with _graph() as graph:
        return " ".join(services.service_arguments(services.service_type(graph, graph.resolve(service_name))))


def get_service_class_by_name(service_name: str) -> ServiceClass:
    """Return a running service's class. Raise ROSServiceException if the service does not exist or its type is not installed."""
    from minirospy.core.idl.load import service_class

    with _graph() as graph:
        return service_class(services.service_type(graph, _sent(graph, service_name)))


def rosservice_find(service_type: str) -> list[str]:
    """Return the services that have this type."""
    with _graph() as graph:
        if service_type:
            return services.find_services_of_type(graph, service_type)
        # Query the master although no service can match, because as in ROS, an unreachable master is an error.
        services.list_services(graph)
        return []


def call_service(
    service_name: str, service_args: Sequence[object], service_class: ServiceClass | None = None
) -> tuple[Message, Any]:
    """Call a service; return (request, response), with the request built from the values.

    Raise ROSServiceException if the call fails.
    """
    with _graph() as graph:
        name = _sent(graph, service_name)
        type_ = service_class._type if service_class else services.service_type(graph, name)
        request = services.fill_request(type_, service_args)
        return request, services.call_service(graph, name, type_, request)


def get_service_headers(service_name: str, service_uri: str) -> dict[str, str]:
    """Return the connection header of a service's response. Raise ROSServiceIOException if the service does not respond."""
    if not isinstance(service_uri, str):
        raise ROSServiceException(
            f"Unable to communicate with service [{service_name}], address [{service_uri}]"
        )
    with _graph() as graph:
        return services.service_header(graph, _resolved(graph, service_name), service_uri)


def has_service_args(service_name: str, service_class: ServiceClass | None = None) -> bool:
    """Return whether a service's request has fields."""
    return bool((service_class or get_service_class_by_name(service_name))._request_class.__slots__)


def rosservicemain(argv: Sequence[str] | None = None) -> None:
    """Run the command, and exit the program if it fails, as ROS does. ``argv`` starts with the command's name."""
    from minirospy.ros.rosservice.commands.rosservice import main

    if status := main(list(sys.argv if argv is None else argv)[1:]):
        sys.exit(status)


# The following private functions of ROS's rosservice are called by programs.

_rosservice_cmd_args = _rosservice_cmd_call = _rosservice_cmd_find = _rosservice_cmd_info = rosservicemain
_rosservice_cmd_list = _rosservice_cmd_node = _rosservice_cmd_type = _rosservice_cmd_uri = rosservicemain


def _fullusage() -> None:
    """Print the list of commands, and exit with the status of a usage error."""
    rosservicemain([NAME])


def _resolved(graph: Graph, name: str) -> str:
    """Return a name's global name. A value that is not a string is converted to one, which matches no service, as in ROS."""
    return graph.resolve(name) if isinstance(name, str) else str(name)


def _sent(graph: Graph, name: str) -> str:
    """Return the global name to send to the master. Raise TypeError if XML-RPC does not support the value's type."""
    check_sendable(name)
    return _resolved(graph, name)


def _get_master() -> masterapi.Master:
    """Return a master proxy with rosservice's caller id."""
    return masterapi.Master("/rosservice")


@contextmanager
def _graph() -> Iterator[Graph]:
    try:
        with Graph.open("rosservice") as graph:
            yield graph
    except MasterUnreachableError as error:
        raise ROSServiceIOException(error.ros_text) from error
    except NodeUnreachableError as error:
        text = f"Unable to communicate with service [{error.name}], address [{error.uri}]"
        raise ROSServiceIOException(text) from error
    except NotFoundError as error:
        text = f"Service [{error.name}] is not available." if error.kind == "service" else str(error)
        raise ROSServiceException(text) from error
    except (MinirospyError, MessageException, ServiceException) as error:
        raise ROSServiceException(str(error)) from error
