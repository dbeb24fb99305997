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
from typing import Any, Generic, NamedTuple, TypeVar

from minirospy import names
from minirospy.client.process import process
from minirospy.clock import wait_for_event
from minirospy.errors import (
    MasterUnreachableError,
    ROSException,
    ROSInterruptException,
    ROSSerializationException,
    RpcError,
    SerializationError,
)
from minirospy.idl.message import Message, args_kwds_to_message
from minirospy.runtime.tcp import OutLink
from minirospy.runtime.topics import Publication, Subscription
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

_log = logging.getLogger("rosout")
_M = TypeVar("_M", bound=Any)
_LENGTH = struct.Struct("<I")


class AnyMsg(Message):
    """A message of any type: its bytes, and in ``_connection_header`` what the publisher told of them."""

    _md5sum = ANY
    _type = ANY
    _has_header = False
    _takes_memoryview = True
    _full_text = ""
    _slot_types: list[str] = []
    __slots__ = ["_buff", "_connection_header"]

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
    """What Publisher and Subscriber share: ``name`` (as resolved), ``type``, ``md5sum``, ``data_class``."""

    def __init__(self, name: str, data_class: type[_M], reg_type: str) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("topic name is not a non-empty string")
        if not inspect.isclass(data_class):
            raise ValueError(f"data_class [{data_class}] is not a class")
        if not hasattr(data_class, "_md5sum") or not hasattr(data_class, "serialize"):
            raise ValueError(f"data_class [{data_class.__name__}] is not a message data class")
        self.resolved_name = process.resolve(name)
        if not names.is_legal_name(self.resolved_name):
            warnings.warn(
                f"'{self.resolved_name}' is not a legal ROS graph resource name. "
                "This may cause problems with other ROS tools",
                stacklevel=3,
            )
        self.name = self.resolved_name
        self.data_class = data_class
        self.type: str = data_class._type  # type: ignore[attr-defined]
        self.md5sum: str = data_class._md5sum  # type: ignore[attr-defined]
        self.reg_type = reg_type


class Publisher(Topic[_M]):
    """Publishes messages of ``data_class`` on a topic.

    ``queue_size``: how many messages may wait for a slow subscriber before the oldest is dropped (0: any
    number; None: ``publish`` itself waits until all are written). ``latch``: whoever joins later gets
    the last message. ``headers``: fields for the connection header. Raises ValueError on a bad name or class.
    """

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
        with process.lock:
            state = process.published.get(self.resolved_name)
            if state is None:
                state = process.published[self.resolved_name] = _Published(self.resolved_name, data_class)
            state.join(self, subscriber_listener, queue_size, latch, headers, tcp_nodelay)
        self._state: _Published | None = state
        process.when_ready(state.register)

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, or the message that these field values make.

        Raises ROSException before init_node and after unregister, ROSSerializationException or TypeError on
        values that do not fit. Never waits for a subscriber, except with ``queue_size=None``.
        """
        state = self._state
        if state is None:
            raise ROSException("publish() to an unregistered() handle")
        if len(args) == 1 and args[0].__class__ is self.data_class and not kwds:
            state.publish(args[0])
        else:
            state.publish(args_kwds_to_message(self.data_class, args, kwds))

    def get_num_connections(self) -> int:
        """How many subscribers are connected."""
        return len(self._state.publication.links) if self._state else 0

    def unregister(self) -> None:
        """Stop publishing; the topic ends with the last Publisher of it in this process."""
        state, self._state = self._state, None
        if state:
            state.leave(self)


class Subscriber(Topic[_M]):
    """Calls ``callback(message)`` with each message of a topic.

    ``callback_args`` is handed to the callback as second argument. ``queue_size``: while the callback is
    busy, keep only so many messages, the newest (None: all, in order). ``buff_size`` is accepted and not
    needed: freshness does not depend on it.
    """

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
        with process.lock:
            state = process.subscribed.get(self.resolved_name)
            if state is None:
                state = process.subscribed[self.resolved_name] = _Subscribed(
                    self.resolved_name, data_class, queue_size or 0, tcp_nodelay
                )
            state.join(self)
        self._state: _Subscribed | None = state
        process.when_ready(state.register)

    def get_num_connections(self) -> int:
        """How many publishers are connected."""
        subscription = self._state.subscription if self._state else None
        return len(subscription.links) if subscription else 0

    def unregister(self) -> None:
        """Stop listening; the connection ends with the last Subscriber of the topic in this process."""
        state, self._state = self._state, None
        if state:
            state.leave(self)


def wait_for_message(topic: str, topic_type: type[_M], timeout: float | None = None) -> _M:
    """The next message of ``topic``.

    Raises ROSException after ``timeout`` seconds, ROSInterruptException where the node shuts down.
    """
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
        raise ROSInterruptException("rospy shutdown")
    raise ROSException(f"timeout exceeded while waiting for message on topic {subscriber.resolved_name}")


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """[topic, type] of each published topic at or below ``namespace``. Raises ROSException."""
    try:
        return [list(pair) for pair in process.master.get_published_topics(namespace)]
    except (MasterUnreachableError, RpcError) as error:
        raise ROSException(f"unable to get published topics: {error}") from error


class _Published:
    """One published topic of the process: what its Publishers share."""

    def __init__(self, topic: str, data_class: type[Any]) -> None:
        self.publication = Publication(topic, _interface_type(data_class), on_link=self._on_link)
        self._handles: set[Publisher[Any]] = set()
        self._listeners: list[SubscribeListener] = []
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
        self._handles.add(handle)
        if listener:
            self._listeners.append(listener)
        publication.queue_size = queue_size
        publication.latch = publication.latch or latch
        publication.tcp_nodelay = publication.tcp_nodelay or tcp_nodelay
        publication.headers.update(headers or {})

    def register(self) -> None:
        """Tell the master, once."""
        if self._registered or not process.node or process.is_shutdown():
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

    def publish(self, message: Any) -> None:
        publication = self.publication
        if not self._registered:
            if process.is_shutdown():
                return
            raise ROSException("ROS node has not been initialized yet. Please call init_node() first")
        if publication.links or publication.latch:
            publication.publish(self._frame(message))
            if process.late_signal:
                process.take_late_signal()

    def _frame(self, message: Any) -> bytes:
        if self._has_header:
            message.header.seq = next(self._sequence)
        buffer = BytesIO()
        buffer.write(b"\0\0\0\0")
        try:
            message.serialize(buffer)
        except SerializationError as error:
            raise ROSSerializationException(str(error)) from error
        size = buffer.tell() - 4
        buffer.seek(0)
        buffer.write(_LENGTH.pack(size))
        return buffer.getvalue()

    def _on_link(self, link: OutLink, is_up: bool) -> None:
        if not self._listeners or not process.node:
            return
        topic = self.publication.topic

        def publish_to_all(*args: Any, **kwds: Any) -> None:
            for handle in list(self._handles)[:1]:
                handle.publish(*args, **kwds)

        def publish_to_peer(*args: Any, **kwds: Any) -> None:
            for handle in list(self._handles)[:1]:
                link.send(self._frame(args_kwds_to_message(handle.data_class, args, kwds)))

        for listener in self._listeners:
            if is_up:
                process.node.workers.start(listener.peer_subscribe, topic, publish_to_all, publish_to_peer)
            else:
                process.node.workers.start(listener.peer_unsubscribe, topic, len(self.publication.links))


class _Callback(NamedTuple):
    """A subscriber's function with the argument that it wants beside the message."""

    function: Callable[..., object]
    args: Any


class _Receiver(NamedTuple):
    """A message class, whether it can be read from a memoryview (genpy's cannot), and who wants it."""

    data_class: type[Any]
    takes_memoryview: bool
    callbacks: tuple[_Callback, ...]


class _Subscribed:
    """One subscribed topic of the process: what its Subscribers share."""

    def __init__(self, topic: str, data_class: type[Any], newest: int, tcp_nodelay: bool) -> None:
        self.topic = topic
        self.subscription: Subscription | None = None
        self._data_class = data_class
        self._newest = newest
        self._tcp_nodelay = tcp_nodelay
        self._handles: list[Subscriber[Any]] = []
        self._receivers: tuple[_Receiver, ...] = ()
        self._registered = False

    def join(self, handle: Subscriber[Any]) -> None:
        self._handles.append(handle)
        self._update()

    def leave(self, handle: Subscriber[Any]) -> None:
        with process.lock:
            self._handles.remove(handle)
            self._update()
            is_last = not self._handles
            if is_last:
                del process.subscribed[self.topic]
        if is_last and process.node and self.subscription and not process.is_shutdown():
            _unregister(process.node.unsubscribe(self.subscription))

    def register(self) -> None:
        """Tell the master, once."""
        if self._registered or not process.node or process.is_shutdown():
            return
        self._registered = True
        self.subscription = process.node.make_subscription(
            self.topic,
            _interface_type(self._data_class),
            self._deliver,
            newest=self._newest,
            tcp_nodelay=self._tcp_nodelay,
        )
        _register("subscription", self.topic, process.node.subscribe(self.subscription))

    def _update(self) -> None:
        """Group the callbacks by class, so that a message is deserialised once for all of a class."""
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

    def _deliver(self, frame: memoryview, header: Header) -> None:
        for data_class, takes_memoryview, callbacks in self._receivers:
            message = data_class()
            try:
                message.deserialize(frame if takes_memoryview else bytes(frame))
            except Exception as error:  # noqa: BLE001 - whatever a foreign message class raises on bad bytes
                _log.error(
                    "a message on %s from %s does not fit %s: %s",
                    self.topic,
                    header.get("callerid"),
                    data_class._type,
                    error,
                )
                continue
            message._connection_header = header
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


def _interface_type(data_class: type[Any]) -> InterfaceType:
    return InterfaceType(data_class._type, data_class._md5sum, getattr(data_class, "_full_text", ""))


def _register(what: str, topic: str, registration: Any) -> None:
    """Run a registration; a master that says no is logged, as in rospy, and the program goes on."""
    try:
        process.run(registration)
    except (MasterUnreachableError, RpcError) as error:
        _log.critical("unable to register %s [%s] with master: %s", what, topic, error)


def _unregister(unregistration: Any) -> None:
    try:
        process.run(unregistration)
    except (MasterUnreachableError, RpcError) as error:
        _log.debug("unregistering: %s", error)
