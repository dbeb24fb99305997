"""tf2_py: the thread-safe buffer. It reads and returns messages. Source: http://wiki.ros.org/tf2_py."""

from __future__ import annotations

import logging
import threading
import time as clocks
from collections.abc import Callable

from geometry_msgs.msg import TransformStamped

from minirospy.base.errors import InvalidArgumentException
from minirospy.client.time import Time
from minirospy.core.tf2.buffer import DEFAULT_CACHE_TIME, TransformBuffer
from minirospy.core.tf2.insertion import Refusal, RefusalLog
from minirospy.core.tf2.listing import frames_as_dot, frames_as_yaml
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment, nanoseconds, transform_stamped

__all__ = ["BufferCore"]

_BILLION = 1_000_000_000
_NO_TIME = Time()
_log = logging.getLogger("rosout")


def _write(text: str, is_error: bool) -> None:
    _log.log(logging.ERROR if is_error else logging.WARNING, "%s", text)


class BufferCore:
    """The tree of frames, with the transforms of the last ``cache_time`` (a Duration; default: 10 s).

    Stamps are exact; the real tf2_py rounds them to the precision of a float in seconds (about 0.2 us today).
    Rejected transforms are logged with a count, at most once a second per frame and error.
    """

    def __init__(self, cache_time: Moment | None = None) -> None:
        self._lock = threading.RLock()
        self._refused: list[Refusal] = []
        self._refusals = RefusalLog(_write, clocks.monotonic)
        self._tree = TransformBuffer(
            DEFAULT_CACHE_TIME if cache_time is None else nanoseconds(cache_time), self._refused.append
        )
        self._changed: tuple[Callable[[], object], ...] = ()

    # --- inserting transforms

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Insert a transform that the node ``authority`` published."""
        self._insert(transform, authority, False)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Insert a static transform, which is valid at all times."""
        self._insert(transform, authority, True)

    def insert_message(self, data: bytes, authority: str, is_static: bool = False) -> None:
        """Insert a serialized TFMessage. If earlier messages had the same layout, decode it only when a lookup needs it.

        The real tf2_py has no such method. Raise DeserializationError if the bytes are invalid.
        """
        with self._lock:
            self._tree.insert_message(data, authority, is_static=is_static)
        self._after_insertion()

    def clear(self) -> None:
        """Remove all transforms except static ones."""
        with self._lock:
            self._tree.clear()

    # --- lookups

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Moment) -> TransformStamped:
        """Return the pose of ``source_frame`` in ``target_frame`` at ``time``; time 0 means the latest common time.

        Raise LookupException if a frame is unknown, ConnectivityException if the frames are not connected,
        ExtrapolationException if there is no data for ``time``, InvalidArgumentException if a frame name is invalid.
        """
        stamp = nanoseconds(time)
        _check_names(target_frame, source_frame)
        with self._lock:
            found = self._tree.lookup(target_frame, source_frame, stamp)
        if self._refused:
            self._report()
        return transform_stamped(target_frame, source_frame, found)

    def lookup_transform_full_core(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> TransformStamped:
        """Return the pose of ``source_frame`` at ``source_time``, relative to ``target_frame`` at ``target_time``.

        ``fixed_frame`` is assumed not to move between the two times. Raise the same exceptions as
        :meth:`lookup_transform_core`.
        """
        stamps = nanoseconds(target_time), nanoseconds(source_time)
        _check_names(target_frame, source_frame, fixed_frame)
        with self._lock:
            found = self._tree.lookup_full(target_frame, stamps[0], source_frame, stamps[1], fixed_frame)
        if self._refused:
            self._report()
        return transform_stamped(target_frame, source_frame, found)

    def can_transform_core(self, target_frame: str, source_frame: str, time: Moment) -> tuple[int, str]:
        """Return (1, "") if a lookup would succeed, otherwise (0, the reason)."""
        stamp = nanoseconds(time)
        _check_names(target_frame, source_frame)
        return self._possible(lambda: self._tree.why_not(target_frame, source_frame, stamp))

    def can_transform_full_core(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> tuple[int, str]:
        """Return (1, "") if a lookup with a fixed frame would succeed, otherwise (0, the reason)."""
        stamps = nanoseconds(target_time), nanoseconds(source_time)
        _check_names(target_frame, source_frame, fixed_frame)
        return self._possible(
            lambda: self._tree.why_not_full(target_frame, stamps[0], source_frame, stamps[1], fixed_frame)
        )

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """Return the latest time at which a lookup succeeds, or zero if all transforms between the frames are static.

        Raise LookupException if a frame is unknown, InvalidArgumentException if a frame name is invalid, TransformException if
        the frames are not connected.
        """
        _check_names(target_frame, source_frame)
        with self._lock:
            return Time(*divmod(self._tree.latest_common_time(target_frame, source_frame), _BILLION))

    # --- known frames

    def all_frames_as_yaml(self, time: Moment | float = 0.0) -> str:
        """Return each frame's parent, broadcaster, rate and times; ``time`` has no effect, as in real ROS."""
        with self._lock:
            return frames_as_yaml(self._tree)

    def all_frames_as_string(self) -> str:
        """Return one line of text for each frame that has a parent."""
        with self._lock:
            return self._tree.frames_as_string()

    def _allFramesAsDot(self, time: Moment = _NO_TIME) -> str:
        """Return the frame tree as a graphviz graph. If a time is given, include the age of each frame."""
        stamp = nanoseconds(time)
        with self._lock:
            return frames_as_dot(self._tree, stamp)

    def _chain(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> list[str]:
        stamps = nanoseconds(target_time), nanoseconds(source_time)
        with self._lock:
            return self._tree.chain(target_frame, stamps[0], source_frame, stamps[1], fixed_frame)

    def _frameExists(self, frame_id: str) -> bool:
        with self._lock:
            return self._tree.frame_exists(frame_id)

    def _getFrameStrings(self) -> list[str]:
        with self._lock:
            return self._tree.frame_names()

    # --- internal

    def on_change(self, function: Callable[[], object]) -> Callable[[], None]:
        """Call ``function`` after each insertion, in the inserting thread. Return a function that unregisters it."""
        with self._lock:
            self._changed = (*self._changed, function)

        def end() -> None:
            with self._lock:
                self._changed = tuple(each for each in self._changed if each is not function)

        return end

    def _insert(self, message: TransformStamped, authority: str, is_static: bool) -> None:
        header, where, turn = message.header, message.transform.translation, message.transform.rotation
        parent, child = header.frame_id, message.child_frame_id
        _check_names(parent, child)
        if not isinstance(authority, str):
            kind = None if authority is None else type(authority).__name__
            raise TypeError(f"argument 2 must be str, not {kind}")
        with self._lock:
            self._tree.insert(
                parent,
                child,
                nanoseconds(header.stamp),
                # Convert to floats: a lookup returns floats even if integers or numpy numbers were inserted.
                (float(where.x), float(where.y), float(where.z)),
                (float(turn.x), float(turn.y), float(turn.z), float(turn.w)),
                authority,
                is_static=is_static,
            )
        self._after_insertion()

    def _after_insertion(self) -> None:
        if self._refused:
            self._report()
        for function in self._changed:
            function()

    def _possible(self, why_not: Callable[[], str | None]) -> tuple[int, str]:
        try:
            with self._lock:
                why = why_not()
        except InvalidArgumentException as error:
            self._refusals(Refusal("", str(error), str(error), False))
            return 0, ""
        if self._refused:
            self._report()
        return int(why is None), why or ""

    def _report(self) -> None:
        """Log rejected transforms. Do not hold the lock meanwhile, because a log handler may look up transforms."""
        with self._lock:
            refused = self._refused[:]
            del self._refused[: len(refused)]
        for refusal in refused:
            self._refusals(refusal)


def _check_names(*names: str) -> None:
    for number, name in enumerate(names, 1):
        if not isinstance(name, str):
            raise TypeError(f"argument {number} must be str, not {type(name).__name__}")
