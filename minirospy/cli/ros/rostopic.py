"""rostopic: which topics there are, what goes over them; publishing by hand.

Source: http://wiki.ros.org/rostopic. What is printed is what ROS prints.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from minirospy.cli.command import Parser, one_argument, refuse_bag, tool_node, warn_unpublished
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import NotFoundError
from minirospy.introspect import topics
from minirospy.introspect.graph import Graph

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from minirospy.introspect.streams import Received, ToolNode
    from minirospy.names import Arguments

__all__ = ["main"]

_CLEAR_SCREEN = "\033[2J\033[;H"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return _FAMILY.main(argv)


# --- what the master knows


def _list(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser("rostopic list", description="List the topics, or those in a namespace.")
    parser.add_argument("namespace", nargs="?", help="only topics at or below this name")
    _add_bag(parser, "list topics in .bag file")
    parser.add_argument("-v", "--verbose", action="store_true", help="list full details about each topic")
    side = parser.add_mutually_exclusive_group()
    side.add_argument("-p", dest="publishers", action="store_true", help="list only publishers")
    side.add_argument("-s", dest="subscribers", action="store_true", help="list only subscribers")
    parser.add_argument("--host", action="store_true", help="group by host name")
    options = parser.parse_args(argv)
    if options.bag:
        refuse_bag("rostopic list")
    with Graph.open("rostopic", arguments=arguments) as graph:
        namespace = graph.resolve(options.namespace) if options.namespace else "/"
        if not options.verbose and not options.host:
            print("\n".join(_names(graph, namespace, options)))
            return
        found = topics.list_topics(graph, namespace)
        if not options.host:
            _print_topics(found, options, indent="")
            return
        for host, on_host in topics.by_host(graph, found).items():
            print(f"Host [{host}]:")
            _print_topics(on_host, options, indent="  ")


def _names(graph: Graph, namespace: str, options: argparse.Namespace) -> list[str]:
    return topics.topic_names(
        graph, namespace, published=not options.subscribers, subscribed=not options.publishers
    )


def _print_topics(found: topics.TopicList, options: argparse.Namespace, indent: str) -> None:
    published = [] if options.subscribers else found.published
    subscribed = [] if options.publishers else found.subscribed
    if not options.verbose:
        names = {topic.name for topic in (*published, *subscribed)}
        print("\n".join(indent + name for name in sorted(names)))
        return
    print(indent if options.subscribers else "")
    if not options.subscribers:
        print(f"{indent}Published topics:")
        _print_rows(published, "publisher", indent)
        print(indent if not options.publishers else "")
    if not options.publishers:
        print(f"{indent}Subscribed topics:")
        _print_rows(subscribed, "subscriber", indent)
        print()


def _print_rows(rows: list[topics.TopicNodes], word: str, indent: str) -> None:
    for topic in rows:
        plural = "s" if len(topic.nodes) > 1 else ""
        print(f"{indent} * {topic.name} [{topic.type}] {len(topic.nodes)} {word}{plural}")


def _info(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_topic("info", "Print a topic's type, publishers and subscribers.", argv)
    with Graph.open("rostopic", arguments=arguments) as graph:
        detail = topics.topic_detail(graph, graph.resolve(name))
    from minirospy.introspect.texts import topic_text

    print(topic_text(detail))


def _type(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_topic("type", "Print the type of a topic, or of a field of its messages.", argv)
    with Graph.open("rostopic", arguments=arguments) as graph:
        field = topics.require_topic(graph, graph.resolve(name))
    print(f"{field.type} {field.path} {topics.topic_field_type(field)}" if field.path else field.type)


def _find(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    help_ = "a message type, as std_msgs/Bool"
    type_ = one_argument("rostopic find", "List the topics of a type.", "type", help_, argv)
    with Graph.open("rostopic", arguments=arguments) as graph:
        print("\n".join(topics.find_topics_of_type(graph, type_)))


def _one_topic(verb: str, description: str, argv: Sequence[str]) -> str:
    return one_argument(f"rostopic {verb}", description, "topic", "the topic's name", argv)


# --- what goes over a topic


def _echo(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser("rostopic echo", description="Print the messages of a topic, or one field of them.")
    add = parser.add_argument
    add("topic", nargs="?", help="the topic, with a field's path behind it where wanted: /pose/position/x")
    _add_bag(parser, "echo messages from .bag file")
    add("-p", dest="plot", action="store_true", help="echo in a plotting friendly format")
    add("-w", dest="width", type=int, metavar="NUM_WIDTH", help="fixed width for numeric values, at least 2")
    add("--filter", metavar="EXPRESSION", help="print only messages m for which this Python is true")
    add("--nostr", action="store_true", help="exclude string fields")
    add("--noarr", action="store_true", help="exclude arrays")
    add("-c", "--clear", action="store_true", help="clear screen before printing next message")
    add("-a", "--all", action="store_true", help="display all messages of a bag, with -b only")
    add("-n", dest="count", type=int, metavar="COUNT", help="number of messages to echo")
    add("--offset", action="store_true", help="display time as offsets from current time (in seconds)")
    options = parser.parse_intermixed_args(argv)
    if options.bag:
        refuse_bag("rostopic echo")
    if options.topic is None:
        parser.error("a topic is missing")
    if options.all:
        parser.error("-a displays all messages of a bag: it needs -b")
    if options.width is not None and options.width < 2:
        parser.error("-w: the fixed width of numbers is at least 2")
    from minirospy.introspect.echo import Echo, Filter
    from minirospy.introspect.streams import wait_for_topic

    keep = Filter(options.filter) if options.filter else None
    with Graph.open("rostopic", arguments=arguments) as graph:
        topic = graph.resolve(options.topic)
        if options.count is not None and options.count <= 0:
            return
        field = wait_for_topic(graph, topic, lambda: warn_unpublished(graph, topic))
    printed = 0
    with tool_node("rostopic", arguments, ros_time=True) as node:
        echo = Echo(
            field,
            plot=options.plot,
            strings=not options.nostr,
            arrays=not options.noarr,
            width=options.width,
            offset=options.offset,
            now=node.clock.now,
        )
        for received in node.inbox(field.topic):
            message = echo.message(received)
            if keep and not keep(message, field.topic):
                continue
            try:
                text = echo.text(message, received)
            except IndexError as error:
                print(f"rostopic: {error}", file=sys.stderr)
                continue
            sys.stdout.write(_CLEAR_SCREEN + text if options.clear and not options.plot else text)
            sys.stdout.flush()
            printed += 1
            if printed == options.count:
                return


def _hz(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser("rostopic hz", description="Print the rate at which messages come, once a second.")
    parser.add_argument("topics", nargs="+", metavar="topic", help="names of topics")
    _add_window(parser, default=0)
    parser.add_argument(
        "--filter", metavar="EXPRESSION", help="only measure messages m for which this Python is true"
    )
    parser.add_argument(
        "--wall-time",
        action="store_true",
        help="measure by the machine's clock, even where /clock tells another",
    )
    parser.add_argument("--tcpnodelay", action="store_true", help="use the TCP_NODELAY transport hint")
    options = parser.parse_intermixed_args(argv)
    from minirospy.introspect.echo import Filter
    from minirospy.introspect.rates import RateWindow, rate_text

    keep = Filter(options.filter) if options.filter else None
    windows: dict[str, RateWindow] = {}
    with tool_node("rostopic", arguments, ros_time=not options.wall_time) as node:
        for name in _published_topics(options.topics, arguments):
            window = windows[name] = RateWindow(options.window)

            def count(received: Received, topic: str = name, window: RateWindow = window) -> None:
                if keep is None or keep(node.classes.read(received), topic):
                    window.add(received.time)

            _measure(node, name, count, options.tcpnodelay)
        while not node.wait(1.0):
            print(rate_text({name: window.report() for name, window in windows.items()}), flush=True)


def _bw(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser("rostopic bw", description="Print the bandwidth that topics take, once a second.")
    parser.add_argument("topics", nargs="+", metavar="topic", help="names of topics")
    _add_window(parser, default=100)
    options = parser.parse_intermixed_args(argv)
    import time

    from minirospy.introspect.rates import BandwidthWindow, bandwidth_text

    windows: dict[str, BandwidthWindow] = {}
    with tool_node("rostopic", arguments) as node:
        for name in _published_topics(options.topics, arguments):
            window = windows[name] = BandwidthWindow(options.window)

            def add(received: Received, window: BandwidthWindow = window) -> None:
                window.add(received.time, len(received.body))

            _measure(node, name, add)
        while not node.wait(1.0):
            now = time.time()
            text = bandwidth_text({name: window.report(now) for name, window in windows.items()})
            if text:
                print(text, flush=True)


def _delay(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser(
        "rostopic delay", description="Print how late messages come after the stamps in their headers."
    )
    parser.add_argument("topic", help="the topic's name")
    _add_window(parser, default=0)
    parser.add_argument("--tcpnodelay", action="store_true", help="use the TCP_NODELAY transport hint")
    options = parser.parse_args(argv)
    from minirospy.introspect.rates import DelayWindow, delay_text

    window = DelayWindow(options.window)
    with tool_node("rostopic", arguments, ros_time=True) as node:
        (topic,) = _published_topics([options.topic], arguments)
        unstamped: list[str] = []

        def add(received: Received) -> None:
            message = node.classes.read(received)
            if message._has_header:
                window.add(received.time, message.header.stamp.to_sec())
            else:
                unstamped.append(message._type)
                node.stop()

        _measure(node, topic, add, options.tcpnodelay)
        while not node.wait(1.0):
            print(delay_text(window.report()), flush=True)
        if unstamped:
            raise NotFoundError(
                "header", topic, hint=f"messages of [{unstamped[0]}] have no stamp to measure by"
            )


def _measure(
    node: ToolNode, topic: str, add: Callable[[Received], object], tcp_nodelay: bool = False
) -> None:
    node.measure(topic, add, tcp_nodelay=tcp_nodelay)
    print(f"subscribed to [{topic}]", flush=True)


def _add_window(parser: Parser, default: int) -> None:
    parser.add_argument(
        "-w", "--window", type=int, default=default, help="window size, in # of messages, for calculating"
    )


def _add_bag(parser: Parser, what: str) -> None:
    parser.add_argument("-b", "--bag", metavar="BAGFILE", help=f"{what} (not yet: bags come later)")


def _published_topics(names: Sequence[str], arguments: Arguments | None) -> list[str]:
    """The global names of topics, also where a field of one is named; one that nobody publishes yet is warned of."""
    found = []
    with Graph.open("rostopic", arguments=arguments) as graph:
        for name in map(graph.resolve, names):
            field = topics.find_topic(graph, name)
            found.append(field.topic if field else name)
            if not field:
                warn_unpublished(graph, name)
    return list(dict.fromkeys(found))


def _pub(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    from minirospy.cli.ros.rostopic_pub import publish

    publish(argv, arguments)


_FAMILY = Family(
    "rostopic",
    "rostopic is a command-line tool for printing information about ROS Topics.",
    (
        Verb("bw", "display bandwidth used by topic", _bw),
        Verb("delay", "display delay of topic from timestamp in header", _delay),
        Verb("echo", "print messages to screen", _echo),
        Verb("find", "find topics by type", _find),
        Verb("hz", "display publishing rate of topic    ", _hz),
        Verb("info", "print information about active topic", _info),
        Verb("list", "list active topics", _list),
        Verb("pub", "publish data to topic", _pub),
        Verb("type", "print topic or field type", _type),
    ),
    "Type rostopic <command> -h for more detailed usage, e.g. 'rostopic echo -h'",
    is_node=True,
)
