"""`rosrun rosapi rosapi_node`: the services of rosapi as a node. Source: http://wiki.ros.org/rosapi."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.aio.node import Node
from minirospy.bridge.access import NameFilter
from minirospy.bridge.graph import Filters
from minirospy.bridge.node_parameters import globs
from minirospy.bridge.rosapi.services import Rosapi
from minirospy.bridge.serve import run
from minirospy.errors import MinirospyError

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down; return the exit status."""
    try:
        return run("rosapi_node", sys.argv[1:] if argv is None else argv, _start, _announce)
    except MinirospyError as error:
        print(f"rosapi_node: ERROR: {error}", file=sys.stderr)
        return 1


async def _start(node: Node) -> Rosapi:
    parameters = await node.get_param("~", {})
    private = parameters if isinstance(parameters, dict) else {}
    filters = Filters(
        topics=NameFilter.of(globs(private, "topics_glob")),
        services=NameFilter.of(globs(private, "services_glob")),
        parameters=NameFilter.of(globs(private, "params_glob")),
    )
    return Rosapi(node, filters)


def _announce(api: Rosapi) -> None:
    api.node.log.info("Rosapi started")
