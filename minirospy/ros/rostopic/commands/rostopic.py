"""rostopic: lists topics and shows their messages.

Measurements are in `rostopic_rates.py`, publishing is in `rostopic_pub.py`.
Source: http://wiki.ros.org/rostopic. The output is the same as in ROS.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING

from minirospy.base.errors import NotFoundError
from minirospy.command.command import RosText, WordedError, tool_node, warn, warn_unpublished
from minirospy.command.parser import Misuse, Parser, integer
from minirospy.command.verbs import Family, HelpStatus, Verb, deferred_verb
from minirospy.introspect import topics
from minirospy.introspect.graph import Graph

if TYPE_CHECKING:
    from collections.abc import Sequence

    from minirospy.base.names import Arguments

__all__ = ["FAMILY", "main"]

_RATES = "minirospy.ros.rostopic.commands.rostopic_rates"
_CLEAR_SCREEN = "\033[2J\033[;H"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


# --- data from the master


def _list_parser() -> Parser:
    parser = Parser(
        "rostopic list",
        "List the topics, or those in a namespace.",
        "rostopic list [/namespace]",
        surplus="you may only specify one input topic",
    )
    parser.add_argument("namespace", nargs="?", help="only topics at or below this name", completer="topics")
    _add_bag(parser, "list topics in .bag file")
    parser.add_argument("-v", "--verbose", action="store_true", help="list full details about each topic")
    parser.add_argument("-p", dest="publishers", action="store_true", help="list only publishers")
    parser.add_argument("-s", dest="subscribers", action="store_true", help="list only subscribers")
    parser.add_argument("--host", action="store_true", help="group by host name")
    return parser


def _list(
    namespace: str | None,
    bag: str | None,
    verbose: bool,
    publishers: bool,
    subscribers: bool,
    host: bool,
    arguments: Arguments | None = None,
) -> None:
    if bag:
        for option, given in (("-s", subscribers), ("-p", publishers), ("--host", host)):
            if given:
                raise Misuse(
                    f"{option} needs a master: it does not go with -b",
                    f"{option} option is not valid with bags",
                )
        from minirospy.ros.rosbag.commands.read_from_bag import list_bag

        with Graph.open("rostopic", arguments=arguments) as graph:
            list_bag(bag, graph.resolve(namespace) if namespace else None)
        return
    if publishers and subscribers:
        raise Misuse("argument -s: not allowed with argument -p", "you may only specify one of -p, -s")
    show = partial(_print_topics, publishers=not subscribers, subscribers=not publishers, verbose=verbose)
    with Graph.open("rostopic", arguments=arguments) as graph:
        space = graph.resolve(namespace) if namespace else "/"
        if not verbose and not host:
            names = topics.topic_names(graph, space, published=not subscribers, subscribed=not publishers)
            print("\n".join(names))
            return

        found = topics.list_topics(graph, space)
        if not host:
            show(found)
            return
        for name, on_host in topics.by_host(graph, found).items():
            print(f"Host [{name}]:")
            show(on_host, indent="  ")


def _print_topics(
    found: topics.TopicList, *, publishers: bool, subscribers: bool, verbose: bool, indent: str = ""
) -> None:
    published = found.published if publishers else []
    subscribed = found.subscribed if subscribers else []
    if not verbose:
        names = {topic.name for topic in (*published, *subscribed)}
        print("\n".join(indent + name for name in sorted(names)))
        return

    print("" if publishers else indent)
    if publishers:
        print(f"{indent}Published topics:")
        _print_rows(published, "publisher", indent)
        print(indent if subscribers else "")
    if subscribers:
        print(f"{indent}Subscribed topics:")
        _print_rows(subscribed, "subscriber", indent)
        print()


def _print_rows(rows: list[topics.TopicNodes], word: str, indent: str) -> None:
    for topic in rows:
        plural = "s" if len(topic.nodes) > 1 else ""
        print(f"{indent} * {topic.name} [{topic.type}] {len(topic.nodes)} {word}{plural}")


def _info_parser() -> Parser:
    parser = Parser(
        "rostopic info",
        "Print a topic's type, publishers and subscribers.",
        "rostopic info /topic",
        missing="you must specify a topic name",
        surplus="you may only specify one topic name",
    )
    _add_topic(parser)
    return parser


def _info(topic: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rostopic", arguments=arguments) as graph:
        detail = topics.topic_detail(graph, graph.resolve(topic))

    from minirospy.introspect.texts import topic_text

    print(topic_text(detail))


def _type_parser() -> Parser:
    parser = Parser(
        "rostopic type",
        "Print the type of a topic, or of a field of its messages.",
        "rostopic type [-h] topic_or_field",
        ros_argparse="rostopic type",
    )
    parser.add_argument("topic_or_field", help="Topic or field name", completer="topics")
    return parser


def _type(topic_or_field: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rostopic", arguments=arguments) as graph:
        name = graph.resolve(topic_or_field)
        try:
            field = topics.require_topic(graph, name)
            path_type = topics.topic_field_type(field) if field.path else ""
        except NotFoundError as error:
            raise WordedError(error, RosText(f"unknown topic type [{name}]")) from error
    print(f"{field.type} {field.path} {path_type}" if field.path else field.type)


def _find_parser() -> Parser:
    parser = Parser(
        "rostopic find",
        "List the topics of a type.",
        "rostopic find msg-type",
        missing="please specify a message type",
        surplus="you may only specify one message type",
    )
    parser.add_argument("type", help="a message type, as std_msgs/Bool", completer="message_types")
    return parser


def _find(type: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rostopic", arguments=arguments) as graph:
        print("\n".join(topics.find_topics_of_type(graph, type)))


# --- messages on a topic


def _echo_parser() -> Parser:
    parser = Parser(
        "rostopic echo",
        "Print the messages of a topic, or one field of them.",
        "rostopic echo [options] /topic",
        missing="topic must be specified",
        surplus="you may only specify one input topic",
    )

    add = parser.add_argument
    add(
        "topic",
        nargs="?",
        help="the topic, followed by a field's path where wanted: /pose/position/x",
        completer="topics",
    )
    _add_bag(parser, "echo messages from .bag file")

    add("-p", dest="plot", action="store_true", help="echo in a plotting friendly format")
    add(
        "-w",
        dest="width",
        type=integer("NUM_WIDTH"),
        metavar="NUM_WIDTH",
        help="fixed width for numeric values",
    )
    add(
        "--filter",
        metavar="FILTER-EXPRESSION",
        help="Python expression to filter messages that are printed. Expression can use Python builtins as well as "
        "m (the message) and topic (the topic name).",
        completer="nothing",
    )

    add("--nostr", action="store_true", help="exclude string fields")
    add("--noarr", action="store_true", help="exclude arrays")
    add("-c", "--clear", action="store_true", help="clear screen before printing next message")
    add("-a", "--all", action="store_true", help="display all message in bag, only valid with -b option")
    add("-n", dest="count", type=integer("COUNT"), metavar="COUNT", help="number of messages to echo")
    add("--offset", action="store_true", help="display time as offsets from current time (in seconds)")
    return parser


def _echo(
    topic: str | None,
    bag: str | None,
    plot: bool,
    width: int | None,
    filter: str | None,
    nostr: bool,
    noarr: bool,
    clear: bool,
    all: bool,
    count: int | None,
    offset: bool,
    arguments: Arguments | None = None,
) -> None:
    if all and bag:
        topic = None
    elif topic is None:
        raise Misuse("a topic is missing", "topic must be specified")
    if all and not bag:
        raise Misuse(
            "-a displays all messages of a bag: it needs -b",
            "Display all option is only valid when echoing from bag files",
        )
    if width is not None and width < 2:
        raise Misuse(
            "-w: the fixed width of numbers is at least 2",
            "Fixed width for numeric values must be at least 2",
        )

    from minirospy.introspect.echo import Echo, Filter
    from minirospy.introspect.streams import wait_for_topic

    keep = Filter(filter) if filter else None
    make = partial(Echo, plot=plot, strings=not nostr, arrays=not noarr, width=width, offset=offset)
    prefix = _CLEAR_SCREEN if clear and not plot else ""
    if bag:
        if offset:
            raise Misuse("--offset does not go with -b", "offset time option is not valid with bag files")
        from minirospy.ros.rosbag.commands.read_from_bag import EchoOptions, echo_bag

        with Graph.open("rostopic", arguments=arguments) as graph:
            make = partial(make, header_times=False, is_type_known=False)
            echo_bag(bag, graph.resolve(topic) if topic else None, EchoOptions(make, keep, count, prefix))
        return
    assert topic is not None
    with Graph.open("rostopic", arguments=arguments) as graph:
        name = graph.resolve(topic)
        if count is not None and count <= 0:
            return
        field = wait_for_topic(graph, name, lambda: warn_unpublished(graph, name))
        _warn_of_type_left_behind(graph, field.topic)

    def report(error: Exception) -> None:
        """Print ROS's and minirospy's messages for an index beyond the end of an array."""
        print(f"{error.__cause__}: /{field.path}\nrostopic: {error}", file=sys.stderr)

    printed = 0
    with tool_node("rostopic", arguments, ros_time=True) as node:
        echo = make(field, now=node.clock.now, report=report)
        for received in node.inbox(field.topic):
            message = echo.message(received)
            if keep and not keep(message, field.topic):
                continue
            try:
                text = echo.text(message, received)
            except IndexError as error:
                report(error)
                continue

            sys.stdout.write(prefix + text)
            sys.stdout.flush()
            printed += 1
            if printed == count:
                return


def _warn_of_type_left_behind(graph: Graph, topic: str) -> None:
    """Warn if nothing publishes a topic: its registered type may come from a publisher that has left."""
    if topic in graph.state().publishers:
        return
    type_ = graph.master.get_topic_types().get(topic)
    warn(
        f"nothing publishes [{topic}] now; messages of its last type [{type_}] are awaited. A publisher of another type "
        "needs another `rostopic echo`"
    )


# --- arguments common to several verbs


def _add_topic(parser: Parser) -> None:
    parser.add_argument("topic", help="the topic's name", completer="topics")


def _add_bag(parser: Parser, help: str) -> None:
    parser.add_argument("-b", "--bag", metavar="BAGFILE", help=help, completer="bag_files")


FAMILY = Family(
    "rostopic",
    "rostopic is a command-line tool for printing information about ROS Topics.",
    (
        deferred_verb("bw", "display bandwidth used by topic", _RATES, "BW"),
        deferred_verb("delay", "display delay of topic from timestamp in header", _RATES, "DELAY"),
        Verb("echo", "print messages to screen", _echo_parser, _echo),
        Verb("find", "find topics by type", _find_parser, _find),
        deferred_verb("hz", "display publishing rate of topic    ", _RATES, "HZ"),
        Verb(
            "info",
            "print information about active topic",
            _info_parser,
            _info,
            {"topic": RosText("ERROR: Unknown topic {name}")},
        ),
        Verb("list", "list active topics", _list_parser, _list),
        deferred_verb("pub", "publish data to topic", "minirospy.ros.rostopic.commands.rostopic_pub"),
        Verb("type", "print topic or field type", _type_parser, _type),
    ),
    "Type rostopic <command> -h for more detailed usage, e.g. 'rostopic echo -h'",
    is_node=True,
    help_status=HelpStatus(none=64, short=64, long=64, unknown=64),
    shows_help_on_error=True,
)
