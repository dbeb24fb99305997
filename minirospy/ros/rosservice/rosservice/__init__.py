"""rosservice: calls services, and provides information about them. Source: http://wiki.ros.org/rosservice."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import yaml

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
from minirospy.ros.rosgraph.rosgraph.names import script_resolve_name

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message, ServiceClass

__all__ = [
    "NAME",
    "ROSServiceException",
    "ROSServiceIOException",
    "_fullusage",
    "_get_master",
    "_optparse_service_only",
    "_resource_name_package",
    "_rosservice_args",
    "_rosservice_call",
    "_rosservice_cmd_args",
    "_rosservice_cmd_call",
    "_rosservice_cmd_find",
    "_rosservice_cmd_info",
    "_rosservice_cmd_list",
    "_rosservice_cmd_node",
    "_rosservice_cmd_type",
    "_rosservice_cmd_uri",
    "_rosservice_info",
    "_rosservice_list",
    "_rosservice_node",
    "_rosservice_type",
    "_rosservice_uri",
    "_stdin_yaml_arg",
    "_succeed",
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
    """Raised if a request about a service failed."""


class ROSServiceIOException(ROSServiceException):
    """Raised if the master or the service does not respond."""


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[Any]:
    """Return the service names, optionally only those of one node or in one namespace.

    If ``include_nodes``, return [name, [nodes]] for each service.
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
    """Return the services of this type."""
    with _graph() as graph:
        if service_type:
            return services.find_services_of_type(graph, service_type)
        # Query the master even if no service can match: as in ROS, an unreachable master is an error.
        services.list_services(graph)
        return []


def call_service(
    service_name: str, service_args: Sequence[object], service_class: ServiceClass | None = None
) -> tuple[Message, Any]:
    """Call a service with a request built from the values; return (request, response).

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
    """Run the command and, as in ROS, exit the program if it fails. ``argv`` starts with the command's name."""
    from minirospy.ros.rosservice.commands.rosservice import main

    if status := main(list(sys.argv if argv is None else argv)[1:]):
        sys.exit(status)


# Programs call the following private functions of ROS's rosservice.


def _verb(name: str) -> Callable[[Sequence[str]], None]:
    """Return a function that runs a verb. Its argument is a command line, starting with the command's name and the verb."""

    def call(argv: Sequence[str] = sys.argv) -> None:
        from minirospy.command.called import Raised, call_verb
        from minirospy.ros.rosservice.commands.rosservice import FAMILY

        call_verb(FAMILY, [name, *argv[2:]], Raised(ROSServiceException, ROSServiceIOException))

    return call


_rosservice_cmd_args = _verb("args")
_rosservice_cmd_call = _verb("call")
_rosservice_cmd_find = _verb("find")
_rosservice_cmd_list = _verb("list")
_rosservice_cmd_type = _verb("type")
_rosservice_cmd_uri = _verb("uri")


def _rosservice_cmd_node(argv: Sequence[str]) -> None:
    """Run `rosservice node`."""
    _rosservice_node(_optparse_service_only("node", argv))


def _rosservice_cmd_info(argv: Sequence[str]) -> None:
    """Run `rosservice info`."""
    from optparse import OptionParser

    parser = OptionParser(usage="usage: %prog info /service", prog=NAME)
    _, words = parser.parse_args(list(argv)[2:])
    if len(words) != 1:
        parser.error("you may only specify one service" if words else "you must specify a service name")
    _rosservice_info(script_resolve_name(NAME, words[0]))


def _rosservice_type(service_name: str) -> None:
    """Print a service's type. If the service does not exist, print an error and exit."""
    _print_or_exit(get_service_type(service_name), f"Unknown service [{service_name}]")


def _rosservice_uri(service_name: str) -> None:
    """Print a service's URI. If the service does not exist, print an error and exit."""
    _print_or_exit(get_service_uri(service_name), f"Unknown service: {service_name}")


def _rosservice_node(service_name: str) -> None:
    """Print the node that provides a service. If the service does not exist, print an error and exit."""
    _print_or_exit(get_service_node(service_name), f"Unknown service: {service_name}")


def _rosservice_args(service_name: str) -> None:
    """Print the field names of a service's request. Raise ROSServiceException if the service does not exist."""
    print(get_service_args(service_name))


def _print_or_exit(text: str | None, error: str) -> None:
    if not text:
        print(error, file=sys.stderr)
        sys.exit(1)
    print(text)


def _rosservice_list(namespace: str | None = None, print_nodes: bool = False) -> None:
    """Print the services in a namespace and, if ``print_nodes``, the nodes that provide them."""
    for name, nodes in sorted(get_service_list(namespace=namespace, include_nodes=True)):
        print(f"{name} {','.join(nodes)}" if print_nodes else name)


def _rosservice_info(service_name: str) -> None:
    """Print a service's node, URI, type and arguments. If the service does not exist, print an error and exit."""
    node = get_service_node(service_name)
    if not node:
        print("ERROR: unknown service", file=sys.stderr)
        sys.exit(1)
    print(f"Node: {node}")
    for label, find in (("URI", get_service_uri), ("Type", get_service_type), ("Args", get_service_args)):
        found = find(service_name)
        if found is None:
            print("ERROR: service is no longer available", file=sys.stderr)
            return
        print(f"{label}: {found}")


def _rosservice_call(
    service_name: str,
    service_args: Sequence[object],
    verbose: bool = False,
    service_class: ServiceClass | None = None,
) -> None:
    """Call a service; print the response and, if ``verbose``, the request before it.

    Raise ROSServiceException if the call fails.
    """
    request, response = call_service(script_resolve_name(NAME, service_name), service_args, service_class)
    if verbose:
        print(f"{request}\n---")
    print(response)


def _optparse_service_only(cmd: str, argv: Sequence[str] = sys.argv) -> str:
    """Return the global name of the single service on a command line.

    If there is none or more than one, print the usage and exit.
    """
    from optparse import OptionParser

    parser = OptionParser(usage=f"usage: %prog {cmd} /service", prog=NAME)
    _, words = parser.parse_args(list(argv)[2:])
    if len(words) != 1:
        parser.error("you may only specify one input service" if words else "service must be specified")
    return script_resolve_name(NAME, words[0])


def _resource_name_package(name: str) -> str | None:
    """Return the package in `pkg/Name`, or None if there is none."""
    return name.partition("/")[0] if "/" in name else None


def _stdin_yaml_arg() -> Iterator[Any]:
    """Yield each YAML document on stdin; a line with three hyphens or an empty line ends a document."""
    lines: list[str] = []
    while True:
        line = sys.stdin.readline()
        if line.strip() not in ("", "---"):
            lines.append(line)
            continue
        document = None
        try:
            document = yaml.safe_load("".join(lines))
        except yaml.YAMLError as error:
            print(f"Invalid YAML: {error}", file=sys.stderr)
        if document is None:
            return
        yield document
        lines.clear()


def _succeed(args: Sequence[object]) -> object:
    """Return the value of a response (code, status message, value). Raise ROSServiceException if it is an error."""
    code, text, value = args
    if code != 1:
        raise ROSServiceException(f"remote call failed: {text}")
    return value


def _fullusage() -> None:
    """Print the list of commands and exit with the status of a usage error."""
    rosservicemain([NAME])


def _resolved(graph: Graph, name: str) -> str:
    """Resolve a name to a global name. As in ROS, a non-string becomes a name that matches no service."""
    return graph.resolve(name) if isinstance(name, str) else str(name)


def _sent(graph: Graph, name: str) -> str:
    """Return the global name to send to the master. Raise TypeError if XML-RPC does not support the value's type."""
    check_sendable(name)
    return _resolved(graph, name)


def _get_master() -> masterapi.Master:
    """Return a master proxy that uses rosservice's caller id."""
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
