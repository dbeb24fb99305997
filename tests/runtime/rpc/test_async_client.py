"""runtime/rpc/async_client and runtime/master/notifier: connections that are reused, lost, refused or late; long lists."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from minirospy.base.errors import RpcError, RpcProtocolError, RpcTimeout, RpcUnreachable
from minirospy.core.graph.registry import PublisherUpdate
from minirospy.core.wire.xmlrpc import serialize_call
from minirospy.runtime.master.notifier import Notifier
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.rpc.turns import Turns
from tests.waiting import until

CALL = serialize_call("getPid", ["/x"])


class Publishers:
    """A graph whose topics have publishers, and which has no parameters."""

    def __init__(self, uris_of: Callable[[str], list[str]]) -> None:
        self.publisher_uris = uris_of

    def parameter(self, key: str) -> Any:
        raise AssertionError(key)

    def subscribed_parameters(self, uri: str) -> list[str]:
        raise AssertionError(uri)


def run(test: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(test(), 30))


def test_a_kept_connection_that_the_peer_closed_is_replaced() -> None:
    async def test() -> None:
        client, server = AsyncRpcClient(), RpcServer(lambda method, args: [method, *args])
        await server.start()
        uri = f"http://localhost:{server.port}/"
        assert await client.call(uri, "a", 1) == ["a", 1]
        await until(lambda: server.clients == 1)
        assert await client.call(uri, "a", 2) == ["a", 2]
        assert server.clients == 1
        for connection in list(server.connections):
            connection.end()
        assert await client.call(uri, "a", 3) == ["a", 3]
        await server.close()
        with pytest.raises(RpcUnreachable):
            await client.call(uri, "a", 4)
        assert not client.under_way
        await client.close()

    run(test)


def test_a_call_that_was_late_on_a_kept_connection_is_not_made_again() -> None:
    async def test() -> None:
        made: list[str] = []

        async def late() -> int:
            await asyncio.sleep(60)
            return 0

        def dispatch(method: str, _: object) -> object:
            made.append(method)
            return late() if method == "late" else 1

        server = RpcServer(dispatch)
        await server.start()
        client = RpcClient(f"http://127.0.0.1:{server.port}/", 30.0)
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(None, client.call, "quick")
        client.timeout = 0.2
        for kept in client.idle:
            kept.settimeout(0.2)
        with pytest.raises(RpcUnreachable, match=r"timed out after 0\.2 s"):
            await loop.run_in_executor(None, client.call, "late")
        assert made == ["quick", "late"]
        client.close()
        await server.close()

    run(test)


def test_a_server_at_the_ipv6_address_of_localhost_alone_is_found() -> None:
    if not socket.has_ipv6:
        pytest.skip("this machine has no IPv6")

    async def test() -> None:
        client, server = AsyncRpcClient(), RpcServer(lambda method, args: 5, bind_host="::1")
        try:
            await server.start()
        except OSError:
            pytest.skip("this machine has no IPv6")
        assert await client.call(f"http://localhost:{server.port}/", "a") == 5
        await client.close()
        await server.close()

    run(test)


def test_a_call_under_way_ends_with_its_client_or_its_time_limit() -> None:
    async def test() -> None:
        with socket.create_server(("127.0.0.1", 0)) as silent:
            uri = f"http://127.0.0.1:{silent.getsockname()[1]}/"
            client = AsyncRpcClient()
            # The server accepted the connection, so the fault is in its process, not its address.
            with pytest.raises(RpcTimeout, match=r"timed out after 0\.05 s"):
                await client.call(uri, "a", timeout=0.05)
            waiting = asyncio.ensure_future(client.call(uri, "a"))
            await until(lambda: client.under_way)
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)
            assert not client.under_way
            waiting = asyncio.ensure_future(client.call(uri, "a"))
            await until(lambda: client.under_way)
            await client.close()
            with pytest.raises(RpcUnreachable, match="closed"):
                await waiting

    run(test)


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (b"", "closed without an answer"),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "answered HTTP/1.1 404"),
        (b"garbage\r\n\r\n", "not HTTP"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 10\r\n\r\nabc", "ended inside a message"),
    ],
)
def test_bad_answers(answer: bytes, why: str) -> None:
    async def test() -> None:
        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.readuntil(b"</methodCall>")
            writer.write(answer)
            writer.close()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        client = AsyncRpcClient()
        with pytest.raises((RpcUnreachable, RpcProtocolError), match=why):
            await client.call(f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/", "a")
        await client.close()
        server.close()

    run(test)


def test_a_bad_uri_is_reported_immediately() -> None:
    async def test() -> None:
        client, found = AsyncRpcClient(), list[bytes | RpcError]()
        client.start("nonsense", CALL, 1.0, found.append)
        assert isinstance(found[0], RpcUnreachable)
        await client.close()

    run(test)


def test_without_a_file_descriptor_a_call_fails_and_the_next_one_is_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def test() -> None:
        received: list[str] = []
        server = RpcServer(lambda _, args: received.append(args[1]) or [1, "", 0])  # type: ignore[func-returns-value]
        await server.start()
        uri = f"http://127.0.0.1:{server.port}/"
        notifier = Notifier(Publishers(lambda _: []), Turns(), 60.0)

        def none_left(*_: object) -> None:
            raise OSError(errno.EMFILE, "Too many open files")

        with monkeypatch.context() as patch:
            patch.setattr(socket, "socket", none_left)
            notifier.send(PublisherUpdate(uri, "/lost"))
            await until(lambda: not notifier.nodes)
        notifier.send(PublisherUpdate(uri, "/notified"))
        await until(lambda: received)
        assert received == ["/notified"]
        assert notifier.line.under_way + notifier.suspect_line.under_way <= 1
        await notifier.close()
        await server.close()

    run(test)


def test_a_kept_connection_ends_with_its_server(monkeypatch: pytest.MonkeyPatch) -> None:
    # The connection is closed because the server closes, not because it was idle.
    monkeypatch.setattr("minirospy.runtime.rpc.async_client.KEEP_SECONDS", 1000.0)

    async def test() -> None:
        client, server = AsyncRpcClient(same_host=False), RpcServer(lambda *_: 5)
        await server.start()
        await client.call(f"http://127.0.0.1:{server.port}/", "a")
        await until(lambda: client.idle)
        await server.close()
        await until(lambda: not client.idle)
        await client.close()

    run(test)


def test_unrequested_bytes_of_a_server_are_not_an_answer() -> None:
    body = b"<methodResponse><params><param><value>%d</value></param></params></methodResponse>"
    calls = ended = 0

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal calls, ended
        # It continues until the client has disconnected.
        with contextlib.suppress(asyncio.IncompleteReadError, OSError):
            while await reader.readuntil(b"</methodCall>\n"):
                calls += 1
                one = body % calls
                answer = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s" % (len(one), one)
                writer.write(answer + answer[:-5])
        with contextlib.suppress(OSError):
            writer.close()
            await writer.wait_closed()
        ended += 1

    async def test() -> None:
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        client = AsyncRpcClient()
        uri = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/"
        assert [await client.call(uri, "a") for _ in range(3)] == ["1", "2", "3"]
        await client.close()
        await until(lambda: ended == 3)
        server.close()

    run(test)
