"""runtime/transport/tcp: links, listeners and handshakes with real sockets, and with malicious peers."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import struct
import sys
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import pytest

from minirospy.base.errors import WireError
from minirospy.core.wire.header import serialize_header
from minirospy.runtime.transport import sockets, tcp
from minirospy.runtime.transport.loop import new_event_loop
from tests.waiting import until


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a new loop."""
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.close()


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Return both sockets of a TCP connection on loopback."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        one = socket.create_connection(server.getsockname())
        other, _ = server.accept()
    with one, other:
        yield one, other


def test_keepalive_is_on(pair: tuple[socket.socket, socket.socket]) -> None:
    sockets.tune(pair[0])
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


def test_a_requested_port_is_preferred_to_the_range() -> None:
    with tcp.bind("127.0.0.1") as probe:
        port = probe.getsockname()[1]
    with tcp.bind("127.0.0.1", port, range(1, 2)) as sock:
        assert sock.getsockname()[1] == port


def test_a_failed_connection_names_its_step() -> None:
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
    """Return a listener that records the headers that it receives, and responds to each."""

    async def accept(sock: socket.socket, _address: str) -> None:
        received.append(await tcp.receive_header(sock))
        await tcp.send_header(sock, {"callerid": "/server"})
        sock.close()

    listener = tcp.Listener(accept)
    listener.open("127.0.0.1")
    return listener


async def greet(port: int) -> dict[str, str]:
    """Return the response to a correct client."""
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


def test_a_silent_peer_is_disconnected_after_a_while(
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


def test_silent_connections_neither_stop_the_node_nor_fill_its_log(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        received: list[dict[str, str]] = []
        listener = await serve(received)
        silent: list[socket.socket] = []
        try:
            # Use as many as this process may open. It has both sockets of each connection open, unless the listener
            # closes its own.
            for number in range(1000):
                silent.append(await tcp.connect("127.0.0.1", listener.port))
                if number % 100 == 99:
                    assert await greet(listener.port) == {"callerid": "/server"}
                if len(silent) == 300:
                    silent.pop(0).close()
            assert len(listener.handshakes) <= tcp.MAX_HANDSHAKES
            assert len(received) == 10
        finally:
            for sock in silent:
                sock.close()
            await listener.close()

    monkeypatch.setattr("minirospy.runtime.transport.rate_limited_logger.INTERVAL_SECONDS", 1e9)
    run(scene)
    lines = [record.getMessage() for record in caplog.records]
    assert lines[0].endswith("closed: it sent nothing, and 200 others are waiting")
    assert 10 < len(lines) < 30
    assert lines[-1].endswith(" more like the last ones")


def test_long_headers_share_a_limited_memory() -> None:
    """A client that sends the start of a long header occupies memory; a header of normal length must still be accepted."""

    async def scene() -> None:
        loop, memory = asyncio.get_running_loop(), tcp.HeaderMemory(300_000)
        with contextlib.ExitStack() as stack:

            def connect() -> tuple[socket.socket, socket.socket]:
                one, other = socket.socketpair()
                for sock in (one, other):
                    sock.setblocking(False)
                    stack.enter_context(sock)
                return one, other

            one, other = connect()
            long = serialize_header({"message_definition": "x" * 400_000})
            receiving = asyncio.ensure_future(tcp.receive_header(one, memory=memory))
            await loop.sock_sendall(other, long[:200_000])
            await until(lambda: memory.held >= 200_000 - 2 * 65536)

            second, other_second = connect()
            sending = asyncio.ensure_future(loop.sock_sendall(other_second, long))
            with pytest.raises(WireError, match="too many long connection headers"):
                await tcp.receive_header(second, memory=memory)
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)

            third, other_third = connect()
            short = {"topic": "/t", "message_definition": "x" * 20_000}
            sending = asyncio.ensure_future(loop.sock_sendall(other_third, serialize_header(short)))
            assert await tcp.receive_header(third, memory=memory) == short
            await sending

            receiving.cancel()
            await asyncio.gather(receiving, return_exceptions=True)
            assert memory.held == 0

    run(scene)


def test_closing_ends_handshakes_that_are_under_way() -> None:
    async def scene() -> None:
        listener = await serve([])
        sock = await tcp.connect("127.0.0.1", listener.port)
        await until(lambda: listener.handshakes)
        await listener.close()
        assert await asyncio.get_running_loop().sock_recv(sock, 1) == b""
        sock.close()
        with pytest.raises(ConnectionRefusedError):
            await tcp.connect("127.0.0.1", listener.port)
        await listener.close()

    run(scene)
