"""rospy's Subscriber. It deserializes a message in the worker that received it.

Source: http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers.
"""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import MasterUnreachableError, ROSException, RpcError, ThreadLimitError
from minirospy.base.numpy_names import add_numpy_note
from minirospy.client.connection import Connection, connection_to_publisher
from minirospy.client.session import NEW_SECONDS, Session, current_session
from minirospy.client.topic import SharedTopic, Topic, register_with_master, unregister_from_master
from minirospy.client.type_advice import advice_for_callback
from minirospy.core.idl.protocols import Message, declared
from minirospy.core.wire.framing import Frame, SplitFrame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.client.statistics import StatisticsPublisher
    from minirospy.runtime.node.subscription import InLink, Subscription

__all__ = ["SubscribedTopic", "Subscriber", "wait_for_message"]

_log = logging.getLogger("rosout")
_own_log = logging.getLogger(__name__)  # logs to the terminal and the log file, not to /rosout
_M = TypeVar("_M", bound=Message)
_M_co = TypeVar("_M_co", bound=Message, covariant=True)
_BUFF_SIZE = 65536
_SILENT_SECONDS = 5.0  # seconds; a longer wait for a message is logged, like one for a service
_WITHOUT_STATISTICS = frozenset({"/statistics", "/clock"})
"""Topics that are not counted: /statistics itself, and /clock, which sets the time."""


class Subscriber(Topic[_M_co]):
    """Calls ``callback(message)`` with each message on a topic.

    ``callback_args`` is passed to the callback as second argument. ``queue_size``: number of newest messages to keep
    while the callback is busy (None: all, in order). ``buff_size`` is accepted for compatibility: queue_size alone
    determines which messages are kept. Subscribers to one topic in a process share the connections; they keep as many
    messages as the largest queue_size. If a Subscriber is added to a latched topic later, its callback receives the
    last message before the constructor returns. Raise ValueError if the name or class is invalid, ROSException if a
    size is invalid.
    """

    impl: SubscribedTopic | None

    def __init__(
        self,
        name: str,
        data_class: type[_M_co],
        callback: Callable[..., object] | None = None,
        callback_args: object = None,
        queue_size: int | None = None,
        buff_size: int = _BUFF_SIZE,
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
        if callback is not None and not callable(callback):
            # Warn now, because rospy reports an invalid callback only when a message arrives.
            warnings.warn(
                f"the callback {callback!r} for {self.resolved_name} is not a function: pass its name, without quotes "
                "and parentheses",
                stacklevel=2,
            )
        self._newest = max(0, queue_size or 0)

        with self._session.lock:
            state = self._session.subscribed.get(self.resolved_name)
            if state is None:
                state = self._session.subscribed[self.resolved_name] = SubscribedTopic(
                    self._session, self.resolved_name, data_class
                )
            state.join(self, queue_size, buff_size, tcp_nodelay)
            # Join before reading the links. If a link opens in between, its message may be delivered twice, but none is lost.
            links = state.links
        self.impl = state

        try:
            self._session.when_ready(state.register, f"the subscriber of {self.resolved_name}")
        except ThreadLimitError:
            self.unregister()
            raise

        if callback is not None:
            state.replay(data_class, _Callback(callback, callback_args), links)

    def unregister(self) -> None:
        """Stop receiving. Unregistering the topic's last Subscriber in this process also closes the connections."""
        super().unregister()
        self.callback = self.callback_args = None


def wait_for_message(topic: str, topic_type: type[_M], timeout: float | None = None) -> _M:
    """Return the next message on ``topic``. ``timeout`` is in seconds, or a Duration.

    Raise ROSException after ``timeout``, ROSInterruptException if the node shuts down.
    """
    session = current_session()
    if session.is_fork_without_node:
        raise ROSException(session.why_fork_has_no_effect(f"wait_for_message({topic!r})"))
    if timeout is not None and hasattr(timeout, "to_sec"):
        timeout = timeout.to_sec()
    got: list[_M] = []
    arrived = SignalSafeEvent()

    def on_message(message: _M) -> None:
        got.append(message)
        arrived.set()

    with session.lifecycle.interrupting(arrived.set):
        subscriber = Subscriber(topic, topic_type, on_message)
        try:
            patience = _SILENT_SECONDS if timeout is None else min(timeout, _SILENT_SECONDS)
            is_longer = timeout is None or timeout > _SILENT_SECONDS
            if not wait_for_event(arrived, patience) and is_longer:
                # rospy logs nothing here, so users would not notice a misspelled name. Do not publish this on /rosout.
                peers = subscriber.get_num_connections()
                why = "no message yet" if peers else "nothing publishes it"
                _own_log.warning("wait_for_message(%s): %s, waiting...", subscriber.resolved_name, why)
                wait_for_event(arrived, None if timeout is None else timeout - patience)
        finally:
            subscriber.unregister()
    if got:
        return got[0]
    if session.is_shutdown():
        raise session.lifecycle.interrupted("rospy shutdown")
    raise ROSException(f"timeout exceeded while waiting for message on topic {topic}")


class _Callback(NamedTuple):
    """A Subscriber's callback function and the additional argument for it."""

    function: Callable[..., object]
    args: object


class _Receiver(NamedTuple):
    """A message class, whether it can deserialize a memoryview and a split frame (genpy's cannot), and its callbacks."""

    data_class: type[Message]
    takes_memoryview: bool
    takes_split_frames: bool
    callbacks: tuple[_Callback, ...]

    @classmethod
    def of(cls, data_class: type[Message], callbacks: tuple[_Callback, ...]) -> _Receiver:
        """Return a receiver with what the class declares."""
        takes_memoryview = bool(declared(data_class, "deserialize", "_takes_memoryview"))
        takes_split_frames = bool(declared(data_class, "deserialize", "_takes_split_frames"))
        return cls(data_class, takes_memoryview, takes_split_frames, callbacks)


class SubscribedTopic(SharedTopic):
    """A topic that this process subscribes to. Its Subscribers share this object."""

    def __init__(self, session: Session, topic: str, data_class: type[Message]) -> None:
        super().__init__(session, topic, data_class)
        self.subscription: Subscription | None = None
        self.queue_size: int | None = None
        self.buff_size = _BUFF_SIZE
        self.tcp_nodelay = False
        self._handles: list[Subscriber[Message]] = []
        self._added: list[_Callback] = []
        self._receivers: tuple[_Receiver, ...] = ()
        self._statistics: StatisticsPublisher | None = None
        self._misfits = RateLimitedLogger(_log)
        self._registered = False
        self._since = time.monotonic()  # time at which the latest Subscriber was created

    @property
    def has_callback(self) -> bool:
        """Return whether any Subscriber of the topic has a callback."""
        return any(handle.callback is not None for handle in self._handles)

    @property
    def is_new(self) -> bool:
        """Return whether the latest Subscriber was created a moment ago, and no link has received a message."""
        has_received = any(link.received for link in self.links)
        return not has_received and time.monotonic() - self._since < NEW_SECONDS

    @property
    def links(self) -> tuple[InLink, ...]:
        """The links to publishers."""
        return self.subscription.links if self.subscription else ()

    @property
    def connections(self) -> list[Connection]:
        """The links to publishers, as rospy represents them."""
        return [connection_to_publisher(link, self.resolved_name) for link in self.links]

    def get_stats(self) -> tuple[str, list[tuple[object, ...]]]:
        """Return the topic's row for the Slave API's getBusStats."""
        return self.resolved_name, [
            (c.id, c.stat_bytes, c.stat_num_msg, -1, not c.done) for c in self.connections
        ]

    def get_num_connections(self) -> int:
        """Return the number of links."""
        return len(self.links)

    def has_connection(self, endpoint_id: str) -> bool:
        """Return whether the node with this Slave API URI is connected."""
        return any(link.uri == endpoint_id for link in self.links)

    @property
    def callbacks(self) -> list[tuple[Callable[..., object], object]]:
        """The functions that receive the messages, each with its callback_args."""
        own = [(each.callback, each.callback_args) for each in self._handles if each.callback is not None]
        return own + list(self._added)

    def join(
        self, handle: Subscriber[Message], queue_size: int | None, buff_size: int, tcp_nodelay: bool
    ) -> None:
        if queue_size is not None:
            self.queue_size = queue_size
        if buff_size != _BUFF_SIZE:
            self.buff_size = buff_size
        self.tcp_nodelay = self.tcp_nodelay or tcp_nodelay
        self._handles.append(handle)
        self._since = time.monotonic()
        self._update()

    def leave(self, handle: Subscriber[Message]) -> None:
        with self._session.lock:
            self._handles.remove(handle)
            self._update()
            if self._handles or self._session.subscribed.get(self.resolved_name) is not self:
                return
            del self._session.subscribed[self.resolved_name]
            if not self._session.node or not self.subscription or self._session.is_shutdown():
                return
            # Start unregistering now, before another thread can subscribe to the topic again.
            wait = self._session.start(self._session.node.unsubscribe(self.subscription))
        unregister_from_master(wait)

    def add_callback(self, cb: Callable[..., object], cb_args: object) -> None:
        """Add the callback ``cb``. If the topic is latched, call ``cb`` immediately with the last message.

        rosbridge calls this method.
        """
        callback = _Callback(cb, cb_args)
        with self._session.lock:
            self._added.append(callback)
            self._update()
            links = self.links
        self.replay(self.data_class, callback, links)

    def remove_callback(self, cb: Callable[..., object], cb_args: object) -> None:
        """Remove a callback that was added by add_callback or a Subscriber. Raise KeyError if it is not registered."""
        with self._session.lock:
            if (callback := _Callback(cb, cb_args)) in self._added:
                self._added.remove(callback)
            else:
                self._handle_with(callback).callback = None
            self._update()

    def set_queue_size(self, queue_size: int | None) -> None:
        """Set the number of messages to keep, like a Subscriber's ``queue_size``."""
        with self._session.lock:
            for handle in self._handles:
                handle._newest = max(0, queue_size or 0)
            self.queue_size = queue_size
            self._update()

    def set_buff_size(self, buff_size: int) -> None:
        """Record the size; like a Subscriber's ``buff_size``, it has no effect."""
        self.buff_size = buff_size

    def register(self) -> None:
        """Register with the master. Only the first call has an effect."""
        with self._session.lock:
            node = self._session.node
            if self._registered or not self._handles or not node or self._session.is_shutdown():
                return
            self._registered = True
            self.subscription = node.make_subscription(
                self.resolved_name,
                InterfaceType.of(self.data_class),
                self._deliver,
                newest=self._newest(),
                tcp_nodelay=self.tcp_nodelay,
            )
            wait = self._session.start(node.subscribe(self.subscription))

        try:
            if self.resolved_name not in _WITHOUT_STATISTICS:
                node.workers.start(self._look_for_statistics)
        finally:
            register_with_master("subscription", self.resolved_name, wait)

    def _newest(self) -> int:
        """Return the number of messages to keep: that of the Subscriber with the largest queue_size."""
        sizes = [handle._newest for handle in self._handles]
        return 0 if 0 in sizes else max(sizes, default=0)

    def _look_for_statistics(self) -> None:
        """Count the received messages if the parameter /enable_statistics is set.

        Runs in a worker thread, so that no Subscriber waits for the master.
        """
        try:
            is_on = self._session.master.get_param("/enable_statistics")
        except (MasterUnreachableError, RpcError):
            return
        if is_on:
            from minirospy.client.statistics import StatisticsPublisher

            self._statistics = StatisticsPublisher(self.resolved_name)

    def _update(self) -> None:
        """Group the callbacks by class, so that a message is deserialized once per class."""
        if self.subscription:
            self.subscription.newest = self._newest()
        by_class: dict[type[Message], list[_Callback]] = {}
        for handle in self._handles:
            callbacks = by_class.setdefault(handle.data_class, [])
            if handle.callback is not None:
                callbacks.append(_Callback(handle.callback, handle.callback_args))
        by_class.setdefault(self.data_class, []).extend(self._added)
        self._receivers = tuple(
            _Receiver.of(cls, tuple(callbacks)) for cls, callbacks in by_class.items() if callbacks
        )

    def replay(self, data_class: type[Message], callback: _Callback, links: tuple[InLink, ...]) -> None:
        """Call a newly added callback with the last message of each latched publisher."""
        receivers = (_Receiver(data_class, False, False, (callback,)),)
        for link in links:
            frame = link.latched
            if frame is None:
                continue
            self._deliver(frame, link.header, receivers)
            newest = link.latched
            if newest is not None and newest is not frame:
                # A newer message has arrived in the meantime, and may have been delivered before this older one.
                # Deliver that newer message again, so that it comes last.
                self._deliver(newest, link.header, receivers)

    def _handle_with(self, callback: _Callback) -> Subscriber[Message]:
        for handle in self._handles:
            if (handle.callback, handle.callback_args) == callback:
                return handle
        raise KeyError("no matching cb")

    def _deliver(self, frame: Frame, header: Header, receivers: tuple[_Receiver, ...] | None = None) -> None:
        statistics = None if receivers else self._statistics
        is_split = isinstance(frame, SplitFrame)
        for data_class, takes_memoryview, takes_split_frames, callbacks in receivers or self._receivers:
            message = data_class()
            takes = takes_split_frames if is_split else takes_memoryview
            try:
                message.deserialize(frame if takes else bytes(frame))
            except Exception as error:  # noqa: BLE001 - whatever a foreign message class raises on bad bytes
                self._misfits.error(
                    "a message on %s from %s does not fit %s: %s",
                    self.resolved_name,
                    header.get("callerid"),
                    data_class._type,
                    f"no memory for its {len(frame)} bytes" if isinstance(error, MemoryError) else error,
                )
                continue

            message._connection_header = header
            if statistics:
                statistics.count(message, header, len(frame))
                statistics = None
            for callback in callbacks:
                _call(callback, message, receivers is not None)


def _call(callback: _Callback, message: Message, is_callers_thread: bool) -> None:
    try:
        if callback.args is None:
            callback.function(message)
        else:
            callback.function(message, callback.args)
    except BaseException as error:
        add_numpy_note(error)
        # As in rospy, sys.exit() has no effect in a link's thread, but exits the program if called inside Subscriber().
        if is_callers_thread and not isinstance(error, Exception):
            raise
        # Ignore errors in the callback during a shutdown: a hook may have released resources that the callback uses.
        session = current_session()
        if not session.lifecycle.is_shutdown_requested:
            advice = advice_for_callback(
                error, callback.function, message, has_args=callback.args is not None
            )
            session.callback_errors.log(callback.function, error, advice)
