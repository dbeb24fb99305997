"""rospy's Publisher. It serializes messages in the thread that publishes.

Source: http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers.
"""

from __future__ import annotations

import itertools
import logging
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import (
    ROSException,
    ROSSerializationException,
    SerializationError,
)
from minirospy.client.connection import Connection, connection_to_subscriber
from minirospy.client.session import Session, current_session
from minirospy.client.topic import (
    AnyMsg,
    SharedTopic,
    Topic,
    register_with_master,
    unregister_from_master,
)
from minirospy.core.idl.message import args_kwds_to_message
from minirospy.core.idl.protocols import Message, declared
from minirospy.core.wire.framing import LargeFrame, Pieces
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.transport.workers import InOrder

if TYPE_CHECKING:
    from minirospy.runtime.transport.links import OutLink

__all__ = ["PublishedTopic", "Publisher", "SubscribeListener"]

_log = logging.getLogger("rosout")
_OF_THE_LIBRARY = frozenset({"/rosout", "/statistics"})
"""The topics on which the library itself publishes; errors on them are not reported to the program."""
_M_co = TypeVar("_M_co", bound=Message, covariant=True)


class SubscribeListener:
    """Notified when subscribers connect and disconnect. Override the methods that you need."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """Handle a new subscriber. ``topic_publish`` publishes to all subscribers, ``peer_publish`` only to the new one."""

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Handle the disconnection of a subscriber. ``num_peers`` remain."""


class Publisher(Topic[_M_co]):
    """Publishes messages of ``data_class`` on a topic.

    ``queue_size``: maximum number of messages queued for a slow subscriber; beyond that the oldest is dropped (0: no
    limit; None: ``publish`` itself waits until all are written). ``latch``: a subscriber that connects later receives
    the last message. ``headers``: fields for the connection header. ``subscriber_listener`` is notified when
    subscribers connect and disconnect, in a library thread, one event at a time; an object that is not a listener is
    ignored, with a warning. Raise ValueError if the name, the class or queue_size is invalid.
    """

    impl: PublishedTopic | None

    def __init__(
        self,
        name: str,
        data_class: type[_M_co],
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,
        latch: bool = False,
        headers: Mapping[str, str] | None = None,
        queue_size: int | None = None,
    ) -> None:
        super().__init__(name, data_class, "pub")
        if queue_size is None:
            warnings.warn(
                "The publisher should be created with an explicit keyword argument 'queue_size'. Please see "
                "http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more information.",
                SyntaxWarning,
                stacklevel=2,
            )

        size = _checked_size(queue_size)
        if subscriber_listener and not _is_listener(subscriber_listener):
            warnings.warn(_not_a_listener(subscriber_listener), SyntaxWarning, stacklevel=2)
            subscriber_listener = None
        fields = dict(headers or {})
        with self._session.lock:
            state = self._session.published.get(self.resolved_name)
            if state is None:
                state = self._session.published[self.resolved_name] = PublishedTopic(
                    self._session, self.resolved_name, data_class
                )
            state.join(self, subscriber_listener, size, latch, fields, tcp_nodelay)

        self.impl = state
        self._session.when_ready(state.register, state.title)

    def publish(self, *args: object, **kwds: object) -> None:
        """Publish a message, or a message with the given field values.

        Raise ROSException before init_node and after unregister, ROSSerializationException or TypeError if a value
        is invalid. With a slow subscriber it blocks for a few milliseconds at most, except with ``queue_size=None``.
        """
        state = self.impl
        if state is None:
            raise ROSException("publish() to an unregistered() handle")
        if len(args) == 1 and args[0].__class__ is self.data_class and not kwds:
            state.publish(args[0])
        else:
            state.check_initialized()
            if len(args) == 1 and isinstance(args[0], AnyMsg):
                # As in rospy, the bytes are not checked against the type.
                state.publish(args[0])
            else:
                state.publish(args_kwds_to_message(self.data_class, args, kwds))

    def wait_for_subscribers(self, count: int = 1, timeout: float | None = None) -> bool:
        """Wait until ``count`` subscribers are connected. Return False if that takes longer than ``timeout`` seconds.

        Messages published before a subscriber has connected do not reach it, unless the topic is latched.
        Raise ROSException before init_node and after unregister, ROSInterruptException if the node shuts down.
        """
        if self.impl is None:
            raise ROSException("wait_for_subscribers() on an unregistered() handle")
        return self.impl.wait_for_subscribers(count, timeout)


class PublishedTopic(SharedTopic):
    """A topic published by this process. Its Publishers share this object."""

    def __init__(self, session: Session, topic: str, data_class: type[Message]) -> None:
        # Imported here, because the module imports asyncio.
        from minirospy.runtime.node.publication import Publication

        super().__init__(session, topic, data_class)
        self._deferral = session.lifecycle.deferral
        self.publication = Publication(topic, InterfaceType.of(data_class), on_link=self._on_link)
        self._handles: set[Publisher[Message]] = set()
        # Notified when subscribers connect and disconnect. A program may add and remove listeners
        self.subscriber_listeners: list[SubscribeListener] = []
        self._events: InOrder | None = None
        self._waiting: list[Callable[[], None]] = []
        self._had_subscriber = False
        self._sequence = itertools.count(1)
        self._has_header = bool(getattr(data_class, "_has_header", False))
        after_array = declared(data_class, "serialize", "_bytes_after_array")
        self._after_array = after_array if isinstance(after_array, int) else None
        self._registered = False

    def join(
        self,
        handle: Publisher[Message],
        listener: SubscribeListener | None,
        queue_size: int | None,
        latch: bool,
        headers: Mapping[str, str] | None,
        tcp_nodelay: bool,
    ) -> None:
        publication = self.publication
        if ANY not in (handle.md5sum, publication.type.md5sum) and handle.md5sum != publication.type.md5sum:
            _log.error(
                "topic [%s] is published as [%s] by this process already: subscribers will not understand "
                "what its Publisher of [%s] sends",
                self.resolved_name,
                self.type,
                handle.type,
            )

        self._handles.add(handle)
        if listener:
            self.add_subscriber_listener(listener)

        if queue_size is not None or len(self._handles) == 1:
            publication.queue_size = queue_size
        publication.latch = publication.latch or latch
        publication.tcp_nodelay = publication.tcp_nodelay or tcp_nodelay
        publication.headers.update(headers or {})

    def register(self) -> None:
        """Register with the master. Only the first call has an effect."""
        with self._session.lock:
            if self._registered or not self._handles or not self._session.node or self._session.is_shutdown():
                return
            # Set this before registering: a subscriber may connect, and publish() must work, before the master responds.
            self._registered = True
            wait = self._session.start(self._session.node.advertise(self.publication))
        register_with_master("publication", self.publication.topic, wait)

    def leave(self, handle: Publisher[Message]) -> None:
        with self._session.lock:
            self._handles.discard(handle)
            # After a fork, or after init_node has created another node, the session's table no longer contains this topic.
            if self._handles or self._session.published.get(self.resolved_name) is not self:
                return
            del self._session.published[self.resolved_name]
            if not self._session.node or self._session.is_shutdown():
                return
            # Start unregistering now, before another thread can publish the topic again.
            wait = self._session.start(self._session.node.unadvertise(self.publication))
        unregister_from_master(wait)

    @property
    def title(self) -> str:
        """The name that error messages use for the topic's publisher."""
        return f"the publisher of {self.resolved_name}"

    @property
    def queue_size(self) -> int | None:
        """The queue_size passed to the last Publisher. None if publish() waits until messages are written to the sockets."""
        return self.publication.queue_size

    @property
    def headers(self) -> dict[str, str]:
        """Return the fields that are added to the connection headers."""
        return self.publication.headers

    @property
    def is_latch(self) -> bool:
        """Return whether the last message is sent to subscribers that connect later. Programs may set this property."""
        return self.publication.latch

    @is_latch.setter
    def is_latch(self, value: bool) -> None:
        self.publication.latch = value

    def enable_latch(self) -> None:
        """Send the last message to subscribers that connect later."""
        self.is_latch = True

    def add_subscriber_listener(self, l: SubscribeListener) -> None:  # noqa: E741 - as rospy calls it
        """From now on, notify ``l`` when subscribers connect and disconnect. If ``l`` is not a listener, warn and ignore it."""
        if _is_listener(l):
            self.subscriber_listeners.append(l)
        else:
            warnings.warn(_not_a_listener(l), SyntaxWarning, stacklevel=2)

    def check_initialized(self) -> None:
        """Raise ROSException before init_node. In a fork of the node, log that the topic belongs to the parent."""
        if self._session.is_abandoned:
            if self.resolved_name not in _OF_THE_LIBRARY:
                current_session().report_fork(self.title)
        elif not self._registered and not self._session.is_shutdown():
            raise ROSException("ROS node has not been initialized yet. Please call init_node() first")

    def publish(self, message: Message) -> None:
        """Send a message to every subscriber."""
        publication = self.publication
        if not self._registered:
            self.check_initialized()
        elif publication.links or publication.latch:
            publication.publish(self._frame(message))
            if self._deferral.pending:
                self._deferral.poll()
        elif not self._had_subscriber:
            self._had_subscriber = True
            self._log_unheard(message)

    def forget_subscribers(self) -> None:
        """Stop publishing to the current subscribers: in a fork, these are connected to the parent process."""
        self.publication.links = ()
        self._registered = False

    def wait_for_subscribers(self, count: int, timeout: float | None) -> bool:
        """See :meth:`Publisher.wait_for_subscribers`."""
        if self._session.is_abandoned:
            raise ROSException(current_session().why_fork_has_no_effect(self.title))
        self.check_initialized()
        enough = SignalSafeEvent()

        def look() -> None:
            if len(self.publication.links) >= count or self._session.is_shutdown():
                enough.set()

        with self._session.lifecycle.interrupting(enough.set):
            self._waiting.append(look)
            try:
                look()
                wait_for_event(enough, timeout)
            finally:
                self._waiting.remove(look)
        if self._session.is_shutdown():
            raise self._session.lifecycle.interrupted("rospy shutdown")
        return enough.is_set()

    @property
    def connections(self) -> list[Connection]:
        """The links to subscribers."""
        return [connection_to_subscriber(link, self.resolved_name) for link in self.publication.links]

    def get_stats(self) -> tuple[str, int, list[tuple[object, ...]]]:
        """Return the topic's row for the Slave API's getBusStats."""
        rows: list[tuple[object, ...]] = [
            (c.id, c.stat_bytes, c.stat_num_msg, not c.done) for c in self.connections
        ]
        return self.resolved_name, self.publication.sent_bytes, rows

    def get_num_connections(self) -> int:
        """Return the number of links."""
        return len(self.publication.links)

    def has_connection(self, endpoint_id: str) -> bool:
        """Return whether the node ``endpoint_id`` is connected."""
        return any(link.peer == endpoint_id for link in self.publication.links)

    def _log_unheard(self, message: Any) -> None:
        """Log that the first message was published without a subscriber, or that it does not match its type.

        Log a warning only if the master reports a subscriber that is still connecting: many topics have no subscriber at
        first, or never have one.
        """
        if fault := self._fault_of(message):
            _log.warning(
                "a message on %s does not fit %s: %s. It went to nobody; with a subscriber, publish() raises this",
                self.resolved_name,
                self.type,
                fault,
            )
        elif self.publication.expected and not self._session.is_shutdown():
            _log.warning(
                "the first message on %s went to nobody: %d known to the master, not connected yet. "
                "wait_for_subscribers() waits for them, latch=True keeps the last message for them",
                self.resolved_name,
                self.publication.expected,
            )
        else:
            _log.debug("the first message on %s went to nobody: it has no subscriber yet", self.resolved_name)

    def _fault_of(self, message: Any) -> str:
        """Return the reason why a message does not match its type, or "". Unlike `_frame`, do not change the message's header."""
        try:
            if isinstance(message, AnyMsg) or (self._has_header and message.header.frame_id is None):
                return ""
            message.serialize(Pieces())
        except SerializationError as error:
            return str(error)
        except Exception:  # noqa: BLE001 - publish() raises it if there is a subscriber
            return ""
        return ""

    def _frame(self, message: Any) -> bytes | LargeFrame:
        if self._has_header and not isinstance(message, AnyMsg):
            message.header.seq = next(self._sequence)
        pieces = Pieces()
        try:
            message.serialize(pieces)
        except SerializationError as error:
            if not self._has_header or getattr(message.header, "frame_id", "") is not None:
                raise self._refused(message, error) from None
            # rospy replaces None with "0".
            message.header.frame_id = "0"
            pieces.clear()
            try:
                message.serialize(pieces)
            except SerializationError as again:
                raise self._refused(message, again) from None
        return pieces.frame(self._after_array)

    def _refused(self, message: Message, error: SerializationError) -> ROSSerializationException:
        """Return the error for a message that does not match its type: rospy's error message and the topic."""
        where = f"topic {self.resolved_name}, type {message._type}"
        return ROSSerializationException(f"{error}\n({where})")

    def _on_link(self, link: OutLink, is_up: bool) -> None:
        self._had_subscriber = True
        for look in list(self._waiting):
            look()
        if not self.subscriber_listeners or not self._session.node:
            return
        if self._events is None:
            self._events = InOrder(self._session.node.workers)
        topic = self.publication.topic

        def publish_to_all(*args: object, **kwds: object) -> None:
            for handle in list(self._handles)[:1]:
                handle.publish(*args, **kwds)

        def publish_to_peer(*args: object, **kwds: object) -> None:
            for handle in list(self._handles)[:1]:
                link.send(self._frame(args_kwds_to_message(handle.data_class, args, kwds)))

        # Read the attribute in the worker: it may be a property that runs the user's code.
        for listener in list(self.subscriber_listeners):
            if is_up:
                self._events.start(
                    _notify, listener, "peer_subscribe", topic, publish_to_all, publish_to_peer
                )
            else:
                self._events.start(_notify, listener, "peer_unsubscribe", topic, len(self.publication.links))


def _notify(listener: SubscribeListener, event: str, *args: object) -> None:
    """Call a listener's method for an event. If the listener lacks the method, ignore the event."""
    method = getattr(listener, event, None)
    if method is not None:
        method(*args)


def _is_listener(value: object) -> bool:
    """Return whether an object has any SubscribeListener method. Programs need not derive from the class."""
    return any(hasattr(value, name) for name in ("peer_subscribe", "peer_unsubscribe"))


def _not_a_listener(value: object) -> str:
    """Return the warning for an argument that is not a listener.

    With such an argument, rospy would reject every subscriber.
    """
    text = f"subscriber_listener {value!r} is ignored: it has no method peer_subscribe or peer_unsubscribe."
    if isinstance(value, int):
        return f"{text} The third argument of Publisher is not the queue size: write queue_size={value!r}"
    return text


def _checked_size(queue_size: int | None) -> int | None:
    """Check a Publisher's queue_size and return it. As in rospy, a negative size means unlimited.

    Raise ValueError if it is neither an integer nor None.
    """
    if queue_size is None:
        return None
    try:
        return max(0, int(queue_size))
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"queue_size must be an integer or None: {queue_size!r}") from None
