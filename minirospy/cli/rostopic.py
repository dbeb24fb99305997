"""rostopic: which topics there are, what goes over them; publishing by hand.

Source: http://wiki.ros.org/rostopic. What is printed is what ROS prints.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from minirospy.cli.command import Parser
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import NotFoundError, UsageError
from minirospy.introspect import topics
from minirospy.introspect.graph import Graph

if TYPE_CHECKING:
    import argparse

    from minirospy.introspect.graph import NodeAddress
    from minirospy.introspect.rates import Spread
    from minirospy.introspect.streams import Received, ToolNode, TopicPublisher

__all__ = ["main"]

_CLEAR_SCREEN = "\033[2J\033[;H"
_LATCH_SECONDS = 3.0
_FILE_RATE = 10.0
_CONNECT_SECONDS = 0.5
_NEGATIVE_NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\Z", re.IGNORECASE)
_SHIELD = "\0"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return _FAMILY.main(argv)


# --- what the master knows


def _list(argv: Sequence[str]) -> None:
    parser = Parser("rostopic list", description="List the topics, or those in a namespace.")
    parser.add_argument("namespace", nargs="?", help="only topics at or below this name")
    parser.add_argument("-v", "--verbose", action="store_true", help="list full details about each topic")
    side = parser.add_mutually_exclusive_group()
    side.add_argument("-p", dest="publishers", action="store_true", help="list only publishers")
    side.add_argument("-s", dest="subscribers", action="store_true", help="list only subscribers")
    parser.add_argument("--host", action="store_true", help="group by host name")
    options = parser.parse_args(argv)
    with Graph.open("rostopic") as graph:
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


def _info(argv: Sequence[str]) -> None:
    name = _one_topic("info", "Print a topic's type, publishers and subscribers.", argv)
    with Graph.open("rostopic") as graph:
        detail = topics.topic_detail(graph, graph.resolve(name))

    def side(title: str, nodes: list[NodeAddress]) -> str:
        if not nodes:
            return f"{title}: None"
        rows = (f" * {node.name} ({node.uri or f'unknown address {node.name}'})" for node in nodes)
        return f"{title}: \n" + "\n".join(rows)

    print(f"Type: {detail.type}\n")
    print(side("Publishers", detail.publishers) + "\n")
    print(side("Subscribers", detail.subscribers) + "\n\n")


def _type(argv: Sequence[str]) -> None:
    name = _one_topic("type", "Print the type of a topic, or of a field of its messages.", argv)
    with Graph.open("rostopic") as graph:
        field = topics.require_topic(graph, graph.resolve(name))
    print(f"{field.type} {field.path} {topics.topic_field_type(field)}" if field.path else field.type)


def _find(argv: Sequence[str]) -> None:
    parser = Parser("rostopic find", description="List the topics of a type.")
    parser.add_argument("type", help="a message type, as std_msgs/Bool")
    options = parser.parse_args(argv)
    with Graph.open("rostopic") as graph:
        print("\n".join(topics.find_topics_of_type(graph, options.type)))


def _one_topic(verb: str, description: str, argv: Sequence[str]) -> str:
    """The name, as typed, of the one topic that a verb is about."""
    parser = Parser(f"rostopic {verb}", description=description)
    parser.add_argument("topic", help="the topic's name")
    return str(parser.parse_args(argv).topic)


# --- what goes over a topic


def _echo(argv: Sequence[str]) -> None:
    parser = Parser("rostopic echo", description="Print the messages of a topic, or one field of them.")
    parser.add_argument(
        "topic", help="the topic, with a field's path behind it where wanted: /pose/position/x"
    )
    parser.add_argument(
        "-c", "--clear", action="store_true", help="clear screen before printing next message"
    )
    parser.add_argument(
        "-n", dest="count", type=int, default=0, metavar="COUNT", help="number of messages to echo"
    )
    parser.add_argument("-p", dest="plot", action="store_true", help="echo in a plotting friendly format")
    parser.add_argument(
        "-w", dest="width", type=int, metavar="NUM_WIDTH", help="fixed width for numeric values"
    )
    parser.add_argument(
        "--filter", metavar="EXPRESSION", help="print only messages m for which this Python is true"
    )
    parser.add_argument("--nostr", action="store_true", help="exclude string fields")
    parser.add_argument("--noarr", action="store_true", help="exclude arrays")
    parser.add_argument(
        "--offset", action="store_true", help="display time as offsets from current time (in seconds)"
    )
    options = parser.parse_intermixed_args(argv)
    from minirospy.introspect.echo import Echo, Filter
    from minirospy.introspect.streams import wait_for_topic

    keep = Filter(options.filter) if options.filter else None
    with Graph.open("rostopic") as graph:
        topic = graph.resolve(options.topic)
        field = wait_for_topic(graph, topic, lambda: _warn_unpublished(topic))
    echo = Echo(
        field,
        plot=options.plot,
        strings=not options.nostr,
        arrays=not options.noarr,
        width=options.width,
        offset=options.offset,
    )
    printed = 0
    with _tool_node() as node:
        for received in node.inbox(field.topic):
            message = echo.message(received)
            if keep and not keep(message, field.topic):
                continue
            try:
                text = echo.text(message, received)
            except IndexError as error:
                print(f"rostopic: {error}", file=sys.stderr)
                continue
            sys.stdout.write(_CLEAR_SCREEN + text if options.clear else text)
            sys.stdout.flush()
            printed += 1
            if printed == options.count:
                return


def _hz(argv: Sequence[str]) -> None:
    parser = Parser("rostopic hz", description="Print the rate at which messages come, once a second.")
    parser.add_argument("topics", nargs="+", metavar="topic", help="names of topics")
    _add_window(parser, default=0)
    parser.add_argument(
        "--filter", metavar="EXPRESSION", help="only measure messages m for which this Python is true"
    )
    parser.add_argument(
        "--wall-time", action="store_true", help="measure by the wall's clock, as is done anyway"
    )
    parser.add_argument("--tcpnodelay", action="store_true", help="use the TCP_NODELAY transport hint")
    options = parser.parse_intermixed_args(argv)
    from minirospy.introspect.echo import Filter
    from minirospy.introspect.rates import RateWindow

    keep = Filter(options.filter) if options.filter else None
    windows: dict[str, RateWindow] = {}
    with _tool_node() as node:
        for name in _published_topics(options.topics):
            window = windows[name] = RateWindow(options.window)

            def count(received: Received, topic: str = name, window: RateWindow = window) -> None:
                if keep is None or keep(node.classes.read(received), topic):
                    window.add(received.time)

            node.measure(name, count, tcp_nodelay=options.tcpnodelay)
            print(f"subscribed to [{name}]", flush=True)
        while not node.wait(1.0):
            print(_rates({name: window.report() for name, window in windows.items()}), flush=True)


def _rates(reports: dict[str, Spread | None]) -> str:
    if len(reports) == 1:
        (report,) = reports.values()
        if report is None:
            return "no new messages"
        return f"average rate: {report.rate:.3f}\n\t{_spread(report)}"
    rows = [
        (name, *(_four_digits(number) for number in (r.rate, r.min, r.max, r.std_dev)), str(r.window))
        for name, r in reports.items()
        if r is not None
    ]
    if not rows:
        return "no new messages"
    head = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    lines = ["   ".join(text.center(width) for text, width in zip(head, widths, strict=True)).rstrip()]
    lines.append("=" * (sum(widths) + 3 * (len(widths) - 1)))
    lines += ["   ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(lines) + "\n"


def _four_digits(number: float) -> str:
    return str(float(f"{number:.4g}"))


def _spread(report: Spread) -> str:
    return (
        f"min: {report.min:.3f}s max: {report.max:.3f}s "
        f"std dev: {report.std_dev:.5f}s window: {report.window}"
    )


def _bw(argv: Sequence[str]) -> None:
    parser = Parser("rostopic bw", description="Print the bandwidth that a topic takes, once a second.")
    parser.add_argument("topic", help="the topic's name")
    _add_window(parser, default=100)
    options = parser.parse_args(argv)
    from minirospy.introspect.rates import BandwidthWindow

    window = BandwidthWindow(options.window)
    with _tool_node() as node:
        (topic,) = _published_topics([options.topic])
        node.measure(topic, lambda received: window.add(received.time, len(received.body)))
        print(f"subscribed to [{topic}]", flush=True)
        import time

        while not node.wait(1.0):
            report = window.report(time.time())
            if report is None:
                continue
            unit, size = _unit(report.rate)
            mean, low, high = (
                f"{number / size:.2f}{unit}" for number in (report.mean, report.min, report.max)
            )
            print(f"average: {report.rate / size:.2f}{unit}/s")
            print(f"\tmean: {mean} min: {low} max: {high} window: {report.window}", flush=True)


def _unit(rate: float) -> tuple[str, float]:
    if rate < 1000.0:
        return "B", 1.0
    return ("KB", 1e3) if rate < 1e6 else ("MB", 1e6)


def _delay(argv: Sequence[str]) -> None:
    parser = Parser(
        "rostopic delay", description="Print how late messages come after the stamps in their headers."
    )
    parser.add_argument("topic", help="the topic's name")
    _add_window(parser, default=0)
    parser.add_argument("--tcpnodelay", action="store_true", help="use the TCP_NODELAY transport hint")
    options = parser.parse_args(argv)
    from minirospy.introspect.rates import DelayWindow

    window = DelayWindow(options.window)
    with _tool_node() as node:
        (topic,) = _published_topics([options.topic])
        unstamped: list[str] = []

        def add(received: Received) -> None:
            message = node.classes.read(received)
            if message._has_header:
                window.add(received.time, message.header.stamp.to_sec())
            else:
                unstamped.append(message._type)
                node.stop()

        node.measure(topic, add, tcp_nodelay=options.tcpnodelay)
        print(f"subscribed to [{topic}]", flush=True)
        while not node.wait(1.0):
            report = window.report()
            if report is None:
                print("no new messages", flush=True)
            else:
                print(f"average delay: {report.mean:.3f}\n\t{_spread(report)}", flush=True)
        if unstamped:
            raise NotFoundError(
                "header", topic, hint=f"messages of [{unstamped[0]}] have no stamp to measure by"
            )


def _add_window(parser: Parser, default: int) -> None:
    parser.add_argument(
        "-w", "--window", type=int, default=default, help="window size, in # of messages, for calculating"
    )


def _published_topics(names: Sequence[str]) -> list[str]:
    """The global names of topics; one that nobody publishes yet is warned of."""
    with Graph.open("rostopic") as graph:
        found = [graph.resolve(name) for name in names]
        published = graph.state().publishers
    for topic in found:
        if topic not in published:
            _warn_unpublished(topic)
    return found


def _warn_unpublished(topic: str) -> None:
    sys.stdout.flush()
    print(f"WARNING: topic [{topic}] does not appear to be published yet", file=sys.stderr)


# --- publishing


def _pub(argv: Sequence[str]) -> None:
    parser = Parser(
        "rostopic pub",
        description="Publish to a topic: one message that stays (latched) until Ctrl-C, or by options.",
        epilog='Arguments are YAML: one dictionary ("data: True"), or a value for each field in order. '
        "Without arguments, messages are read from standard input, with --- between them.",
    )
    parser.add_argument("topic", help="the topic's name")
    parser.add_argument("type", help="the message type, as std_msgs/Bool")
    parser.add_argument(
        "args", nargs="*", help="the message's values; `now` is the time, header: auto is stamped"
    )
    parser.add_argument("-v", dest="verbose", action="store_true", help="print verbose output")
    parser.add_argument("-r", "--rate", type=_positive, metavar="RATE", help="publishing rate (hz)")
    parser.add_argument("-1", "--once", action="store_true", help="publish one message and exit")
    parser.add_argument(
        "-f", "--file", metavar="FILE", help="read messages from a YAML file, with --- between them"
    )
    parser.add_argument(
        "-l", "--latch", action="store_true", help="latch: whoever joins later gets the last message"
    )
    parser.add_argument(
        "-s",
        "--substitute-keywords",
        action="store_true",
        help="with a rate: `now` and `auto` anew for each message",
    )
    options = parser.parse_intermixed_args([_shield(word) for word in argv])
    options.args = [word.removeprefix(_SHIELD) for word in options.args]
    from minirospy.idl.load import message_class
    from minirospy.introspect.echo import fill_message
    from minirospy.names import is_legal_name

    cls = message_class(options.type)
    with Graph.open("rostopic") as graph:
        topic = graph.resolve(options.topic)
        if not is_legal_name(topic):
            raise UsageError(f"[{options.topic}] is not a legal name of a topic: letters, digits, _ and /")
        all_values = _messages_to_publish(cls, options)
        values = next(all_values)
        # Before the node is there, so that a typing error shows at once.
        message = fill_message(cls, values)
        _warn_other_type(graph, topic, cls._type)
    # One message stays for late subscribers; a stream of them does not, unless asked to.
    from_documents = bool(not options.args and (cls.__slots__ or options.file))
    streaming = options.rate is not None or from_documents
    with _tool_node() as node:
        publisher = node.publisher(topic, cls, latch=options.once or options.latch or not streaming)
        shown = f"[{message}]" if options.verbose else "message"
        if options.once:
            print(f"publishing and latching {shown} for {_LATCH_SECONDS} seconds", flush=True)
            publisher.publish(message)
            node.wait(_LATCH_SECONDS)
        elif not streaming or (options.latch and options.rate is None):
            print(f"publishing and latching {shown}. Press ctrl-C to terminate", flush=True)
            publisher.publish(message)
            while not node.wait(3600.0):
                pass
        elif from_documents:
            _publish_all(node, publisher, message, (fill_message(cls, each) for each in all_values), options)
        else:
            anew = options.substitute_keywords
            _publish_at_rate(node, publisher, lambda: fill_message(cls, values) if anew else message, options)


def _publish_at_rate(
    node: ToolNode, publisher: TopicPublisher, message: Callable[[], Any], options: argparse.Namespace
) -> None:
    import time

    start, sent = time.monotonic(), 0
    while not node.ended.is_set():
        current = message()
        if options.verbose:
            print(f"publishing {current}", flush=True)
        publisher.publish(current)
        sent += 1
        # From the start, not from the last message: pauses that come out too long do not add up.
        if node.wait(max(0.0, start + sent / options.rate - time.monotonic())):
            return


def _publish_all(
    node: ToolNode, publisher: TopicPublisher, first: Any, rest: Iterator[Any], options: argparse.Namespace
) -> None:
    pause = 1.0 / (options.rate or _FILE_RATE)
    # The first messages of a stream have nobody to go to before subscribers have connected.
    node.wait(_CONNECT_SECONDS)
    for message in (each for part in ((first,), rest) for each in part):
        if options.verbose:
            print(f"publishing {message}", flush=True)
        publisher.publish(message)
        if node.wait(pause):
            return


def _messages_to_publish(cls: type[Any], options: argparse.Namespace) -> Iterator[list[Any]]:
    """The YAML values of each message: from the command line, a file, or standard input. At least one."""
    from minirospy.introspect.values import parse_documents, parse_value

    if options.args:
        yield [parse_value(word) for word in options.args]
        return
    if options.file is None and not cls.__slots__:
        yield []
        return
    where = options.file or "standard input"
    if options.file is not None:
        text = _read_text(options.file)
    elif sys.stdin.isatty():
        raise UsageError(f"please specify message values: {' '.join(cls.__slots__)}")
    else:
        text = sys.stdin.read()
    found = False
    for document in parse_documents(text, where):
        if document is not None:
            found = True
            yield document if isinstance(document, list) else [document]
    if not found:
        raise UsageError(
            f"{where} holds no message; please specify message values: {' '.join(cls.__slots__)}"
        )


def _read_text(file: str) -> str:
    from pathlib import Path

    try:
        return Path(file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise NotFoundError(
            "file", file, hint=getattr(error, "strerror", None) or "it is not UTF-8 text"
        ) from error


def _warn_other_type(graph: Graph, topic: str, type_: str) -> None:
    state = graph.state()
    # The master remembers the type of a topic that everybody has left: that one is free.
    used = topic in state.publishers or topic in state.subscribers
    other = graph.master.get_topic_types().get(topic, "*")
    if used and other not in ("*", type_):
        print(f"WARNING: topic [{topic}] is of type [{other}] already, not [{type_}]", file=sys.stderr)


def _positive(text: str) -> float:
    import argparse

    try:
        rate = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"rate must be a number, not {text}") from None
    if not 0.0 < rate < 1e6:
        raise argparse.ArgumentTypeError("rate must be greater than zero")
    return rate


def _shield(word: str) -> str:
    """Negative numbers as values beside an option that is called `-1`."""
    return _SHIELD + word if word != "-1" and _NEGATIVE_NUMBER.match(word) else word


def _tool_node() -> ToolNode:
    from minirospy.environment import Environment
    from minirospy.introspect.streams import ToolNode

    return ToolNode(Environment.read(), "rostopic")


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
)
