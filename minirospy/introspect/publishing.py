"""Convert YAML values from arguments, a file or a stream to messages, and publish them at a rate: `rostopic pub`.

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
    """Yield the YAML values of each message, at least once. ``fields`` contains the names of the message's fields.

    ``arguments`` are the values of one message. If there are none, the values are read from a file, or from standard input as
    data arrives. Raise UsageError if there are no values, NotFoundError if the file does not exist, or ValueTextError if the
    input is not YAML.
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
    """Publish ``messages`` at ``rate`` Hz (by the node's clock) until all have been published or the node is stopped.

    If time jumps back (a simulation is restarted), continue from the new time.
    """
    start, sent = node.clock.now(), 0

    for message in messages:
        on_message(message)
        publisher.publish(message)
        sent += 1
        # Measure from the start instead of from the last message, so that errors do not add up.
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
