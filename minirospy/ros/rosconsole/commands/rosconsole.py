"""rosconsole: get and set the levels of a node's loggers, and print the messages that nodes log.

Source: http://wiki.ros.org/rosconsole (the command). The output is identical to that of ROS.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime, timezone
from typing import TYPE_CHECKING, cast

from minirospy.base.errors import MinirospyError, UsageError
from minirospy.base.log_levels import LEVEL_NAMES
from minirospy.command.command import tool_node, warn, warn_unpublished
from minirospy.command.parser import Parser
from minirospy.command.verbs import Family, Verb
from minirospy.introspect.graph import Graph
from minirospy.introspect.loggers import logger_level, logger_levels, set_logger_level
from minirospy.introspect.nodes import list_nodes
from minirospy.introspect.topics import find_topic

if TYPE_CHECKING:
    from rosgraph_msgs.msg import Log

    from minirospy.base.names import Arguments

__all__ = ["FAMILY", "main"]

# Levels of rosgraph_msgs/Log, by lowercase name.
_LEVELS = {name.lower(): level for level, name in LEVEL_NAMES.items()}

_COLOURS = {"debug": 92, "info": 97, "warn": 93, "error": 91, "fatal": 95}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


def _list_parser() -> Parser:
    parser = Parser("rosconsole list", "List the loggers of a node.")
    _add_node(parser)
    return parser


def _list(node: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosconsole", arguments=arguments) as graph:
        print("\n".join(logger_levels(graph, graph.resolve(node))))


def _get_parser() -> Parser:
    parser = Parser("rosconsole get", "Print the level of a node's logger.")
    _add_node(parser)
    _add_logger(parser)
    return parser


def _get(node: str, logger: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosconsole", arguments=arguments) as graph:
        print(logger_level(graph, graph.resolve(node), logger).upper())


def _set_parser() -> Parser:
    parser = Parser("rosconsole set", "Set the level of a node's logger.")
    _add_node(parser)
    _add_logger(parser)
    parser.add_argument("level", type=str.lower, choices=list(_LEVELS), help="the least level that it logs")
    return parser


def _set(node: str, logger: str, level: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosconsole", arguments=arguments) as graph:
        set_logger_level(graph, graph.resolve(node), logger, level)


def _echo_parser() -> Parser:
    parser = Parser("rosconsole echo", "Print what nodes log, until Ctrl-C.")

    parser.add_argument(
        "filter",
        metavar="FILTER",
        nargs="?",
        default=".*",
        help="a regular expression: only nodes whose name starts with it (default: .*)",
        completer="nothing",
    )
    parser.add_argument(
        "-l",
        "--level",
        type=str.lower,
        choices=list(_LEVELS),
        default="warn",
        help="only what has at least this level (default: warn)",
    )

    parser.add_argument("-1", "--once", action="store_true", help="exit after the first line")
    parser.add_argument(
        "--topic", default="/rosout", help="listen to this topic (default: /rosout)", completer="topics"
    )
    parser.add_argument("--nocolor", action="store_true", help="no colours")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="print the time and the place in the code, too"
    )
    return parser


def _echo(
    filter: str,
    level: str,
    once: bool,
    topic: str,
    nocolor: bool,
    verbose: bool,
    arguments: Arguments | None = None,
) -> int:
    try:
        wanted = re.compile(filter)
    except re.error as error:
        raise UsageError(f"[{filter}] is not a regular expression: {error}") from error

    with Graph.open("rosconsole", arguments=arguments) as graph:
        name = graph.resolve(topic)
        field = find_topic(graph, name)
        if not field or field.path:
            warn_unpublished(graph, name)
        if not any(map(wanted.match, list_nodes(graph))):
            warn(f"no node's name starts with [{wanted.pattern}] yet")

    with tool_node("rosconsole", arguments) as node:
        for received in node.inbox(name):
            message = node.classes.read(received)
            if message._type != "rosgraph_msgs/Log":
                raise MinirospyError(f"[{topic}] carries {message._type}, not rosgraph_msgs/Log")
            log = cast("Log", message)
            if log.level < _LEVELS[level] or not wanted.match(log.name):
                continue

            print(_shown(log, colour=not nocolor, verbose=verbose), flush=True)
            if once:
                break
    return 0


def _add_node(parser: Parser) -> None:
    parser.add_argument("node", help="the node's name", completer="nodes")


def _add_logger(parser: Parser) -> None:
    parser.add_argument("logger", help="the logger, as rosout", completer="loggers")


def _shown(log: Log, *, colour: bool, verbose: bool) -> str:
    name = next((name for name, level in _LEVELS.items() if level == log.level), str(log.level))
    label = f"{name.upper():5}"
    if colour:
        label = f"\033[{_COLOURS.get(name, 97)}m{label}\033[0m"
    text = f"[ {label} ] [\033[1m{log.name}\033[21m]: {log.msg}"
    if verbose:
        seconds = log.header.stamp.to_sec()
        when = datetime.fromtimestamp(seconds, timezone.utc).astimezone()
        text += f"\n          [{when} ({seconds:.6f})] [{log.function}]: {log.file}:{log.line}"
    return text


FAMILY = Family(
    "rosconsole",
    "rosconsole is a command-line tool for configuring the logger level of ROS nodes.",
    (
        Verb("get", "display level for a logger", _get_parser, _get),
        Verb("list", "list loggers for a node", _list_parser, _list),
        Verb("set", "set level for a logger", _set_parser, _set),
        Verb("echo", "print logger messages", _echo_parser, _echo),
    ),
    "Type rosconsole <command> -h for more detailed usage, e.g. 'rosconsole list -h'",
    is_node=True,
    wording={},
)
