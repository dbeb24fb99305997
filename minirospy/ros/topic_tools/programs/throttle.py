"""throttle forwards a limited number of messages or bytes per second. drop drops X of every Y messages.

Parameters of throttle: ~lazy (subscribe only while the output has subscribers), ~wall_clock (use the machine's time, even
if the node's time is simulated), ~force_latch and ~force_latch_value (whether the output is latched, regardless of the
input).
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from minirospy import client as rospy
from minirospy.client.topics import AnyMsg
from minirospy.ros.topic_tools.programs.passing import Input, Output, base_name, checked_topic, flag, run_node

__all__ = ["ByteLimit", "Filter", "MessageLimit", "drop_main", "every", "main"]

_USAGE = """
usage:\x20
  throttle messages IN_TOPIC MSGS_PER_SEC [OUT_TOPIC]]
OR
  throttle bytes IN_TOPIC BYTES_PER_SEC WINDOW [OUT_TOPIC]]

  This program will drop messages from IN_TOPIC so that either: the\x20
  average bytes per second on OUT_TOPIC, averaged over WINDOW\x20
  seconds, remains below BYTES_PER_SEC, or: the minimum inter-message
  period is 1/MSGS_PER_SEC. The messages are output\x20
  to OUT_TOPIC, or (if not supplied), to IN_TOPIC_throttle.

"""
_DROP_USAGE = """
usage: drop IN_TOPIC X Y [OUT_TOPIC]

 This program will drop X out of every Y messages from IN_TOPIC,
 forwarding the rest to OUT_TOPIC if given, else to a topic\x20
 named IN_TOPIC_drop

"""

Passes = Callable[[float, int], bool]
"""Takes the time in seconds and a message's size in bytes. Returns whether to forward the message; counts it if so."""


def main() -> int:
    """Run throttle; return its exit status."""
    return run_node(_USAGE, lambda words: f"{base_name(words[1])}_throttle", _prepare, range(3, 6))


def _prepare(words: Sequence[str]) -> Callable[[], Filter]:
    kind, source, *rest = words
    wanted = {"messages": 1, "bytes": 2}.get(kind)
    if wanted is None or not wanted <= len(rest) <= wanted + 1:
        raise ValueError("" if wanted is None else f"throttle {kind} takes {wanted + 1} words, and an output")
    numbers = [_positive(word) for word in rest[:wanted]]
    passes: Passes = (
        MessageLimit(1.0 / numbers[0]) if kind == "messages" else ByteLimit(int(numbers[0]), numbers[1])
    )
    target = checked_topic(rest[wanted]) if len(rest) > wanted else f"{checked_topic(source)}_throttle"
    return lambda: _start(source, target, passes)


def _start(source: str, target: str, passes: Passes) -> Filter:
    latch = bool(rospy.get_param("~force_latch_value", True)) if flag("force_latch") else None
    clock = time.time if flag("wall_clock") else rospy.get_time
    return Filter(source, target, passes, clock, is_lazy=flag("lazy"), latch=latch)


def drop_main() -> int:
    """Run drop; return its exit status."""
    return run_node(_DROP_USAGE, lambda words: f"{base_name(words[0])}_drop", _prepare_drop, range(3, 5))


def _prepare_drop(words: Sequence[str]) -> Callable[[], Filter]:
    source, dropped, of = checked_topic(words[0]), _count(words[1]), _count(words[2])
    if not of:
        raise ValueError("messages are dropped out of each 1 or more, not out of each 0")
    target = checked_topic(words[3]) if len(words) > 3 else f"{source}_drop"
    return lambda: Filter(source, target, every(dropped, of), rospy.get_time)


def _positive(word: str) -> float:
    try:
        number = float(word)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise ValueError(f"[{word}] is not a number above 0")
    return number


def _count(word: str) -> int:
    if not word.isdecimal():
        raise ValueError(f"[{word}] is not a number of messages")
    return int(word)


class MessageLimit:
    """Lets a message pass if the last one passed more than ``period`` seconds ago."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._last = 0.0

    def __call__(self, now: float, size: int) -> bool:
        """Return whether a message with ``size`` bytes at time ``now`` passes."""
        if self._last > now:
            rospy.logwarn("Detected jump back in time, resetting throttle period to now for.")
            self._last = now
        if now - self._last <= self._period:
            return False
        self._last = now
        return True


class ByteLimit:
    """Lets a message pass if fewer than ``limit`` bytes have passed in the last ``window`` seconds."""

    def __init__(self, limit: int, window: float) -> None:
        self._limit = limit
        self._window = window
        self._sent: deque[tuple[float, int]] = deque()

    def __call__(self, now: float, size: int) -> bool:
        """Return whether a message with ``size`` bytes at time ``now`` passes."""
        while self._sent and self._sent[0][0] < now - self._window:
            self._sent.popleft()
        if sum(size for _, size in self._sent) >= self._limit:
            return False
        self._sent.append((now, size))
        return True


def every(dropped: int, of: int) -> Passes:
    """Return a function that drops the first ``dropped`` of every ``of`` messages."""
    seen = 0

    def passes(now: float, size: int) -> bool:
        nonlocal seen
        number, seen = seen, seen + 1
        if seen >= of:
            seen = 0
        return number >= dropped

    return passes


class Filter:
    """Forwards the messages that a function selects, unchanged."""

    def __init__(
        self,
        source: str,
        target: str,
        passes: Passes,
        clock: Callable[[], float],
        *,
        is_lazy: bool = False,
        latch: bool | None = None,
    ) -> None:
        self._passes = passes
        self._clock = clock
        self._is_lazy = is_lazy
        # Guards opening and closing the input: a subscriber that arrives while the input is being closed then reopens it.
        self._lock = threading.Lock()

        self._output = Output(
            target,
            latch=latch,
            on_subscriber=self._subscribed,
            on_advertised=lambda: print(f"advertised as {target}", flush=True),
        )
        self._input = Input(source, self._received)
        self._input.open()

    def _advertised(self) -> None:
        print(f"advertised as {self._output.topic}", flush=True)

    def _subscribed(self) -> None:
        with self._lock:
            if self._is_lazy:
                self._input.open()

    def _received(self, message: AnyMsg) -> None:
        self._output.advertise(message)
        with self._lock:
            is_wanted = not self._is_lazy or self._output.has_subscribers
            if not is_wanted:
                self._input.close()
        if is_wanted and self._passes(self._clock(), len(message._buff or b"")):
            self._output.publish(message)
