"""rostopic hz, bw, delay: print the rate, bandwidth and delay of a topic's messages once a second.

Source: http://wiki.ros.org/rostopic. The output is the same as in ROS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.base.errors import NotFoundError
from minirospy.command.command import tool_node, warn_unpublished
from minirospy.command.parser import Parser, integer
from minirospy.command.verbs import Verb
from minirospy.core.idl.protocols import is_stamped
from minirospy.introspect.graph import Graph
from minirospy.introspect.topics import find_topic

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from minirospy.base.names import Arguments
    from minirospy.introspect.messages import Received
    from minirospy.introspect.streams import ToolNode

__all__ = ["BW", "DELAY", "HZ"]


def _hz_parser() -> Parser:
    parser = Parser(
        "rostopic hz",
        "Print the rate of messages once a second.",
        "rostopic hz [options] /topic_0 [/topic_1 [topic_2 [..]]]",
        missing="topic must be specified",
    )

    _add_topics(parser)
    _add_window(parser, default=0)
    parser.add_argument(
        "--filter",
        metavar="EXPR",
        help="only measure messages matching the specified Python expression",
        completer="nothing",
    )
    parser.add_argument(
        "--wall-time",
        action="store_true",
        help="calculates rate using wall time which can be helpful when clock isn't published during simulation",
    )

    _add_tcp_nodelay(parser)
    return parser


def _hz(
    topics: Sequence[str],
    window: int,
    filter: str | None,
    wall_time: bool,
    tcpnodelay: bool,
    arguments: Arguments | None = None,
) -> None:
    from minirospy.introspect.echo import Filter
    from minirospy.introspect.rates import RateWindow, rate_text

    keep = Filter(filter) if filter else None
    windows: dict[str, RateWindow] = {}
    with tool_node("rostopic", arguments, ros_time=not wall_time) as node:
        for name in _published_topics(topics, arguments):
            measured = windows[name] = RateWindow(window)

            def count(received: Received, topic: str = name, measured: RateWindow = measured) -> None:
                if keep is None or keep(node.classes.read(received), topic):
                    measured.add(received.time)

            _measure(node, name, count, tcpnodelay)
        while not node.wait(1.0):
            print(rate_text({name: each.report() for name, each in windows.items()}), flush=True)


def _bw_parser() -> Parser:
    parser = Parser(
        "rostopic bw",
        "Print the bandwidth that topics use once a second.",
        "rostopic bw /topic",
        missing="topic must be specified",
    )
    _add_topics(parser)
    _add_window(parser, default=100)
    return parser


def _bw(topics: Sequence[str], window: int, arguments: Arguments | None = None) -> None:
    import time

    from minirospy.introspect.rates import BandwidthWindow, bandwidth_text

    windows: dict[str, BandwidthWindow] = {}
    with tool_node("rostopic", arguments) as node:
        for name in _published_topics(topics, arguments):
            measured = windows[name] = BandwidthWindow(window)

            def add(received: Received, measured: BandwidthWindow = measured) -> None:
                measured.add(received.time, len(received.body))

            _measure(node, name, add)
        while not node.wait(1.0):
            now = time.time()
            text = bandwidth_text({name: each.report(now) for name, each in windows.items()})
            if text:
                print(text, flush=True)


def _delay_parser() -> Parser:
    parser = Parser(
        "rostopic delay",
        "Print the delay of messages, from the stamps in their headers to their arrival.",
        "rostopic delay [options] /topic",
        ros_argparse="rostopic",
    )
    # ROS's misspelling
    parser.add_argument("topic", help="topic name to be calcurated the delay", completer="topics")
    parser.add_argument(
        "-w",
        "--window",
        type=int,
        default=0,
        metavar="WINDOW_SIZE",
        help="window size, in # of messages, for calculating rate",
    )
    _add_tcp_nodelay(parser)
    return parser


def _delay(topic: str, window: int, tcpnodelay: bool, arguments: Arguments | None = None) -> None:
    from minirospy.introspect.rates import DelayWindow, delay_text

    measured = DelayWindow(window)
    with tool_node("rostopic", arguments, ros_time=True) as node:
        (name,) = _published_topics([topic], arguments)
        unstamped: list[str] = []

        def add(received: Received) -> None:
            message = node.classes.read(received)
            if is_stamped(message):
                measured.add(received.time, message.header.stamp.to_sec())
            else:
                unstamped.append(message._type)
                node.stop()

        _measure(node, name, add, tcpnodelay)
        while not node.wait(1.0):
            print(delay_text(measured.report()), flush=True)
        if unstamped:
            raise NotFoundError(
                "header", name, hint=f"messages of [{unstamped[0]}] have no stamp to measure by"
            )


def _measure(
    node: ToolNode, topic: str, add: Callable[[Received], object], tcp_nodelay: bool = False
) -> None:
    node.measure(topic, add, tcp_nodelay=tcp_nodelay)
    print(f"subscribed to [{topic}]", flush=True)


def _published_topics(names: Sequence[str], arguments: Arguments | None) -> list[str]:
    """Return the global names of topics, which may be given with a field; warn about topics without a publisher."""
    found = []
    with Graph.open("rostopic", arguments=arguments) as graph:
        for name in map(graph.resolve, names):
            field = find_topic(graph, name)
            found.append(field.topic if field else name)
            if not field:
                warn_unpublished(graph, name)
    return list(dict.fromkeys(found))


def _add_topics(parser: Parser) -> None:
    parser.add_argument("topics", nargs="+", metavar="topic", help="names of topics", completer="topics")


def _add_window(parser: Parser, default: int) -> None:
    parser.add_argument(
        "-w",
        "--window",
        type=integer("window size"),
        default=default,
        help="window size, in # of messages, for calculating rate",
    )


def _add_tcp_nodelay(parser: Parser) -> None:
    parser.add_argument(
        "--tcpnodelay",
        action="store_true",
        help="use the TCP_NODELAY transport hint when subscribing to topics",
    )


HZ = Verb("hz", "display publishing rate of topic    ", _hz_parser, _hz)
BW = Verb("bw", "display bandwidth used by topic", _bw_parser, _bw)
DELAY = Verb("delay", "display delay of topic from timestamp in header", _delay_parser, _delay)
