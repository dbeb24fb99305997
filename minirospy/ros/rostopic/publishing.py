"""rostopic's functions that publish values from a program, from stdin or a file, or from a parameter.

Source: the behaviour of ROS's rostopic.
"""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import yaml

from minirospy.ros.rostopic.errors import ROSTopicException

if TYPE_CHECKING:
    from minirospy.client.publisher import Publisher
    from minirospy.core.idl.protocols import Message

__all__ = [
    "SUBSCRIBER_TIMEOUT",
    "argv_publish",
    "file_yaml_arg",
    "fill_message",
    "param_publish",
    "param_publish_once",
    "publish_at_rate",
    "publish_latched",
    "publish_message",
    "stdin_publish",
    "stdin_yaml_arg",
    "wait_for_subscriber",
]

SUBSCRIBER_TIMEOUT = 5.0  # seconds until stdin_publish publishes even without a subscriber
_LATCH_SECONDS = 3.0  # seconds to run after publishing a single message, as in ROS
_POLL_SECONDS = 0.05  # seconds between checks of a cached parameter value


def publish_message(
    pub: Publisher[Message],
    msg_class: type[Message],
    pub_args: Sequence[object],
    rate: float | None = None,
    once: bool = False,
    verbose: bool = False,
    substitute_keywords: bool = False,
) -> None:
    """Publish a message built from YAML values, ``rate`` times a second until shutdown, or once without a rate.

    Without a rate, return immediately if ``once``, else wait for shutdown. ``substitute_keywords``: replace `now` and
    `auto` in each message. Raise ROSTopicException if the values do not match the message's fields.
    """
    import rospy

    message = msg_class()
    fill_message(message, pub_args)
    try:
        if rate is not None:
            publish_at_rate(pub, message, rate, verbose, substitute_keywords, pub_args)
            return
        shown = f"[{message}]" if verbose else "message"
        print(
            f"publishing and latching {shown}"
            + (f" for {_LATCH_SECONDS} seconds" if once else ". Press ctrl-C to terminate")
        )
        publish_latched(pub, message, once, verbose)
    except rospy.ROSSerializationException as error:
        from minirospy.introspect.interfaces import Interfaces, Kind
        from minirospy.workspace.packages import Packages

        definition = Interfaces(Packages(), Kind.MESSAGE).description(msg_class._type)
        raise ROSTopicException(
            "Unable to publish message. One of the fields has an incorrect type:\n"
            f"  {error}\n\nmsg file:\n{definition}"
        ) from error


def publish_at_rate(
    pub: Publisher[Message],
    msg: Message,
    rate: float,
    verbose: bool = False,
    substitute_keywords: bool = False,
    pub_args: Sequence[object] | None = None,
) -> None:
    """Publish a message ``rate`` times a second until shutdown. Raise ROSTopicException if ``rate`` is not a number."""
    import rospy

    try:
        pauses = rospy.Rate(float(rate))
    except ValueError:
        raise ROSTopicException("Rate must be a number") from None
    while not rospy.is_shutdown():
        if substitute_keywords:
            fill_message(msg, pub_args)
        if verbose:
            print(f"publishing {msg}")
        pub.publish(msg)
        pauses.sleep()


def publish_latched(pub: Publisher[Message], msg: Message, once: bool = False, verbose: bool = False) -> None:
    """Publish a message and, unless ``once``, wait for shutdown. Raise ROSTopicException if ``msg`` is not a message."""
    import rospy

    try:
        pub.publish(msg)
    except TypeError as error:
        raise ROSTopicException(str(error)) from error
    if not once:
        rospy.spin()


def fill_message(msg: Message, pub_args: Sequence[object] | None) -> None:
    """Fill a message from YAML values. Raise ROSTopicException if they do not match the fields."""
    import rospy
    from std_msgs.msg import Header

    from minirospy.base.errors import MessageException
    from minirospy.core.idl.fill_message import fill_message_args
    from minirospy.core.idl.message_text import get_printable_message_args

    now = rospy.get_rostime()
    try:
        fill_message_args(msg, pub_args, {"now": now, "auto": Header(stamp=now)})
    except MessageException as error:
        needed = get_printable_message_args(msg)
        raise ROSTopicException(f"{error}\n\nArgs are: [{needed}]") from error


def argv_publish(
    pub: Publisher[Message],
    msg_class: type[Message],
    pub_args: Sequence[object],
    rate: float | None,
    once: bool,
    verbose: bool,
    substitute_keywords: bool = False,
) -> None:
    """Publish values in the form of `rostopic pub`'s command line. If ``once``, wait 3 seconds afterwards."""
    import rospy

    publish_message(pub, msg_class, pub_args, rate, once, verbose, substitute_keywords)
    end = time.monotonic() + _LATCH_SECONDS
    while once and time.monotonic() < end and not rospy.is_shutdown():
        rospy.sleep(0.2)


def wait_for_subscriber(pub: Publisher[Message], timeout: float) -> None:
    """Wait up to ``timeout`` seconds for a publisher to have a subscriber."""
    import rospy

    end = time.monotonic() + timeout
    while pub.get_num_connections() == 0 and time.monotonic() < end:
        rospy.rostime.wallsleep(0.01)


def stdin_publish(
    pub: Publisher[Message],
    msg_class: type[Message],
    rate: float | None,
    once: bool,
    filename: str | None,
    verbose: bool,
) -> None:
    """Publish the YAML documents from a file, or from stdin if ``filename`` is empty.

    If there is a ``rate`` and the file has only one document, publish that document repeatedly. Raise ROSTopicException if the
    file does not exist or is not valid YAML.
    """
    import rospy

    documents: Callable[[], Iterator[Any]] = file_yaml_arg(filename) if filename else stdin_yaml_arg
    is_only_one = bool(filename) and len(list(documents())) == 1
    pauses = rospy.Rate(rate) if rate is not None else None
    wait_for_subscriber(pub, SUBSCRIBER_TIMEOUT)
    for document in documents():
        if rospy.is_shutdown():
            return
        if document:
            values = document if isinstance(document, list) else [document]
            try:
                if is_only_one and rate is not None:
                    print("Got one message and a rate, publishing repeatedly")
                    publish_message(pub, msg_class, values, rate, once, verbose)
                else:
                    publish_message(pub, msg_class, values, None, pauses is not None or once, verbose)
            except ValueError as error:
                sys.stderr.write(f"{error}\n")
                return
        if pauses is not None:
            pauses.sleep()
        if rospy.is_shutdown() or once:
            return


def file_yaml_arg(filename: str) -> Callable[[], Iterator[list[Any]]]:
    """Return a function that yields [document] for each YAML document in a file.

    Raise ROSTopicException if the file does not exist; the function raises it if the file is not valid YAML.
    """
    if not os.path.isfile(filename):
        raise ROSTopicException(f"file does not exist: {filename}")

    def documents() -> Iterator[list[Any]]:
        try:
            with open(filename, encoding="utf-8") as stream:
                for document in yaml.safe_load_all(stream):
                    yield [document]
        except yaml.YAMLError as error:
            raise ROSTopicException(f"invalid YAML in file: {error}") from error

    return documents


def stdin_yaml_arg() -> Iterator[Any]:
    """Yield each YAML document on stdin, ended by a line with three hyphens. Stop at the end of stdin or at shutdown."""
    lines: list[str] = []
    # Ignore a document without an end: it may be incomplete.
    for line in _lines_of_stdin():
        if line.strip() != "---":
            lines.append(line)
            continue
        document = None
        try:
            document = yaml.safe_load("".join(lines).rstrip())
        except yaml.YAMLError as error:
            sys.stderr.write(f"Invalid YAML: {error}\n")
        if document is not None:
            yield document
        lines.clear()


def _lines_of_stdin() -> Iterator[str]:
    """Yield the lines of stdin as they arrive. Stop at the end of stdin or at shutdown."""
    import rospy

    if os.name == "nt":
        # On Windows, select() supports only sockets.
        while not rospy.is_shutdown() and (line := sys.stdin.readline()):
            yield line
        return

    encoding, descriptor = sys.stdin.encoding, sys.stdin.fileno()
    started: list[bytes] = []  # parts of an incomplete line
    while not rospy.is_shutdown():
        if not select.select([descriptor], [], [], 1.0)[0]:
            continue
        # Do not use readline(): it buffers lines, and select() does not report buffered lines.
        data = os.read(descriptor, 1 << 16)
        if not data:
            return
        *ended, rest = data.split(b"\n")
        for part in ended:
            yield b"".join([*started, part]).decode(encoding, "replace") + "\n"
            started.clear()
        started.append(rest)


def param_publish_once(
    pub: Publisher[Message], msg_class: type[Message], param_name: str, verbose: bool
) -> None:
    """Publish a parameter's value once.

    Raise ROSTopicException if the parameter is not set, or its value does not match the message.
    """
    import rospy

    _require_param(param_name)
    argv_publish(pub, msg_class, rospy.get_param(param_name), None, True, verbose)


def param_publish(
    pub: Publisher[Message],
    msg_class: type[Message],
    param_name: str,
    rate: float | None,
    verbose: bool,
) -> None:
    """Publish a parameter's value until shutdown, ``rate`` times a second or, if ``rate`` is None, on each change.

    Raise ROSTopicException if the parameter is not set, or is neither a dictionary nor a list.
    """
    import rospy

    _require_param(param_name)
    pauses = rospy.Rate(rate) if rate is not None else None
    published: object = None
    while not rospy.is_shutdown():
        # This call makes the master notify the node of changes, so that the cached value stays current.
        value = rospy.get_param_cached(param_name)
        if not isinstance(value, dict | list):
            raise ROSTopicException(f"Parameter [{param_name}] in not a valid type")
        if pauses is not None or value != published:
            published = value
            try:
                values = [value] if isinstance(value, dict) else value
                publish_message(pub, msg_class, values, None, True, verbose)
            except ValueError as error:
                sys.stderr.write(f"{error}\n")
                return
        if pauses is not None:
            pauses.sleep()
        else:
            rospy.rostime.wallsleep(_POLL_SECONDS)


def _require_param(name: str) -> None:
    import rospy

    if not rospy.has_param(name):
        raise ROSTopicException(f"parameter does not exist: {name}")
