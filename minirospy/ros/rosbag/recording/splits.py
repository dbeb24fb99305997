"""Splits a recording into files: decides when to start the next file, how to name it, and which files to delete. Pure."""

from __future__ import annotations

import enum
import time

from minirospy.ros.rosbag.recording.options import RecordOptions

__all__ = ["Next", "Splits", "file_name"]


_MAX_EMPTY = 100  # maximum number of empty files to write after a long gap without messages, as in ROS


class Next(enum.Enum):
    """The action before a message is recorded."""

    CONTINUE = enum.auto()
    SPLIT = enum.auto()  # close the file and continue in the next one
    END = enum.auto()


class Splits:
    """Decides when to split a recording, which started at ``start``. Times are ROS times in nanoseconds."""

    def __init__(self, options: RecordOptions, start: int) -> None:
        self._options = options
        self._start = start
        self._kept: list[str] = []
        self.count = 0  # number of closed files

    def check(self, size: int, now: int) -> Next:
        """Return the action for a file with ``size`` bytes.

        After SPLIT, call this method again: several splits may be due after a time without messages.
        """
        options = self._options
        if options.max_size and size > options.max_size:
            return self._full()
        if options.max_duration and now - self._start > options.max_duration:
            if now - self._start > _MAX_EMPTY * options.max_duration:
                # The clock has jumped: a simulator was restarted or the system time was set.
                self._start = now - options.max_duration
            self._start += options.max_duration
            return self._full()
        return Next.CONTINUE

    def closed(self, name: str) -> list[str]:
        """Count a closed file; return the names of the files to delete now, according to ``--max-splits``."""
        self.count += 1
        if not self._options.max_splits:
            return []
        self._kept.append(name)
        # The list omits the file being written.
        surplus = len(self._kept) - self._options.max_splits
        removed, self._kept = self._kept[: max(0, surplus)], self._kept[max(0, surplus) :]
        return removed

    def _full(self) -> Next:
        return Next.SPLIT if self._options.split else Next.END


def file_name(options: RecordOptions, count: int, now: float) -> str:
    """Return the name of file number ``count``. ``now`` is its opening time in seconds since 1970."""
    parts = [options.prefix.removesuffix(options.extension)] if options.prefix else []
    if options.append_date:
        parts.append(time.strftime("%Y-%m-%d-%H-%M-%S", time.localtime(now)))
    if options.split:
        parts.append(str(count))
    return "_".join(parts) + options.extension
