"""rostopic: queries about topics, and functions for publishing. Source: http://wiki.ros.org/rostopic."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NotFoundError, UsageError
from minirospy.introspect import topics
from minirospy.introspect.fields import NotAnArrayError, Step, field_value, parse_path
from minirospy.introspect.graph import Graph
from minirospy.ros.rosgraph.rosgraph import masterapi
from minirospy.ros.rosgraph.rosgraph.names import make_global_ns, script_resolve_name
from minirospy.ros.rosgraph.rosgraph.network import parse_http_host_and_port
from minirospy.ros.rostopic.errors import ROSTopicException, ROSTopicIOException
from minirospy.ros.rostopic.plots import array_index_or_slice as _get_array_index_or_slice_object
from minirospy.ros.rostopic.plots import ascii_table as _get_ascii_table
from minirospy.ros.rostopic.plots import convert_getattr as _convert_getattr
from minirospy.ros.rostopic.plots import is_string_type as _isstring_type
from minirospy.ros.rostopic.plots import nested_attribute as _get_nested_attribute
from minirospy.ros.rostopic.plots import plot as _str_plot
from minirospy.ros.rostopic.plots import plot_cells as _sub_str_plot
from minirospy.ros.rostopic.plots import plot_field_cells as _sub_str_plot_fields
from minirospy.ros.rostopic.plots import plot_fields as _str_plot_fields
from minirospy.ros.rostopic.publishing import (
    SUBSCRIBER_TIMEOUT,
    argv_publish,
    file_yaml_arg,
    param_publish,
    param_publish_once,
    publish_message,
    stdin_publish,
    stdin_yaml_arg,
    wait_for_subscriber,
)
from minirospy.ros.rostopic.publishing import fill_message as _fillMessageArgs  # noqa: N812 - ROS's name
from minirospy.ros.rostopic.publishing import publish_at_rate as _publish_at_rate
from minirospy.ros.rostopic.publishing import publish_latched as _publish_latched
from minirospy.ros.rostopic.rostopic.echo import CallbackEcho

if TYPE_CHECKING:
    import rosgraph as rosgraph

    from minirospy.client.publisher import Publisher
    from minirospy.core.idl.protocols import Message
    from minirospy.ros.rostopic.rostopic.echo import create_field_filter, create_value_transform
    from minirospy.ros.rostopic.rostopic.rates import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz

__all__ = [
    "NAME",
    "SUBSCRIBER_TIMEOUT",
    "CallbackEcho",
    "ROSTopicBandwidth",
    "ROSTopicDelay",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "_check_master",
    "_convert_getattr",
    "_fillMessageArgs",
    "_fullusage",
    "_get_array_index_or_slice_object",
    "_get_ascii_table",
    "_get_nested_attribute",
    "_get_topic_type",
    "_isstring_type",
    "_master_get_topic_types",
    "_optparse_topic_only",
    "_publish_at_rate",
    "_publish_latched",
    "_resource_name_package",
    "_rostopic_bw",
    "_rostopic_cmd_bw",
    "_rostopic_cmd_delay",
    "_rostopic_cmd_echo",
    "_rostopic_cmd_find",
    "_rostopic_cmd_hz",
    "_rostopic_cmd_info",
    "_rostopic_cmd_list",
    "_rostopic_cmd_pub",
    "_rostopic_cmd_type",
    "_rostopic_delay",
    "_rostopic_echo",
    "_rostopic_echo_bag",
    "_rostopic_hz",
    "_rostopic_info",
    "_rostopic_list",
    "_rostopic_list_bag",
    "_rostopic_list_group_by_host",
    "_rostopic_type",
    "_sleep",
    "_str_plot",
    "_str_plot_fields",
    "_sub_rostopic_list",
    "_sub_str_plot",
    "_sub_str_plot_fields",
    "argv_publish",
    "create_field_filter",
    "create_publisher",
    "create_value_transform",
    "file_yaml_arg",
    "find_by_type",
    "get_api",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "param_publish",
    "param_publish_once",
    "publish_message",
    "rostopicmain",
    "stdin_publish",
    "stdin_yaml_arg",
    "wait_for_subscriber",
]

NAME = "rostopic"
_Topic = tuple[str, str, list[str]]
# (topic, type, nodes that publish or subscribe to the topic)
_TopicRow = tuple[str, str, list[str]]


class _NoMaster(ROSTopicIOException, ConnectionRefusedError):
    """A ROSTopicIOException that is also a socket error, which programs expect from ROS's get_topic_list."""


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str | None, str | None, Callable[[Message], object] | None]:
    """Return (type, topic, function that extracts the field from a message), or (None, None, None) if there is no such topic.

    ``topic`` may include a field name. If ``blocking``, wait until the topic exists or the node shuts down.
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
    """Like get_topic_type(), but return the message class in place of the type name.

    Raise ROSTopicException if the class is not installed.
    """
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
    """Return the topics of this type."""
    with _graph() as graph:
        return topics.find_topics_of_type(graph, topic_type)


def msgevalgen(pattern: str) -> Callable[[Message], object] | None:
    """Return a function that extracts the field at a path (``/pose/x``) from a message, or None for the whole message.

    Also return None if a bracket in the path is invalid. An invalid bracket or a missing field is reported on stderr. The
    function raises AttributeError if a field with a bracket is not an array, ValueError if a slice has a step of 0.
    """
    fields = [each for each in pattern.split("/") if each]
    try:
        steps = parse_path("/".join(fields), zero_steps=True)
    except UsageError:
        if faults := list(filter(None, map(_slice_fault, fields))):
            print(faults[0], file=sys.stderr)
            return None
        # Treat the invalid text as field names: no message has such fields, so they are reported as missing.
        steps = tuple(Step(each, None) for each in fields)

    def report(error: NotFoundError | IndexError) -> None:
        if isinstance(error, NotAnArrayError):
            raise AttributeError(f"'{error.type_name}' object has no attribute '__getitem__'") from error
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
    """Return ROS's error message for invalid brackets in a field, or "" if they are valid."""
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
    """Return a topic's type, publishers and subscribers, formatted like `rostopic info`.

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
    """Return a node's URI, or `unknown address` with its name if the node is unknown.

    Raise ROSTopicIOException if the master does not respond.
    """
    try:
        return master.lookupNode(caller_id)
    except masterapi.MasterException:
        return f"unknown address {caller_id}"
    except OSError as error:
        raise ROSTopicIOException(MasterUnreachableError.ros_text) from error


def create_publisher(
    topic_name: str, topic_type: str, latch: bool, disable_rostime: bool = True
) -> tuple[Publisher[Message], type[Message]]:
    """Return (publisher, message class) for a topic and type name. Call init_node if this process is not a node yet.

    Raise ROSTopicException if the type is not installed.
    """
    import rospy

    from minirospy.ros.genpy.genpy.message import get_message_class

    try:
        cls = get_message_class(topic_type)
    except (AttributeError, TypeError, ValueError) as error:
        raise ROSTopicException(f"invalid topic type: {topic_type}") from error
    if cls is None:
        hint = f"If this is a valid message type, perhaps you need to type 'rosmake {_resource_name_package(topic_type)}'"
        raise ROSTopicException(f"invalid message type: {topic_type}.\n{hint}")
    if not rospy.core.is_initialized():
        rospy.init_node(NAME, anonymous=True, disable_rosout=True, disable_rostime=disable_rostime)
    name = script_resolve_name(NAME, topic_name)
    return rospy.Publisher(name, cls, latch=latch, queue_size=100), cls


def rostopicmain(argv: Sequence[str] | None = None) -> None:
    """Run the command and, as in ROS, exit the program if it fails. ``argv`` starts with the command's name."""
    _command(list(sys.argv if argv is None else argv)[1:])


# Programs call the following private functions of ROS's rostopic.


def _verb(name: str) -> Callable[[Sequence[str]], None]:
    """Return a function that runs a verb. Its argument is a command line, starting with the command's name and the verb."""

    def call(argv: Sequence[str] = sys.argv) -> None:
        from minirospy.command.called import Raised, call_verb
        from minirospy.ros.rostopic.commands.rostopic import FAMILY

        call_verb(FAMILY, [name, *argv[2:]], Raised(ROSTopicException, ROSTopicIOException))

    return call


_rostopic_cmd_bw = _verb("bw")
_rostopic_cmd_delay = _verb("delay")
_rostopic_cmd_echo = _verb("echo")
_rostopic_cmd_find = _verb("find")
_rostopic_cmd_hz = _verb("hz")
_rostopic_cmd_info = _verb("info")
_rostopic_cmd_list = _verb("list")
_rostopic_cmd_pub = _verb("pub")
_rostopic_cmd_type = _verb("type")


def _fullusage() -> NoReturn:
    """Print the list of commands and exit with the status of a usage error."""
    _command([])
    raise AssertionError("a command without arguments is a usage error")


def _rostopic_list_group_by_host(
    master: masterapi.Master, pubs: Sequence[_Topic], subs: Sequence[_Topic]
) -> tuple[dict[str, list[_Topic]], dict[str, list[_Topic]]]:
    """Return the publishers and the subscribers as dicts from host to rows (topic, type, nodes)."""
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
    """Return [topic, type] for every topic registered with the master."""
    return master.getTopicTypes()


def _sleep(duration: float) -> None:
    """Wait for ``duration`` seconds of wall time, even if the node's time is simulated."""
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
    """Pass a topic's messages or one of their fields to ``callback_echo`` until its ``done`` is True."""
    import rospy

    if bag_file:
        _rostopic_echo_bag(callback_echo, bag_file)
        return
    _become_node()
    cls, real_topic, field = get_topic_class(topic, blocking=True)
    if real_topic is None or cls is None:
        return
    callback_echo.msg_eval = field
    information = {"topic": real_topic, "type_information": cls._type}
    subscriber = rospy.Subscriber(real_topic, cls, callback_echo.callback, information)
    while not rospy.is_shutdown() and not callback_echo.done:
        time.sleep(0.05)
    subscriber.unregister()


def _rostopic_echo_bag(callback_echo: CallbackEcho, bag_file: str) -> None:
    """Pass a bag's messages to ``callback_echo`` until its ``done`` is True.

    Raise ROSTopicException if the file does not exist.
    """
    with _open_bag(bag_file) as bag:
        for topic, message, stamp in bag.read_messages():
            callback_echo.callback(message, {"topic": script_resolve_name(NAME, topic)}, current_time=stamp)
            if callback_echo.done:
                return


def _rostopic_list_bag(bag_file: str, topic: str | None = None) -> None:
    """Print a bag's topics or, if ``topic`` is given, the count and times of the messages on it and in its namespace.

    Raise ROSTopicException if the file does not exist.
    """
    with _open_bag(bag_file) as bag:
        if topic:
            stamps = [
                stamp.to_time()
                for name, _, stamp in bag.read_messages(raw=True)
                if name == topic or name.startswith(make_global_ns(topic))
            ]
            start, end = (time.strftime("%d %b %Y %H:%M:%S", time.localtime(stamps[at])) for at in (0, -1))
            print(f"{len(stamps)} message(s) from {start} to {end}")
            return
        for name in dict.fromkeys(name for name, _, _ in bag.read_messages(raw=True)):
            print(name)


def _open_bag(path: str) -> Any:
    from minirospy.ros.rosbag.rosbag.bag import Bag

    if not os.path.exists(path):
        raise ROSTopicException(f"bag file [{path}] does not exist")
    return Bag(path)


def _become_node(disable_rostime: bool = False) -> None:
    """Call init_node if this process is not a node yet. Raise ROSTopicIOException if the master does not respond."""
    import rospy

    _check_master()
    if not rospy.core.is_initialized():
        rospy.init_node(NAME, anonymous=True, disable_rostime=disable_rostime)


def _rostopic_hz(
    topics: Sequence[str],
    window_size: int = -1,
    filter_expr: Callable[[object], bool] | None = None,
    use_wtime: bool = False,
    tcp_nodelay: bool = False,
) -> None:
    """Wait until each topic is published, then print the rates every second until shutdown."""
    import rospy

    from minirospy.ros.rostopic.rostopic.rates import ROSTopicHz

    _become_node()
    rates = ROSTopicHz(window_size, filter_expr=filter_expr, use_wtime=use_wtime)
    for topic in topics:
        cls, real_topic, _ = get_topic_class(topic, blocking=True)
        if real_topic is None:
            return
        wanted: Any = rospy.AnyMsg if filter_expr is None else cls
        rospy.Subscriber(real_topic, wanted, rates.callback_hz, topic, tcp_nodelay=tcp_nodelay)
        print(f"subscribed to [{real_topic}]")
    _print_every_second(lambda: rates.print_hz(topics))


def _rostopic_bw(topic: str, window_size: int = -1) -> None:
    """Wait until a topic is published, then print its bandwidth every second until shutdown."""
    import rospy

    from minirospy.ros.rostopic.rostopic.rates import ROSTopicBandwidth

    _check_master()
    _, real_topic, _ = get_topic_type(topic, blocking=True)
    if real_topic is None:
        return
    _become_node(disable_rostime=True)
    bandwidth = ROSTopicBandwidth(window_size)
    subscriber = rospy.Subscriber(real_topic, rospy.AnyMsg, bandwidth.callback)
    print(f"subscribed to [{subscriber.resolved_name}]")
    _print_every_second(bandwidth.print_bw)


def _rostopic_delay(topic: str, window_size: int = -1, tcp_nodelay: bool = False) -> None:
    """Wait until a topic is published, then print the delay of its stamped messages every second until shutdown."""
    import rospy

    from minirospy.ros.rostopic.rostopic.rates import ROSTopicDelay

    cls, real_topic, _ = get_topic_class(topic, blocking=True)
    if cls is None or real_topic is None:
        return
    _become_node()
    delay = ROSTopicDelay(window_size)
    subscriber: Any = rospy.Subscriber(real_topic, cls, delay.callback_delay, tcp_nodelay=tcp_nodelay)
    print(f"subscribed to [{subscriber.resolved_name}]")
    _print_every_second(delay.print_delay)


def _print_every_second(show: Callable[[], None]) -> None:
    import rospy

    if rospy.get_param("use_sim_time", False):
        print("WARNING: may be using simulated time", file=sys.stderr)
    with suppress(rospy.ROSInterruptException):
        while not rospy.is_shutdown():
            _sleep(1.0)
            show()


def _sub_rostopic_list(
    master: masterapi.Master,
    pubs: Sequence[_Topic],
    subs: Sequence[_Topic],
    publishers_only: bool,
    subscribers_only: bool,
    verbose: bool,
    indent: str = "",
) -> None:
    """Print (topic, type, nodes) rows like `rostopic list`, indented by ``indent``."""
    if not verbose:
        chosen = [
            *([] if subscribers_only and not publishers_only else pubs),
            *([] if publishers_only else subs),
        ]
        names = [row[0] for row in chosen]
        names = sorted(names if publishers_only or subscribers_only else set(names))
        print("\n".join(indent + name for name in names))
        return
    _master_get_topic_types(master)
    if not subscribers_only:
        print(f"\n{indent}Published topics:")
        _print_counts(pubs, "publisher", indent)
    if not publishers_only:
        print(indent)
        print(f"{indent}Subscribed topics:")
        _print_counts(subs, "subscriber", indent)
    print()


def _print_counts(rows: Sequence[_Topic], word: str, indent: str) -> None:
    for topic, type_, nodes in rows:
        count = f"{len(nodes)} {word}s" if len(nodes) > 1 else f"1 {word}"
        print(f"{indent} * {topic} [{type_}] {count}")


def _resource_name_package(name: str) -> str | None:
    """Return the package in `pkg/Name`, or None if there is none."""
    return name.partition("/")[0] if "/" in name else None


def _optparse_topic_only(cmd: str, argv: Sequence[str]) -> str:
    """If a command line contains exactly one topic, return its global name; otherwise print the usage and exit."""
    from optparse import OptionParser

    parser = OptionParser(usage=f"usage: %prog {cmd} /topic", prog=NAME)
    _, words = parser.parse_args(list(argv)[2:])
    if len(words) != 1:
        parser.error("you may only specify one input topic" if words else "topic must be specified")
    return script_resolve_name(NAME, words[0])


def _is_shutdown() -> bool:
    """Return whether this process is a node that is shutting down; False if the program has not imported rospy."""
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
