"""The history of a frame's transforms: stores samples (stamp, parent, transform), and returns the sample at a given time.

Times are nanoseconds since the epoch; time 0 means the newest sample. Source: http://wiki.ros.org/tf2/Design.
"""

from __future__ import annotations

from bisect import bisect_left
from enum import Enum

from minirospy.core.tf2.rotation import slerp

__all__ = ["Frame", "Misfit", "Sample", "StaticCache", "TimeCache", "seconds"]

# Maximum number of expired samples before the lists are trimmed, because each trimming moves all samples
_COMPACT_ABOVE = 32


def seconds(nanoseconds: int) -> float:
    """Return a time in seconds, rounded as in C++. At present-day times, the rounding affects the last printed digits."""
    whole, rest = divmod(nanoseconds, 1_000_000_000)
    return whole + 1e-9 * rest


class Misfit(Enum):
    """The reason why a cache rejects a sample."""

    OLD = "TF_OLD_DATA ignoring data from the past (Possible reasons are listed at http://wiki.ros.org/tf/Errors%20explained)"
    REPEATED = "TF_REPEATED_DATA ignoring data with redundant timestamp"


class Frame:
    """A frame that occurs in a transform: its cache (None if it is only a parent), and the authority of its last sample."""

    __slots__ = ("authority", "cache", "name", "settled")

    def __init__(self, name: str) -> None:
        self.name = name
        self.cache: TimeCache | StaticCache | None = None
        self.authority = ""
        # number of messages that had arrived when this frame's messages were last decoded
        self.settled = 0


# Parent, translation x, y, z, and rotation x, y, z, w
Sample = tuple[Frame, float, float, float, float, float, float, float]


class TimeCache:
    """The samples from the last ``span`` nanoseconds, ordered by stamp, in parallel lists."""

    __slots__ = ("_first", "_samples", "_span", "_stamps")

    def __init__(self, span: int) -> None:
        self._span = span
        self._stamps: list[int] = []
        self._samples: list[Sample] = []
        self._first = 0  # index of the first sample that has not expired

    def __len__(self) -> int:
        return len(self._stamps) - self._first

    @property
    def newest(self) -> int:
        """The newest stamp, or 0 if there are no samples."""
        return self._stamps[-1] if self._stamps else 0

    @property
    def oldest(self) -> int:
        """The oldest stamp, or 0 if there are no samples."""
        return self._stamps[self._first] if self._stamps else 0

    def insert(self, stamp: int, sample: Sample) -> Misfit | None:
        """Insert a sample and drop samples older than the span. If the sample is rejected, return the reason."""
        stamps = self._stamps
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            self._samples.append(sample)
            if stamps[self._first] < stamp - self._span:
                self._expire(stamp - self._span)
            return None

        if stamps[-1] > stamp + self._span:
            return Misfit.OLD
        at = bisect_left(stamps, stamp, self._first)
        if stamps[at] == stamp:
            return Misfit.REPEATED
        stamps.insert(at, stamp)
        self._samples.insert(at, sample)
        return None

    def at(self, time: int) -> Sample | None:
        """Return the sample at ``time`` (0: the newest), interpolated between its neighbours, or None if there is none.

        If the neighbours have different parents, return the older one.
        """
        stamps = self._stamps
        if not stamps:
            return None
        newest = stamps[-1]
        if time in (newest, 0):
            return self._samples[-1]
        if time > newest or time < stamps[self._first]:
            return None

        at = bisect_left(stamps, time, self._first)
        newer, newer_stamp = self._samples[at], stamps[at]
        if newer_stamp == time:
            return newer
        older, older_stamp = self._samples[at - 1], stamps[at - 1]
        if older[0] is not newer[0]:
            return older
        ratio = (time - older_stamp) / (newer_stamp - older_stamp)
        rest = 1.0 - ratio
        return (
            older[0],
            rest * older[1] + ratio * newer[1],
            rest * older[2] + ratio * newer[2],
            rest * older[3] + ratio * newer[3],
            *slerp(older[4:], newer[4:], ratio),
        )

    def latest(self) -> tuple[int, Frame] | None:
        """Return the stamp and parent frame of the newest sample, or None if there are no samples."""
        return (self._stamps[-1], self._samples[-1][0]) if self._stamps else None

    def why_not(self, time: int) -> str:
        """Return the error message for a time without a sample, or "" if there are no samples at all."""
        if not self._stamps:
            return ""
        if len(self) == 1:
            return (
                f"Lookup would require extrapolation at time {seconds(time):.9f}, "
                f"but only time {seconds(self.newest):.9f} is in the buffer"
            )
        if time > self.newest:
            return (
                f"Lookup would require extrapolation {seconds(time - self.newest):.9f}s into the future.  "
                f"Requested time {seconds(time):.9f} but the latest data is at time {seconds(self.newest):.9f}"
            )
        return (
            f"Lookup would require extrapolation {seconds(self.oldest - time):.9f}s into the past.  "
            f"Requested time {seconds(time):.9f} but the earliest data is at time {seconds(self.oldest):.9f}"
        )

    def clear(self) -> None:
        """Drop all samples."""
        self._stamps.clear()
        self._samples.clear()
        self._first = 0

    def _expire(self, horizon: int) -> None:
        self._first = bisect_left(self._stamps, horizon, self._first)
        if self._first > _COMPACT_ABOVE and 2 * self._first > len(self._stamps):
            del self._stamps[: self._first]
            del self._samples[: self._first]
            self._first = 0


class StaticCache:
    """A single sample that is valid at any time, until another one replaces it."""

    __slots__ = ("_sample",)

    newest = oldest = 0

    def __init__(self, sample: Sample) -> None:
        self._sample = sample

    def __len__(self) -> int:
        return 1

    def insert(self, stamp: int, sample: Sample) -> None:
        """Replace the sample. The stamp is ignored."""
        self._sample = sample

    def at(self, time: int) -> Sample:
        """Return the only sample, at any ``time``."""
        return self._sample

    def latest(self) -> tuple[int, Frame]:
        """Return stamp 0 and the parent frame."""
        return 0, self._sample[0]

    def why_not(self, time: int) -> str:
        """Return "": a static transform is available at any time."""
        return ""

    def clear(self) -> None:
        """Do nothing: clearing a buffer keeps its static transforms."""
