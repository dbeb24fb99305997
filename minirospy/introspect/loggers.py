"""A node's loggers and their levels, as the node reports them.

Source: http://wiki.ros.org/rosconsole (the services get_loggers and set_logger_level of each node).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from minirospy.base.errors import MinirospyError, NotFoundError
from minirospy.introspect.nodes import find_node
from minirospy.introspect.services import call_service, fill_request

if TYPE_CHECKING:
    from roscpp.srv import GetLoggersResponse

    from minirospy.core.idl.protocols import Message
    from minirospy.introspect.graph import Graph

__all__ = ["logger_level", "logger_levels", "set_logger_level"]


def logger_levels(graph: Graph, node: str) -> dict[str, str]:
    """Return the loggers of the node with global name ``node``, as a dict from logger to level (lower case).

    Raise NotFoundError if the node does not exist, NodeUnreachableError if it does not respond, or MinirospyError if it
    has no logger services.
    """
    response = _ask(graph, node, "get_loggers", "roscpp/GetLoggers", [])
    return {logger.name: logger.level for logger in cast("GetLoggersResponse", response).loggers}


def logger_level(graph: Graph, node: str, logger: str) -> str:
    """Return the level of one of a node's loggers.

    Raise NotFoundError if the logger does not exist; otherwise raise the same exceptions as :func:`logger_levels`.
    """
    levels = logger_levels(graph, node)
    if logger not in levels:
        raise NotFoundError(f"logger of node {node}", logger, levels)
    return levels[logger]


def set_logger_level(graph: Graph, node: str, logger: str, level: str) -> None:
    """Set the level of a node's logger. Raise the same exceptions as :func:`logger_level`."""
    # A node accepts any logger name, so check that the logger exists first.
    logger_level(graph, node, logger)
    _ask(graph, node, "set_logger_level", "roscpp/SetLoggerLevel", [logger, level])


def _ask(graph: Graph, node: str, service: str, type_: str, arguments: Sequence[str]) -> Message:
    """Call one of the services that every node provides; return the response."""
    name = find_node(graph, node).name
    try:
        return call_service(graph, f"{name}/{service}", type_, fill_request(type_, arguments))
    except NotFoundError as error:
        raise MinirospyError(
            f"node [{name}] does not report its loggers: it has no service {service}"
        ) from error
