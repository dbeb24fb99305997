"""rostopic pub: publishing by hand, once, at a rate, or from a file or pipe.

Source: http://wiki.ros.org/rostopic#rostopic_pub. What is printed is what ROS prints.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from minirospy.cli.command import Parser, tool_node, warn
from minirospy.errors import UsageError
from minirospy.idl.load import message_class
from minirospy.introspect.echo import fill_message
from minirospy.introspect.graph import Graph, why_illegal
from minirospy.introspect.publishing import publish_all, values_to_publish

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Sequence

    from minirospy.introspect.streams import ToolNode, TopicPublisher
    from minirospy.names import Arguments

__all__ = ["publish"]

_LATCH_SECONDS = 3.0
_FILE_RATE = 10.0
_CONNECT_SECONDS = 0.5
_REGISTERED_CONNECT_SECONDS = 2.0
_CLOCK_SECONDS = 1.0
_SHIELD = "\0"


def publish(argv: Sequence[str], arguments: Arguments | None) -> None:
    """The verb, with the remapping arguments that were among its words."""
    options = _parse(argv)
    cls = message_class(options.type)
    with Graph.open("rostopic", arguments=arguments) as graph:
        topic = graph.resolve(options.topic)
        all_values = values_to_publish(cls.__slots__, options.args, options.file)
        values = next(all_values)
        # Before the node is there, so that a typing error shows at once.
        message = fill_message(cls, values)
        state = graph.state()
        awaited = topic in state.subscribers
        if awaited or topic in state.publishers:
            _warn_of_other_type(graph, topic, cls._type)
        elif why := why_illegal(topic):
            raise UsageError(f"topic [{topic}]: {why}")
    # One message stays for late subscribers; a stream of them does not, unless asked to.
    from_documents = bool(not options.args and (cls.__slots__ or options.file))
    lasting = options.once or options.latch or (options.rate is None and not from_documents)
    with tool_node("rostopic", arguments, ros_time=options.use_rostime) as node:
        publisher = node.publisher(topic, cls, latch=lasting)

        def filled(values: list[Any]) -> Any:
            return fill_message(cls, values, node.clock.now())

        if node.simulated:
            node.wait_for_time(_CLOCK_SECONDS)
            message = filled(values)
        if options.once or (lasting and options.rate is None):
            _latch(node, publisher, message, options)
            return
        messages: Iterable[Any] = itertools.repeat(message)
        if from_documents:
            # The first messages of a file have nobody to go to before subscribers have connected.
            seconds = _REGISTERED_CONNECT_SECONDS if awaited else _CONNECT_SECONDS
            publisher.wait_for_subscriber(node.wait, seconds)
            messages = itertools.chain([message], map(filled, all_values))
        elif options.substitute_keywords:
            messages = map(filled, itertools.repeat(values))

        def show(message: Any) -> None:
            if options.verbose:
                print(f"publishing {message}", flush=True)

        publish_all(node, publisher, messages, options.rate or _FILE_RATE, show)


def _warn_of_other_type(graph: Graph, topic: str, type_: str) -> None:
    other = graph.master.get_topic_types().get(topic, "*")
    if other not in ("*", type_):
        warn(f"topic [{topic}] is of type [{other}] already, not [{type_}]")


def _latch(node: ToolNode, publisher: TopicPublisher, message: Any, options: argparse.Namespace) -> None:
    how_long = f" for {_LATCH_SECONDS} seconds" if options.once else ". Press ctrl-C to terminate"
    shown = f"[{message}]" if options.verbose else "message"
    print(f"publishing and latching {shown}{how_long}", flush=True)
    publisher.publish(message)
    while not node.wait(_LATCH_SECONDS):
        if options.once:
            return


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = Parser(
        "rostopic pub",
        description="Publish to a topic: one message that stays (latched) until Ctrl-C, or by options.",
        epilog='Arguments are YAML: one dictionary ("data: True"), or a value for each field in order. '
        "Without arguments, messages are read from standard input, with --- between them.",
    )
    add = parser.add_argument
    add("topic", help="the topic's name")
    add("type", help="the message type, as std_msgs/Bool")
    add(
        "args", nargs="*", default=[], help="the message's values; `now` is the time, header: auto is stamped"
    )
    add("-v", dest="verbose", action="store_true", help="print verbose output")
    add(
        "-r",
        "--rate",
        type=_positive,
        metavar="RATE",
        help="publishing rate (hz); 10 for messages from a file or standard input",
    )
    add("-1", "--once", action="store_true", help="publish one message and exit")
    add("-f", "--file", metavar="FILE", help="read messages from a YAML file, with --- between them")
    add("-l", "--latch", action="store_true", help="latch: whoever joins later gets the last message")
    add(
        "-s",
        "-K",
        "--substitute-keywords",
        action="store_true",
        help="with a rate: `now` and `auto` anew for each message",
    )
    add("--use-rostime", action="store_true", help="`now`, `auto` and the rate go by /clock where it is used")
    options = parser.parse_intermixed_args([_shield(word) for word in argv])
    options.args = [word.removeprefix(_SHIELD) for word in options.args]
    if options.once and options.rate is not None:
        parser.error("-1 and -r exclude each other")
    if options.file is not None and options.args:
        parser.error("-f and values on the command line exclude each other")
    return options


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
    import re

    negative = re.match(r"-(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\Z", word, re.IGNORECASE)
    return _SHIELD + word if word != "-1" and negative else word
