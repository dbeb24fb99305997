"""When a recording goes on in the next file, what the files are called, and which are removed. Pure."""

from __future__ import annotations

import enum
import time

from minirospy.ros.rosbag.recording.options import RecordOptions

__all__ = ["Next", "Splits", "file_name"]


_MAX_EMPTY = 100
"""Files without a message that a silence may leave, as in ROS."""


class Next(enum.Enum):
    """The step before a message is recorded."""

    CONTINUE = enum.auto()
    SPLIT = enum.auto()
    """Close the file, and go on in the next."""
    END = enum.auto()


class Splits:
    """The files of a recording that started at ``start``; times are ROS times in nanoseconds."""

    def __init__(self, options: RecordOptions, start: int) -> None:
        self._options = options
        self._start = start
        self._kept: list[str] = []
        self.count = 0
        """How many files have been closed."""

    def check(self, size: int, now: int) -> Next:
        """Return what to do with a file of ``size`` bytes. At SPLIT call it again: a long silence may end several."""
        options = self._options
        if options.max_size and size > options.max_size:
            return self._full()
        if options.max_duration and now - self._start > options.max_duration:
            if now - self._start > _MAX_EMPTY * options.max_duration:
                # The clock has jumped: a simulator's, or a machine's that was set.
                self._start = now - options.max_duration
            self._start += options.max_duration
            return self._full()
        return Next.CONTINUE

    def closed(self, name: str) -> list[str]:
        """Count a file that has been closed; return the names of those to be removed now, for ``--max-splits``."""
        self.count += 1
        if not self._options.max_splits:
            return []
        self._kept.append(name)
        # One more is being written.
        surplus = len(self._kept) - self._options.max_splits
        removed, self._kept = self._kept[: max(0, surplus)], self._kept[max(0, surplus) :]
        return removed

    def _full(self) -> Next:
        return Next.SPLIT if self._options.split else Next.END


def file_name(options: RecordOptions, count: int, now: float) -> str:
    """Return the name of file number ``count``, which is opened at ``now`` (seconds since 1970, local time is shown)."""
    parts = [options.prefix.removesuffix(options.extension)] if options.prefix else []
    if options.append_date:
        parts.append(time.strftime("%Y-%m-%d-%H-%M-%S", time.localtime(now)))
    if options.split:
        parts.append(str(count))
    return "_".join(parts) + options.extension
