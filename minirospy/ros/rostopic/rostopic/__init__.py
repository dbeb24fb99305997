"""rostopic: queries about topics, and publishing. Source: http://wiki.ros.org/rostopic."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NotFoundError, UsageError
from minirospy.introspect import topics
from minirospy.introspect.fields import Step, field_value, parse_path
from minirospy.introspect.graph import Graph
from minirospy.ros.rosgraph.rosgraph import masterapi
from minirospy.ros.rosgraph.rosgraph.names import script_resolve_name
from minirospy.ros.rosgraph.rosgraph.network import parse_http_host_and_port
from minirospy.ros.rostopic.rostopic.echo import CallbackEcho

if TYPE_CHECKING:
    import rosgraph as rosgraph

    from minirospy.client.publisher import Publisher
    from minirospy.core.idl.protocols import Message
    from minirospy.ros.rostopic.rostopic.echo import create_field_filter, create_value_transform
    from minirospy.ros.rostopic.rostopic.rates import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz

__all__ = [
    "NAME",
    "CallbackEcho",
    "ROSTopicBandwidth",
    "ROSTopicDelay",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "_check_master",
    "_fullusage",
    "_get_topic_type",
    "_master_get_topic_types",
    "_rostopic_cmd_bw",
    "_rostopic_cmd_delay",
    "_rostopic_cmd_echo",
    "_rostopic_cmd_find",
    "_rostopic_cmd_hz",
    "_rostopic_cmd_info",
    "_rostopic_cmd_list",
    "_rostopic_cmd_pub",
    "_rostopic_cmd_type",
    "_rostopic_echo",
    "_rostopic_info",
    "_rostopic_list",
    "_rostopic_list_group_by_host",
    "_rostopic_type",
    "_sleep",
    "create_field_filter",
    "create_publisher",
    "create_value_transform",
    "find_by_type",
    "get_api",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "publish_message",
    "rostopicmain",
]

NAME = "rostopic"
_LATCH_SECONDS = 3.0
_Topic = tuple[str, str, list[str]]

_TopicRow = tuple[str, str, list[str]]  # topic, type, nodes that publish (or subscribe to) it


class ROSTopicException(Exception):
    """A request about a topic failed."""


class ROSTopicIOException(ROSTopicException):
    """The master does not respond."""


class _NoMaster(ROSTopicIOException, ConnectionRefusedError):
    """Also a socket error, because programs expect one from ROS's get_topic_list."""


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str | None, str | None, Callable[[Message], object] | None]:
    """Return (type, topic, function that extracts the field from a message), or three times None if there is no such topic.

    ``topic`` may include a field of the messages. With ``blocking``, wait until the topic exists or the node shuts down.
    """
    with _graph() as graph:
        name = graph.resolve(topic)
        field = topics.find_topic(graph, name)
        if field is None and blocking:
            from minirospy.command.command import warn_unpublished

            warn_unpublished(graph, name)
            while field is None and not _is_shutdown():
                time.sleep(0.1)
                field = topics.find_topic(graph, name)
    if field is None:
        return None, None, None
    return field.type, field.topic, msgevalgen(field.path)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Message] | None, str | None, Callable[[Message], object] | None]:
    """Return get_topic_type()'s result, but with the message class as type. Raise ROSTopicException if it is not installed."""
    from minirospy.core.idl.load import get_message_class

    type_, real_topic, function = get_topic_type(topic, blocking)
    if type_ is None:
        return None, None, None
    cls = get_message_class(type_)
    if cls is None:
        raise ROSTopicException(f"Cannot load message class for [{type_}]. Are your messages built?")
    return cls, real_topic, function


def get_topic_list(master: masterapi.Master | None = None) -> tuple[list[_TopicRow], list[_TopicRow]]:
    """Return (published, subscribed), each a list of (topic, type, nodes)."""
    with _graph(_NoMaster) as graph:
        found = topics.list_topics(graph)
    published, subscribed = ([(each.name, each.type, list(each.nodes)) for each in side] for side in found)
    return published, subscribed


def find_by_type(topic_type: str) -> list[str]:
    """Return the topics that have this type."""
    with _graph() as graph:
        return topics.find_topics_of_type(graph, topic_type)


def msgevalgen(pattern: str) -> Callable[[Message], object] | None:
    """Return a function that extracts the field at a path (``/pose/x``) from a message, or None for the whole message.

    Also return None if a bracket in the path is invalid. Print this error, and the error for a missing field, to stderr.
    """
    fields = [each for each in pattern.split("/") if each]
    try:
        steps = parse_path("/".join(fields))
    except UsageError:
        if faults := list(filter(None, map(_slice_fault, fields))):
            print(faults[0], file=sys.stderr)
            return None
        # Treat the step as a field name, which no message has.
        steps = tuple(Step(each, None) for each in fields)

    def report(error: NotFoundError | IndexError) -> None:
        why = f"no field named {error.name} in" if isinstance(error, NotFoundError) else f"{error.__cause__}:"
        print(why, pattern, file=sys.stderr)

    def value(message: Message) -> object:
        try:
            return field_value(message, steps, report)
        except (NotFoundError, IndexError) as error:
            report(error)
            return None

    return value if steps else None


def _slice_fault(field: str) -> str:
    """Return the error in a field's brackets, in ROS's wording, or an empty string if there is none."""
    name, bracket, rest = field.partition("[")
    if not bracket:
        return ""
    if not rest.endswith("]"):
        return f"missing closing ']' in slice spec '{field}'"
    numbers = rest[:-1].split(":")
    roles = ("slice start", "slice stop", "slice step") if len(numbers) > 1 else ("array index step",)
    faults = [
        f"non-integer {role} '{number}'"
        for role, number in zip(roles, numbers, strict=False)
        if number and not re.fullmatch(r"[+-]?\d+", number.strip())
    ]
    if len(numbers) > 3:
        faults.append("too many slice arguments")
    why = "empty array index" if numbers == [""] else next(iter(faults), "")
    return why and f"field '{name}' has invalid slice argument '{rest[:-1]}': {why}"


def get_info_text(topic: str) -> str:
    """Return a topic's type, publishers and subscribers, as `rostopic info` prints them.

    Raise ROSTopicException if the topic does not exist.
    """
    from minirospy.introspect.texts import topic_text

    if topic is not None and not isinstance(topic, str):
        raise ROSTopicException(f"Unknown topic {topic}")
    with _graph() as graph:
        try:
            return topic_text(topics.topic_detail(graph, graph.resolve(topic)))
        except NotFoundError as error:
            raise ROSTopicException(f"Unknown topic {topic}") from error


def get_api(master: masterapi.Master, caller_id: str) -> str:
    """Return a node's URI, or `unknown address` with its name. Raise ROSTopicIOException if the master does not respond."""
    try:
        return master.lookupNode(caller_id)
    except masterapi.MasterException:
        return f"unknown address {caller_id}"
    except OSError as error:
        raise ROSTopicIOException(MasterUnreachableError.ros_text) from error


def create_publisher(
    topic_name: str, topic_type: str, latch: bool, disable_rostime: bool = True
) -> tuple[Publisher[Message], type[Message]]:
    """Return (publisher, message class) for a topic and a type name; call init_node if this process is not a node yet.

    Raise ROSTopicException if the type is not installed.
    """
    import rospy

    from minirospy.ros.genpy.genpy.message import get_message_class

    try:
        cls = get_message_class(topic_type)
    except (AttributeError, TypeError, ValueError) as error:
        raise ROSTopicException(f"invalid topic type: {topic_type}") from error
    if cls is None:
        raise ROSTopicException(f"invalid message type: {topic_type}.\nIs its package built and sourced?")
    if not rospy.core.is_initialized():
        rospy.init_node(NAME, anonymous=True, disable_rosout=True, disable_rostime=disable_rostime)
    name = script_resolve_name(NAME, topic_name)
    return rospy.Publisher(name, cls, latch=latch, queue_size=100), cls


def publish_message(
    pub: Publisher[Message],
    msg_class: type[Message],
    pub_args: Sequence[object],
    rate: float | None = None,
    once: bool = False,
    verbose: bool = False,
    substitute_keywords: bool = False,
) -> None:
    """Publish a message built from YAML values: ``rate`` times a second, else ``once`` for 3 seconds, else until shutdown.

    ``substitute_keywords``: replace `now` and `auto` in each message. Raise ROSTopicException if the values do not
    match the message's fields.
    """
    import rospy

    from minirospy.base.errors import MessageException
    from minirospy.introspect.echo import fill_message

    def message() -> Message:
        try:
            return fill_message(msg_class, pub_args, rospy.Time.now().to_nsec())
        except MessageException as error:
            raise ROSTopicException(f"Unable to publish message. {error}") from error

    value = message()
    shown = f"[{value}]" if verbose else "message"
    if rate is None:
        pause = f" for {_LATCH_SECONDS} seconds" if once else ". Press ctrl-C to terminate"
        print(f"publishing and latching {shown}{pause}")
        pub.publish(value)
        if not once:
            rospy.spin()
            return
        end = time.monotonic() + _LATCH_SECONDS
        while time.monotonic() < end and not rospy.is_shutdown():
            time.sleep(0.05)
        return
    pauses = rospy.Rate(rate)
    with suppress(rospy.ROSInterruptException):
        while not rospy.is_shutdown():
            if verbose:
                print(f"publishing {shown}")
            pub.publish(message() if substitute_keywords else value)
            if once:
                return
            pauses.sleep()


def rostopicmain(argv: Sequence[str] | None = None) -> None:
    """Run the command; ``argv`` starts with its name. Exit the program on failure, as in ROS."""
    _command(list(sys.argv if argv is None else argv)[1:])


# Private functions of ROS that programs call.

_rostopic_cmd_bw = _rostopic_cmd_delay = _rostopic_cmd_echo = _rostopic_cmd_find = _rostopic_cmd_hz = (
    rostopicmain
)
_rostopic_cmd_info = _rostopic_cmd_list = _rostopic_cmd_pub = _rostopic_cmd_type = rostopicmain


def _fullusage() -> NoReturn:
    """Print the list of commands, and exit with the status of a usage error."""
    _command([])
    raise AssertionError("a command without arguments is a usage error")


def _rostopic_list_group_by_host(
    master: masterapi.Master, pubs: Sequence[_Topic], subs: Sequence[_Topic]
) -> tuple[dict[str, list[_Topic]], dict[str, list[_Topic]]]:
    """Return host -> rows for the publishers, and the same for the subscribers; each row is (topic, type, nodes)."""
    hosts: dict[str, str] = {}

    def grouped(rows: Sequence[_Topic]) -> dict[str, list[_Topic]]:
        found: dict[str, dict[tuple[str, str], list[str]]] = {}
        for topic, type_, nodes in rows:
            for node in nodes:
                if node not in hosts:
                    hosts[node] = parse_http_host_and_port(master.lookupNode(node))[0]
                found.setdefault(hosts[node], {}).setdefault((topic, type_), []).append(node)
        return {host: [(*key, nodes) for key, nodes in topics.items()] for host, topics in found.items()}

    return grouped(pubs), grouped(subs)


def _check_master() -> None:
    """Raise ROSTopicIOException if no master responds."""
    with _graph() as graph:
        graph.master.get_pid()


def _master_get_topic_types(master: masterapi.Master) -> list[list[str]]:
    """Return [topic, type] for every topic that is registered with the master."""
    return master.getTopicTypes()


def _sleep(duration: float) -> None:
    """Wait for ``duration`` seconds on ROS's clock. Raise ROSInterruptException if the node shuts down."""
    import rospy

    rospy.rostime.wallsleep(duration)


_get_topic_type = get_topic_type


def _rostopic_list(
    topic: str | None,
    verbose: bool = False,
    subscribers_only: bool = False,
    publishers_only: bool = False,
    group_by_host: bool = False,
) -> None:
    """Print the output of `rostopic list`. Raise ROSTopicIOException if the master does not respond."""
    _check_master()
    chosen = {"-v": verbose, "-s": subscribers_only, "-p": publishers_only, "--host": group_by_host}
    _command(["list", *(option for option, on in chosen.items() if on), *([topic] if topic else [])])


def _rostopic_info(topic: str) -> None:
    """Print the output of `rostopic info`. Raise ROSTopicException if the topic does not exist."""
    print(get_info_text(topic))


def _rostopic_type(topic: str) -> None:
    """Print the output of `rostopic type`. Raise ROSTopicIOException if the master does not respond."""
    _check_master()
    _command(["type", topic])


def _rostopic_echo(
    topic: str, callback_echo: CallbackEcho, bag_file: str | None = None, echo_all_topics: bool = False
) -> None:
    """Pass a topic's messages, or one of their fields, to ``callback_echo`` until its ``done`` is true."""
    import rospy

    if bag_file:
        raise ROSTopicException(f"[{bag_file}]: bags are not read by this function")
    if not rospy.core.is_initialized():
        rospy.init_node(NAME, anonymous=True)
    cls, real_topic, field = get_topic_class(topic, blocking=True)
    if real_topic is None or cls is None:
        return
    callback_echo.msg_eval = field
    information = {"topic": real_topic, "type_information": cls._type}
    subscriber = rospy.Subscriber(real_topic, cls, callback_echo.callback, information)
    while not rospy.is_shutdown() and not callback_echo.done:
        time.sleep(0.05)
    subscriber.unregister()


def _is_shutdown() -> bool:
    """Return whether the program is a node that is shutting down; False if it never imported rospy."""
    rospy: Any = sys.modules.get("rospy")
    return rospy is not None and bool(rospy.is_shutdown())


def _command(words: Sequence[str]) -> None:
    from minirospy.ros.rostopic.commands.rostopic import main

    if status := main(list(words)):
        sys.exit(status)


@contextmanager
def _graph(unreachable: type[Exception] = ROSTopicIOException) -> Iterator[Graph]:
    try:
        with Graph.open(NAME) as graph:
            yield graph
    except MasterUnreachableError as error:
        raise unreachable(error.ros_text) from error
    except MinirospyError as error:
        raise ROSTopicException(str(error)) from error
