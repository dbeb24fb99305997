"""Classes that measure rates, bandwidths and delays in user code, as subscribers' callbacks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.introspect.rates import (
    BandwidthWindow,
    DelayWindow,
    RateWindow,
    Spread,
    bandwidth_text,
    delay_text,
    rate_text,
)

if TYPE_CHECKING:
    from minirospy.client.topics import AnyMsg
    from minirospy.core.idl.protocols import Stamped

__all__ = ["ROSTopicBandwidth", "ROSTopicDelay", "ROSTopicHz"]

Statistics = tuple[float, float, float, float, int]


class ROSTopicHz:
    """Measures topic rates: ``rospy.Subscriber(topic, rospy.AnyMsg, hz.callback_hz, callback_args=topic)``.

    ``window_size`` is the number of latest messages to use (-1: all). If ``use_wtime``, the machine's clock is used
    instead of rospy's.
    """

    def __init__(
        self,
        window_size: float,
        filter_expr: Callable[[object], bool] | None = None,
        use_wtime: bool = False,
    ) -> None:
        self.lock = threading.Lock()
        self.window_size = int(max(window_size, 0))
        self.filter_expr = filter_expr
        self.use_wtime = use_wtime
        self._windows: dict[str | None, RateWindow] = {}

    def callback_hz(self, m: object, topic: str | None = None) -> None:
        """Count a message."""
        if self.filter_expr is None or self.filter_expr(m):
            now = time.time() if self.use_wtime else _now()
            with self.lock:
                self._window(topic).add(now)

    def get_hz(self, topic: str | None = None) -> Statistics | None:
        """Return (rate, minimum interval, maximum interval, standard deviation, number of messages).

        Return None if no new message has arrived.
        """
        report = self._report(topic)
        return report and (report.rate, report.min, report.max, report.std_dev, report.window)

    def print_hz(self, topics: Sequence[str | None] = (None,)) -> None:
        """Print the rates: two lines for one topic, a table for several."""
        print(rate_text({str(topic): self._report(topic) for topic in topics}))

    def _report(self, topic: str | None) -> Spread | None:
        with self.lock:
            return self._window(topic).report()

    def _window(self, topic: str | None) -> RateWindow:
        return self._windows.setdefault(topic, RateWindow(self.window_size))


class ROSTopicBandwidth:
    """Measures a topic's bandwidth: ``rospy.Subscriber(topic, rospy.AnyMsg, bw.callback)``.

    ``times`` (seconds) and ``sizes`` (bytes) describe the latest ``window_size`` messages.
    """

    def __init__(self, window_size: int = 100) -> None:
        self.lock = threading.Lock()
        self.window_size = window_size or 100
        self.times: list[float] = []
        self.sizes: list[int] = []

    def callback(self, data: AnyMsg) -> None:
        """Count a message."""
        with self.lock:
            self.times.append(time.time())
            self.sizes.append(len(data._buff or b""))
            if len(self.times) > self.window_size:
                del self.times[0], self.sizes[0]

    def print_bw(self) -> None:
        """Print the bandwidth if at least two messages have arrived."""
        window = BandwidthWindow(self.window_size)
        with self.lock:
            for moment, size in zip(self.times, self.sizes, strict=True):
                window.add(moment, size)
        text = bandwidth_text({"": window.report(time.time())})
        if text:
            print(text)


class ROSTopicDelay:
    """Measures the delay of a topic's stamped messages: ``rospy.Subscriber(topic, Type, delay.callback_delay)``."""

    def __init__(self, window_size: int) -> None:
        self.lock = threading.Lock()
        self.window_size = int(max(window_size, 0))
        self._window = DelayWindow(self.window_size)

    def callback_delay(self, msg: Stamped) -> None:
        """Measure a message's delay; log an error if it has no header."""
        if not msg._has_header:
            import rospy

            rospy.logerr("msg does not have header")
            return
        now = _now()
        with self.lock:
            self._window.add(now, msg.header.stamp.to_sec())

    def get_delay(self) -> Statistics | None:
        """Return (mean, minimum, maximum, standard deviation, number of messages), or None if there is no new message."""
        report = self._report()
        return report and (report.mean, report.min, report.max, report.std_dev, report.window)

    def print_delay(self) -> None:
        """Print the delay if a new message has arrived."""
        report = self._report()
        if report:
            print(delay_text(report))

    def _report(self) -> Spread | None:
        with self.lock:
            return self._window.report()


def _now() -> float:
    # Import this late, because it is slow; a program that receives messages has already imported it with rospy.
    from minirospy.client import get_time

    return get_time()
