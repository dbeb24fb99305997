"""Rate, bandwidth and delay of a topic over a window of messages.

Pure: takes arrival times (seconds) and sizes (bytes), returns statistics.
Source: http://wiki.ros.org/rostopic (hz, bw, delay).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

__all__ = [
    "Bandwidth",
    "BandwidthWindow",
    "DelayWindow",
    "RateWindow",
    "Spread",
    "bandwidth_text",
    "delay_text",
    "rate_text",
]

UNBOUNDED = 50000
"""Maximum number of messages in a window of unlimited size, which bounds the memory of a long measurement."""


_NOTHING = "no new messages"


class Spread(NamedTuple):
    """Statistics of times, in seconds: mean, minimum, maximum and standard deviation, and the number of messages."""

    mean: float
    min: float
    max: float
    std_dev: float
    window: int

    @property
    def rate(self) -> float:
        """Return the mean rate in Hz. The times must be periods between messages."""
        return 1.0 / self.mean if self.mean > 0 else 0.0


class Bandwidth(NamedTuple):
    """The bandwidth in bytes per second, and statistics of the message sizes in bytes."""

    rate: float
    mean: float
    min: int
    max: int
    window: int


class RateWindow:
    """Measures the periods between messages, for the newest ``size`` messages (0: no limit)."""

    def __init__(self, size: int = 0) -> None:
        self._pauses: deque[float] = deque(maxlen=max(1, (size or UNBOUNDED) - 1))
        self._last: float | None = None
        self._arrived = 0
        self._reported = 0

    def add(self, time: float) -> None:
        """Record a message's arrival time."""
        self._arrived += 1
        if self._last is not None and time >= self._last:
            self._pauses.append(time - self._last)
        elif self._last is not None:
            # The clock was set back, so later times cannot be compared with earlier ones.
            self._pauses.clear()
        self._last = time

    def report(self) -> Spread | None:
        """Return the statistics, or None if there are too few messages or none has arrived since the last report."""
        if self._arrived == self._reported or not self._pauses:
            return None
        self._reported = self._arrived
        return _spread(list(self._pauses), len(self._pauses) + 1)


class BandwidthWindow:
    """Measures message sizes, for the newest ``size`` messages."""

    def __init__(self, size: int = 0) -> None:
        self._messages: deque[tuple[float, int]] = deque(maxlen=size or 100)

    def add(self, time: float, size: int) -> None:
        """Record a message of ``size`` bytes."""
        self._messages.append((time, size))

    def report(self, now: float) -> Bandwidth | None:
        """Return the statistics, or None before the second message."""
        messages = list(self._messages)
        if len(messages) < 2:
            return None
        sizes = [size for _, size in messages]
        total = sum(sizes)
        seconds = max(now - messages[0][0], 1e-9)
        return Bandwidth(total / seconds, total / len(sizes), min(sizes), max(sizes), len(sizes))


class DelayWindow:
    """Measures the delay from a message's stamp to its arrival, for the newest ``size`` messages (0: no limit)."""

    def __init__(self, size: int = 0) -> None:
        self._delays: deque[float] = deque(maxlen=size or UNBOUNDED)
        self._arrived = 0
        self._reported = 0

    def add(self, time: float, stamp: float) -> None:
        """Record a message stamped ``stamp`` that arrived at ``time``, both in seconds."""
        self._arrived += 1
        self._delays.append(time - stamp)

    def report(self) -> Spread | None:
        """Return the statistics, or None if no message has arrived since the last report."""
        if self._arrived == self._reported:
            return None
        self._reported = self._arrived
        return _spread(list(self._delays), len(self._delays))


def rate_text(reports: Mapping[str, Spread | None]) -> str:
    """Return what `rostopic hz` prints once a second: two lines for a single topic, a table for several."""
    if len(reports) == 1:
        (report,) = reports.values()
        return f"average rate: {report.rate:.3f}\n\t{_extremes(report)}" if report else _NOTHING
    rows = [
        (name, *(_four_digits(number) for number in (r.rate, r.min, r.max, r.std_dev)), str(r.window))
        for name, r in reports.items()
        if r
    ]
    return _table(("topic", "rate", "min_delta", "max_delta", "std_dev", "window"), rows)


def delay_text(report: Spread | None) -> str:
    """Return what `rostopic delay` prints once a second."""
    return f"average delay: {report.mean:.3f}\n\t{_extremes(report)}" if report else _NOTHING


def bandwidth_text(reports: Mapping[str, Bandwidth | None]) -> str:
    """Return what `rostopic bw` prints once a second: two lines for one topic, a table for several, "" for none."""
    rows = [
        (
            name,
            f"{_bytes(r.rate, r.rate)}/s",
            *(_bytes(n, r.rate) for n in (r.mean, r.min, r.max)),
            str(r.window),
        )
        for name, r in reports.items()
        if r
    ]
    if len(reports) > 1:
        return _table(("topic", "bandwidth", "mean", "min", "max", "window"), rows)
    return "".join(
        f"average: {rate}\n\tmean: {mean} min: {low} max: {high} window: {window}"
        for _, rate, mean, low, high, window in rows
    )


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    if not rows:
        return _NOTHING
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    lines = ["   ".join(text.center(width) for text, width in zip(head, widths, strict=True)).rstrip()]
    lines.append("=" * (sum(widths) + 3 * (len(widths) - 1)))
    lines += ["   ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(lines) + "\n"


def _extremes(report: Spread) -> str:
    return (
        f"min: {report.min:.3f}s max: {report.max:.3f}s "
        f"std dev: {report.std_dev:.5f}s window: {report.window}"
    )


def _four_digits(number: float) -> str:
    return str(float(f"{number:.4g}"))


def _bytes(number: float, rate: float) -> str:
    """Format a number of bytes, using the unit that suits ``rate``."""
    unit, size = ("B", 1.0) if rate < 1e3 else ("KB", 1e3) if rate < 1e6 else ("MB", 1e6)
    return f"{number / size:.2f}{unit}"


def _spread(values: Sequence[float], window: int) -> Spread:
    mean = sum(values) / len(values)
    std_dev = math.sqrt(sum((value - mean) ** 2 for value in values) / len(values))
    return Spread(mean, min(values), max(values), std_dev, window)
