"""Malicious peers of a minirospy node and master: their cost, and their effect on well-behaved clients.

    python benchmarks/bad_peers.py [--peers N] [--json]

Each row: the attack; the memory (RSS) of the attacked process before, at its peak, and after, in MiB; the number of lines that
it logged meanwhile; and the longest time in seconds of a well-behaved client's call during the attack. The exit status is 1 if
a well-behaved client got no response.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple
from xmlrpc.client import ServerProxy

import psutil

MIB = 1024 * 1024
_WIDTH = 56
NODE = """
import rospy, sys
from sensor_msgs.msg import LaserScan
from std_msgs.msg import UInt8MultiArray
from std_srvs.srv import SetBool
rospy.init_node("victim")
big = rospy.Publisher("/big", UInt8MultiArray, queue_size=2)
rospy.Subscriber("/scan", LaserScan, lambda scan: None)
rospy.Service("/flag", SetBool, lambda request: (request.data, "served"))
message = UInt8MultiArray(data=bytes(1000000))
print("ready", flush=True)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    big.publish(message)
    rate.sleep()
"""


class Row(NamedTuple):
    """The effects of an attack."""

    attack: str
    before: float
    height: float
    after: float
    lines: int
    worst: float
    answered: bool

    def shown(self) -> str:
        """Return the row as a line of text."""
        worst = f"{self.worst * 1000:9.1f} ms" if self.answered else "   NO ANSWER"
        return f"{self.attack:{_WIDTH}}  {self.before:6.1f}  {self.height:6.1f}  {self.after:6.1f}  {self.lines:5}  {worst}"


class Victim:
    """An attacked process: its memory, its log lines, and a well-behaved client's calls."""

    def __init__(self, command: list[str], environ: dict[str, str], ready: str) -> None:
        self.process = subprocess.Popen(
            command, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.lines: list[str] = []
        self._ready = threading.Event()
        self._reader = threading.Thread(target=self._read, args=(ready,), daemon=True)
        self._reader.start()
        if not self._ready.wait(20):
            raise SystemExit(f"the attacked process does not start: {self.lines}")
        self._memory = psutil.Process(self.process.pid)

    @property
    def mib(self) -> float:
        """Return its resident memory in MiB."""
        return float(self._memory.memory_info().rss) / MIB

    def close(self) -> None:
        """Stop it."""
        self.process.terminate()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._reader.join(5)
        assert self.process.stdout
        self.process.stdout.close()

    def _read(self, ready: str) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            if ready in line:
                self._ready.set()
            self.lines.append(line)


Attack = Callable[[int, int], "Iterator[None]"]
"""A function of (port, number of peers) that yields while the attack runs; the well-behaved client calls between its yields."""


def silent(port: int, peers: int) -> Iterator[None]:
    """Connect, and send nothing."""
    yield from _hold(port, peers, b"")


def garbage(port: int, peers: int) -> Iterator[None]:
    """Connect, and send 128 KiB of random data."""
    yield from _hold(port, peers, random.Random(1).randbytes(131072))


def half_header(port: int, peers: int) -> Iterator[None]:
    """Connect, and send half of a connection header."""
    yield from _hold(port, peers, struct.pack("<I", 100) + b"topic=/")


def half_request(port: int, peers: int) -> Iterator[None]:
    """Connect, and send half of an HTTP request with a 10 MiB body."""
    yield from _hold(port, peers, b"POST / HTTP/1.1\r\nContent-Length: 10485760\r\n\r\n" + bytes(10000))


def huge_length(port: int, peers: int) -> Iterator[None]:
    """Send 2 GiB as the length of a connection header."""
    yield from _hold(port, peers, b"\xff\xff\xff\x7f" + bytes(10000))


def huge_request(port: int, peers: int) -> Iterator[None]:
    """Do a valid handshake for a service, then send 1 GiB as the request's length, and little of its data."""
    header = _header(callerid="/bad", service="/flag", md5sum="*", persistent="1")
    yield from _hold(port, min(peers, 150), header + struct.pack("<I", 2**30 - 1) + bytes(10000))


def slow_subscribers(port: int, peers: int) -> Iterator[None]:
    """Subscribe to a topic with 20 MB per second, and do not read."""
    yield from _hold(
        port, min(peers, 100), _header(callerid="/bad", topic="/big", md5sum="*", type="*"), seconds=2.0
    )


def slow_readers(port: int, peers: int) -> Iterator[None]:
    """Send the same request 1000 times, and do not read the responses."""
    body = b"<methodCall><methodName>system.listMethods</methodName></methodCall>"
    request = b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    yield from _hold(port, min(peers, 150), request * 1000, seconds=1.0)


TCPROS = (silent, garbage, half_header, huge_length, huge_request, slow_subscribers)
XMLRPC = (silent, garbage, half_request, slow_readers)


def bad_publisher(master: str, frames: bytes) -> Callable[[int, int], Iterator[None]]:
    """Return an attack in which a publisher of /scan sends ``frames`` repeatedly to each subscriber."""

    def bad_frames(_: int, __: int) -> Iterator[None]:
        from xmlrpc.server import SimpleXMLRPCServer

        with socket.create_server(("127.0.0.1", 0)) as server:
            api = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
            where = ["TCPROS", "127.0.0.1", server.getsockname()[1]]
            api.register_function(lambda *_: [1, "", where], "requestTopic")
            threading.Thread(target=api.serve_forever, args=(0.05,), daemon=True).start()
            uri = f"http://127.0.0.1:{api.server_address[1]}/"
            with ServerProxy(master) as proxy:
                proxy.registerPublisher("/bad", "/scan", "sensor_msgs/LaserScan", uri)
            end = time.monotonic() + 2.0
            server.settimeout(0.1)
            while time.monotonic() < end:
                with contextlib.suppress(OSError):
                    sock, _ = server.accept()
                    sock.sendall(_header(callerid="/bad", md5sum="*", type="sensor_msgs/LaserScan"))
                    threading.Thread(target=_pour, args=(sock, frames, end), daemon=True).start()
                yield
            with ServerProxy(master) as proxy:
                proxy.unregisterPublisher("/bad", "/scan", uri)
            api.shutdown()
            api.server_close()

    return bad_frames


def _pour(sock: socket.socket, frames: bytes, end: float) -> None:
    with contextlib.suppress(OSError), sock:
        while time.monotonic() < end:
            sock.sendall(frames)


def _hold(port: int, peers: int, data: bytes, seconds: float = 0.5) -> Iterator[None]:
    """Open connections, send ``data`` on them, and keep them open."""
    with contextlib.ExitStack() as stack:
        for number in range(peers):
            with contextlib.suppress(OSError):
                sock = stack.enter_context(_connect(port))
                sock.setblocking(False)
                sock.send(data)
            if number % 20 == 0:
                yield
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            yield
            time.sleep(0.05)


def _connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), 20)


def _header(**fields: str) -> bytes:
    parts = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(body)) + body


def measure(name: str, victim: Victim, attack: Attack, port: int, peers: int, ask: Callable[[], None]) -> Row:
    """Run an attack, with a well-behaved client's calls in between."""
    before = height = victim.mib
    lines = len(victim.lines)
    worst, answered = 0.0, True
    for _ in attack(port, peers):
        start = time.monotonic()
        try:
            ask()
        except OSError:
            answered = False
        worst = max(worst, time.monotonic() - start)
        height = max(height, victim.mib)
    time.sleep(0.3)
    return Row(name, before, height, victim.mib, len(victim.lines) - lines, worst, answered)


def ask_node(api: str, service: str) -> None:
    """Call the node's Slave API and its service once. Raise OSError if a response is not correct."""
    with ServerProxy(api) as proxy:
        proxy.getPid("/good")
    with _connect(port_of(service)) as sock:
        sock.sendall(_header(callerid="/good", service="/flag", md5sum="*") + struct.pack("<I", 1) + b"\1")
        if b"served" not in _all(sock):
            raise OSError("the service did not answer")


def port_of(uri: str) -> int:
    """Return the port in the URI of a node or a service."""
    return int(uri.rstrip("/").rsplit(":", 1)[1])


def main() -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(description="Bad peers against a node and a master.")
    parser.add_argument("--peers", type=int, default=1000, help="connections of each attack (default: 1000)")
    parser.add_argument("--json", action="store_true", help="print a JSON object for each row")
    options = parser.parse_args()
    socket.setdefaulttimeout(5)
    _raise_file_limit(4 * options.peers)
    rows: list[Row] = []
    if not options.json:
        print(f"{'attack':{_WIDTH}}  before  height   after  lines  worst answer")
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        uri = f"http://127.0.0.1:{port}/"
        environ = {
            **os.environ,
            "ROS_MASTER_URI": uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_HOME": folder,
            "ROS_LOG_DIR": str(Path(folder) / "log"),
            "PYTHONUNBUFFERED": "1",
        }
        roscore = [sys.executable, "-m", "minirospy", "master", "-p", str(port), "--no-journal"]
        master = Victim(roscore, environ, "Ctrl-C stops the master")
        stack.callback(master.close)
        node = Victim([sys.executable, "-c", NODE], environ, "ready")
        stack.callback(node.close)
        with ServerProxy(uri) as proxy:
            api = proxy.lookupNode("/bench", "/victim")[2]
            service = proxy.lookupService("/bench", "/flag")[2]

        def ask_master() -> None:
            with ServerProxy(uri) as good:
                good.getPid("/good")

        def ask() -> None:
            ask_node(api, service)

        def attack(name: str, victim: Victim, what: Attack, at: int, ask: Callable[[], None]) -> None:
            row = measure(name, victim, what, at, options.peers, ask)
            rows.append(row)
            print(json.dumps(row._asdict()) if options.json else row.shown(), flush=True)

        for each in XMLRPC:
            attack(f"master: {each.__name__}", master, each, port, ask_master)
        for each in XMLRPC:
            attack(f"node, XML-RPC: {each.__name__}", node, each, port_of(api), ask)
        for each in TCPROS:
            attack(f"node, TCPROS: {each.__name__}", node, each, port_of(service), ask)
        for what, frames in (
            ("frames that are no message", struct.pack("<I", 5) + b"short"),
            ("a frame of 1 GiB, says its length", struct.pack("<I", 2**30 - 1)),
            ("a frame of 4 GiB, says its length", b"\xff\xff\xff\xff"),
        ):
            attack(f"node, subscriber: {what}", node, bad_publisher(uri, frames), 0, ask)
        lines = node.lines
    if not options.json:
        print(f"\nthe node's lines, {len(lines)}, of which the first of each kind:")
        seen: set[str] = set()
        for line in lines:
            kind = "".join(letter for letter in line if not letter.isdigit())[:60]
            if kind not in seen:
                seen.add(kind)
                print("  " + line.rstrip()[:200])
    return 0 if all(row.answered for row in rows) else 1


def _all(sock: socket.socket) -> bytes:
    data = b""
    while more := sock.recv(65536):
        data += more
    return data


def _raise_file_limit(wanted: int) -> None:
    if sys.platform != "win32":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        most = wanted if hard == resource.RLIM_INFINITY else min(hard, wanted)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))


if __name__ == "__main__":
    sys.exit(main())
