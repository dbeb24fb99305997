"""tf_monitor: measures the delay of each frame's transforms, and the rate at which each node sends them.

Source: http://wiki.ros.org/tf#tf_monitor. Nodes are shown by name, as in the real program before tf2.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence

from minirospy import client as rospy
from minirospy.base.errors import DeserializationError, TransformException
from minirospy.base.escape import escaped
from minirospy.core.tf2.pending import read_transforms
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
from minirospy.ros.tf2_ros.tf2_ros.messages import LazyTFMessage
from minirospy.ros.tf2_ros.tools.program import ToolError, report, run_program

__all__ = ["Delays", "main"]

_USAGE = "TF_Monitor: usage: tf_monitor framea frameb"
_KEPT = 1000  # number of recent delays to average, and of recent messages to compute the rate from
_STEP = 0.01
_STEPS = 20  # number of measurements between two reports of the delay between two frames
_SMOOTHING = 0.01
_MIN_PERIOD = 1e-8


def main(words: Sequence[str] | None = None) -> int:
    """Run tf_monitor for all frames, or for the frames between two given ones; return the exit status."""
    return run_program(_run, words)


class Delays:
    """The delays of all frames and nodes. Performs no I/O: the caller passes the times, in seconds."""

    def __init__(self) -> None:
        self._sender: dict[str, str] = {}
        self._delays: dict[str, deque[float]] = {}
        self._node_delays: dict[str, deque[float]] = {}
        self._node_times: dict[str, deque[float]] = {}

    def add(self, sender: str, frames: Sequence[tuple[str, float]], now: float, *, is_static: bool) -> None:
        """Record a message from ``sender``: its child frames and their stamps. Static transforms have a delay of zero."""
        sender = sender + "(static)" * is_static
        late = [(child, 0.0 if is_static else now - stamp) for child, stamp in frames]
        for child, delay in late:
            self._sender[child] = sender
            self._delays.setdefault(child, deque(maxlen=_KEPT)).append(delay)
        average = sum(delay for _, delay in late) / max(len(late), 1)
        self._node_delays.setdefault(sender, deque(maxlen=_KEPT)).append(average)
        self._node_times.setdefault(sender, deque(maxlen=_KEPT)).append(now)

    def frame_lines(self, chain: Sequence[str] | None = None) -> Iterator[str]:
        """Yield a line for each frame, or only for the frames in ``chain`` if it is given."""
        for child in sorted(self._delays):
            if chain is None or child in chain:
                average, most = _average_and_most(self._delays[child])
                sender = self._sender[child]
                yield f"Frame: {child} published by {sender} Average Delay: {average:g} Max Delay: {most:g}"

    def node_lines(self) -> Iterator[str]:
        """Yield a line for each node that publishes transforms."""
        for sender in sorted(self._node_delays):
            average, most = _average_and_most(self._node_delays[sender])
            times = self._node_times[sender]
            rate = len(times) / max(times[-1] - times[0], _MIN_PERIOD)
            yield f"Node: {sender} {rate:g} Hz, Average Delay: {average:g} Max Delay: {most:g}"


def _average_and_most(delays: deque[float]) -> tuple[float, float]:
    return sum(delays) / len(delays), max(0.0, *delays)


def _run(words: Sequence[str]) -> None:
    if len(words) not in (0, 2):
        # The usage is logged at level INFO, as in ROS.
        report(_USAGE, "INFO")
        raise ToolError("")
    rospy.init_node("tf_monitor", anonymous=True)
    delays, lock = Delays(), threading.Lock()

    def take(message: LazyTFMessage, is_static: bool) -> None:
        try:
            found = read_transforms(message.raw or b"\0" * 4)
        except DeserializationError as error:
            rospy.logerr_throttle(1.0, f"a message on /tf is not a tf2_msgs/TFMessage: {error}")
            return
        frames = [(each.child, each.stamp / 1e9) for each in found]
        sender = message._connection_header.get("callerid", "unknown_publisher")
        with lock:
            delays.add(sender, frames, rospy.get_time(), is_static=is_static)

    pair = (words[0].removeprefix("/"), words[1].removeprefix("/")) if words else None
    buffer = Buffer()
    if pair:
        TransformListener(buffer)
        _wait_for_chain(buffer, *pair)
    for topic, is_static in (("/tf", False), ("/tf_static", True)):
        rospy.Subscriber(topic, LazyTFMessage, take, is_static, queue_size=100)

    chain: list[str] = []
    net = _Net()
    while not rospy.is_shutdown():
        for _ in range(_STEPS):
            if pair:
                net.look(buffer, *pair)
                chain = net.chain
            time.sleep(_STEP)
            if rospy.is_shutdown():
                return
        with lock:
            frames = [*delays.frame_lines(chain if pair else None)]
            nodes = [*delays.node_lines()]
        head = f"RESULTS: for {pair[0]} to {pair[1]}\n{net.lines()}" if pair else "RESULTS: for all Frames"
        _print("\n\n", head, "\nFrames:", *frames)
        print("\nAll Broadcasters:", file=sys.stderr, flush=True)
        _print(*nodes)


def _wait_for_chain(buffer: Buffer, source: str, target: str) -> None:
    print(
        f"Waiting for transform chain to become available between {source} and {target} ", end="", flush=True
    )
    while not rospy.is_shutdown():
        with contextlib.suppress(rospy.ROSTimeMovedBackwardsException):
            if buffer.can_transform(source, target, rospy.Time(), rospy.Duration(1)):
                break
        print(".", end="", flush=True)
    print(flush=True)


class _Net:
    """The moving average and the maximum of the delay between two frames."""

    def __init__(self) -> None:
        self.chain: list[str] = []
        self._average = self._most = 0.0

    def look(self, buffer: Buffer, source: str, target: str) -> None:
        try:
            found = buffer.lookup_transform(source, target, rospy.Time())
            self.chain = buffer._chain(target, rospy.Time(), source, rospy.Time(), source) or [source]
        except TransformException:
            return
        late = rospy.get_time() - found.header.stamp.to_sec() if found.header.stamp else 0.0
        self._average += _SMOOTHING * (late - self._average)
        self._most = max(self._most, late)

    def lines(self) -> str:
        return f"Chain is: {' -> '.join(self.chain)}\nNet delay     avg = {self._average:g}: max = {self._most:g}"


def _print(*lines: str) -> None:
    print(escaped("\n".join(lines), "\n"), flush=True)
