"""rostopic pub: publishes messages once, at a rate, or from a file or pipe.

Source: http://wiki.ros.org/rostopic#rostopic_pub. The output is the same as in ROS.
"""

from __future__ import annotations

import argparse
import itertools
import re
from typing import TYPE_CHECKING, NamedTuple, cast

from minirospy.base.errors import (
    MessageException,
    NotFoundError,
    SerializationError,
    UsageError,
    ValueTextError,
)
from minirospy.base.yaml_text import safe_load
from minirospy.command.command import RosText, WordedError, tool_node, warn, warn_no_subscribers
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Verb
from minirospy.introspect.graph import Graph, why_illegal

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from minirospy.base.names import Arguments
    from minirospy.core.idl.protocols import Message
    from minirospy.introspect.streams import ToolNode, TopicPublisher

__all__ = ["VERB"]

_SHIELD = "\0"
_NEGATIVE = re.compile(r"-(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\Z", re.IGNORECASE)

LATCH_SECONDS = 3.0
_FILE_RATE = 10.0
_CONNECT_SECONDS = 0.5
REGISTERED_CONNECT_SECONDS = 5.0
_CLOCK_SECONDS = 5.0


class _PubParser(Parser):
    """A parser that accepts negative numbers as values although `-1` is an option."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Parse the arguments to a dict keyed by name, accepting negative numbers as values and -1 as a rate."""
        options = super().parse(
            [
                _SHIELD + word
                if _NEGATIVE.match(word) and (word != "-1" or previous in ("-r", "--rate"))
                else word
                for previous, word in zip(["", *words], words, strict=False)
            ]
        )
        options["args"] = [word.removeprefix(_SHIELD) for word in cast("list[str]", options["args"])]
        return options


def _pub_parser() -> Parser:
    parser = _PubParser(
        "rostopic pub",
        "Publish to a topic: one message that stays (latched) until Ctrl-C, or by options.",
        "rostopic pub /topic type [args...]",
        missing={"topic": "/topic must be specified", "type": "topic type must be specified"},
        epilog='Arguments are YAML: one dictionary ("data: True"), or a value for each field in order. '
        "Without arguments, messages are read from standard input, with --- between them.",
    )

    add = parser.add_argument
    add("topic", help="the topic's name", completer="topics")
    add("type", help="the message type, as std_msgs/Bool", completer="topic_type")
    add(
        "args",
        nargs="*",
        default=[],
        help="the message's values; `now` is the time, header: auto is stamped",
        completer="message_text",
    )

    add("-v", dest="verbose", action="store_true", help="print verbose output")
    add(
        "-r",
        "--rate",
        type=_positive,
        metavar="RATE",
        help="publishing rate (hz).  For -f and stdin input, this defaults to 10.  Otherwise it is not set.",
    )
    add("-1", "--once", action="store_true", help="publish one message and exit")
    add("-f", "--file", metavar="FILE", help="read args from YAML file (Bagy)", completer="files")
    add(
        "-l",
        "--latch",
        action="store_true",
        help="enable latching for -f, -r and piped input.  This latches the first message.",
    )
    add(
        "-s",
        "--substitute-keywords",
        action="store_true",
        help="When publishing with a rate, performs keyword ('now' or 'auto') substitution for each message",
    )
    add("--use-rostime", action="store_true", help="use rostime for time stamps, else walltime is used")

    # Before Noetic, the option -s was called -K.
    parser.own_options().add_argument("-K", dest="substitute_keywords", action="store_true", help="as -s")
    return parser


def _pub(
    topic: str,
    type: str,
    args: Sequence[str],
    verbose: bool,
    rate: float | None,
    once: bool,
    file: str | None,
    latch: bool,
    substitute_keywords: bool,
    use_rostime: bool,
    arguments: Arguments | None = None,
) -> None:
    if once and rate is not None:
        raise Misuse("-1 and -r exclude each other", "You cannot select both -r and -1 (--once)")
    if file is not None and args:
        raise Misuse("-f and values on the command line exclude each other", "args conflict with -f setting")

    _publish(
        _Publishing(topic, type, args, verbose, rate, once, file, latch, substitute_keywords, use_rostime),
        arguments,
    )


def _positive(text: str) -> float:
    try:
        rate = float(text.removeprefix(_SHIELD))
    except ValueError:
        raise argparse.ArgumentTypeError("rate must be a number") from None
    if not 0.0 < rate < 1e6:
        raise argparse.ArgumentTypeError("rate must be greater than zero")
    return rate


class _Publishing(NamedTuple):
    """The arguments of `rostopic pub`."""

    topic: str
    type: str
    args: Sequence[str]
    verbose: bool
    rate: float | None
    once: bool
    file: str | None
    latch: bool
    substitute_keywords: bool
    use_rostime: bool


def _publish(options: _Publishing, arguments: Arguments | None) -> None:
    """Publish messages. ``arguments`` holds the command line's remapping arguments."""
    # imported here, because other verbs do not need message classes
    from minirospy.introspect.echo import fill_message
    from minirospy.introspect.publishing import publish_all, values_to_publish

    cls = _message_class(options.type, options.topic)
    with Graph.open("rostopic", arguments=arguments) as graph:
        topic = graph.resolve(options.topic)
        all_values = values_to_publish(cls.__slots__, options.args, options.file)
        # Parse the values before starting the node, to report typos immediately.
        values = _first_values(all_values, options)
        message = _filled(cls, values)
        state = graph.state()
        awaited = topic in state.subscribers
        if awaited or topic in state.publishers:
            _warn_of_other_type(graph, topic, cls._type)
        elif why := why_illegal(topic):
            raise UsageError(f"topic [{topic}]: {why}")
        else:
            warn_no_subscribers(topic, state.subscribers.keys() - {"/rosout"})
    # Latch a single message for late subscribers, but a stream of messages only on request.
    from_documents = bool(not options.args and (cls.__slots__ or options.file))
    lasting = options.once or options.latch or (options.rate is None and not from_documents)
    with tool_node("rostopic", arguments, ros_time=options.use_rostime) as node:
        publisher = node.publisher(topic, cls, latch=lasting)

        def filled(values: list[object]) -> Message:
            return fill_message(cls, values, node.clock.now())

        if node.simulated:
            node.wait_for_time(_CLOCK_SECONDS)
            message = filled(values)
        if options.once or (lasting and options.rate is None):
            _latch(node, publisher, message, options)
            return
        messages: Iterable[Message] = itertools.repeat(message)
        if from_documents:
            # Wait for subscribers to connect: otherwise the first messages from a file would be lost.
            seconds = REGISTERED_CONNECT_SECONDS if awaited else _CONNECT_SECONDS
            publisher.wait_for_subscriber(node.wait, seconds)
            messages = itertools.chain([message], map(filled, all_values))
        elif options.substitute_keywords:
            messages = map(filled, itertools.repeat(values))

        def show(message: Message) -> None:
            if options.verbose:
                print(f"publishing {message}", flush=True)

        publish_all(node, publisher, messages, options.rate or _FILE_RATE, show)


def _message_class(type_: str, topic: str) -> type[Message]:
    from minirospy.core.idl.load import get_message_class, message_class

    try:
        return message_class(type_)
    except NotFoundError as error:
        package = type_.partition("/")[0]
        hint = f"If this is a valid message type, perhaps you need to type 'rosmake {package}'"
        if "/" in topic.strip("/") and get_message_class(topic.strip("/")):
            error.hint = f"the topic comes first: rostopic pub {type_} {topic}"
        raise WordedError(error, RosText(f"ERROR: invalid message type: {type_}.\n{hint}")) from error


def _first_values(all_values: Iterator[list[object]], options: _Publishing) -> list[object]:
    """Return the first message's values.

    Raise WordedError if the file does not exist, Misuse if an argument is not valid YAML.
    """
    try:
        return next(all_values)
    except NotFoundError as error:
        raise WordedError(error, RosText(f"ERROR: file does not exist: {error.name}")) from error
    except ValueTextError as error:
        if options.file is not None or not options.args:
            raise
        raise Misuse(str(error), _ros_argument_error(error.text)) from error


def _ros_argument_error(text: str) -> str:
    """Return ROS's error message for an argument that is not valid YAML, including PyYAML's error."""
    import yaml

    try:
        safe_load(text)
    except yaml.YAMLError as error:
        return f"Argument error: {error}"
    return ""


def _filled(cls: type[Message], values: list[object]) -> Message:
    from minirospy.core.idl.message_text import get_printable_message_args
    from minirospy.introspect.echo import fill_message

    try:
        return fill_message(cls, values)
    except MessageException as error:
        if isinstance(error.__cause__, SerializationError):
            raise  # ROS detects these errors only when publishing, and does not print them
        text = f"ERROR: {error.__cause__ or error}\n\nArgs are: [{get_printable_message_args(cls())}]"
        raise WordedError(error, RosText(text)) from error


def _warn_of_other_type(graph: Graph, topic: str, type_: str) -> None:
    other = graph.master.get_topic_types().get(topic, "*")
    if other not in ("*", type_):
        warn(f"topic [{topic}] is of type [{other}] already, not [{type_}]")


def _latch(node: ToolNode, publisher: TopicPublisher, message: Message, options: _Publishing) -> None:
    how_long = f" for {LATCH_SECONDS} seconds" if options.once else ". Press ctrl-C to terminate"
    shown = f"[{message}]" if options.verbose else "message"
    print(f"publishing and latching {shown}{how_long}", flush=True)
    publisher.publish(message)
    while not node.wait(LATCH_SECONDS):
        if options.once:
            return


VERB = Verb("pub", "publish data to topic", _pub_parser, _pub)
