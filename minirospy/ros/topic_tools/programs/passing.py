"""The common part of the programs: messages of any type come in and go out as the bytes that they are."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Mapping, Sequence

from minirospy import client as rospy
from minirospy.base.errors import ROSInterruptException
from minirospy.base.names import is_legal_name
from minirospy.client.topics import AnyMsg, SubscribeListener

__all__ = ["NONE", "Input", "Output", "base_name", "flag", "run_node"]

NONE = "__none"
"""The name that selects no topic, of mux and demux."""
_QUEUE_SIZE = 10


class _Connected(SubscribeListener):
    """Calls a function with each new subscriber."""

    def __init__(self, call: Callable[[], object]) -> None:
        super().__init__()
        self._call = call

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        self._call()


class Output:
    """A topic that has the type of the first message that is passed on, and is latched where that was."""

    def __init__(
        self,
        topic: str,
        *,
        latch: bool | None = None,
        on_subscriber: Callable[[], object] = lambda: None,
        on_advertised: Callable[[], object] = lambda: None,
    ) -> None:
        """``latch``: None as the input. ``on_advertised`` is called after the first message has come."""
        self.topic = _checked(topic)
        self._latch = latch
        self._on_subscriber = on_subscriber
        self._on_advertised = on_advertised
        self._publisher: rospy.Publisher[AnyMsg] | None = None
        self._lock = threading.Lock()

    @property
    def is_advertised(self) -> bool:
        """Return whether a message has come."""
        return self._publisher is not None

    @property
    def has_subscribers(self) -> bool:
        """Return whether a node subscribes to it."""
        return self._publisher is not None and self._publisher.get_num_connections() > 0

    def advertise(self, message: AnyMsg) -> None:
        """Advertise the topic with the type of a message, once."""
        with self._lock:
            if self._publisher is not None:
                return
            header: Mapping[str, str] = message._connection_header
            latch = header.get("latching") == "1" if self._latch is None else self._latch
            fields = {
                "_type": header["type"],
                "_md5sum": header["md5sum"],
                "_full_text": header.get("message_definition", ""),
                "__slots__": [],
            }
            cls: type[AnyMsg] = type("PassedMessage", (AnyMsg,), fields)
            self._publisher = rospy.Publisher(
                self.topic, cls, _Connected(self._on_subscriber), latch=latch, queue_size=_QUEUE_SIZE
            )
        self._on_advertised()

    def close(self) -> None:
        """Unregister the topic, where it is advertised."""
        with self._lock:
            if self._publisher is not None:
                self._publisher.unregister()

    def publish(self, message: AnyMsg) -> None:
        """Publish a message after ``advertise``; one of another type is left out, with a warning."""
        assert self._publisher is not None
        header = message._connection_header
        if header["md5sum"] not in ("*", self._publisher.md5sum):
            rospy.logwarn_throttle(
                60,
                f"{self.topic} is of type [{self._publisher.type}]: messages of type [{header['type']}] are not passed on",
            )
            return
        self._publisher.publish(message)


class Input:
    """A subscription that can be given up and taken again."""

    def __init__(self, topic: str, callback: Callable[[AnyMsg], object]) -> None:
        self.topic = _checked(topic)
        self._callback = callback
        self._subscriber: rospy.Subscriber[AnyMsg] | None = None
        self._lock = threading.Lock()

    @property
    def is_open(self) -> bool:
        """Return whether it is subscribed."""
        return self._subscriber is not None

    def open(self) -> None:
        """Subscribe, where it is not."""
        with self._lock:
            if self._subscriber is None:
                self._subscriber = rospy.Subscriber(
                    self.topic, rospy.AnyMsg, self._callback, queue_size=_QUEUE_SIZE
                )

    def close(self) -> None:
        """Unsubscribe, where it is subscribed."""
        with self._lock:
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.unregister()


def base_name(topic: str) -> str:
    """Return the last part of a topic's name, of which the node's name is made. Raise ValueError if it has none."""
    name = _checked(topic).rstrip("/").rpartition("/")[2].lstrip("~")
    if not name:
        raise ValueError(f"[{topic}] is not the name of a topic")
    return name


def _checked(topic: str) -> str:
    """Return a topic's name. Raise ValueError if it is not legal."""
    if not is_legal_name(topic):
        raise ValueError(f"[{topic}] is not the name of a topic")
    return topic


def flag(name: str) -> bool:
    """Return a private parameter that is true or false; false without it."""
    return bool(rospy.get_param(f"~{name}", False))


def run_node(
    usage: str, name: Callable[[Sequence[str]], str], start: Callable[[Sequence[str]], object], counts: range
) -> int:
    """Run a program until its node shuts down; return its exit status.

    ``name`` and ``start`` get the words of the command line; a ValueError of theirs is printed with the usage.
    ``counts``: how many words there may be.
    """
    words = rospy.myargv()[1:]
    try:
        if len(words) not in counts:
            raise ValueError("")
        rospy.init_node(name(words), anonymous=True)
        # It keeps what it starts: a subscription, services.
        running = start(words)
        rospy.spin()
        del running
    except ValueError as error:
        print(usage)
        if str(error):
            print(f"ERROR: {error}", file=sys.stderr)
        return 1
    except ROSInterruptException:
        pass
    return 0
