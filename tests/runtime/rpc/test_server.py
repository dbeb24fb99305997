"""runtime/rpc/server: clients are served in turns, and a time limit applies only to clients that make no progress."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from minirospy.core.wire.http import HttpReader, serialize_request
from minirospy.core.wire.xmlrpc import serialize_call
from minirospy.runtime.rpc import connection as connections
from minirospy.runtime.rpc import server as servers
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.rpc.turns import Turns
from tests.waiting import until


def call(method: str, *args: Any) -> bytes:
    return serialize_request("localhost", "/", serialize_call(method, args))


def connect(server: RpcServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), 100)


def test_many_requests_of_a_client_do_not_delay_others() -> None:
    called: list[str] = []

    def dispatch(method: str, args: Sequence[Any]) -> str:
        called.append(method)
        return method

    async def scene() -> bytes:
        server = RpcServer(dispatch)
        server.turns = Turns(seconds=0.0)
        await server.start()
        with connect(server) as greedy, connect(server) as modest:
            greedy.sendall(b"".join(call(f"greedy{number}") for number in range(50)))
            modest.sendall(call("modest"))
            await until(lambda: len(called) == 51)
            await until(lambda: all(each.is_idle for each in server.connections))
            greedy.setblocking(False)
            answers = b""
            while b"greedy49" not in answers:
                answers += await asyncio.get_running_loop().sock_recv(greedy, 65536)
        await server.close()
        return answers

    answers = asyncio.run(scene())
    assert called.index("modest") < 10
    places = [answers.index(b"greedy%d<" % number) for number in range(50)]
    assert places == sorted(places)


def test_a_client_that_is_disconnected_amid_its_requests_gets_no_answers() -> None:
    called: list[str] = []

    def dispatch(method: str, args: Sequence[Any]) -> int:
        called.append(method)
        return 1

    async def scene() -> int:
        server = RpcServer(dispatch)
        server.turns = Turns(seconds=0.0)
        await server.start()
        with connect(server) as greedy:
            greedy.sendall(call("more") * 50)
            while not called:  # poll on every loop iteration: after a pause, all fifty calls would be done
                await asyncio.sleep(0)
            for each in list(server.connections):
                each.end()
            before = len(called)
            for _ in range(5):
                await asyncio.sleep(0)
        await server.close()
        return before

    assert asyncio.run(scene()) == len(called) < 50


def test_the_time_limit_restarts_for_a_client_that_makes_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PROGRESS_BYTES", 10_000)

    async def scene() -> None:
        server = RpcServer(lambda *_: "x" * 20_000_000)
        await server.start()
        with connect(server) as client:

            def limit() -> float:
                return max(server.deadlines._ends.values(), default=0.0)

            request = call("take", "x" * 50_000)
            client.sendall(request[:100])
            await until(limit)
            first = limit()
            held = next(iter(server.connections))
            client.sendall(request[100:30_000])
            await until(lambda: limit() > first)
            client.sendall(request[30_000:])
            await until(lambda: held._out)
            # The response is being sent.
            first = limit()
            client.setblocking(False)
            while limit() == first:
                await asyncio.get_running_loop().sock_recv(client, 3_000_000)
        await server.close()

    asyncio.run(scene())


@pytest.mark.parametrize("last_closes", [False, True])
def test_a_client_is_not_read_from_while_its_method_waits(last_closes: bool) -> None:
    called: list[str] = []

    async def scene() -> bytes:
        go_on = asyncio.Event()

        async def dispatch(method: str) -> str:
            await go_on.wait()
            called.append(method)
            return method

        server = RpcServer(lambda method, _: dispatch(method))
        await server.start()
        with connect(server) as greedy:
            requests = [call(f"greedy{number}") for number in range(1000)]
            if last_closes:
                requests[500] = requests[500].replace(b"\r\n", b"\r\nConnection: close\r\n", 1)
            greedy.sendall(b"".join(requests))
            await until(lambda: server.connections)
            (connection,) = server.connections
            await until(lambda: connection._message)
            for _ in range(100):
                await asyncio.sleep(0)
            # The received data that is already in memory is not parsed, either.
            assert connection._reader.held < 500 * len(requests[0])
            go_on.set()
            greedy.setblocking(False)
            answers = b""
            # The peer resets the connection if data arrives after its final response.
            with contextlib.suppress(ConnectionResetError):
                while b"greedy999<" not in answers:
                    answers += await asyncio.get_running_loop().sock_recv(greedy, 65536) or b"greedy999<"
        await server.close()
        return answers

    answers = asyncio.run(scene())
    assert called == [f"greedy{number}" for number in range(501 if last_closes else 1000)]
    assert last_closes or answers.count(b"HTTP/1.1 200") == 1000


def test_a_client_that_does_not_read_its_answers_is_not_read_from() -> None:
    async def scene() -> None:
        calls: list[int] = []

        def dispatch(method: str, args: Sequence[Any]) -> str:
            calls.append(args[0])
            return "x" * 30_000

        server = RpcServer(dispatch)
        await server.start()
        loop = asyncio.get_running_loop()
        client = socket.socket()
        client.setblocking(False)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 65536)
        await loop.sock_connect(client, ("127.0.0.1", server.port))

        # The requests exceed the system's buffers; a server that continued to read would read all of them.
        asked = [call("m", number, "x" * 10_000) for number in range(4000)]
        left = memoryview(b"".join(asked))
        blocked = 0
        while left and blocked < 200:
            try:
                left = left[client.send(left) :]
                blocked = 0
            except BlockingIOError:
                blocked += 1
            await asyncio.sleep(0)
        assert left
        assert len(calls) < 200

        async def ask_rest() -> None:
            await loop.sock_sendall(client, left)

        asking = asyncio.ensure_future(ask_rest())
        reader, answers = HttpReader(), 0
        while answers < len(asked):
            answers += len(reader.feed(await loop.sock_recv(client, 65536)))
        await asking
        assert calls == list(range(len(asked)))
        client.close()
        await server.close()

    asyncio.run(scene())


@pytest.mark.parametrize("is_known", [True, False])
def test_clients_do_not_wait_for_a_crowd_that_disconnects(is_known: bool) -> None:
    crowd, left = 400, []

    async def scene() -> None:
        server = RpcServer(lambda method, args: left.append(len(server.connections)) or 0)
        await server.start()
        with contextlib.ExitStack() as stack:
            good = stack.enter_context(connect(server))
            if is_known:
                good.sendall(call("getPid"))
                await until(lambda: left)
            silent = [connect(server) for _ in range(crowd)]
            await until(lambda: len(server.connections) == crowd + 1)
            for sock in silent:
                sock.close()
            # This client's request arrives after all requests of the other clients are finished.
            if not is_known:
                good = stack.enter_context(connect(server))
            good.sendall(call("getPid"))
            await until(lambda: len(left) == 1 + is_known)
            await until(lambda: len(server.connections) <= 2)
        await server.close()

    asyncio.run(scene())
    assert left[-1] > crowd // 4


class Late:
    """A connection whose data has not been read yet."""

    def __init__(self, name: str, log: list[str]) -> None:
        self.name = name
        self.log = log

    def read(self) -> None:
        self.log.append(self.name)


def admit(server: RpcServer, late: Late, *, is_new: bool = False) -> bool:
    """Do the same as the loop does if a connection has data."""
    is_admitted = server.admit(late, is_new=is_new)  # type: ignore[arg-type]
    if is_admitted:
        late.read()
    return is_admitted


def test_connections_that_are_too_many_come_first_in_the_next_iteration(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(servers, "time", SimpleNamespace(perf_counter=lambda: 1.0))

    async def scene() -> tuple[list[str], list[str], list[str]]:
        log: list[str] = []
        server = RpcServer(lambda method, args: 0)
        admitted = [name for name in map(str, range(300)) if admit(server, Late(name, log))]
        gone = Late("gone", log)
        assert not admit(server, gone)
        server.drop_late(gone)  # type: ignore[arg-type]
        assert not admit(server, Late("new", log), is_new=True)
        first = list(log)
        await asyncio.sleep(0)
        await server.close()
        return admitted, first, log[len(first) :]

    admitted, first, then = asyncio.run(scene())
    assert first == admitted == [str(number) for number in range(255)]
    assert then == ["255", "new", *(str(number) for number in range(256, 300))]


def test_new_connections_are_read_from_both_ends_of_the_queue() -> None:
    async def scene() -> list[str]:
        log: list[str] = []
        server = RpcServer(lambda method, args: 0)
        for number in range(8):
            server._late_new[Late(str(number), log)] = None  # type: ignore[index]
        server._start_iteration()
        await server.close()
        return log

    # One end is the client that has been idle longest before it disconnects, the other end is the newest client.
    assert set(asyncio.run(scene())[:4]) == {"7", "0", "6", "1"}


def test_reading_ends_when_the_time_for_it_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    def clock() -> float:
        nonlocal now
        now += 0.004
        return now

    async def scene() -> int:
        log: list[str] = []
        server = RpcServer(lambda method, args: 0)
        while admit(server, Late("", log)):
            pass
        await server.close()
        return len(log)

    monkeypatch.setattr(servers, "time", SimpleNamespace(perf_counter=clock))
    # The clock is read after every 16 connections.
    assert asyncio.run(scene()) == 3 * 16 - 1


def test_connections_are_accepted_for_some_milliseconds_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    def clock() -> float:
        nonlocal now
        now += 0.001
        return now

    async def scene() -> tuple[int, int]:
        server = RpcServer(lambda method, args: 0)
        await server.start()
        with contextlib.ExitStack() as stack:
            for _ in range(50):
                stack.enter_context(connect(server))
            server._accept(server._listening[0])
            accepted = len(server.connections)
            await until(lambda: len(server.connections) == 50)
        await server.close()
        return accepted, len(server.connections)

    monkeypatch.setattr(servers, "time", SimpleNamespace(perf_counter=clock))
    accepted, _ = asyncio.run(scene())
    assert accepted == 15


def test_connections_that_may_displace_each_other_are_read_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 0.0

    def clock() -> float:
        nonlocal now
        now += 0.001
        return now

    made: list[object] = []
    read: list[object] = []

    class Recorded(connections.Connection):
        def __init__(self, *args: Any) -> None:
            super().__init__(*args)
            made.append(self)

        def read(self) -> None:
            read.append(self)

    async def scene() -> None:
        server = RpcServer(lambda method, args: 0, max_idle=2)
        await server.start()
        with contextlib.ExitStack() as stack:
            for _ in range(8):
                stack.enter_context(connect(server))
            await until(lambda: len(made) == 8)
        await server.close()

    monkeypatch.setattr(servers, "time", SimpleNamespace(perf_counter=clock))
    monkeypatch.setattr(servers, "Connection", Recorded)
    asyncio.run(scene())
    assert read[:8] == made
