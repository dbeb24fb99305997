"""The memory of a bridge's process under attack, read from /proc, so only on Linux. The tests measure no times."""

from __future__ import annotations

import base64
import contextlib
import json
import re
import socket
import struct
import subprocess
import sys
import threading
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.frames import Opcode

MAX_PEAK = 400_000_000  # maximum memory of the process in bytes, with Python and all libraries

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="by /proc")


class Attacked:
    """A bridge as a process, and its clients, which do not read."""

    def __init__(self, stack: contextlib.ExitStack) -> None:
        self._stack = stack
        self._process = subprocess.Popen(
            [sys.executable, "-m", "minirospy", "bridge", "--port", "0"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        stack.callback(self._end)
        assert self._process.stdout
        self.port, self.rosbridge_port = (
            int(self._process.stdout.readline().rpartition(":")[2]) for _ in range(2)
        )

    def _end(self) -> None:
        self._process.terminate()
        self._process.communicate(timeout=60)

    @property
    def peak(self) -> int:
        """Return the process's peak memory."""
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii")
        found = re.search(r"VmHWM:\s+(\d+) kB", status)
        assert found
        return int(found[1]) * 1024

    def client(self, port: int, subprotocol: str = "") -> socket.socket:
        """Return a WebSocket client after its handshake."""
        sock = self._stack.enter_context(socket.create_connection(("127.0.0.1", port), 60))
        offered = f"Sec-WebSocket-Protocol: {subprotocol}\r\n" if subprotocol else ""
        sock.sendall(
            "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            f"{offered}\r\n".encode()
        )
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += sock.recv(1)
        return sock

    def foxglove(self) -> socket.socket:
        return self.client(self.port, "foxglove.websocket.v1")

    def rosbridge(self) -> socket.socket:
        return self.client(self.rosbridge_port)

    def synchronize(self) -> None:
        """Return when the bridge has handled everything that has reached it."""
        sock = self.rosbridge()
        for number in range(20):
            sock.sendall(frame(b'{"op": "jump", "id": "%d"}' % number))
            assert sock.recv(4096)

    def side_by_side(self, count: int, work: Callable[[], object]) -> None:
        """Run ``work`` in ``count`` parallel threads, one for each client; a client that is disconnected stops."""

        def run() -> None:
            with contextlib.suppress(OSError):
                work()

        threads = [threading.Thread(target=run) for _ in range(count)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()


def frame(data: bytes, opcode: int = Opcode.TEXT, *, announced: int = 0) -> bytes:
    """Return a client's frame; with ``announced``, it is cut off."""
    size = announced or len(data)
    return bytes((0x80 | opcode, 0xFF)) + struct.pack("!Q", size) + bytes(4) + data


def operation(**fields: object) -> bytes:
    return frame(json.dumps(fields, ensure_ascii=False).encode())


@pytest.fixture
def attacked(master: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Attacked]:
    package = tmp_path / "src" / "robot"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot</name></package>")
    with (package / "mesh.stl").open("wb") as file:
        file.truncate(60_000_000)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    with contextlib.ExitStack() as stack:
        yield Attacked(stack)


def meshes(attacked: Attacked) -> None:
    """25 clients request a mesh of 60 MB five times each, and do not read."""
    for _ in range(25):
        sock = attacked.foxglove()
        for number in range(5):
            sock.sendall(operation(op="fetchAsset", uri="package://robot/mesh.stl", requestId=number))


def fragments(attacked: Attacked) -> None:
    """Twenty clients send fragments with wide characters, whose messages are never complete."""
    data = "\U0001f600" + "a" * 250_000

    def send() -> None:
        sock = attacked.rosbridge()
        for number in range(50):
            sock.sendall(operation(op="fragment", id="i", num=number, total=99, data=data))

    attacked.side_by_side(20, send)


def half_messages(attacked: Attacked) -> None:
    """Eight clients send most of a 60 MB message each."""
    data = frame(bytes(55_000_000), Opcode.BINARY, announced=60_000_000)
    attacked.side_by_side(8, lambda: attacked.foxglove().sendall(data))


def wide_texts(attacked: Attacked) -> None:
    """Send strings of 60 MB with one wide character."""
    data = frame(b'{"op": "x", "y": "\xf0\x9f\x98\x80' + b"a" * 60_000_000 + b'"}')
    attacked.side_by_side(2, lambda: attacked.rosbridge().sendall(data))


def latched_messages(attacked: Attacked) -> None:
    """Five clients publish 60 MB of latched messages each."""

    def send() -> None:
        sock = attacked.rosbridge()
        for number in range(12):
            topic = f"/t{sock.getsockname()[1]}_{number}"
            sock.sendall(operation(op="advertise", topic=topic, type="std_msgs/String", latch=True))
            sock.sendall(operation(op="publish", topic=topic, msg={"data": "a" * 5_000_000}))

    attacked.side_by_side(5, send)


def calls(attacked: Attacked) -> None:
    """Call services that do not exist, with large arguments."""
    sock = attacked.rosbridge()
    data = operation(op="call_service", service="/none", args={"data": "a" * 2_000_000})
    with contextlib.suppress(OSError):
        for _ in range(50):
            sock.sendall(data)


def many_values(attacked: Attacked) -> None:
    """Send text with the maximum number of values and, at the same time, text with too many strings."""
    numbers = frame(b'{"op": "publish", "topic": "/x", "msg": {"a": [0' + b",1.5" * 3_990_000 + b"]}}")
    strings = frame(b'{"op": "publish", "topic": "/x", "msg": {"a": [0' + b',"ab"' * 1_990_000 + b"]}}")
    more = frame(b'{"op": "publish", "topic": "/x", "msg": {"a": [0' + b',"ab"' * 3_990_000 + b"]}}")
    for data in (numbers, strings, more):

        def send(data: bytes = data) -> None:
            sock = attacked.rosbridge()
            with contextlib.suppress(OSError):
                sock.sendall(data)
                sock.recv(1000)

        attacked.side_by_side(16, send)


def large_png(attacked: Attacked) -> None:
    """Publish a PNG of 500 kB with 13,000 x 13,000 pixels, and request it as a page."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack("!I", len(data)) + kind + data + struct.pack("!I", zlib.crc32(kind + data))

    size = 13_000
    packer = zlib.compressobj(9)
    rows = b"".join([packer.compress(bytes(1 + 3 * size)) for _ in range(size)] + [packer.flush()])
    head = chunk(b"IHDR", struct.pack("!IIBBBBB", size, size, 8, 2, 0, 0, 0))
    png = b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", rows) + chunk(b"IEND", b"")

    sock = attacked.rosbridge()
    sock.sendall(operation(op="advertise", topic="/camera", type="sensor_msgs/CompressedImage", latch=True))
    fields = {"format": "png", "data": base64.b64encode(png).decode()}
    sock.sendall(operation(op="publish", topic="/camera", msg=fields))
    attacked.synchronize()
    with socket.create_connection(("127.0.0.1", attacked.rosbridge_port), 60) as page:
        page.sendall(b"GET /snapshot?topic=/camera&quality=80 HTTP/1.1\r\nHost: localhost\r\n\r\n")
        answer = b""
        while more := page.recv(65536):
            answer += more
    assert b"13000x13000 pixels is too large: 16000000 are allowed" in answer
    assert answer.startswith(b"HTTP/1.1 500 ")


@pytest.mark.parametrize(
    "attack",
    [meshes, fragments, half_messages, wide_texts, latched_messages, calls, many_values, large_png],
    ids=lambda each: str(each.__name__),
)
def test_memory_of_the_process_is_limited(attack: Callable[[Attacked], None], attacked: Attacked) -> None:
    attack(attacked)
    attacked.synchronize()
    assert attacked.peak < MAX_PEAK
