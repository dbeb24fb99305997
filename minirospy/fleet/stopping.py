"""Stops a robot when velocity commands stop arriving, by publishing a zero velocity, like the dashboard.

Only streams of commands are guarded; a single velocity stays in effect, as it does without a gateway. The guard's thread
publishes the zero velocity, so a blocked event loop does not prevent it.
"""

from __future__ import annotations

import contextlib
import logging
import math
import struct
import threading
import time
from collections.abc import Callable

from minirospy.base.errors import ROSException
from minirospy.fleet.rules import STOP_SECONDS
from minirospy.runtime.stop_guard import StopGuard
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["CommandStream", "at_rest"]

_log = logging.getLogger(__name__)
_TWIST = struct.Struct("<6d")
_HEADER = 16
"""Size in bytes of a header with an empty frame id: sequence number, stamp, and length of the frame id."""


def at_rest(type_: str, body: bytes) -> bytes | None:
    """Return ``body`` with all velocities set to zero, or None if they are zero, ``body`` is invalid, or the type has none."""
    find = _FIELDS.get(type_)
    if find is None:
        return None
    try:
        parts = find(body)
    except struct.error:
        return None
    rest = bytearray(body)
    moves = False
    for start, end, format_ in parts:
        if end > len(body):
            return None
        moves = moves or any(
            struct.unpack(f"<{(end - start) // struct.calcsize(format_)}{format_}", body[start:end])
        )
        rest[start:end] = bytes(end - start)
    return bytes(rest) if moves else None


_Part = tuple[int, int, str]  # (start offset, end offset, struct format) of consecutive numbers in a message


def _twist(_: bytes) -> list[_Part]:
    return [(0, _TWIST.size, "d")]


def _twist_stamped(body: bytes) -> list[_Part]:
    start = _after_header(body)
    return [(start, start + _TWIST.size, "d")]


def _joy(body: bytes) -> list[_Part]:
    parts: list[_Part] = []
    end = _after_header(body)
    for format_ in "fi":
        (count,) = struct.unpack_from("<I", body, end)
        start = end + 4
        end = start + 4 * count
        parts.append((start, end, format_))
    return parts


def _after_header(body: bytes) -> int:
    (length,) = struct.unpack_from("<I", body, _HEADER - 4)
    return _HEADER + int(length)


_FIELDS: dict[str, Callable[[bytes], list[_Part]]] = {
    "geometry_msgs/Twist": _twist,
    "geometry_msgs/TwistStamped": _twist_stamped,
    "sensor_msgs/Joy": _joy,
}


class CommandStream:
    """Publishes the commands on one topic in order, then zero velocity when a stream of commands stops. Thread-safe."""

    def __init__(
        self,
        topic: str,
        type_: str,
        publish: Callable[[bytes], None],
        seconds: float = STOP_SECONDS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._topic = topic
        self._type = type_
        self._publish = publish
        self._seconds = seconds
        self._clock = clock
        self.guard = StopGuard(clock)
        self._logger = RateLimitedLogger(_log)
        self._lock = threading.Lock()
        self._rest: bytes | None = None
        self._last = -math.inf
        self._deadline = math.inf

    @staticmethod
    def guards(type_: str) -> bool:
        """Return whether messages of this type are velocity commands."""
        return type_ in _FIELDS

    def publish(self, body: bytes) -> None:
        """Publish a velocity command."""
        now = self._clock()
        rest = at_rest(self._type, body)
        with self._lock:
            is_stream = now - self._last < self._seconds
            self._last, self._rest = now, rest
            self._deadline = now + self._seconds if rest is not None and is_stream else math.inf
            if self._deadline < math.inf:
                # Arm the guard before publishing, so that a stop follows every published command.
                self.guard.arm(self._silent, self._deadline)
            else:
                self.guard.disarm(self._silent)
            self._publish(body)

    def close(self) -> None:
        """Publish zero velocity if a stream is active. Idempotent."""
        self.guard.disarm(self._silent)
        with self._lock:
            self._stop()

    def _silent(self) -> None:
        """Publish zero velocity if no more commands arrive. Runs in the guard's thread."""
        with self._lock:
            if self._clock() < self._deadline:
                return  # another command has just arrived
            with contextlib.suppress(ROSException):  # the node has been shut down
                self._stop()
        self._logger.warning(
            "%s is stopped: no command came for %g s (fleet gateway --stop-after)", self._topic, self._seconds
        )

    def _stop(self) -> None:
        """Publish zero velocity if a stream has ended with a nonzero velocity. The caller must hold the lock."""
        rest, is_stream = self._rest, self._deadline < math.inf
        self._rest, self._deadline = None, math.inf
        if rest is not None and is_stream:
            self._publish(rest)
