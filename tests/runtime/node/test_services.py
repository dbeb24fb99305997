"""A service and its clients in one process: bytes in, bytes out, and which side closes the connection when."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, NamedTuple

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import CallFailed, HandshakeRefused, ServiceException, WireError
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.service_client import ServiceClient, parse_service_uri
from minirospy.runtime.node.services import AsyncServiceClient, LoopServiceServer, ServiceServer
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port

TYPE = InterfaceType("a/B", "0" * 32)
TYPES = {"request_type": "a/BRequest", "response_type": "a/BResponse"}


class Unprintable(Exception):
    def __str__(self) -> str:
        raise ValueError("no text")


FAULTS: dict[bytes, tuple[Exception, bytes]] = {
    b"value": (ValueError("no such joint"), b"error processing request: no such joint"),
    # This error is about a file that the handler reads, not about the connection.
    b"os": (FileNotFoundError("no map"), b"error processing request: no map"),
    b"wire": (WireError("short"), b"error processing request: short"),
    b"bytes": (ValueError("name \udcff"), b"error processing request: name \\udcff"),
    b"sent": (ServiceException("name \udcff"), b"name \\udcff"),
    b"text": (Unprintable(), b"error processing request: Unprintable"),
}
"""Dict from request to the handler's exception and the client's response."""

EXITS: dict[bytes, tuple[BaseException, bytes]] = {
    b"exit": (SystemExit(3), b"error processing request: SystemExit: 3"),
    b"exit without a status": (SystemExit(), b"error processing request: SystemExit"),
    b"generator": (GeneratorExit(), b"error processing request: GeneratorExit"),
    b"interrupt": (KeyboardInterrupt(), b"error processing request: KeyboardInterrupt"),
}
"""The same for exceptions that do not derive from Exception: in a coroutine, asyncio handles them."""


class Scene(NamedTuple):
    """A node, its loop, and its services /worker and /loop, which behave the same."""

    node: Node
    loop: LoopThread
    gate: threading.Event
    called: threading.Event

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        return self.loop.run(coroutine, 30.0)

    def client(self, service: str, *, persistent: bool = False, md5sum: str = TYPE.md5sum) -> ServiceClient:
        return ServiceClient(self.node.service_uri, service, md5sum, "/test", persistent=persistent)


@pytest.fixture
def scene(master: str) -> Iterator[Scene]:
    loop = LoopThread("scene")
    gate, called = threading.Event(), threading.Event()
    node = Node("/n", Environment.read())

    def handle(request: memoryview, _: object) -> bytes:
        if bytes(request) == b"wait":
            called.set()
            gate.wait(30)
        if bytes(request) == b"fail":
            raise ServiceException("zażółć")
        if bytes(request) in FAULTS:
            raise FAULTS[bytes(request)][0]
        if bytes(request) in EXITS:
            raise EXITS[bytes(request)][0]
        if bytes(request) == b"none":
            return None  # type: ignore[return-value]
        return bytes(request)[::-1]

    async def handle_on_loop(request: bytes, _: object) -> bytes:
        if request == b"wait":
            called.set()
            await asyncio.to_thread(gate.wait, 30)
        if request == b"cancel":
            raise asyncio.CancelledError
        return handle(memoryview(request), None)

    async def start() -> None:
        await node.start()
        await node.serve(ServiceServer("/worker", TYPE, "/n", handle, workers=node.workers, **TYPES))
        await node.serve(
            LoopServiceServer("/loop", TYPE, "/n", handle_on_loop, workers=node.workers, **TYPES)
        )

    loop.run(start())
    yield Scene(node, loop, gate, called)
    gate.set()
    loop.run(node.close())
    loop.close()


both = pytest.mark.parametrize("service", ["/worker", "/loop"])


@both
def test_calls(scene: Scene, service: str) -> None:
    client = scene.client(service)
    assert client.header["service"] == service
    assert client.call(b"abc") == b"cba"
    with pytest.raises((WireError, OSError)):
        client.call(b"abc")
    client.close()
    client.close()
    kept = scene.client(service, persistent=True)
    large = bytes(range(256)) * 20_000
    for body in (b"", b"abc", large, b"x"):
        assert kept.call(body) == body[::-1]
    with pytest.raises(CallFailed, match="zażółć") as caught:
        kept.call(b"fail")
    assert caught.value.text == "zażółć".encode()
    assert kept.call(b"abc") == b"cba"
    assert not kept.has_ended()
    kept.close()


@both
def test_calls_on_the_loop(scene: Scene, service: str) -> None:
    async def main() -> None:
        client = await AsyncServiceClient.connect(
            scene.node.service_uri, service, TYPE.md5sum, "/test", persistent=True
        )
        large = bytes(range(256)) * 20_000
        for body in (b"", b"abc", large):
            assert await client.call(body) == body[::-1]
        with pytest.raises(CallFailed, match="zażółć"):
            await client.call(b"fail")
        assert not client.has_ended()
        client.close()
        with pytest.raises(HandshakeRefused, match="md5sums do not match"):
            await AsyncServiceClient.connect(scene.node.service_uri, service, "1" * 32, "/test")

    scene.run(main())


@both
def test_request_over_the_limit_is_refused_with_its_reason(
    scene: Scene, service: str, caplog: pytest.LogCaptureFixture
) -> None:
    client = scene.client(service)
    client._sock.sendall(struct.pack("<I", 0xFFFFFFFE))
    assert client._sock.recv(1) == b""
    client.close()
    # The connection is closed after the line is logged.
    assert (
        f"service {service}: client /test is disconnected: a body of 4294967294 bytes is over" in caplog.text
    )


@pytest.mark.parametrize("request_", EXITS)
def test_handler_that_exits_is_answered_and_served_on(scene: Scene, request_: bytes) -> None:
    client = scene.client("/worker", persistent=True)
    with pytest.raises(CallFailed) as caught:
        client.call(request_)
    assert caught.value.text == EXITS[request_][1]
    assert client.call(b"abc") == b"cba"
    client.close()


@both
@pytest.mark.parametrize("request_", FAULTS)
def test_handler_that_raises_is_answered_and_served_on(scene: Scene, service: str, request_: bytes) -> None:
    client = scene.client(service, persistent=True)
    with pytest.raises(CallFailed) as caught:
        client.call(request_)
    assert caught.value.text == FAULTS[request_][1]
    assert client.call(b"abc") == b"cba"
    client.close()


@pytest.mark.parametrize("request_", [b"exit", b"exit without a status"])
def test_coroutine_that_calls_exit_is_answered_and_its_loop_goes_on(scene: Scene, request_: bytes) -> None:
    client = scene.client("/loop", persistent=True)
    with pytest.raises(CallFailed) as caught:
        client.call(request_)
    assert caught.value.text == EXITS[request_][1]
    assert client.call(b"abc") == b"cba"
    client.close()


@both
def test_handler_that_returns_no_bytes_is_answered(scene: Scene, service: str) -> None:
    client = scene.client(service)
    with pytest.raises(CallFailed, match="error processing request: "):
        client.call(b"none")
    client.close()


def test_handler_on_the_loop_that_is_cancelled_is_answered(scene: Scene) -> None:
    client = scene.client("/loop")
    with pytest.raises(CallFailed, match="error processing request: it was cancelled"):
        client.call(b"cancel")
    client.close()


@both
def test_closing_hangs_up_on_those_that_wait_for_nothing(scene: Scene, service: str) -> None:
    idle = scene.client(service, persistent=True)
    assert idle.call(b"ab") == b"ba"
    busy = scene.client(service, persistent=True)
    answers: list[bytes] = []
    calling = threading.Thread(target=lambda: answers.append(busy.call(b"wait")))
    calling.start()

    assert scene.called.wait(30)
    scene.run(scene.node.unserve(scene.node.services[service]))
    with pytest.raises((WireError, OSError)):
        idle.call(b"ab")
    scene.gate.set()
    calling.join(30)

    assert len(answers) == 1
    with pytest.raises((WireError, OSError)):
        busy.call(b"ab")
    assert busy.has_ended()

    busy.close()
    idle.close()


def test_hang_up_ends_a_call_of_another_thread(scene: Scene) -> None:
    client = scene.client("/worker")
    errors: list[BaseException] = []

    def call() -> None:
        try:
            client.call(b"wait")
        except (WireError, OSError) as error:
            errors.append(error)

    calling = threading.Thread(target=call)
    calling.start()
    assert scene.called.wait(30)
    client.hang_up()
    calling.join(30)
    assert "unable to receive data from sender" in str(errors[0])
    client.close()


def test_refusals(scene: Scene) -> None:
    with pytest.raises(HandshakeRefused, match="md5sums do not match"):
        scene.client("/worker", md5sum="1" * 32)
    with pytest.raises(HandshakeRefused, match=r"\[/n\] is not a provider of  \[/nothing\]"):
        scene.client("/nothing")
    scene.client("/worker", md5sum=ANY).close()
    with pytest.raises(OSError, match="refused"):
        ServiceClient(f"rosrpc://localhost:{free_port()}", "/s", ANY, "/test")


Serve = Callable[[bytes], str]


@pytest.fixture
def liar() -> Iterator[Serve]:
    """Yield a function that serves fixed bytes to one connection and closes it. The function returns the URI."""
    threads: list[threading.Thread] = []

    def serve(answer: bytes) -> str:
        listening = socket.create_server(("127.0.0.1", 0))

        def run() -> None:
            with listening, listening.accept()[0] as sock:
                sock.recv(65536)
                sock.sendall(answer)

        threads.append(threading.Thread(target=run))
        threads[-1].start()
        return f"rosrpc://127.0.0.1:{listening.getsockname()[1]}"

    yield serve
    for thread in threads:
        thread.join(30)


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (b"", r"terminated before handshake header received. 0 bytes"),
        (b"\x10\0\0\0abc", r"terminated before handshake header received. 3 bytes"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not speak TCPROS"),
        (b"\0\0\0\0", r"header missing required field \[md5sum\]"),
        (b"\x0a\0\0\0\x06\0\0\0error=", "^$"),
        (b"\x05\0\0\0\x01\0\0\0x", "has no '='"),
    ],
)
def test_bad_servers(liar: Serve, answer: bytes, error: str) -> None:
    with pytest.raises(WireError, match=error):
        ServiceClient(liar(answer), "/s", ANY, "/test")


@pytest.mark.parametrize(
    "uri", ["", "http://localhost:1", "rosrpc://localhost", "rosrpc://:1", "rosrpc://a:x"]
)
def test_bad_uris(uri: str) -> None:
    with pytest.raises(WireError, match="protocol uri is invalid"):
        parse_service_uri(uri)
