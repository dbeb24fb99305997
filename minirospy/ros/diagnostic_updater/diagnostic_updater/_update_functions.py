"""Tasks that monitor the frequency of events, the age of time stamps, and whether the node is alive.

Source: http://wiki.ros.org/diagnostic_updater.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping

from minirospy import client as rospy
from minirospy.base import times
from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_status_wrapper import ERROR, OK, WARN
from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_updater import DiagnosticTask, Status

__all__ = [
    "FrequencyStatus",
    "FrequencyStatusParam",
    "Heartbeat",
    "TimeStampStatus",
    "TimeStampStatusParam",
]


class FrequencyStatusParam:
    """The limits of FrequencyStatus."""

    def __init__(self, freq_bound: Mapping[str, float], tolerance: float = 0.1, window_size: int = 5) -> None:
        """Set the limits. ``freq_bound`` maps "min" and optionally "max" to Hz, and is read at each run.

        ``tolerance``: the fraction by which a frequency may exceed the bounds; ``window_size``: the number of runs over
        which the frequency is measured.
        """
        self.freq_bound = freq_bound
        self.tolerance = tolerance
        self.window_size = window_size


class FrequencyStatus(DiagnosticTask):
    """Reports a warning if the frequency is out of bounds, or an error if no event occurred in the window."""

    def __init__(self, params: FrequencyStatusParam, name: str = "FrequencyStatus") -> None:
        super().__init__(name)
        self.params = params
        self.lock = threading.Lock()
        self.clear()

    def clear(self) -> None:
        """Reset the event counts."""
        with self.lock:
            size = self.params.window_size
            self.count = 0
            self.times = [rospy.Time.now()] * size
            self.seq_nums = [0] * size
            self.hist_indx = 0

    def tick(self) -> None:
        """Count an event."""
        with self.lock:
            self.count += 1

    def run(self, stat: Status) -> Status:
        """Fill a status from the events in the window."""
        with self.lock:
            now = rospy.Time.now()
            oldest = self.hist_indx
            events = self.count - self.seq_nums[oldest]
            window = (now - self.times[oldest]).to_sec()
            self.seq_nums[oldest], self.times[oldest] = self.count, now
            self.hist_indx = (oldest + 1) % self.params.window_size
            total = self.count

        # The window has no duration if a simulated clock has not advanced.
        frequency = events / window if window else math.inf if events else 0.0
        lowest = self.params.freq_bound["min"] * (1 - self.params.tolerance)
        highest = self.params.freq_bound.get("max", math.inf) * (1 + self.params.tolerance)
        if events == 0:
            stat.summary(ERROR, "No events recorded.")
        elif frequency < lowest:
            stat.summary(WARN, "Frequency too low.")
        elif frequency > highest:
            stat.summary(WARN, "Frequency too high.")
        else:
            stat.summary(OK, "Desired frequency met")

        stat.add("Events in window", events)
        stat.add("Events since startup", total)
        stat.add("Duration of window (s)", f"{window:f}")
        stat.add("Actual frequency (Hz)", f"{frequency:f}")
        self._add_bounds(stat, lowest, highest)
        return stat

    def _add_bounds(self, stat: Status, lowest: float, highest: float) -> None:
        bounds = self.params.freq_bound
        if "max" in bounds and bounds["min"] == bounds["max"]:
            stat.add("Target frequency (Hz)", f"{bounds['min']:f}")
        if bounds["min"] > 0:
            stat.add("Minimum acceptable frequency (Hz)", f"{lowest:f}")
        if "max" in bounds:
            stat.add("Maximum acceptable frequency (Hz)", f"{highest:f}")


class TimeStampStatusParam:
    """The accepted age of a timestamp on arrival, in seconds; a future timestamp has a negative age."""

    def __init__(self, min_acceptable: float = -1, max_acceptable: float = 5) -> None:
        self.max_acceptable = max_acceptable
        self.min_acceptable = min_acceptable


class TimeStampStatus(DiagnosticTask):
    """Reports timestamps that are zero, too old or too far in the future, and counts the runs that found any."""

    def __init__(self, params: TimeStampStatusParam | None = None, name: str = "Timestamp Status") -> None:
        super().__init__(name)
        self.params = TimeStampStatusParam() if params is None else params
        self.lock = threading.Lock()
        self.early_count = 0
        self.late_count = 0
        self.zero_count = 0
        self._forget()

    def _forget(self) -> None:
        self.zero_seen = False
        self.max_delta: float = 0
        self.min_delta: float = 0
        self.deltas_valid = False

    def tick(self, stamp: times.Time | float) -> None:
        """Count an event with its timestamp: a Time, or seconds."""
        seconds = stamp if isinstance(stamp, (int, float)) else stamp.to_sec()
        with self.lock:
            if seconds == 0:
                self.zero_seen = True
                return
            age = rospy.Time.now().to_sec() - seconds
            self.max_delta = max(age, self.max_delta) if self.deltas_valid else age
            self.min_delta = min(age, self.min_delta) if self.deltas_valid else age
            self.deltas_valid = True

    def run(self, stat: Status) -> Status:
        """Fill a status from the timestamps since the last run."""
        with self.lock:
            self._summarize(stat)
            for key, value in (
                ("Earliest timestamp delay:", f"{self.min_delta:f}"),
                ("Latest timestamp delay:", f"{self.max_delta:f}"),
                ("Earliest acceptable timestamp delay:", f"{self.params.min_acceptable:f}"),
                ("Latest acceptable timestamp delay:", f"{self.params.max_acceptable:f}"),
                ("Late diagnostic update count:", self.late_count),
                ("Early diagnostic update count:", self.early_count),
                ("Zero seen diagnostic update count:", self.zero_count),
            ):
                stat.add(key, value)
            self._forget()
        return stat

    def _summarize(self, stat: Status) -> None:
        stat.summary(OK, "Timestamps are reasonable.")
        if not self.deltas_valid:
            stat.summary(WARN, "No data since last update.")
            return
        if self.min_delta < self.params.min_acceptable:
            stat.summary(ERROR, "Timestamps too far in future seen.")
            self.early_count += 1
        if self.max_delta > self.params.max_acceptable:
            stat.summary(ERROR, "Timestamps too far in past seen.")
            self.late_count += 1
        if self.zero_seen:
            stat.summary(ERROR, "Zero timestamp seen.")
            self.zero_count += 1


class Heartbeat(DiagnosticTask):
    """Always reports OK and "Alive"."""

    def __init__(self) -> None:
        super().__init__("Heartbeat")

    def run(self, stat: Status) -> Status:
        """Set the status to OK and "Alive"."""
        stat.summary(OK, "Alive")
        return stat
