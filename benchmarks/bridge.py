"""`python benchmarks/bridge.py`: the cost of the bridge, compared with foxglove-sdk's server if it is installed, in one run.

Image: 640x480 RGB at 30 Hz to five clients. Topics: 1,000 at 1 Hz to one client. Latency: a client's additional delay compared
with a ROS subscriber. Stuck: ten clients of the image, one of which does not read. Soak: at least as many messages as an hour
of images, to five clients that connect and disconnect. The peer is a program with the same subscription and foxglove-sdk's
server (pip install foxglove-sdk), written in Rust. CPU is that of the server's process, in percent of one core.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import selectors
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import psutil

BIN = Path(sys.executable).parent
HELLO = (
    "GET / HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Reader:
    """A client that subscribes to all topics with a prefix and counts messages."""

    def __init__(self, port: int, prefix: str) -> None:
        self.sock = socket.create_connection(("127.0.0.1", port))
        self.messages = self.bytes = 0
        self.delays: list[int] = []
        self.subscribed = 0
        self._prefix = prefix
        self._asked = b""
        self._buffer = bytearray(1 << 20)
        self._start = self._end = 0
        self.sock.sendall(HELLO.format(port=port).encode())
        head = b""
        while b"\r\n\r\n" not in head:
            head += self.sock.recv(1)
        assert head.startswith(b"HTTP/1.1 101"), head

    def read(self) -> bool:
        """Read the received data; return whether the connection is open."""
        if self._end == len(self._buffer):
            rest = self._buffer[self._start : self._end]
            if len(rest) > len(self._buffer) // 2:
                self._buffer = bytearray(2 * len(self._buffer))
            self._buffer[: len(rest)] = rest
            self._start, self._end = 0, len(rest)
        count = self.sock.recv_into(memoryview(self._buffer)[self._end :])
        self._end += count
        self._frames()
        return bool(count)

    def _frames(self) -> None:
        view = self._buffer
        while self._end - self._start >= 2:
            at = self._start + 2
            length = view[self._start + 1]
            if length == 126:
                (length,), at = struct.unpack_from("!H", view, at), at + 2
            elif length == 127:
                (length,), at = struct.unpack_from("!Q", view, at), at + 8
            if self._end < at + length:
                break
            opcode = view[self._start] & 15
            if opcode == 2:
                self.messages += 1
                self.bytes += length
                if length == 21:
                    self.delays.append(time.monotonic_ns() - struct.unpack_from("<Q", view, at + 13)[0])
            elif opcode == 1:
                self._text(json.loads(bytes(view[at : at + length])))
            elif opcode == 9:
                self._send(0x8A, bytes(view[at : at + length]))
            self._start = at + length
        if self._start == self._end:
            self._start = self._end = 0

    def _text(self, fields: dict) -> None:
        if fields["op"] == "status" and "unknown channel" in fields["message"]:
            # foxglove-sdk may advertise a channel before it accepts subscriptions to it.
            time.sleep(0.05)
            self._send(0x81, self._asked)
        if fields["op"] != "advertise":
            return
        wanted = [each["id"] for each in fields["channels"] if each["topic"].startswith(self._prefix)]
        self.subscribed += len(wanted)
        subscriptions = [{"id": id_, "channelId": id_} for id_ in wanted]
        if wanted:
            self._asked = json.dumps({"op": "subscribe", "subscriptions": subscriptions}).encode()
            self._send(0x81, self._asked)

    def _send(self, opcode: int, data: bytes) -> None:
        size = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack("!H", len(data))
        if len(data) > 65535:
            size = b"\xff" + struct.pack("!Q", len(data))
        self.sock.sendall(bytes([opcode]) + size + bytes(4) + data)


def clients(port: int, prefix: str, count: int, seconds: float, topics: int, stuck: int, lives: int) -> None:
    """Role: run ``count`` clients for this long; print the number of messages in the second half."""
    selector = selectors.DefaultSelector()
    readers = []

    def add() -> None:
        reader = Reader(port, prefix)
        readers.append(reader)
        selector.register(reader.sock, selectors.EVENT_READ, reader)

    for _ in range(count):
        add()
    stuck_readers = [Reader(port, prefix) for _ in range(stuck)]
    for reader in stuck_readers:
        while reader.subscribed < topics:
            reader.read()

    def turn() -> None:
        for key, _ in selector.select(0.5):
            if not key.data.read():
                selector.unregister(key.data.sock)
        for reader in [each for each in readers if lives and each.messages >= lives]:
            # This client disconnects, and another one connects.
            selector.unregister(reader.sock)
            reader.sock.close()
            gone.append(reader.messages)
            readers.remove(reader)
            add()

    gone: list[int] = []
    while any(reader.subscribed < topics or not reader.messages for reader in readers):
        turn()
    before = [(reader.messages, reader.bytes) for reader in readers]
    for reader in readers:
        reader.delays.clear()
    print(json.dumps({"ready": True}), flush=True)
    start = time.monotonic()
    while time.monotonic() - start < seconds:
        turn()
    took = time.monotonic() - start
    if lives:
        print(
            json.dumps(
                {"messages": sum(gone) + sum(reader.messages for reader in readers), "lives": len(gone)}
            )
        )
        return
    rates = [(reader.messages - was[0]) / took for reader, was in zip(readers, before, strict=True)]
    delays = sorted(delay for reader in readers for delay in reader.delays)
    result: dict[str, object] = {
        "rates": rates,
        "mb": sum(r.bytes - w[1] for r, w in zip(readers, before, strict=True)) / 1e6 / took,
    }
    if delays:
        result["delay"] = [delays[len(delays) // 2] / 1e6, delays[len(delays) * 99 // 100] / 1e6]
    print(json.dumps(result), flush=True)


async def publish(kind: str, rate: float, size: int, topics: int) -> None:
    """Role: publish until stdin is closed."""
    from sensor_msgs.msg import Image
    from std_msgs.msg import UInt8MultiArray, UInt64

    from minirospy import Node
    from minirospy.aio.handle import serialized

    cls = {"image": Image, "topics": UInt64, "delay": UInt64, "flood": UInt8MultiArray}[kind]
    body = b""
    if kind == "image":
        body = serialized(Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes(640 * 480 * 3)))
    elif kind == "flood":
        body = serialized(UInt8MultiArray(data=bytes(size)))
    async with Node("bench_publisher", rosout=False) as node:
        publishers = [
            await node.advertise(f"/bench/{number:04}", cls, queue_size=100) for number in range(topics)
        ]
        ending = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        period = 1 / rate / topics
        due = time.monotonic()
        number = 0
        while not ending.done():
            publisher = publishers[number % topics]
            publisher.publish_raw(body or struct.pack("<Q", time.monotonic_ns()))
            number += 1
            due = max(due + period, time.monotonic() - 0.1)
            if kind == "flood":
                links = publisher._state.publication.links  # type: ignore[union-attr]
                for link in links:
                    await link.drain(5.0)
            await asyncio.sleep(max(0.0, due - time.monotonic()))


async def relay(port: int) -> None:
    """Role: run the peer, foxglove-sdk's server with the same subscriptions."""
    import foxglove

    from minirospy import Node
    from minirospy.introspect.type_texts import installed_type

    foxglove.set_log_level("ERROR")
    server = foxglove.start_server(host="127.0.0.1", port=port, name="peer", supported_encodings=["ros1"])
    async with Node("bench_relay", rosout=False) as node:
        kept = []

        def follow(topic: str, type_: str) -> None:
            found = installed_type(type_)
            assert found
            schema = foxglove.Schema(name=type_, encoding="ros1msg", data=found.definition.encode())
            channel = foxglove.Channel(topic, message_encoding="ros1", schema=schema)
            kept.append(
                node.subscribe_raw(topic, lambda frame, _: channel.log(bytes(frame), log_time=time.time_ns()))
            )

        known: set[str] = set()
        while not node.is_shutdown:
            for topic, type_ in await node._node.master("getPublishedTopics", "/bench"):
                if topic not in known:
                    known.add(topic)
                    follow(topic, type_)
            await asyncio.sleep(0.2)
    server.stop()


async def direct(seconds: float) -> None:
    """Role: run a ROS subscriber to the topic for delays; print their median and 99th percentile in milliseconds."""
    from minirospy import Node

    delays: list[int] = []
    async with Node("bench_direct", rosout=False) as node:
        kept = node.subscribe_raw(
            "/bench/0000",
            lambda frame, _: delays.append(time.monotonic_ns() - struct.unpack("<Q", frame)[0]),
        )
        await asyncio.sleep(seconds)
        del kept
    delays.sort()
    print(json.dumps({"delay": [delays[len(delays) // 2] / 1e6, delays[len(delays) * 99 // 100] / 1e6]}))


class Run:
    """A master and a server, which are stopped at the end of the block."""

    def __init__(self, server: str) -> None:
        master_port, self.port = free_port(), free_port()
        self._environ = {
            **os.environ,
            "ROS_MASTER_URI": f"http://localhost:{master_port}",
            "ROS_HOSTNAME": "localhost",
        }
        self._children: list[subprocess.Popen[str]] = []
        self.start([str(BIN / "rosmaster"), "-p", str(master_port)])
        time.sleep(1.5)
        bridge = [str(BIN / "minirospy"), "bridge", "--port", str(self.port), "--no-rosbridge"]
        self.server = self.start(bridge if server == "minirospy" else self.role("relay", port=self.port))
        self.process = psutil.Process(self.server.pid)
        end = time.monotonic() + 30
        while time.monotonic() < end:
            try:
                socket.create_connection(("127.0.0.1", self.port)).close()
                break
            except OSError:
                time.sleep(0.1)

    @staticmethod
    def role(name: str, **options: object) -> list[str]:
        return [sys.executable, __file__, "--role", name, json.dumps(options)]

    def start(self, command: list[str]) -> subprocess.Popen[str]:
        child = subprocess.Popen(
            command, env=self._environ, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self._children.append(child)
        return child

    def clients(self, **options: object) -> subprocess.Popen[str]:
        settings = {"prefix": "/bench", "topics": 1, "stuck": 0, "lives": 0, "count": 1, **options}
        child = self.start(self.role("clients", port=self.port, **settings))
        assert child.stdout
        child.stdout.readline()
        return child

    def cpu(self) -> float:
        times = self.process.cpu_times()
        return times.user + times.system

    def result(self, child: subprocess.Popen[str]) -> dict:
        assert child.stdout
        return json.loads(child.stdout.readline())

    def __enter__(self) -> Run:
        return self

    def __exit__(self, *_: object) -> None:
        for child in reversed(self._children):
            child.terminate()
        for child in self._children:
            child.wait(20)


def measured(run: Run, seconds: float, **options: object) -> tuple[dict, float, float]:
    """Return the clients' results, the server's CPU in percent, and its memory in MB."""
    child = run.clients(seconds=seconds, **options)
    before, start = run.cpu(), time.monotonic()
    time.sleep(seconds * 0.9)
    percent = 100 * (run.cpu() - before) / (time.monotonic() - start)
    memory = run.process.memory_info().rss / 1e6
    return run.result(child), percent, memory


def image(server: str, seconds: float) -> dict[str, float]:
    with Run(server) as run:
        run.start(Run.role("publish", kind="image", rate=30, size=0, topics=1))
        found, percent, memory = measured(run, seconds, count=5)
        return {"cpu %": percent, "slowest Hz": min(found["rates"]), "MB/s": found["mb"], "memory MB": memory}


def topics(server: str, seconds: float) -> dict[str, float]:
    with Run(server) as run:
        run.start(Run.role("publish", kind="topics", rate=1, size=0, topics=1000))
        found, percent, memory = measured(run, seconds, topics=1000)
        return {"cpu %": percent, "messages/s": found["rates"][0], "memory MB": memory}


def delay(server: str, seconds: float) -> dict[str, float]:
    with Run(server) as run:
        run.start(Run.role("publish", kind="delay", rate=200, size=0, topics=1))
        child = run.clients(seconds=seconds)
        beside = run.start(Run.role("direct", seconds=seconds))
        found, ros = run.result(child)["delay"], run.result(beside)["delay"]
        return {
            "added median ms": found[0] - ros[0],
            "added p99 ms": found[1] - ros[1],
            "ROS median ms": ros[0],
        }


def stuck(server: str, seconds: float) -> dict[str, float]:
    with Run(server) as run:
        run.start(Run.role("publish", kind="image", rate=30, size=0, topics=1))
        found, percent, memory = measured(run, seconds, count=9, stuck=1)
        return {"cpu %": percent, "slowest of nine Hz": min(found["rates"]), "memory MB": memory}


def soak(server: str, seconds: float) -> dict[str, float]:
    """Send as many 20 kB messages as possible; an hour of images at 30 Hz has 540,000 for five clients."""
    with Run(server) as run:
        run.start(Run.role("publish", kind="flood", rate=1e6, size=20_000, topics=1))
        child = run.clients(seconds=seconds, count=5, lives=2000)
        start = time.monotonic()
        memories = [run.process.memory_info().rss / 1e6]
        for part in (1, 2, 3, 4):
            time.sleep(max(0.0, start + 0.99 * seconds * part / 4 - time.monotonic()))
            memories.append(run.process.memory_info().rss / 1e6)
        found = run.result(child)
        return {
            "messages": found["messages"],
            "lives": found["lives"],
            **{f"memory MB at {25 * part} %": memory for part, memory in enumerate(memories)},
        }


MEASUREMENTS = {"image": image, "topics": topics, "delay": delay, "stuck": stuck, "soak": soak}
ROLES = {"publish": publish, "relay": relay, "direct": direct}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each measurement")
    parser.add_argument("--soak-seconds", type=float, default=90.0)
    parser.add_argument("names", nargs="*", default=list(MEASUREMENTS))
    parser.add_argument("--role", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        arguments = json.loads(options.names[0])
        if options.role == "clients":
            clients(**arguments)
        else:
            asyncio.run(ROLES[options.role](**arguments))
        return 0

    servers = ["minirospy"]
    try:
        import foxglove  # noqa: F401 only whether it is there

        servers.append("foxglove-sdk")
    except ImportError:
        print("foxglove-sdk is not installed: no peer")
    for name in options.names:
        seconds = options.soak_seconds if name == "soak" else options.seconds
        for server in servers:
            found = MEASUREMENTS[name](server, seconds)
            print(
                f"{name:8} {server:13}",
                ", ".join(
                    f"{key} {value:.3g}" if value < 1000 else f"{key} {value:.0f}"
                    for key, value in found.items()
                ),
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
