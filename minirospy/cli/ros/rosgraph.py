"""rosgraph: who sends to whom, and which services there are; printed again each second until Ctrl-C.

Source: http://wiki.ros.org/rosgraph. What is printed is what ROS prints, with names sorted; it comes from the master
alone, so that a node that hangs holds nothing up.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from minirospy.cli.command import NO_MASTER
from minirospy.cli.parser import Parser
from minirospy.cli.verbs import Command
from minirospy.introspect.graph import Graph
from minirospy.introspect.nodes import Neighbours, neighbours

__all__ = ["COMMAND", "main"]

_PAUSE_SECONDS = 1.0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit status as in minirospy.cli.command."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "rosgraph", description="Print the nodes, who sends to them and to whom they send, each second."
    )
    parser.add_argument("-1", "--once", action="store_true", help="print it once and exit")
    return parser


def _rosgraph(once: bool) -> None:
    with Graph.open("rosgraph") as graph:
        while True:
            state = graph.state()
            sys.stdout.write(_text(neighbours(state), sorted(state.services)))
            sys.stdout.flush()
            if once:
                return
            time.sleep(_PAUSE_SECONDS)


def _text(nodes: dict[str, Neighbours], services: Sequence[str]) -> str:
    if not nodes:
        return "empty\n"
    lines = ["", "", "Nodes:"]
    for name, node in nodes.items():
        lines += [f"  {name} :", "    Inbound:", *(f"      {each}" for each in node.senders)]
        lines += ["    Outbound:", *(f"      {each}" for each in node.receivers)]
    lines += ["Services:", *(f"  {name}" for name in services)]
    return "\n".join([*lines, ""])


COMMAND = Command("rosgraph", _parser, _rosgraph, wording={"master": NO_MASTER})

if __name__ == "__main__":
    sys.exit(main())
