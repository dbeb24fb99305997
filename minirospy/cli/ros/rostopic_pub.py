"""rostopic pub: publishing by hand, once, at a rate, or from a file or pipe.

Source: http://wiki.ros.org/rostopic#rostopic_pub. What is printed is what ROS prints.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

from minirospy.cli.command import RosText, WordedError, tool_node, warn
from minirospy.cli.parser import Misuse
from minirospy.errors import MessageException, NotFoundError, SerializationError, UsageError, ValueTextError
from minirospy.idl.load import message_class
from minirospy.idl.message import get_printable_message_args
from minirospy.introspect.echo import fill_message
from minirospy.introspect.graph import Graph, why_illegal
from minirospy.introspect.publishing import publish_all, values_to_publish

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from minirospy.idl.protocols import Message
    from minirospy.introspect.streams import ToolNode, TopicPublisher
    from minirospy.names import Arguments

__all__ = ["Publishing", "publish"]

_LATCH_SECONDS = 3.0
_FILE_RATE = 10.0
_CONNECT_SECONDS = 0.5
_REGISTERED_CONNECT_SECONDS = 2.0
_CLOCK_SECONDS = 1.0


class Publishing(NamedTuple):
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


def publish(options: Publishing, arguments: Arguments | None) -> None:
    """Publish, with the remapping arguments that were among the words of the command line."""
    cls = _message_class(options.type)
    with Graph.open("rostopic", arguments=arguments) as graph:
        topic = graph.resolve(options.topic)
        all_values = values_to_publish(cls.__slots__, options.args, options.file)
        # Before the node is started, so that a typing error shows immediately.
        values = _first_values(all_values, options)
        message = _filled(cls, values)
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
            # The first messages of a file have nobody to go to before subscribers have connected.
            seconds = _REGISTERED_CONNECT_SECONDS if awaited else _CONNECT_SECONDS
            publisher.wait_for_subscriber(node.wait, seconds)
            messages = itertools.chain([message], map(filled, all_values))
        elif options.substitute_keywords:
            messages = map(filled, itertools.repeat(values))

        def show(message: Message) -> None:
            if options.verbose:
                print(f"publishing {message}", flush=True)

        publish_all(node, publisher, messages, options.rate or _FILE_RATE, show)


def _message_class(type_: str) -> type[Message]:
    try:
        return message_class(type_)
    except NotFoundError as error:
        package = type_.partition("/")[0]
        hint = f"If this is a valid message type, perhaps you need to type 'rosmake {package}'"
        raise WordedError(error, RosText(f"ERROR: invalid message type: {type_}.\n{hint}")) from error


def _first_values(all_values: Iterator[list[object]], options: Publishing) -> list[object]:
    """Return the values of the first message. Raises WordedError, and Misuse where an argument is not YAML."""
    try:
        return next(all_values)
    except NotFoundError as error:
        raise WordedError(error, RosText(f"ERROR: file does not exist: {error.name}")) from error
    except ValueTextError as error:
        if options.file is not None or not options.args:
            raise
        raise Misuse(str(error), _ros_argument_error(error.text)) from error


def _ros_argument_error(text: str) -> str:
    """Return ROS's text about an argument that is not YAML: that of PyYAML's own parser."""
    import yaml

    try:
        yaml.safe_load(text)
    except yaml.YAMLError as error:
        return f"Argument error: {error}"
    return ""


def _filled(cls: type[Message], values: list[object]) -> Message:
    try:
        return fill_message(cls, values)
    except MessageException as error:
        if isinstance(error.__cause__, SerializationError):
            raise  # ROS finds these only when it publishes, and prints nothing
        text = f"ERROR: {error.__cause__ or error}\n\nArgs are: [{get_printable_message_args(cls())}]"
        raise WordedError(error, RosText(text)) from error


def _warn_of_other_type(graph: Graph, topic: str, type_: str) -> None:
    other = graph.master.get_topic_types().get(topic, "*")
    if other not in ("*", type_):
        warn(f"topic [{topic}] is of type [{other}] already, not [{type_}]")


def _latch(node: ToolNode, publisher: TopicPublisher, message: Message, options: Publishing) -> None:
    how_long = f" for {_LATCH_SECONDS} seconds" if options.once else ". Press ctrl-C to terminate"
    shown = f"[{message}]" if options.verbose else "message"
    print(f"publishing and latching {shown}{how_long}", flush=True)
    publisher.publish(message)
    while not node.wait(_LATCH_SECONDS):
        if options.once:
            return
