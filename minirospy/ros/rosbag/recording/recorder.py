"""The node that records topics: `rosbag record`. Messages are written as received, without deserializing.

The workers that receive messages write them into the current chunk; complete chunks are queued for the disk thread.
Therefore, only the disk limits the recording rate. If the disk is too slow, messages are dropped and counted per topic.
Source: http://wiki.ros.org/rosbag/Commandline#record.
"""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from minirospy import client
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import BagFormatError, MasterUnreachableError, RpcError
from minirospy.client.session import current_session
from minirospy.core.idl.protocols import Message
from minirospy.ros.rosbag.recording.bag_file import BagFile
from minirospy.ros.rosbag.recording.disk import DiskThread
from minirospy.ros.rosbag.recording.frames import ReceivedFrame, parts_of
from minirospy.ros.rosbag.recording.options import RecordOptions, topic_filter
from minirospy.ros.rosbag.recording.splits import Next, Splits, file_name

__all__ = ["Recorder"]

_TICK_SECONDS = 0.25
_POLL_SECONDS = 1.0
_REPORT_SECONDS = 5.0
_SPACE_SECONDS = 20.0
_TIME_SECONDS = 2.0
_PATIENCE_SECONDS = 2.0


class _Topic:
    """A recorded topic: its subscriber and the number of messages still to record (-1: no limit)."""

    def __init__(self, name: str, left: int) -> None:
        self.name = name
        self.left = left
        self.subscriber: client.Subscriber[ReceivedFrame] | None = None


class Recorder:
    """Records topics in :meth:`run` with this process's node. Call init_node() first.

    Raise UsageError if an expression in ``options`` is invalid.
    """

    def __init__(self, options: RecordOptions) -> None:
        self.options = options
        self.status = 0  # 1 after a failure such as a disk error
        self.dropped: Counter[str] = Counter()  # messages dropped per topic because of a slow disk
        self._matches = topic_filter(options)
        self._matches_node = topic_filter(options, subscribed_by_node=True)
        self._topics: dict[str, _Topic] = {}
        self._lock = threading.Lock()
        self._stop = SignalSafeEvent()
        self._finished = SignalSafeEvent()
        self._file: BagFile | None = None
        self._is_complete = False
        self._latched: dict[tuple[str, str], tuple[Mapping[str, str], list[bytes]]] = {}
        self._reported: Counter[str] = Counter()
        self._clock: Callable[[], int] = time.time_ns
        self._announcement: client.Publisher[Message] | None = None

    def stop(self) -> None:
        """Make :meth:`run` complete the file and return. Thread-safe."""
        self._stop.set()

    def run(self) -> int:
        """Record until the node shuts down or a limit from the options is reached; return the exit status."""
        client.on_shutdown(self.stop)
        if self.options.publish:
            from std_msgs.msg import String

            self._announcement = client.Publisher("begin_write", String, latch=True, queue_size=1)
        if not self._wait_for_time():
            return 0
        if self.options.node:
            client.loginfo("Recording from: %s", self.options.node)

        workers = os.cpu_count() or 1
        self._executor = ThreadPoolExecutor(workers) if self.options.compression != "none" else None
        self._disk = DiskThread(self._disk_thread_failed)
        self._splits = Splits(self.options, self._clock())
        # Complete the file in a separate thread: Ctrl-C does not interrupt it, and the process waits for it to end.
        finisher = threading.Thread(target=self._finish, name="rosbag-finisher")
        finisher.start()
        is_interrupted = False
        try:
            with self._lock:
                self._open(self._clock())
            if self._file and self._check_space():
                self._record()
        except KeyboardInterrupt:
            # A second Ctrl-C, or a shutdown that interrupted a registration.
            is_interrupted = True
        finally:
            self._stop.set()
            self._wait_until_complete(is_interrupted)
        return self.status

    # --- called in the main thread

    def _wait_for_time(self) -> bool:
        """Wait until ROS time is valid; return False at shutdown."""
        if not client.is_wallclock():
            self._clock = lambda: client.get_rostime().to_nsec()
            is_reported = False
            start = time.monotonic()
            while not self._clock() and not wait_for_event(self._stop, 0.01):
                if time.monotonic() - start > _TIME_SECONDS and not is_reported:
                    is_reported = True
                    client.logwarn(
                        "/use_sim_time set to true and no clock published.  Still waiting for valid time..."
                    )
        return not self._stop.is_set()

    def _record(self) -> None:
        if not self.options.regex:
            for name in self.options.topics:
                self._subscribe(client.resolve_name(name))

        now = time.monotonic()
        next_poll, next_report, next_space = now, now + _REPORT_SECONDS, now + _SPACE_SECONDS
        while not self._stop.is_set():
            now = time.monotonic()
            if self.options.follows_master and now >= next_poll:
                self._follow_master()
                next_poll = now + _POLL_SECONDS
            if now >= next_report:
                self._report_drops()
                next_report = now + _REPORT_SECONDS
            if now >= next_space:
                self._check_space()
                next_space = now + _SPACE_SECONDS
            with self._lock:
                if self._file:
                    self._file.write_ready()
                if self.options.max_duration:
                    self._split(self._clock())
            if self.options.limit:
                self._end_finished()
            wait_for_event(self._stop, _TICK_SECONDS)

    def _subscribe(self, name: str) -> None:
        if name in self._topics:
            return
        client.loginfo("Subscribing to %s", name)
        topic = self._topics[name] = _Topic(name, self.options.limit or -1)
        topic.subscriber = client.Subscriber(
            name,
            ReceivedFrame,
            self._receive,
            callback_args=topic,
            tcp_nodelay=self.options.tcp_nodelay,
        )

    def _follow_master(self) -> None:
        """Subscribe to topics that are new in the master's list."""
        master = current_session().master
        try:
            state = master.get_system_state()
        except (MasterUnreachableError, RpcError):
            return
        if self.options.all_topics or self.options.regex:
            for name in state.publishers:
                if self._matches(name):
                    self._subscribe(name)
        if self.options.node:
            node = client.resolve_name(self.options.node)
            for name, subscribers in state.subscribers.items():
                if node in subscribers and self._matches_node(name):
                    self._subscribe(name)

    def _check_space(self) -> bool:
        """Return whether enough disk space is left.

        Warn if there is little, and stop recording if there is less than the minimum.
        """
        file, least, text = self._file, self.options.min_space, self.options.min_space_text
        if not file:
            return False

        try:
            free = shutil.disk_usage(Path(file.active_name).absolute().parent).free
        except OSError as error:
            client.logwarn("Failed to check filesystem stats [%s].", error.strerror)
            return True

        if free < least:
            client.logerr(
                "Less than %s of space free on disk with %s. Disabling recording.", text, file.active_name
            )
            self.status = 1
            self._stop.set()
            return False

        if free < 5 * least:
            client.logwarn("Less than 5 x %s of space free on disk with '%s'.", text, file.active_name)
        return True

    def _report_drops(self) -> None:
        """Log the messages dropped since the last report."""
        with self._lock:
            new = self.dropped - self._reported
            self._reported = self.dropped.copy()
        if new:
            client.logwarn("rosbag record buffer exceeded.  Dropped messages: %s", _counts(new))

    def _end_finished(self) -> None:
        """Unsubscribe from topics that have reached their message limit; stop recording when all topics have reached it."""
        for topic in self._topics.values():
            if not topic.left and topic.subscriber:
                topic.subscriber.unregister()
                topic.subscriber = None
        if self._topics and not any(topic.left for topic in self._topics.values()):
            self._stop.set()

    def _wait_until_complete(self, is_interrupted: bool) -> None:
        """Wait until the file is complete. A second Ctrl-C does not interrupt the wait; a third one ends the process.

        Log how much is still to be written: on each Ctrl-C, and once if the wait is long.
        """
        patience = time.monotonic() + _PATIENCE_SECONDS
        # Do not join() the thread: on Python 3.10 and 3.11, an interrupted join() marks the thread as finished.
        while not self._finished.is_set():
            try:
                # Calling is_shutdown() marks this loop as clean-up code, so that the shutdown does not interrupt it.
                client.is_shutdown()
                if is_interrupted or time.monotonic() > patience:
                    is_interrupted, patience = False, math.inf
                    client.logwarn("%d MB are still to be written", self._disk.pending // 10**6)
                wait_for_event(self._finished, _TICK_SECONDS)
            except KeyboardInterrupt:
                is_interrupted = True

    # --- called in the finisher thread

    def _finish(self) -> None:
        """Wait for the recording to stop, then complete the file."""
        try:
            self._stop.wait()
            self._complete()
        finally:
            self._finished.set()

    def _complete(self) -> None:
        with self._lock:
            self._close()
            self._is_complete = True
        self._disk.close()
        if self._executor:
            self._executor.shutdown()
        self._report_drops()
        if self.dropped:
            client.logwarn("The bag lacks messages that were dropped: %s", _counts(self.dropped))

    # --- called with the lock held

    def _open(self, now: int) -> None:
        if self._is_complete:
            return
        name = file_name(self.options, self._splits.count, time.time())
        try:
            self._file = BagFile(
                name, self.options, self._disk, self._lock, self._executor, self._disk_failed
            )
        except OSError as error:
            client.logerr(
                "Error writing: Error opening file: %s.active (%s)", name, error.strerror or str(error)
            )
            self.status = 1
            self._stop.set()
            return

        client.loginfo("Recording to '%s'.", name)
        # Latched messages were received before this file was opened: record them at its start time.
        for (topic, _), (header, parts) in self._latched.items():
            self._file.write(topic, header, now, *parts)
        if self._announcement:
            self._announcement.publish(self._announcement.data_class(name))

    def _waiting(self, file: BagFile) -> int:
        """Return the number of bytes not yet on disk."""
        return self._disk.pending + file.gathered

    def _close(self) -> None:
        file, self._file = self._file, None
        if file:
            client.loginfo("Closing '%s'.", file.name)
            file.close()

    def _split(self, now: int) -> None:
        """Continue in the next file if a limit has been reached."""
        while self._file:
            action = self._splits.check(self._file.size, now)
            if action is Next.CONTINUE:
                return
            name = self._file.name
            self._close()
            if action is Next.END:
                self._stop.set()
                return
            for surplus in self._splits.closed(name):
                self._disk.submit(partial(_remove, surplus))
            self._open(now)

    # --- called in the worker threads that receive messages

    def _receive(self, message: ReceivedFrame, topic: _Topic) -> None:
        now = self._clock()
        header = message._connection_header
        parts = parts_of(message.frame)
        with self._lock:
            if not self._file or not topic.left:
                return
            if topic.left > 0:
                topic.left -= 1
            self._split(now)
            if not self._file:
                return

            if self.options.repeat_latched and header.get("latching") == "1":
                kept = [part if isinstance(part, bytes) else bytes(part) for part in parts]
                self._latched[topic.name, header.get("callerid", "")] = header, kept
            most = self.options.buffer_size
            size = sum(map(len, parts))
            if most and self._waiting(self._file) + size > most:
                # Free memory by writing the chunks compressed so far, without waiting for the next message.
                self._file.write_ready()
                if (waiting := self._waiting(self._file)) and waiting + size > most:
                    self.dropped[topic.name] += 1
                    return
            try:
                self._file.write(topic.name, header, now, *parts)
            except BagFormatError as error:
                self.dropped[topic.name] += 1
                client.logerr("%s", error)

    # --- called in the disk thread

    def _disk_thread_failed(self, error: Exception) -> None:
        client.logerr("Error writing: %s. Recording ends", _reason(error))
        self.status = 1
        self._stop.set()

    def _disk_failed(self, file: BagFile, error: Exception, lost: int) -> None:
        why = _reason(error)
        if lost < 0:
            client.logerr("Error writing: %s: %s. `rosbag reindex` may save it", file.active_name, why)
        else:
            client.logerr(
                "Error writing: %s: %s. Recording ends; %d messages are lost, the bag has those before",
                file.name,
                why,
                lost,
            )
        with self._lock:
            if self._file is file:
                self._file = None
        self.status = 1
        self._stop.set()


def _reason(error: Exception) -> str:
    """Return a write failure's reason in one line."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def _counts(counter: Counter[str]) -> str:
    return ", ".join(f"{topic} {count}" for topic, count in counter.most_common())


def _remove(name: str) -> None:
    try:
        os.unlink(name)
    except OSError as error:
        with contextlib.suppress(OSError):
            client.logerr("Unable to remove %s: %s", name, error.strerror or str(error))
