"""Malicious clients of the dashboard and of rosbridge, while a page drives a robot.

    python benchmarks/hostile_clients.py [--clients 8 64 250] [--seconds N] [--writers] [ATTACK ...]

Each row is a new server under attack by this number of clients, which have the read-only token (``--writers``: none,
which on loopback gives the right to write). Meanwhile a reader, and a writer with the read-write token, send a request
every 50 ms and wait for its response. A page drives a robot, which is a subscriber with plain sockets, at 20 Hz, and at
the end sends nothing more. Columns: the longest wait of the reader and of the writer, the longest gap between two
velocities at the robot, the time from the last command to the zero velocity (0.5 s are intended), all in milliseconds,
and the server's peak memory (RSS) in MiB. Each attack stops by itself; everything is on loopback.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import selectors
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xmlrpc.client import ServerProxy

import psutil

BIN = Path(sys.executable).parent
READ_TOKEN, WRITE_TOKEN = "read-token-0", "write-token-0"
TOPIC = "/cmd_vel"
REQUEST = b'{"op":"subscribe","subscriptions":[{"id":1,"channelId":999999}]}'
# seconds between two requests of a well-behaved client, and between two commands from the page
PERIOD = 0.05
PATIENCE = 30.0  # seconds that a well-behaved client waits for a response
CHUNK = 256 * 1024
MASK = bytes(4)


def frame(opcode: int, data: bytes, *, is_final: bool = True) -> bytes:
    """Return a client's frame, masked with zeros."""
    size = len(data)
    head = bytes((opcode | (0x80 if is_final else 0),))
    if size < 126:
        return head + bytes((0x80 | size,)) + MASK + data
    if size < 65536:
        return head + b"\xfe" + struct.pack("!H", size) + MASK + data
    return head + b"\xff" + struct.pack("!Q", size) + MASK + data


class Attack(NamedTuple):
    """An attack on the port ``endpoint``: ``first`` is sent once, then ``again`` until the end. ``reads``: read the responses."""

    endpoint: str
    first: bytes
    again: bytes
    reads: bool = True
    is_http: bool = False


def _filled(piece: bytes) -> bytes:
    return piece * (CHUNK // len(piece))


def _fragment() -> bytes:
    wide = "\\u4e00" * 1000
    texts = [
        f'{{"op":"fragment","id":"f{number}","num":0,"total":2,"data":"{wide}"}}'.encode()
        for number in range(40)
    ]
    return b"".join(frame(1, text) for text in texts)


def attacks() -> dict[str, Attack]:
    """Return the attacks by name."""
    small_cbor = b"\x9a" + struct.pack("!I", 250_000) + bytes(250_000)
    cbor = b"\x9a" + struct.pack("!I", 990_000) + bytes(990_000)
    small_json = b"[" + b"[]," * 80_000 + b"0]"
    many = (
        b'{"op":"subscribe","subscriptions":['
        + b'{"id":1,"channelId":999},' * 2500
        + b'{"id":1,"channelId":9}]}'
    )
    tiny = b'{"op":"subscribe","topic":"/big","type":"std_msgs/String","fragment_size":1}'
    big_json = b"[" + b"[]," * 330_000 + b"0" + b",1" * 5_700_000 + b"]"
    return {
        "empty continuations": Attack(
            "page", frame(1, b"", is_final=False), _filled(frame(0, b"", is_final=False))
        ),
        "pings": Attack("page", b"", _filled(frame(9, b""))),
        "pings, unread": Attack("page", b"", _filled(frame(9, bytes(125))), reads=False),
        "small texts": Attack("page", b"", _filled(frame(1, b"{}"))),
        "small texts, unread": Attack("page", b"", _filled(frame(1, b"{}")), reads=False),
        "JSON of 60 kB": Attack("rosbridge", b"", _filled(frame(1, b"[" + b"[]," * 20_000 + b"0]"))),
        "CBOR of 60 kB": Attack(
            "rosbridge", b"", _filled(frame(2, b"\x99" + struct.pack("!H", 60_000) + bytes(60_000)))
        ),
        "many subscriptions": Attack("page", b"", _filled(frame(1, many))),
        "JSON of 240 kB": Attack("rosbridge", b"", frame(1, small_json)),
        "JSON of 12.6 MB": Attack("rosbridge", b"", frame(1, big_json)),
        "CBOR of 250 kB": Attack("rosbridge", b"", frame(2, small_cbor)),
        "CBOR of 990 kB": Attack("rosbridge", b"", frame(2, cbor)),
        "rosbridge fragments": Attack("rosbridge", b"", _fragment()),
        "tiny fragments": Attack("rosbridge", frame(1, tiny), b""),
        "half frames": Attack("page", b"\x81\xff" + struct.pack("!Q", 60_000_000) + MASK, bytes(1000)),
        "HTTP": Attack("page", b"", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", is_http=True),
    }


def connect(port: int, token: str, protocol: str) -> socket.socket:
    """Return a connection after the handshake. Raise OSError if the server refuses it."""
    sock = socket.create_connection(("127.0.0.1", port), PATIENCE)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    line = f"Sec-WebSocket-Protocol: {protocol}\r\n" if protocol else ""
    sock.sendall(
        f"GET /?token={token} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n{line}\r\n".encode()
    )
    head = b""
    while b"\r\n\r\n" not in head:
        more = sock.recv(1)
        if not more:
            raise OSError("the server has closed the connection")
        head += more
    if b" 101 " not in head.split(b"\r\n")[0]:
        raise OSError(head.decode())
    return sock


# --- the attackers, in a process of their own


def attack_for(name: str, ports: dict[str, int], count: int, seconds: float, token: str) -> None:
    """Role: attack with ``count`` clients; print a line once they are connected."""
    if hasattr(os, "SCHED_OTHER"):
        # Only the measured processes should have the priority set with `chrt -r 20 python benchmarks/...`.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    attack = attacks()[name]
    port = ports[attack.endpoint]
    if attack.is_http:
        print("ready", flush=True)
        _flood(port, attack.again, count, time.monotonic() + seconds)
        return
    protocol = "foxglove.sdk.v1" if attack.endpoint == "page" else ""
    socks = []
    for _ in range(count):
        sock = connect(port, token, protocol)
        sock.setblocking(False)
        socks.append(sock)
    print("ready", flush=True)
    _send_all(attack, socks, time.monotonic() + seconds)


def _send_all(attack: Attack, socks: list[socket.socket], end: float) -> None:
    selector = selectors.DefaultSelector()
    rests = {sock: memoryview(attack.first or attack.again) for sock in socks}
    events = selectors.EVENT_WRITE | (selectors.EVENT_READ if attack.reads else 0)
    for sock in socks:
        selector.register(sock, events)
    while time.monotonic() < end and rests:
        for key, mask in selector.select(0.1):
            sock: Any = key.fileobj
            if not rests[sock]:
                selector.modify(sock, selectors.EVENT_READ)
            try:
                if mask & selectors.EVENT_READ and not sock.recv(1 << 16):
                    raise OSError
                if mask & selectors.EVENT_WRITE and rests[sock]:
                    rest = rests[sock]
                    sent = sock.send(rest)
                    rests[sock] = rest[sent:] if sent < len(rest) else memoryview(attack.again)
            except (BlockingIOError, InterruptedError):
                continue
            except OSError:
                selector.unregister(sock)
                del rests[sock]
    for sock in socks:
        sock.close()


def _flood(port: int, request: bytes, count: int, end: float) -> None:
    """Open connections one after another, up to ``count`` at a time."""
    socks: list[socket.socket] = []
    while time.monotonic() < end:
        with contextlib.suppress(OSError):
            sock = socket.create_connection(("127.0.0.1", port), 1.0)
            socks.append(sock)
            sock.sendall(request)
        if len(socks) >= count:
            socks.pop(0).close()
    for sock in socks:
        sock.close()


# --- the server, in a process of its own


async def serve() -> None:
    """Role: run the dashboard with rosbridge; print its ports and its node's URI, and run until stdin is closed."""
    from minirospy import Node
    from minirospy.base.heap import return_large_blocks
    from minirospy.web.access import Access
    from minirospy.web.bridge import BridgeOptions
    from minirospy.web.dashboard.dashboard import Dashboard

    return_large_blocks(4 * 1024 * 1024)  # as in `minirospy bridge`
    access = Access(read_token=READ_TOKEN, write_token=WRITE_TOKEN)
    options = BridgeOptions(foxglove_port=0, rosbridge_port=0, access=access)
    async with Node("bench_dashboard", rosout=False) as node:
        dashboard = Dashboard(node, options)
        await dashboard.start()
        with contextlib.suppress(ImportError):  # for older versions of the code
            from minirospy.web.serve import prefer_the_loop

            prefer_the_loop()
        listeners = dashboard.bridge.listeners
        ports = {"page": listeners["foxglove"].port, "rosbridge": listeners["rosbridge"].port}
        publishing = asyncio.ensure_future(_publish_big(node))
        print(json.dumps({"ports": ports, "uri": node._node.uri}), flush=True)
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        publishing.cancel()
        await dashboard.close()


async def _publish_big(node: Any) -> None:
    """Publish strings of 100 kB at 10 Hz, to which clients may subscribe."""
    from std_msgs.msg import String

    publisher = await node.advertise("/big", String, queue_size=10)
    while True:
        await publisher.publish(String("a" * 100_000))
        await asyncio.sleep(0.1)


# --- those that are measured


class Asker(threading.Thread):
    """A well-behaved client, which measures its longest wait for a response.

    ``lost`` is the reason why it gets no more responses.
    """

    def __init__(self, port: int, token: str) -> None:
        super().__init__(daemon=True)
        self.longest = 0.0
        self.count = 0
        self.lost = ""
        self.since = 0.0
        self._ended = threading.Event()
        self._sock = connect(port, token, "foxglove.sdk.v1")

    def run(self) -> None:
        """Send requests and wait for the responses, until the end."""
        try:
            while not self._ended.wait(PERIOD):
                self.since = start = time.monotonic()
                self._sock.sendall(frame(1, REQUEST))
                while b"is not available" not in self._message():
                    pass
                self.longest = max(self.longest, time.monotonic() - start)
                self.count += 1
        except OSError as error:
            self.lost = str(error) or type(error).__name__

    def end(self) -> None:
        """Stop it, after the pending response."""
        self._ended.set()
        self.join(PATIENCE)
        self._sock.close()

    def _message(self) -> bytes:
        head = self._exactly(2)
        size = head[1]
        if size == 126:
            size = struct.unpack("!H", self._exactly(2))[0]
        elif size == 127:
            size = struct.unpack("!Q", self._exactly(8))[0]
        return self._exactly(size)

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            more = self._sock.recv(size - len(data))
            if not more:
                raise OSError("disconnected")
            data += more
        return data


class Robot(threading.Thread):
    """A subscriber to velocities. It measures the longest gap while it is driven, and the time of a zero velocity."""

    def __init__(self, uri: str) -> None:
        super().__init__(daemon=True)
        from geometry_msgs.msg import Twist

        with ServerProxy(uri) as node:
            answer: Any = node.requestTopic("/bench_robot", TOPIC, [["TCPROS"]])
        self._sock = socket.create_connection((answer[2][1], answer[2][2]), PATIENCE)
        fields = {"callerid": "/bench_robot", "topic": TOPIC, "type": Twist._type, "md5sum": Twist._md5sum}
        parts = [f"{name}={value}".encode() for name, value in fields.items()]
        body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
        self._sock.sendall(struct.pack("<I", len(body)) + body)
        self._exactly(struct.unpack("<I", self._exactly(4))[0])
        self.longest = 0.0
        self.zeros = 0
        self.is_moving = threading.Event()
        self.has_stopped = threading.Event()

    def run(self) -> None:
        """Read until the connection is closed."""
        last = 0.0
        with contextlib.suppress(OSError):
            while True:
                moves = any(self._exactly(struct.unpack("<I", self._exactly(4))[0]))
                now = time.monotonic()
                if moves:
                    # A gap starts and ends with a velocity, and includes a zero velocity from the guard in between.
                    if last:
                        self.longest = max(self.longest, now - last)
                    last = now
                    self.has_stopped.clear()
                    self.is_moving.set()
                else:
                    self.zeros += 1
                    self.has_stopped.set()

    def close(self) -> None:
        """Close the connection."""
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_RDWR)
        if self.ident:
            self.join(5)
        self._sock.close()

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            more = self._sock.recv(size - len(data))
            if not more:
                raise OSError("disconnected")
            data += more
        return data


class Row(NamedTuple):
    """The effects of an attack; times are in milliseconds."""

    attack: str
    clients: int
    reader: float
    writer: float
    gap: float
    stop: float
    memory: float
    lost: str

    def shown(self) -> str:
        """Return the row as a line of text."""
        return (
            f"{self.attack:22} {self.clients:7} {self.reader:7.0f} {self.writer:7.0f} {self.gap:7.0f} "
            f"{self.stop:7.0f} {self.memory:7.0f}  {self.lost}"
        )


@contextlib.contextmanager
def started(words: list[str], environ: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    """Run a process that is stopped at the end of the block."""
    process = subprocess.Popen(
        words,
        env=environ,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def role(kind: str, **options: object) -> list[str]:
    """Return the command of a role of this program."""
    return [sys.executable, __file__, "--role", kind, json.dumps(options)]


def measure(name: str, clients: int, seconds: float, environ: dict[str, str], token: str) -> Row:
    """Attack a new server; return the effects."""
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(started(role("serve"), environ))
        assert server.stdout
        found = json.loads(server.stdout.readline())
        memory = Height(server.pid)
        stack.callback(memory.end)
        page = found["ports"]["page"]
        reader, writer = Asker(page, READ_TOKEN), Asker(page, WRITE_TOKEN)
        driver = stack.enter_context(connect(page, WRITE_TOKEN, "minirospy.drive.v1"))
        rest, forward = (
            frame(1, json.dumps({"topic": TOPIC, "twist": [speed, 0, 0, 0, 0, 0]}).encode())
            for speed in (0, 1)
        )
        driver.sendall(rest)
        robot = _until(lambda: Robot(found["uri"]))
        stack.callback(robot.close)

        options = {
            "name": name,
            "ports": found["ports"],
            "count": clients,
            "seconds": seconds + 3.0,
            "token": token,
        }
        attackers = stack.enter_context(started(role("attack", **options), environ))
        assert attackers.stdout
        for thread in (reader, writer, robot):
            thread.start()
        # The attackers connect first and then send; the measurement starts before they send.
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            last = time.monotonic()
            driver.sendall(forward)
            time.sleep(PERIOD)
        # The page stops sending while it drives, as if it hung.
        stopped = robot.is_moving.wait(PATIENCE) and robot.has_stopped.wait(PATIENCE)
        stop = time.monotonic() - last if stopped else PATIENCE
        for asker in (reader, writer):
            asker.end()
        return Row(
            name,
            clients,
            1000 * reader.longest,
            1000 * writer.longest,
            1000 * robot.longest,
            1000 * stop,
            memory.height / 2**20,
            "; ".join(filter(None, (reader.lost, writer.lost))),
        )


class Height(threading.Thread):
    """The peak memory of a process, sampled a hundred times a second."""

    def __init__(self, pid: int) -> None:
        super().__init__(daemon=True)
        self.height = 0.0
        self._process = psutil.Process(pid)
        self._ended = threading.Event()
        self.start()

    def run(self) -> None:
        """Sample until the end."""
        with contextlib.suppress(psutil.Error):
            while not self._ended.wait(0.01):
                self.height = max(self.height, self._process.memory_info().rss)

    def end(self) -> None:
        """Stop sampling."""
        self._ended.set()
        self.join(5)


def _until(make: Callable[[], Robot]) -> Robot:
    """Return the robot as soon as the topic exists."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return make()
        except (OSError, IndexError, TypeError):
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


@contextlib.contextmanager
def master() -> Iterator[dict[str, str]]:
    """Run a master; yield the environment for its nodes."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    environ = {
        **os.environ,
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_HOSTNAME": "localhost",
        "MINIROSPY_LOCAL": "1",
    }
    with started([str(BIN / "rosmaster"), "-p", str(port)], environ):
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            with contextlib.suppress(OSError):
                socket.create_connection(("127.0.0.1", port), 1).close()
                break
            time.sleep(0.05)
        yield environ


def main() -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(description="Hostile clients of the dashboard and of rosbridge.")
    parser.add_argument("--clients", type=int, nargs="+", default=[8, 64, 250])
    parser.add_argument("--seconds", type=float, default=4.0, help="of each attack (default: 4)")
    parser.add_argument(
        "--writers", action="store_true", help="the attackers may write, as on loopback without a token"
    )
    parser.add_argument("--json", action="store_true", help="print a JSON object for each row")
    parser.add_argument("names", nargs="*", metavar="ATTACK", help=f"of: {', '.join(attacks())}")
    parser.add_argument("--role", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        name, arguments = options.role[0], json.loads(options.role[1])
        if name == "serve":
            asyncio.run(serve())
        else:
            attack_for(**arguments)
        return 0

    unknown = set(options.names) - set(attacks())
    if unknown:
        parser.error(f"there is no attack {', '.join(sorted(unknown))}")
    clients = [min(max(1, each), 250) for each in options.clients]  # a listener accepts 256 connections
    seconds = min(options.seconds, 60.0)
    token = "" if options.writers else READ_TOKEN
    if not options.json:
        print(f"{'attack':22} clients  reader  writer     gap    stop  memory")
    with master() as environ:
        for name in options.names or attacks():
            for count in clients:
                row = measure(name, count, seconds, environ, token)
                print(json.dumps(row._asdict()) if options.json else row.shown(), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
