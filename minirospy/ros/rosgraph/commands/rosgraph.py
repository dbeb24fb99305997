"""rosgraph: every second until Ctrl-C, print the connections between nodes, and the services.

Source: http://wiki.ros.org/rosgraph. The output is identical to that of ROS, with sorted names. All data comes from the
master, so a node that hangs causes no delay.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import NoReturn

from minirospy.command.command import NO_MASTER
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.introspect.graph import Graph
from minirospy.introspect.nodes import Neighbours, neighbours

__all__ = ["COMMAND", "main"]

_MISUSE = 255
_PAUSE_SECONDS = 1.0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return an exit status as defined in minirospy.command.command."""
    return COMMAND.main(argv)


_ROS_HELP = """rosgraph is a command-line tool for debugging the ROS Computation Graph.

Usage:
\trosgraph

"""


class _RosgraphParser(Parser):
    """A parser that prints ROS's help before its own and, like ROS, also on a usage error."""

    def format_help(self) -> str:
        return _ROS_HELP + super().format_help()

    def error(self, message: str, ros: str = "") -> NoReturn:
        """Print ROS's help to stdout and raise CommandLineError with ``message``."""
        sys.stdout.write(_ROS_HELP)
        super().error(message, ros)


def _parser() -> Parser:
    parser = _RosgraphParser(
        "rosgraph", description="Print the nodes, the senders and the receivers of each, once a second."
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


COMMAND = Command(
    "rosgraph",
    _parser,
    _rosgraph,
    wording={"master": NO_MASTER._replace(status=0)},
    misuse_status=_MISUSE,
)

if __name__ == "__main__":
    sys.exit(main())
