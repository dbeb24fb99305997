"""`rosrun rosapi rosapi_node`: rosapi's services as a node. Source: http://wiki.ros.org/rosapi."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.aio.node import Node
from minirospy.base.name_filter import NameFilter
from minirospy.web.graph import Filters
from minirospy.web.node_parameters import globs, private_parameters
from minirospy.web.rosapi.services import Rosapi
from minirospy.web.serve import exit_status, run

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""
    return exit_status("rosapi_node", lambda: run("rosapi_node", argv, _start, _announce))


async def _start(node: Node) -> Rosapi:
    private = await private_parameters(node)
    filters = Filters(
        topics=NameFilter.of(globs(private, "topics_glob")),
        services=NameFilter.of(globs(private, "services_glob")),
        parameters=NameFilter.of(globs(private, "params_glob")),
    )
    return Rosapi(node, filters)


def _announce(api: Rosapi) -> None:
    api.node.log.info("Rosapi started")
