"""Code shared by the programs. Receives and sends messages of any type as bytes."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Mapping, Sequence

from minirospy import client as rospy
from minirospy.base.errors import ROSInterruptException
from minirospy.base.names import is_legal_name
from minirospy.client.topics import AnyMsg, SubscribeListener

__all__ = ["NONE", "Input", "Output", "base_name", "checked_topic", "flag", "run_node"]

NONE = "__none"  # the name that selects no topic in mux and demux
_QUEUE_SIZE = 10


class _Connected(SubscribeListener):
    """Calls a function for each new subscriber."""

    def __init__(self, call: Callable[[], object]) -> None:
        super().__init__()
        self._call = call

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        self._call()


class Output:
    """A topic to publish. It is advertised with the type of the first forwarded message."""

    def __init__(
        self,
        topic: str,
        *,
        latch: bool | None = None,
        on_subscriber: Callable[[], object] = lambda: None,
        on_advertised: Callable[[], object] = lambda: None,
    ) -> None:
        """Create the output.

        If ``latch`` is None, the output is latched if the input is; ``on_advertised`` is called after the first message.
        """
        self.topic = checked_topic(topic)
        self._latch = latch
        self._on_subscriber = on_subscriber
        self._on_advertised = on_advertised
        self._publisher: rospy.Publisher[AnyMsg] | None = None
        self._lock = threading.Lock()

    @property
    def is_advertised(self) -> bool:
        """Return whether the topic is advertised, which happens with the first message."""
        return self._publisher is not None

    @property
    def has_subscribers(self) -> bool:
        """Return whether any node subscribes to the output."""
        return self._publisher is not None and self._publisher.get_num_connections() > 0

    def advertise(self, message: AnyMsg) -> None:
        """Advertise the topic with the type of a message; later calls have no effect."""
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
        """Unregister the topic if it has been advertised."""
        with self._lock:
            if self._publisher is not None:
                self._publisher.unregister()

    def publish(self, message: AnyMsg) -> None:
        """Publish a message after ``advertise``. If its type differs from the topic's, drop the message with a warning."""
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
    """A subscription that can be closed and opened again."""

    def __init__(self, topic: str, callback: Callable[[AnyMsg], object]) -> None:
        self.topic = checked_topic(topic)
        self._callback = callback
        self._subscriber: rospy.Subscriber[AnyMsg] | None = None
        self._lock = threading.Lock()

    @property
    def is_open(self) -> bool:
        """Return whether this node is subscribed to the topic."""
        return self._subscriber is not None

    def open(self) -> None:
        """Subscribe, unless the topic is already subscribed."""
        with self._lock:
            if self._subscriber is None:
                self._subscriber = rospy.Subscriber(
                    self.topic, rospy.AnyMsg, self._callback, queue_size=_QUEUE_SIZE
                )

    def close(self) -> None:
        """Unsubscribe, if the topic is subscribed."""
        with self._lock:
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.unregister()


def base_name(topic: str) -> str:
    """Return the last part of a topic's name, for use in a node's name. Raise ValueError if that part is empty."""
    name = checked_topic(topic).rstrip("/").rpartition("/")[2].lstrip("~")
    if not name:
        raise ValueError(f"[{topic}] is not the name of a topic")
    return name


def checked_topic(topic: str) -> str:
    """Return the topic name unchanged. Raise ValueError if it is invalid."""
    if not is_legal_name(topic):
        raise ValueError(f"[{topic}] is not the name of a topic")
    return topic


def flag(name: str) -> bool:
    """Return a boolean private parameter, or False if it is not set."""
    return bool(rospy.get_param(f"~{name}", False))


def run_node(
    usage: str,
    name: Callable[[Sequence[str]], str],
    prepare: Callable[[Sequence[str]], Callable[[], object]],
    counts: range,
) -> int:
    """Run a program until its node shuts down; return its exit status.

    ``name`` and ``prepare`` are called with the command-line arguments; if either raises ValueError, the error is printed
    with the usage. ``prepare`` checks the arguments without a master, and returns the function to call once the node
    runs. ``counts``: the allowed numbers of arguments.
    """
    words = rospy.myargv()[1:]
    try:
        if len(words) not in counts:
            raise ValueError("")
        start = prepare(words)
        rospy.init_node(name(words), anonymous=True)
        # Keep a reference, so that the subscriptions and services are not deleted.
        running = start()
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
