"""The option -b of `rostopic list`, `rostopic echo` and `rosmsg show`: read from a bag file instead of the graph.

Source: http://wiki.ros.org/rostopic. The output is identical to that of ROS; no master is needed.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import BagError, MinirospyError, NotFoundError
from minirospy.command.command import RosText, WordedError
from minirospy.introspect.bags import open_reader

if TYPE_CHECKING:
    from minirospy.core.bag.base import BagReader
    from minirospy.introspect.echo import Echo, Filter
    from minirospy.introspect.topics import TopicField

__all__ = ["echo_bag", "list_bag", "show_bag"]


@contextmanager
def _opened(path: str, ros_error: str) -> Iterator[BagReader]:
    """Open a bag and yield its reader.

    Raise MinirospyError if the bag cannot be read; for a missing file, the error has ROS's message.
    """
    if not os.path.exists(path):
        text = f"bag file [{path}] does not exist"
        raise WordedError(NotFoundError("bag file", path), RosText(f"{ros_error}{text}"))
    try:
        with open_reader(path) as reader:
            yield reader
    except BagError as error:
        raise MinirospyError(f"{path}: {error}") from error


def list_bag(path: str, topic: str | None) -> None:
    """Print a bag's topics, ordered by first message.

    If ``topic`` is given, print that topic's message count, and the topics in its namespace.
    """
    with _opened(path, "ERROR: ") as reader:
        if topic is None:
            for name in _topics_in_order(reader):
                print(name)
            return

        below = topic.rstrip("/") + "/"
        wanted = [
            number
            for number, each in reader.connections.items()
            if each.topic == topic or each.topic.startswith(below)
        ]
        times = sorted(each for part in reader.times(wanted) for each in (min(part), max(part)) if part)
        count = sum(map(len, reader.times(wanted)))
        if not times:
            print("0 message(s)")
            return
        first, last = (
            time.strftime("%d %b %Y %H:%M:%S", time.localtime(each / 1e9)) for each in (times[0], times[-1])
        )
        print(f"{count} message(s) from {first} to {last}")


def _topics_in_order(reader: BagReader) -> list[str]:
    reader.prepare()
    connections = list(reader.connections.values())
    topics = {each.topic for each in connections}
    found: dict[str, None] = {}
    for _, _, messages in reader.blocks([each.id for each in connections]):
        found.update(dict.fromkeys(connections[each[1]].topic for each in messages))
        if len(found) == len(topics):
            break
    return list(found)


class EchoOptions(NamedTuple):
    """Options for printing a bag's messages.

    ``make`` returns the Echo for a topic or field; ``keep`` filters messages; at most ``limit`` messages are printed,
    each after ``prefix``.
    """

    make: Callable[[TopicField], Echo]
    keep: Filter | None
    limit: int | None
    prefix: str


def echo_bag(path: str, name: str | None, options: EchoOptions) -> None:
    """Print a bag's messages on the topic ``name`` (None: all topics).

    If ``name`` ends in a field, print only that field.
    """
    from minirospy.introspect.messages import Received
    from minirospy.introspect.topics import TopicField

    with _opened(path, "ERROR: ") as reader:
        reader.prepare()
        paths = _paths(reader, name)
        echoes: dict[str, Echo] = {}
        printed = 0
        for message in reader.messages(paths) if options.limit != 0 else ():
            connection = message.connection
            field = paths[connection.id]
            # Use one Echo for all topics printed with the same field: with -p, an Echo prints the column names first.
            if field not in echoes:
                echoes[field] = options.make(TopicField(connection.topic, connection.type, field))
            echo = echoes[field]
            header = {key: value.decode("utf-8", "replace") for key, value in connection.header.items()}
            received = Received(message.body, header, message.time)
            value = echo.message(received)
            if options.keep and not options.keep(value, connection.topic):
                continue
            try:
                text = echo.text(value, received)
            except IndexError as error:
                print(f"{error.__cause__}: /{field}\nrostopic: {error}", file=sys.stderr)
                continue

            sys.stdout.write(options.prefix + text)
            sys.stdout.flush()
            printed += 1
            if printed == options.limit:
                return


def _paths(reader: BagReader, name: str | None) -> dict[int, str]:
    """Return a dict from connection IDs to the path of the field to print ("" for the whole message)."""
    topics = {number: _global(each.topic) for number, each in reader.connections.items()}
    if name is None:
        return dict.fromkeys(topics, "")
    # Prefer the longest topic: /a/b means the topic /a/b, if it exists, not the field b of the topic /a.
    holders = [topic for topic in topics.values() if name == topic or name.startswith(f"{topic}/")]
    topic = max(holders, key=len, default="")
    return {
        number: name[len(topic) + 1 :].rstrip("/")
        for number, each in topics.items()
        if holders and each == topic
    }


def _global(topic: str) -> str:
    """Return a topic's global name, because bags may contain relative names."""
    return topic if topic.startswith("/") else f"/{topic}"


def show_bag(path: str, type_: str, *, raw: bool) -> None:
    """Print a type's definition as stored in a bag, expanded or as raw text."""
    from minirospy.core.idl.load import specs_of_text
    from minirospy.introspect.interfaces import describe

    with _opened(path, "ERROR: ") as reader:
        reader.prepare()
        text = next((each.definition for each in reader.connections.values() if each.type == type_), None)
        if text is None:
            types = [each.type for each in reader.connections.values()]
            raise NotFoundError("message type", type_, types, f"the bag {path} has no such message")
        if raw:
            print(text)
            return
        specs = specs_of_text(type_, text)
        print(describe(specs[type_], specs.__getitem__))
