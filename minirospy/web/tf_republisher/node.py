"""`rosrun tf2_web_republisher tf2_web_republisher`: the republisher as a node."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.aio.node import Node
from minirospy.web.serve import exit_status, run
from minirospy.web.tf_republisher.republisher import Republisher

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""

    async def start(node: Node) -> Republisher:
        return Republisher(node, node.name)

    name = "tf2_web_republisher"
    return exit_status(name, lambda: run(name, argv, start, _started))


def _started(republisher: Republisher) -> None:
    republisher.node.log.info("serving transforms")
