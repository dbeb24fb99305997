"""The messages of `rostopic pub`: YAML values of a command line, a file or a stream become messages, at a rate.

Source: http://wiki.ros.org/rostopic#rostopic_pub.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from minirospy.base.errors import NotFoundError, ROSTimeMovedBackwardsException, UsageError
from minirospy.introspect.values import message_values, parse_arguments, parse_documents, parse_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from minirospy.core.idl.protocols import Message
    from minirospy.introspect.streams import ToolNode, TopicPublisher

__all__ = ["publish_all", "values_to_publish"]


def values_to_publish(
    fields: Sequence[str], arguments: Sequence[str], file: str | None
) -> Iterator[list[object]]:
    """Yield the YAML values of each message with ``fields``; at least one.

    ``arguments`` are those of one message; without them a file is read, or standard input as it comes. Raise
    UsageError without values, NotFoundError if the file does not exist, ValueTextError on what is not YAML.
    """
    if arguments or (file is None and not fields):
        yield parse_arguments(arguments)
        return

    where = file or "standard input"

    if file is not None:
        documents = parse_documents(_read_text(file), where)
    elif sys.stdin.isatty():
        raise UsageError(f"please specify message values: {' '.join(fields)}")
    else:
        documents = parse_lines(sys.stdin, where)

    found = False
    for values in message_values(documents):
        found = True
        yield values

    if not found:
        raise UsageError(f"{where} holds no message; please specify message values: {' '.join(fields)}")


def publish_all(
    node: ToolNode,
    publisher: TopicPublisher,
    messages: Iterable[Message],
    rate: float,
    on_message: Callable[[Message], object],
) -> None:
    """Publish ``rate`` messages a second by the node's clock until they end or the node has to stop.

    Where time jumps back (a simulation that starts again), it goes on from there.
    """
    start, sent = node.clock.now(), 0

    for message in messages:
        on_message(message)
        publisher.publish(message)
        sent += 1
        # From the start, not from the last message: pauses that come out too long do not add up.
        pause = round(start + sent * 1e9 / rate) - node.clock.now()

        try:
            if pause > 2e9 / rate:
                raise ROSTimeMovedBackwardsException(pause / 1e9)
            if not node.clock.sleep(max(0, pause), node.ended):
                return
        except ROSTimeMovedBackwardsException:
            start, sent = node.clock.now(), 0


def _read_text(file: str) -> str:
    try:
        with open(file, encoding="utf-8") as stream:
            return stream.read()
    except (OSError, UnicodeDecodeError) as error:
        raise NotFoundError(
            "file", file, hint=getattr(error, "strerror", None) or "it is not UTF-8 text"
        ) from error
