"""The overhead of the ROS 2 bridge: small messages and images from a publisher on one side to a subscriber on the other.

Run it with minirospy's Python after `make ros2`, which installs ROS 2: python benchmarks/ros2.py [SECONDS]. It prints the
numbers of messages sent and lost, and the median and 99th percentile of the latency. Each kind of message is also measured
within ROS 1 and within ROS 2.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from struct import Struct
from typing import Any

ROOT = Path(__file__).parents[1]
INT64 = Struct("<q")
STAMP = Struct("<2I")
PIXELS = bytes(640 * 480 * 3)
IMAGE_OF_ROS1 = Struct("<4I2II4sBII")
IMAGE_OF_ROS2 = Struct("<4s2II4x2II5s3xII")
KINDS = {"5000 Int64/s": ("std_msgs/Int64", 5000.0), "30 VGA images/s": ("sensor_msgs/Image", 30.0)}
ROUTES = ("ros1 ros1", "ros2 ros2", "ros1 ros2", "ros2 ros1")


def main() -> None:
    if len(sys.argv) > 2:
        role, topic, type_, rate, seconds = sys.argv[1:]
        {"send1": send1, "send2": send2, "receive1": receive1, "receive2": receive2}[role](
            topic, type_, float(rate), float(seconds)
        )
        return
    seconds = sys.argv[1] if len(sys.argv) > 1 else "4"
    with contextlib.ExitStack() as parts:
        bridge(parts)
        print(f"{'':18}{'route':12}{'sent':>8}{'lost':>6}{'median ms':>11}{'p99 ms':>9}")
        for kind, (type_, rate) in KINDS.items():
            for number, route in enumerate(ROUTES):
                topic = f"/bench_{type_.rpartition('/')[2].lower()}_{number}"
                measured = measure(route, topic, type_, rate, seconds)
                print(f"{kind:18}{route.replace(' ', ' -> '):12}{measured}", flush=True)


def python(side: str) -> str:
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    return sys.executable if side == "1" else str(ROOT / "build" / f"ros2-{version}" / "bin" / "python")


def environment() -> dict[str, str]:
    return {
        "ROS_DOMAIN_ID": "83",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        "ROS_MASTER_URI": "http://localhost:21783",
    }


def bridge(parts: contextlib.ExitStack) -> None:
    for command in (
        [str(Path(sys.executable).with_name("roscore")), "-p", "21783"],
        [python("2"), "-c", "from minirospy.cli.main import main; main(['ros2-bridge'])"],
    ):
        program = subprocess.Popen(command, env=environment(), stdout=subprocess.DEVNULL)
        parts.callback(program.wait)
        parts.callback(program.terminate)


def measure(route: str, topic: str, type_: str, rate: float, seconds: str) -> str:
    """Return the results for a route. The receiver reports when it is connected, then the sender starts at full rate."""
    sender, receiver = route.split()
    words = [topic, type_, str(rate), seconds]

    def start(role: str, side: str) -> subprocess.Popen[str]:
        command = [python(side[-1]), __file__, f"{role}{side[-1]}", *words]
        return subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment()
        )

    with start("receive", receiver) as receiving, start("send", sender) as sending:
        assert receiving.stdout
        assert sending.stdin
        assert sending.stdout
        assert receiving.stdin
        assert receiving.stdout.readline() == "connected\n"
        print("go", file=sending.stdin, flush=True)
        first, count = json.loads(sending.stdout.readline())
        print("end", file=receiving.stdin, flush=True)
        took = sorted(each[1] for each in json.loads(receiving.stdout.readline()) if each[0] >= first)
    if not took:
        return f"{count:8}{count:6}"
    return f"{count:8}{count - len(took):6}{took[len(took) // 2] / 1e6:11.2f}{took[int(len(took) * 0.99)] / 1e6:9.2f}"


# --- messages, with the time at which they are sent


def message(side: int, type_: str, now: int) -> bytes:
    if type_ == "std_msgs/Int64":
        return (b"\0\1\0\0" if side == 2 else b"") + INT64.pack(now)
    stamp = divmod(now, 10**9)
    if side == 1:
        return IMAGE_OF_ROS1.pack(0, *stamp, 0, 480, 640, 4, b"bgr8", 0, 1920, len(PIXELS)) + PIXELS
    return IMAGE_OF_ROS2.pack(b"\0\1\0\0", *stamp, 1, 480, 640, 5, b"bgr8\0", 1920, len(PIXELS)) + PIXELS


def sent_at(side: int, type_: str, data: bytes | memoryview) -> int:
    if type_ == "std_msgs/Int64":
        return int(INT64.unpack_from(data, 4 if side == 2 else 0)[0])
    secs, nsecs = STAMP.unpack_from(data, 4)
    return int(secs * 10**9 + nsecs)


class Clock:
    """The times for sending: 20 times a second until the line `go` arrives, then at the given rate."""

    def __init__(self, rate: float, seconds: float) -> None:
        self._rate = rate
        self.count = int(rate * seconds)
        self.goes = threading.Event()
        self.first = 0
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        sys.stdin.readline()
        self.goes.set()

    def times(self) -> list[float]:
        time.sleep(0.5)
        self.first = time.time_ns()
        start = time.perf_counter()
        return [start + number / self._rate for number in range(self.count)]

    def report(self) -> None:
        time.sleep(1.5)
        print(json.dumps([self.first, self.count]), flush=True)


class Log:
    """The received messages, each with its send time and latency."""

    def __init__(self, side: int, type_: str) -> None:
        self._side, self._type = side, type_
        self.came: list[tuple[int, int]] = []

    def __call__(self, data: bytes | memoryview, *_: object) -> None:
        then = sent_at(self._side, self._type, data)
        self.came.append((then, time.time_ns() - then))
        if len(self.came) == 1:
            print("connected", flush=True)

    def report(self) -> None:
        print(json.dumps(self.came), flush=True)


# --- roles


def send1(topic: str, type_: str, rate: float, seconds: float) -> None:
    from minirospy import Node
    from minirospy.aio.raw import raw_class
    from minirospy.core.idl.load import message_class
    from minirospy.core.wire.tcpros import InterfaceType

    async def send() -> None:
        clock = Clock(rate, seconds)
        async with Node("sender", rosout=False) as node:
            made = raw_class(InterfaceType.of(message_class(type_)))
            publisher = await node.advertise(topic, made, queue_size=1000)
            while not clock.goes.is_set():
                publisher.publish_raw(message(1, type_, time.time_ns()))
                await asyncio.sleep(0.05)
            for due in clock.times():
                while (left := due - time.perf_counter()) > 0:
                    await asyncio.sleep(left if left > 0.001 else 0)
                publisher.publish_raw(message(1, type_, time.time_ns()))
            await asyncio.sleep(0.5)
            clock.report()

    asyncio.run(send())


def receive1(topic: str, type_: str, *_: float) -> None:
    from minirospy import Node

    async def receive() -> None:
        log = Log(1, type_)
        async with Node("receiver", rosout=False) as node:
            async with node.subscribe_raw(topic, log):
                await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
            log.report()

    asyncio.run(receive())


def send2(topic: str, type_: str, rate: float, seconds: float) -> None:
    node, class_ = node2(type_)
    publisher = node.create_publisher(class_, topic, 1000)
    clock = Clock(rate, seconds)
    while not clock.goes.is_set():
        publisher.publish(message(2, type_, time.time_ns()))
        time.sleep(0.05)
    for due in clock.times():
        left = due - time.perf_counter()
        if left > 0:
            time.sleep(left)
        publisher.publish(message(2, type_, time.time_ns()))
    clock.report()


def receive2(topic: str, type_: str, *_: float) -> None:
    import importlib

    node, class_ = node2(type_)
    log = Log(2, type_)

    def came(data: bytes) -> None:
        log(data)
        with subscription.handle:
            while taken := subscription.handle.take_message(class_, True):
                log(taken[0])

    subscription = node.create_subscription(class_, topic, came, 1000, raw=True)
    executor = importlib.import_module("rclpy.executors").SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    sys.stdin.readline()
    log.report()
    sys.stdout.flush()
    os._exit(0)


def node2(type_: str) -> tuple[Any, Any]:
    import importlib

    rclpy = importlib.import_module("rclpy")
    rclpy.init(args=[])
    package, _, name = type_.partition("/")
    node = rclpy.create_node("bench", enable_rosout=False, start_parameter_services=False)
    return node, getattr(importlib.import_module(f"{package}.msg"), name)


if __name__ == "__main__":
    main()
