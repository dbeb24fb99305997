"""message_filters: combine messages from several topics by their time stamps.

A filter calls its callbacks with each message, or set of messages, that passes; filters can be chained.
Source: http://wiki.ros.org/message_filters.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, MutableMapping, Sequence
from typing import Protocol

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.client.session import current_session
from minirospy.client.time import is_wallclock
from minirospy.core.idl.protocols import Message
from minirospy.ros.message_filters.message_filters.stamps import StampQueue, closest_stamps

__all__ = ["ApproximateTimeSynchronizer", "Cache", "SimpleFilter", "Subscriber", "TimeSynchronizer"]

Callback = Callable[..., object]
Queue = MutableMapping[Time, object]

_NO_HEADER = (
    "Cannot use message filters with non-stamped messages. "
    "Use the 'allow_headerless' constructor option to "
    "auto-assign ROS time to headerless messages."
)


class Input(Protocol):
    """An object that a filter can be connected to."""

    def registerCallback(self, cb: Callback, *args: object) -> object:
        """Register a callback. It is called with each message, followed by ``args``."""


class SimpleFilter:
    """Base class of filters: stores callbacks and calls them with the messages that pass."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callback, tuple[object, ...]]] = {}

    def registerCallback(self, cb: Callback, *args: object) -> int:
        """Register a callback and return its ID. It is called with each message or set that passes, followed by ``args``."""
        conn = len(self.callbacks)
        self.callbacks[conn] = (cb, args)
        return conn

    def signalMessage(self, *msg: object) -> None:
        """Call all callbacks with a message or a set of messages."""
        for cb, args in tuple(self.callbacks.values()):
            cb(*msg, *args)


class Subscriber(SimpleFilter):
    """Forwards a topic's messages. Has the same arguments and attributes as rospy.Subscriber."""

    def __init__(self, *args: object, **kwargs: object) -> None:
        super().__init__()
        self.topic = args[0] if args else kwargs["name"]
        kwargs["callback"] = self.callback
        self.sub: rospy.Subscriber[Message] = rospy.Subscriber(*args, **kwargs)  # type: ignore[arg-type]

    def callback(self, msg: object) -> None:
        """Forward a message to the callbacks."""
        self.signalMessage(msg)

    def getTopic(self) -> object:
        """Return the topic's name as given to the constructor."""
        return self.topic

    def __getattr__(self, key: str) -> object:
        # A copy has no attributes at first, so looking up ``sub`` would recurse endlessly.
        if key == "sub":
            raise AttributeError(key)
        return getattr(self.sub, key)


class Cache(SimpleFilter):
    """Caches the last ``cache_size`` messages from a filter for lookup by time, and forwards each message."""

    def __init__(self, f: Input, cache_size: int = 1, allow_headerless: bool = False) -> None:
        """Create a cache for the messages from a filter.

        ``allow_headerless``: stamp a message without a header on arrival, instead of dropping it with a warning.
        """
        super().__init__()
        self.cache_size = cache_size
        self.cache_msgs: list[object] = []
        self.cache_times: list[Time] = []
        self.allow_headerless = allow_headerless
        self._lock = threading.Lock()
        self.connectInput(f)

    def connectInput(self, f: Input) -> None:
        """Connect a filter as the input."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: object) -> None:
        """Cache a message and forward it to the callbacks."""
        stamp = _stamp_of(msg, self.allow_headerless)
        if stamp is None:
            return

        with self._lock:
            self.cache_times.append(stamp)
            self.cache_msgs.append(msg)
            if len(self.cache_msgs) > self.cache_size:
                del self.cache_msgs[0]
                del self.cache_times[0]

        self.signalMessage(msg)

    def getInterval(self, from_stamp: Time, to_stamp: Time) -> list[object]:
        """Return the messages from one timestamp to another, inclusive.

        Raise AssertionError if ``to_stamp`` precedes ``from_stamp``.
        """
        assert from_stamp <= to_stamp
        return [msg for time, msg in self._stored() if from_stamp <= time <= to_stamp]

    def getElemAfterTime(self, stamp: Time) -> object | None:
        """Return the first message stored with a timestamp at or after ``stamp``, or None."""
        return next((msg for time, msg in self._stored() if time >= stamp), None)

    def getElemBeforeTime(self, stamp: Time) -> object | None:
        """Return the last message stored with a timestamp at or before ``stamp``, or None."""
        return next((msg for time, msg in reversed(self._stored()) if time <= stamp), None)

    def getLatestTime(self) -> Time | None:
        """Return the timestamp of the last message stored, or None."""
        stored = self._stored()
        return stored[-1][0] if stored else None

    def getLastestTime(self) -> Time | None:
        """Return ``getLatestTime()``, under its old, misspelled name."""
        return self.getLatestTime()

    def getOldestTime(self) -> Time | None:
        """Return the timestamp of the first message stored, or None."""
        stored = self._stored()
        return stored[0][0] if stored else None

    def getLast(self) -> object | None:
        """Return ``getElemAfterTime(getLatestTime())``, or None if no message is stored."""
        latest = self.getLatestTime()
        return None if latest is None else self.getElemAfterTime(latest)

    def _stored(self) -> list[tuple[Time, object]]:
        with self._lock:
            return list(zip(self.cache_times, self.cache_msgs, strict=True))


class TimeSynchronizer(SimpleFilter):
    """Forwards sets of messages with equal timestamps, one from each input.

    A callback's arguments are one message per input. Callbacks do not run concurrently.
    """

    def __init__(self, fs: Iterable[Input], queue_size: int, reset: bool = False) -> None:
        """Connect the inputs. ``queue_size`` is the number of messages per input to keep while waiting for the others.

        ``reset``: if simulated time jumps back, discard the input's queued messages.
        """
        super().__init__()
        self.queue_size = queue_size
        # Use a reentrant lock: a callback may publish to an input in the same process.
        self.lock = threading.RLock()
        self.enable_reset = reset
        self.connectInput(fs)

    def connectInput(self, fs: Iterable[Input]) -> None:
        """Connect these filters as the inputs."""
        inputs = list(fs)
        self._stamp_queues = [StampQueue() for _ in inputs]
        self._orders = [queue.order for queue in self._stamp_queues]
        self.queues: Sequence[Queue] = self._stamp_queues
        self.latest_stamps: list[Time] = [rospy.Time(0) for _ in inputs]
        self.input_connections = [
            each.registerCallback(self.add, queue, index)
            for index, (each, queue) in enumerate(zip(inputs, self.queues, strict=True))
        ]

    def add(self, msg: object, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Store an input's message; forward each complete set.

        Raise AttributeError if the message has no header.
        """
        stamp: Time = msg.header.stamp  # type: ignore[attr-defined]
        with self.lock:
            is_stale = self._reset_if_time_jumped(my_queue, my_queue_index)
            my_queue[stamp] = msg
            _keep_newest(my_queue, self.queue_size)
            if is_stale:
                return

            for each in sorted(set(self.queues[0]).intersection(*self.queues[1:]) if self.queues else ()):
                # A callback may have added messages and already completed this set.
                if all(each in queue for queue in self.queues):
                    self.signalMessage(*[queue.pop(each) for queue in self.queues])

    def _reset_if_time_jumped(self, my_queue: Queue, my_queue_index: int | None) -> bool:
        """Clear an input's queue if simulated time has jumped back. Return True if another input's last message came later."""
        if not self.enable_reset or is_wallclock():
            return False
        now = rospy.Time.now()
        if my_queue_index is not None:
            if now < self.latest_stamps[my_queue_index]:
                rospy.logdebug("Detected jump back in time. Clearing message filter queue")
                my_queue.clear()
            self.latest_stamps[my_queue_index] = now
        return max(self.latest_stamps) != now


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Forwards sets of messages, one from each input, whose timestamps differ by less than ``slop`` seconds.

    A new message is matched with the closest messages from the other inputs. If several sets are possible, the one that ROS
    would try first is used.
    """

    def __init__(
        self,
        fs: Iterable[Input],
        queue_size: int,
        slop: float,
        allow_headerless: bool = False,
        reset: bool = False,
    ) -> None:
        """Connect the inputs. ``slop`` is the maximum difference between timestamps, in seconds.

        ``allow_headerless``: stamp a message without a header with its arrival time.
        """
        self.slop: Duration = rospy.Duration.from_sec(slop)
        self.allow_headerless = allow_headerless
        self._last_added = 0
        super().__init__(fs, queue_size, reset)

    def add(self, msg: object, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Store an input's message; forward the set that it completes, if any."""
        try:
            stamp: Time = msg.header.stamp  # type: ignore[attr-defined]
        except AttributeError:
            instead = _stamp_of(msg, self.allow_headerless)
            if instead is None:
                return
            stamp = instead

        nanoseconds = stamp.to_nsec()
        with self.lock:
            is_stale = self.enable_reset and self._reset_if_time_jumped(my_queue, my_queue_index)
            if isinstance(my_queue, StampQueue):
                my_queue.put(nanoseconds, stamp, msg)
                waiting = len(my_queue.order)
            else:
                my_queue[stamp] = msg
                waiting = len(my_queue)
            now = _now()
            if now < self._last_added:
                rospy.loginfo("ApproximateTimeSynchronizer: Detected jump back in time. Clearing buffer.")
                for queue in self.queues:
                    queue.clear()
            self._last_added = now
            if waiting > self.queue_size:
                _keep_newest(my_queue, self.queue_size)
                if my_queue_index is not None and stamp not in my_queue:
                    # The queue was full, and the new message was the oldest, so it has been removed.
                    return
            if is_stale:
                return

            # Skip the search if an input has no messages, the most frequent case.
            if self.queues is self._stamp_queues and not all(self._orders):
                return
            found = self._match(my_queue_index, nanoseconds)
            if found:
                self.signalMessage(*found)

    @property
    def last_added(self) -> Time:
        """Return the arrival time of the last message."""
        return rospy.Time(*divmod(self._last_added, 1_000_000_000))

    def _match(self, my_queue_index: int | None, nanoseconds: int) -> list[object]:
        """Remove the set that a timestamp completes from the queues; return its messages, or [] if there is no set."""
        # Use ``_stamp_queues``: a subclass may have replaced ``queues`` with a list of dicts.
        queues = self._stamp_queues
        if self.queues is not queues:
            queues = [queue if isinstance(queue, StampQueue) else StampQueue(queue) for queue in self.queues]
        found = closest_stamps(queues, nanoseconds, self.slop.to_nsec(), my_queue_index)
        if found is None:
            return []
        if self.queues is queues:
            return [queue.take(each) for queue, each in zip(queues, found, strict=True)]
        return [
            queue.pop(kept.stamp_at(each))
            for queue, kept, each in zip(self.queues, queues, found, strict=True)
        ]


def _stamp_of(message: object, allow_headerless: bool) -> Time | None:
    """Return a message's timestamp. Without a header, return the current time, or log a warning and return None."""
    try:
        stamp: Time = message.header.stamp  # type: ignore[attr-defined]
    except AttributeError:
        pass
    else:
        return stamp
    if allow_headerless:
        return rospy.Time.now()
    rospy.logwarn(_NO_HEADER)
    return None


def _now() -> int:
    """Return the node's time in nanoseconds. Raise ROSInitException if init_node has not been called."""
    session = current_session()
    return session.clock.now() if session.has_time else rospy.Time.now().to_nsec()


def _keep_newest(queue: Queue, size: int) -> None:
    """Remove a queue's oldest messages until at most ``size`` are left."""
    if isinstance(queue, StampQueue):
        queue.keep_newest(size)
    else:
        while len(queue) > size:
            del queue[min(queue)]
