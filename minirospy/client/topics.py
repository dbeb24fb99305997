"""Publisher and Subscriber as rospy has them.

Messages become bytes here, in the thread that publishes, and bytes become messages here, in the worker
that read them. Source: http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers.
"""

from __future__ import annotations

import inspect
import itertools
import logging
import struct
import threading
import traceback
import warnings
from collections.abc import Callable, Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from minirospy.client.process import process, warn_of_illegal_name
from minirospy.clock import wait_for_event
from minirospy.errors import (
    MasterUnreachableError,
    ROSException,
    ROSSerializationException,
    RpcError,
    SerializationError,
)
from minirospy.idl.message import Message, args_kwds_to_message
from minirospy.runtime.tcp import OutLink
from minirospy.runtime.topics import InLink, Publication, Subscription
from minirospy.runtime.workers import InOrder
from minirospy.wire.header import Header
from minirospy.wire.tcpros import ANY, InterfaceType

__all__ = [
    "AnyMsg",
    "Publisher",
    "SubscribeListener",
    "Subscriber",
    "Topic",
    "get_published_topics",
    "wait_for_message",
]

if TYPE_CHECKING:
    from minirospy.client.statistics import StatisticsPublisher

_log = logging.getLogger("rosout")
_M = TypeVar("_M", bound=Any)
_LENGTH = struct.Struct("<I")
_WITHOUT_STATISTICS = frozenset({"/statistics", "/clock"})
"""Topics that are not counted: the counts themselves, and what their times come from."""


class AnyMsg(Message):
    """A message of any type: its bytes, and in ``_connection_header`` what the publisher told of them."""

    _md5sum = ANY
    _type = ANY
    _has_header = False
    _takes_memoryview = True
    _full_text = ""
    _slot_types: list[str] = []
    __slots__ = ["_buff"]

    def __init__(self, *args: object) -> None:
        if args:
            raise ROSException("AnyMsg does not accept arguments")
        self._buff: bytes | None = None

    def serialize(self, buff: Any) -> None:
        """Write the bytes that were received."""
        if self._buff is None:
            raise ROSException("AnyMsg is not initialized")
        buff.write(self._buff)

    def deserialize(self, str: Any) -> AnyMsg:
        """Take the bytes."""
        self._buff = bytes(str)
        return self


class SubscribeListener:
    """Told when subscribers come and go; override what you need."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """A subscriber has come: ``topic_publish`` reaches all, ``peer_publish`` only this one."""

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """A subscriber has gone; ``num_peers`` are left."""


class Topic(Generic[_M]):
    """What Publisher and Subscriber share: ``name`` (as resolved), ``type``, ``md5sum``, ``data_class``.

    ``impl`` is what all handles of the topic in this process share, None once unregistered.
    """

    impl: _Shared | None

    def __init__(self, name: str, data_class: type[_M], reg_type: str) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("topic name is not a non-empty string")
        if data_class is None:
            raise ValueError("topic parameter 'data_class' is not initialized")
        if not inspect.isclass(data_class):
            raise ValueError(f"data_class [{data_class}] is not a class")
        if not hasattr(data_class, "_md5sum") or not hasattr(data_class, "serialize"):
            raise ValueError(f"data_class [{type(data_class).__name__}] is not a message data class")
        self.resolved_name = process.resolve_topic(name)
        warn_of_illegal_name(name, stacklevel=4)
        self.name = self.resolved_name
        self.data_class = data_class
        self.type: str = data_class._type  # type: ignore[attr-defined]
        self.md5sum: str = data_class._md5sum  # type: ignore[attr-defined]
        self.reg_type = reg_type

    def get_num_connections(self) -> int:
        """How many nodes are connected: subscribers of a Publisher, publishers of a Subscriber."""
        return self.impl.get_num_connections() if self.impl else 0

    def unregister(self) -> None:
        """Stop; the topic's connections end with its last handle in this process. Idempotent.

        As with rospy the handle then keeps its ``name`` only.
        """
        shared, self.impl = self.impl, None
        if shared:
            shared.leave(self)
            self.resolved_name = self.type = self.md5sum = self.data_class = None  # type: ignore[assignment]


class Publisher(Topic[_M]):
    """Publishes messages of ``data_class`` on a topic.

    ``queue_size``: how many messages may wait for a slow subscriber before the oldest is dropped (0: any
    number; None: ``publish`` itself waits until all are written). ``latch``: whoever joins later gets
    the last message. ``headers``: fields for the connection header. ``subscriber_listener`` is told of
    subscribers, in a thread of the library, one event after the other. Raises ValueError on a bad name, class
    or queue_size.
    """

    impl: _Published | None

    def __init__(
        self,
        name: str,
        data_class: type[_M],
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
        fields = dict(headers or {})
        with process.lock:
            state = process.published.get(self.resolved_name)
            if state is None:
                state = process.published[self.resolved_name] = _Published(self.resolved_name, data_class)
            state.join(self, subscriber_listener, size, latch, fields, tcp_nodelay)
        self.impl = state
        process.when_ready(state.register)

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, or the message that these field values make.

        Raises ROSException before init_node and after unregister, ROSSerializationException or TypeError on
        values that do not fit. Never waits for a subscriber, except with ``queue_size=None``.
        """
        state = self.impl
        if state is None:
            raise ROSException("publish() to an unregistered() handle")
        if len(args) == 1 and args[0].__class__ is self.data_class and not kwds:
            state.publish(args[0])
        else:
            state.check_initialized()
            if len(args) == 1 and isinstance(args[0], AnyMsg):
                # As with rospy, bytes are taken for what their sender says that they are.
                state.publish(args[0])
            else:
                state.publish(args_kwds_to_message(self.data_class, args, kwds))

    def wait_for_subscribers(self, count: int = 1, timeout: float | None = None) -> bool:
        """Wait until so many subscribers are connected; False where ``timeout`` seconds were not enough.

        What is published before a subscriber is connected does not reach it, unless the topic is latched.
        Raises ROSException before init_node and after unregister, ROSInterruptException at a shutdown.
        """
        if self.impl is None:
            raise ROSException("wait_for_subscribers() on an unregistered() handle")
        return self.impl.wait_for_subscribers(count, timeout)


class Subscriber(Topic[_M]):
    """Calls ``callback(message)`` with each message of a topic.

    ``callback_args`` is handed to the callback as second argument. ``queue_size``: while the callback is
    busy, keep only so many messages, the newest (None: all, in order). ``buff_size`` is accepted and not
    needed: freshness does not depend on it. Subscribers of one topic in a process share the connections;
    they keep as many messages as the one that asks for most. One that comes later to a latched topic gets
    its last message at once, before the constructor returns. Raises ValueError on a bad name or class,
    ROSException on a bad size.
    """

    impl: _Subscribed | None

    def __init__(
        self,
        name: str,
        data_class: type[_M],
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = 65536,
        tcp_nodelay: bool = False,
    ) -> None:
        super().__init__(name, data_class, "sub")
        self.callback = callback
        self.callback_args = callback_args
        if queue_size is not None:
            if not isinstance(queue_size, int):
                raise ROSException("queue size must be an integer")
            if queue_size == 0:
                raise ROSException("queue size may not be set to zero")
        if not isinstance(buff_size, int):
            raise ROSException("buffer size must be an integer")
        if buff_size <= 0:
            raise ROSException("buffer size must be a positive integer")
        self._newest = max(0, queue_size or 0)
        with process.lock:
            state = process.subscribed.get(self.resolved_name)
            if state is None:
                state = process.subscribed[self.resolved_name] = _Subscribed(self.resolved_name, data_class)
            # Looked up before joining: what comes from now on is delivered in the usual way.
            latched = state.latched()
            state.join(self, tcp_nodelay)
        self.impl = state
        process.when_ready(state.register)
        state.replay(self, latched)

    def unregister(self) -> None:
        """Stop listening; the connections end with the last Subscriber of the topic in this process."""
        super().unregister()
        self.callback = self.callback_args = None


def wait_for_message(topic: str, topic_type: type[_M], timeout: float | None = None) -> _M:
    """The next message of ``topic``; ``timeout`` in seconds, or a Duration.

    Raises ROSException after ``timeout``, ROSInterruptException where the node shuts down.
    """
    if timeout is not None and hasattr(timeout, "to_sec"):
        timeout = timeout.to_sec()
    got: list[_M] = []
    arrived = threading.Event()

    def on_message(message: _M) -> None:
        got.append(message)
        arrived.set()

    with process.interrupting(arrived.set):
        subscriber = Subscriber(topic, topic_type, on_message)
        try:
            wait_for_event(arrived, timeout)
        finally:
            subscriber.unregister()
    if got:
        return got[0]
    if process.is_shutdown():
        raise process.interrupted("rospy shutdown")
    raise ROSException(f"timeout exceeded while waiting for message on topic {topic}")


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """[topic, type] of each published topic at or below ``namespace``. Raises ROSException."""
    try:
        return [list(pair) for pair in process.master.get_published_topics(namespace or "")]
    except (MasterUnreachableError, RpcError) as error:
        raise ROSException(f"unable to get published topics: {error}") from error


class _Shared:
    """What the handles of one topic in this process share: the ``impl`` that user code sees of rospy's."""

    def __init__(self, topic: str, data_class: type[Any]) -> None:
        self.resolved_name = self.name = topic
        self.data_class = data_class
        self.type: str = data_class._type

    @property
    def connections(self) -> tuple[Any, ...]:
        """The links to the other ends."""
        raise NotImplementedError

    def leave(self, handle: Any) -> None:
        """One handle less; the last ends the topic."""
        raise NotImplementedError

    def get_num_connections(self) -> int:
        """How many links there are."""
        return len(self.connections)

    def has_connections(self) -> bool:
        """Whether there is a link."""
        return bool(self.connections)


class _Published(_Shared):
    """One published topic of the process: what its Publishers share."""

    def __init__(self, topic: str, data_class: type[Any]) -> None:
        super().__init__(topic, data_class)
        self.publication = Publication(topic, _interface_type(data_class), on_link=self._on_link)
        self._handles: set[Publisher[Any]] = set()
        self._listeners: list[SubscribeListener] = []
        self._events: InOrder | None = None
        self._waiting: list[Callable[[], None]] = []
        self._was_heard = False
        self._sequence = itertools.count(1)
        self._has_header = bool(getattr(data_class, "_has_header", False))
        self._registered = False

    def join(
        self,
        handle: Publisher[Any],
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
            self._listeners.append(listener)
        publication.queue_size = queue_size
        publication.latch = publication.latch or latch
        publication.tcp_nodelay = publication.tcp_nodelay or tcp_nodelay
        publication.headers.update(headers or {})

    def register(self) -> None:
        """Tell the master, once."""
        if self._registered or not self._handles or not process.node or process.is_shutdown():
            return
        self._registered = True
        # Before the master knows: a subscriber may come at once, and a publish() before it answers counts.
        _register("publication", self.publication.topic, process.node.advertise(self.publication))

    def leave(self, handle: Publisher[Any]) -> None:
        with process.lock:
            self._handles.discard(handle)
            is_last = not self._handles
            if is_last:
                del process.published[self.publication.topic]
        if is_last and process.node and not process.is_shutdown():
            _unregister(process.node.unadvertise(self.publication))

    def check_initialized(self) -> None:
        """Raise ROSException before init_node."""
        if not self._registered and not process.is_shutdown():
            raise ROSException("ROS node has not been initialized yet. Please call init_node() first")

    def publish(self, message: Any) -> None:
        """Send a message to every subscriber."""
        publication = self.publication
        if not self._registered:
            self.check_initialized()
        elif publication.links or publication.latch:
            publication.publish(self._frame(message))
            if process.late_signal:
                process.take_late_signal()
        elif not self._was_heard:
            self._was_heard = True
            self._tell_unheard()

    def wait_for_subscribers(self, count: int, timeout: float | None) -> bool:
        """See :meth:`Publisher.wait_for_subscribers`."""
        self.check_initialized()
        enough = threading.Event()

        def look() -> None:
            if len(self.publication.links) >= count or process.is_shutdown():
                enough.set()

        with process.interrupting(enough.set):
            self._waiting.append(look)
            try:
                look()
                wait_for_event(enough, timeout)
            finally:
                self._waiting.remove(look)
        if process.is_shutdown():
            raise process.interrupted("rospy shutdown")
        return enough.is_set()

    @property
    def connections(self) -> tuple[OutLink, ...]:
        """The links to subscribers."""
        return self.publication.links

    def _tell_unheard(self) -> None:
        """The first message went to nobody: worth a warning only where somebody wants it, and is on the way.

        That most topics have no subscriber at first, or ever, is in order.
        """
        if self.publication.expected and not process.is_shutdown():
            _log.warning(
                "the first message on %s went to nobody: %d known to the master, not connected yet. "
                "wait_for_subscribers() waits for them, latch=True keeps the last message for them",
                self.resolved_name,
                self.publication.expected,
            )
        else:
            _log.debug("the first message on %s went to nobody: it has no subscriber yet", self.resolved_name)

    def _frame(self, message: Any) -> bytes:
        if self._has_header and not isinstance(message, AnyMsg):
            message.header.seq = next(self._sequence)
        buffer = BytesIO()
        buffer.write(b"\0\0\0\0")
        try:
            message.serialize(buffer)
        except SerializationError as error:
            if not self._has_header or getattr(message.header, "frame_id", "") is not None:
                raise ROSSerializationException(str(error)) from error
            # What rospy makes of None.
            message.header.frame_id = "0"
            buffer.seek(4)
            try:
                message.serialize(buffer)
            except SerializationError as again:
                raise ROSSerializationException(str(again)) from again
        size = buffer.tell() - 4
        buffer.seek(0)
        buffer.write(_LENGTH.pack(size))
        return buffer.getvalue()

    def _on_link(self, link: OutLink, is_up: bool) -> None:
        self._was_heard = True
        for look in list(self._waiting):
            look()
        if not self._listeners or not process.node:
            return
        if self._events is None:
            self._events = InOrder(process.node.workers)
        topic = self.publication.topic

        def publish_to_all(*args: Any, **kwds: Any) -> None:
            for handle in list(self._handles)[:1]:
                handle.publish(*args, **kwds)

        def publish_to_peer(*args: Any, **kwds: Any) -> None:
            for handle in list(self._handles)[:1]:
                link.send(self._frame(args_kwds_to_message(handle.data_class, args, kwds)))

        for listener in self._listeners:
            if is_up:
                self._events.start(listener.peer_subscribe, topic, publish_to_all, publish_to_peer)
            else:
                self._events.start(listener.peer_unsubscribe, topic, len(self.publication.links))


class _Callback(NamedTuple):
    """A subscriber's function with the argument that it wants beside the message."""

    function: Callable[..., object]
    args: Any


class _Receiver(NamedTuple):
    """A message class, whether it can be read from a memoryview (genpy's cannot), and who wants it."""

    data_class: type[Any]
    takes_memoryview: bool
    callbacks: tuple[_Callback, ...]


class _Subscribed(_Shared):
    """One subscribed topic of the process: what its Subscribers share."""

    def __init__(self, topic: str, data_class: type[Any]) -> None:
        super().__init__(topic, data_class)
        self.subscription: Subscription | None = None
        self._tcp_nodelay = False
        self._handles: list[Subscriber[Any]] = []
        self._receivers: tuple[_Receiver, ...] = ()
        self._statistics: StatisticsPublisher | None = None
        self._registered = False

    @property
    def connections(self) -> tuple[InLink, ...]:
        """The links to publishers."""
        return self.subscription.links if self.subscription else ()

    def join(self, handle: Subscriber[Any], tcp_nodelay: bool) -> None:
        self._tcp_nodelay = self._tcp_nodelay or tcp_nodelay
        self._handles.append(handle)
        self._update()

    def leave(self, handle: Subscriber[Any]) -> None:
        with process.lock:
            self._handles.remove(handle)
            self._update()
            is_last = not self._handles
            if is_last:
                del process.subscribed[self.resolved_name]
        if is_last and process.node and self.subscription and not process.is_shutdown():
            _unregister(process.node.unsubscribe(self.subscription))

    def register(self) -> None:
        """Tell the master, once."""
        if self._registered or not self._handles or not process.node or process.is_shutdown():
            return
        self._registered = True
        self.subscription = process.node.make_subscription(
            self.resolved_name,
            _interface_type(self.data_class),
            self._deliver,
            newest=self._newest(),
            tcp_nodelay=self._tcp_nodelay,
        )
        if self.resolved_name not in _WITHOUT_STATISTICS:
            process.node.workers.start(self._look_for_statistics)
        _register("subscription", self.resolved_name, process.node.subscribe(self.subscription))

    def _newest(self) -> int:
        """How many messages to keep: as many as the Subscriber that asks for most."""
        sizes = [handle._newest for handle in self._handles]
        return 0 if 0 in sizes else max(sizes, default=0)

    def _look_for_statistics(self) -> None:
        """Count what comes where the parameter says so. In a worker: no Subscriber waits for the answer."""
        try:
            is_on = process.master.get_param("/enable_statistics")
        except (MasterUnreachableError, RpcError):
            return
        if is_on:
            from minirospy.client.statistics import StatisticsPublisher

            self._statistics = StatisticsPublisher(self.resolved_name)

    def _update(self) -> None:
        """Group the callbacks by class, so that a message is deserialised once for all of a class."""
        if self.subscription:
            self.subscription.newest = self._newest()
        by_class: dict[type[Any], list[_Callback]] = {}
        for handle in self._handles:
            callbacks = by_class.setdefault(handle.data_class, [])
            if handle.callback is not None:
                callbacks.append(_Callback(handle.callback, handle.callback_args))
        self._receivers = tuple(
            _Receiver(cls, getattr(cls, "_takes_memoryview", False), tuple(callbacks))
            for cls, callbacks in by_class.items()
            if callbacks
        )

    def latched(self) -> list[tuple[bytes | memoryview, Header]]:
        """The last message of each latched publisher, with the header of its link."""
        return [(link.latched, link.header) for link in self.connections if link.latched is not None]

    def replay(self, handle: Subscriber[Any], latched: list[tuple[bytes | memoryview, Header]]) -> None:
        """Give a Subscriber the messages that came before it did."""
        if handle.callback is None:
            return
        callbacks = (_Callback(handle.callback, handle.callback_args),)
        receiver = _Receiver(handle.data_class, False, callbacks)
        for frame, header in latched:
            self._deliver(memoryview(frame), header, (receiver,))

    def _deliver(
        self, frame: memoryview, header: Header, receivers: tuple[_Receiver, ...] | None = None
    ) -> None:
        statistics = None if receivers else self._statistics
        for data_class, takes_memoryview, callbacks in receivers or self._receivers:
            message = data_class()
            try:
                message.deserialize(frame if takes_memoryview else bytes(frame))
            except Exception as error:  # noqa: BLE001 - whatever a foreign message class raises on bad bytes
                _log.error(
                    "a message on %s from %s does not fit %s: %s",
                    self.resolved_name,
                    header.get("callerid"),
                    data_class._type,
                    error,
                )
                continue
            message._connection_header = header
            if statistics:
                statistics.count(message, header, len(frame))
                statistics = None
            for callback in callbacks:
                _call(callback, message)


def _call(callback: _Callback, message: Any) -> None:
    try:
        if callback.args is None:
            callback.function(message)
        else:
            callback.function(message, callback.args)
    except Exception:  # noqa: BLE001 - the user's function: its fault must not end the connection
        if not process.is_shutdown():
            _log.error("bad callback: %s\n%s", callback.function, traceback.format_exc())


def _checked_size(queue_size: Any) -> int | None:
    """A Publisher's queue_size as rospy reads it: less than nothing is no limit. Raises ValueError."""
    if queue_size is None:
        return None
    try:
        return max(0, int(queue_size))
    except (TypeError, ValueError):
        raise ValueError(f"queue_size must be an integer or None: {queue_size!r}") from None


def _interface_type(data_class: type[Any]) -> InterfaceType:
    return InterfaceType(data_class._type, data_class._md5sum, getattr(data_class, "_full_text", ""))


def _register(what: str, topic: str, registration: Any) -> None:
    """Run a registration; a master that says no is logged, as in rospy, and the program goes on."""
    try:
        process.run(registration)
    except MasterUnreachableError as error:
        _log.critical("unable to register %s [%s] with master: %s. Will keep trying.", what, topic, error)
    except RpcError as error:
        _log.critical("unable to register %s [%s] with master: %s", what, topic, error)


def _unregister(unregistration: Any) -> None:
    try:
        process.run(unregistration)
    except (MasterUnreachableError, RpcError) as error:
        _log.debug("unregistering: %s", error)
