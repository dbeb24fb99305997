"""runtime/tcp: links, listeners and handshakes with real sockets, and with peers that mean no good."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import struct
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from minirospy.errors import WireError
from minirospy.runtime import tcp
from minirospy.runtime.loop import LoopThread, new_event_loop
from minirospy.wire.framing import serialize_frame


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a loop of its own."""
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.close()


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two ends of a TCP connection on loopback."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        one = socket.create_connection(server.getsockname())
        other, _ = server.accept()
    with one, other:
        yield one, other


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread("test-loop")
    yield thread
    thread.close()


@dataclass
class Keeps:
    """How many frames a slow receiver is to get."""

    newest: int


# --- links


def open_link(
    loop: LoopThread, sock: socket.socket, queue_size: int, on_closed: Callable[[tcp.OutLink], None]
) -> tcp.OutLink:
    async def make() -> tcp.OutLink:
        sock.setblocking(False)
        link = tcp.OutLink(sock, asyncio.get_running_loop(), "/peer", queue_size, on_closed)
        link.open()
        return link

    return loop.run(make())


def receive_all(sock: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        more = sock.recv(1 << 20)
        assert more, "the link ended"
        data += more
    return bytes(data)


def test_frames_of_several_threads_stay_whole(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None)
    frames = [serialize_frame(bytes([number]) * 300_000) for number in range(8)]
    threads = [threading.Thread(target=lambda f=f: [link.send(f) for _ in range(5)]) for f in frames]
    for thread in threads:
        thread.start()
    data = receive_all(pair[1], sum(map(len, frames)) * 5)
    for thread in threads:
        thread.join()
    seen = []
    while data:
        (length,) = struct.unpack_from("<I", data)
        body = data[4 : 4 + length]
        assert set(body) == {body[0]}
        seen.append(body[0])
        data = data[4 + length :]
    assert sorted(seen) == sorted(list(range(8)) * 5)
    assert (link.sent, link.dropped, link.waiting) == (40, 0, 0)


def test_a_full_queue_drops_the_oldest_and_never_half_a_frame(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 3, lambda _: None)
    size = 4_000_000
    for number in range(50):
        link.send(serialize_frame(bytes([number]) * size))
    assert link.waiting <= 4
    count = 50 - link.dropped
    data = receive_all(pair[1], count * (size + 4))
    numbers = [data[at + 4] for at in range(0, len(data), size + 4)]
    assert numbers[-3:] == [47, 48, 49]
    assert numbers == sorted(numbers)
    assert all(data[at : at + 4] == struct.pack("<I", size) for at in range(0, len(data), size + 4))


def test_a_peer_that_hangs_up_ends_the_link_and_whoever_waits_for_it(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    ended = threading.Event()
    link = open_link(loop, pair[0], 0, lambda _: ended.set())
    link.send(serialize_frame(bytes(50_000_000)))
    waiter = threading.Thread(target=link.wait)
    waiter.start()
    pair[1].close()
    waiter.join(10)
    assert not waiter.is_alive()
    assert ended.wait(10)
    link.send(b"to nobody")


def test_what_a_subscriber_says_is_not_listened_to(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    ended = threading.Event()
    link = open_link(loop, pair[0], 0, lambda _: ended.set())
    pair[1].sendall(b"x" * 10_000)
    link.send(serialize_frame(b"still here"))
    assert receive_all(pair[1], 14)[4:] == b"still here"
    assert not ended.is_set()


def test_reading_ends_at_a_length_over_the_limit(pair: tuple[socket.socket, socket.socket]) -> None:
    pair[1].sendall(serialize_frame(b"good") + b"\xff\xff\xff\xff")
    bodies: list[bytes] = []
    with pytest.raises(WireError, match="over the limit"):
        tcp.read_frames(pair[0], lambda frame: bodies.append(bytes(frame)), Keeps(0))
    assert bodies == [b"good"]
    assert pair[0].fileno() == -1


def test_reading_ends_with_half_a_frame(pair: tuple[socket.socket, socket.socket]) -> None:
    pair[1].sendall(serialize_frame(b"whole") + b"\x05\0\0\0ab")
    pair[1].close()
    bodies: list[bytes] = []
    tcp.read_frames(pair[0], lambda frame: bodies.append(bytes(frame)), Keeps(0))
    assert bodies == [b"whole"]


@pytest.mark.parametrize(
    ("newest", "expected"), [(1, [9]), (3, [7, 8, 9]), (100, list(range(10))), (0, list(range(10)))]
)
def test_newest(pair: tuple[socket.socket, socket.socket], newest: int, expected: list[int]) -> None:
    pair[1].sendall(b"".join(serialize_frame(bytes([number])) for number in range(10)))
    pair[1].close()
    bodies: list[int] = []
    tcp.read_frames(pair[0], lambda frame: bodies.append(frame[0]), Keeps(newest))
    assert bodies == expected


def test_keepalive_is_on(pair: tuple[socket.socket, socket.socket]) -> None:
    tcp.tune(pair[0])
    assert pair[0].getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert pair[0].getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    if sys.platform == "linux":
        options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        assert [pair[0].getsockopt(socket.IPPROTO_TCP, option) for option in options] == [20, 10, 3]


# --- addresses


def test_a_port_out_of_a_range() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        first = taken.getsockname()[1]
        with tcp.bind("127.0.0.1", 0, range(first, first + 20)) as sock:
            assert first < sock.getsockname()[1] < first + 20
        with pytest.raises(OSError, match=f"no port of MINIROSPY_PORTS={first}-{first} is free"):
            tcp.bind("127.0.0.1", 0, range(first, first + 1))


def test_a_port_that_is_asked_for_goes_before_the_range() -> None:
    with tcp.bind("127.0.0.1") as probe:
        port = probe.getsockname()[1]
    with tcp.bind("127.0.0.1", port, range(1, 2)) as sock:
        assert sock.getsockname()[1] == port


def test_connecting_says_what_it_did_when_it_fails() -> None:
    async def scene() -> None:
        with pytest.raises(ConnectionRefusedError):
            await tcp.connect("127.0.0.1", 1)
        with pytest.raises(ConnectionRefusedError):
            await tcp.connect("localhost", 1)
        with pytest.raises(socket.gaierror):
            await tcp.connect("no-such-host.invalid", 1)

    run(scene)


def test_localhost_is_ipv4_or_ipv6() -> None:
    async def scene() -> None:
        for address in ("127.0.0.1", "::1"):
            try:
                server = tcp.bind(address)
            except OSError:
                continue
            server.listen()
            (await tcp.connect("localhost", server.getsockname()[1])).close()
            server.close()

    run(scene)


# --- bad peers


async def serve(received: list[dict[str, str]]) -> tcp.Listener:
    """A listener that keeps the headers that it receives, and answers each."""

    async def accept(sock: socket.socket, _address: str) -> None:
        received.append(await tcp.receive_header(sock))
        await tcp.send_header(sock, {"callerid": "/server"})
        sock.close()

    listener = tcp.Listener(accept)
    listener.open("127.0.0.1")
    return listener


async def greet(port: int) -> dict[str, str]:
    """What a good client is answered."""
    sock = await tcp.connect("127.0.0.1", port)
    try:
        await tcp.send_header(sock, {"callerid": "/good"})
        return await tcp.receive_header(sock)
    finally:
        sock.close()


BAD = {
    "half a length": b"\x01\0",
    "half a header": struct.pack("<I", 100) + b"topic",
    "a huge length": b"\xff\xff\xff\x7f" + b"x" * 100,
    "a page": b"GET / HTTP/1.1\r\n\r\n",
    "a field without =": struct.pack("<II", 9, 5) + b"topic",
    "a field beyond the header": struct.pack("<II", 4, 50),
    "random": os.urandom(1000),
}


@pytest.mark.parametrize("data", BAD.values(), ids=list(BAD))
def test_garbage_is_refused_with_a_log_line(data: bytes, caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        received: list[dict[str, str]] = []
        listener = await serve(received)
        sock = await tcp.connect("127.0.0.1", listener.port)
        await asyncio.get_running_loop().sock_sendall(sock, data)
        sock.shutdown(socket.SHUT_WR)
        with contextlib.suppress(ConnectionResetError):
            assert await asyncio.get_running_loop().sock_recv(sock, 1) == b""
        sock.close()
        assert received == []
        assert await greet(listener.port) == {"callerid": "/server"}
        await listener.close()

    run(scene)
    assert caplog.text.count("connection from 127.0.0.1:") == 1
    assert "refused: " in caplog.text


def test_a_peer_that_says_nothing_is_left_after_a_while(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tcp.receive_header, "__defaults__", (0.05,))

    async def scene() -> None:
        listener = await serve([])
        sock = await tcp.connect("127.0.0.1", listener.port)
        assert await asyncio.get_running_loop().sock_recv(sock, 1) == b""
        sock.close()
        await listener.close()

    run(scene)
    assert "timed out waiting for a connection header" in caplog.text


def test_a_thousand_silent_connections_neither_stop_the_node_nor_fill_its_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def scene() -> None:
        received: list[dict[str, str]] = []
        listener = await serve(received)
        silent: list[socket.socket] = []
        try:
            # As many as this process may open: it holds both ends, unless the listener lets go of them.
            for number in range(1000):
                silent.append(await tcp.connect("127.0.0.1", listener.port))
                if number % 100 == 99:
                    assert await greet(listener.port) == {"callerid": "/server"}
                if len(silent) == 300:
                    silent.pop(0).close()
            assert len(listener._handshakes) <= tcp.MOST_HANDSHAKES
            assert len(received) == 10
        finally:
            for sock in silent:
                sock.close()
            await listener.close()

    run(scene)
    lines = [record.getMessage() for record in caplog.records]
    assert lines[0].endswith("closed: it said nothing, and 200 others are waiting")
    assert 10 < len(lines) < 30
    assert "more connections were refused" in caplog.text


def test_closing_ends_handshakes_that_are_under_way() -> None:
    async def scene() -> None:
        listener = await serve([])
        sock = await tcp.connect("127.0.0.1", listener.port)
        while not listener._handshakes:
            await asyncio.sleep(0)
        await listener.close()
        assert await asyncio.get_running_loop().sock_recv(sock, 1) == b""
        sock.close()
        with pytest.raises(ConnectionRefusedError):
            await tcp.connect("127.0.0.1", listener.port)
        await listener.close()

    run(scene)
