"""`rosrun tf2_web_republisher tf2_web_republisher`: the republisher as a node."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.aio.node import Node
from minirospy.bridge.serve import run
from minirospy.bridge.tf_republisher.republisher import Republisher
from minirospy.errors import MinirospyError

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down; return the exit status."""

    async def start(node: Node) -> Republisher:
        return Republisher(node, node.name)

    try:
        return run("tf2_web_republisher", sys.argv[1:] if argv is None else argv, start, _started)
    except MinirospyError as error:
        print(f"tf2_web_republisher: ERROR: {error}", file=sys.stderr)
        return 1


def _started(republisher: Republisher) -> None:
    republisher.node.log.info("serving transforms")
