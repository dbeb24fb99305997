"""Connections: refusals, limits, slow clients, HTTP pages, TLS; with real sockets."""

from __future__ import annotations

import contextlib
import json
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from http.client import HTTPConnection, HTTPSConnection
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import pytest
from std_msgs.msg import String, UInt8MultiArray
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.typing import Subprotocol

from minirospy.base.errors import BridgeError
from minirospy.web.access import Access, Grant
from minirospy.web.server import owners
from minirospy.web.server.account import Account
from minirospy.web.server.admission import Rank
from minirospy.web.server.client import Limits
from minirospy.web.server.connection import Connection
from minirospy.web.server.pipe import Endpoints
from minirospy.web.server.rate import ConnectionRate
from minirospy.web.server.turns import FairTurns
from tests.waiting import wait_until

if TYPE_CHECKING:
    from tests.web.conftest import Client, Running

HANDSHAKE = (
    "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
)


def raw_answer(port: int, request: bytes) -> bytes:
    """Return a server's complete response to these bytes."""
    with socket.create_connection(("127.0.0.1", port), 30) as sock:
        sock.sendall(request)
        return read_all(sock)


def read_all(sock: socket.socket) -> bytes:
    data = b""
    while more := sock.recv(65536):
        data += more
    return data


def page(port: int, path: str, **headers: str) -> tuple[int, str]:
    connection = HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request(
        "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
    )
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body


def assert_alive(client: Client) -> None:
    client.send(op="getParameters", parameterNames=["/none"], id="alive")
    client.next("parameterValues", lambda each: each.get("id") == "alive")


@pytest.mark.parametrize(
    ("options", "status", "text"),
    [
        ({"subprotocols": ("x.v1",)}, 400, "foxglove.sdk.v1 or foxglove.websocket.v1 is required"),
        ({"subprotocols": None}, 400, "is required"),
        ({"origin": "https://evil.example"}, 403, "pages of 'https://evil.example' may not connect"),
        ({"additional_headers": {"Host": "evil.example"}}, 403, "Host"),
    ],
)
def test_unwanted_clients_are_refused_with_one_line(
    bridge: Running, options: dict[str, Any], status: int, text: str
) -> None:
    with pytest.raises(InvalidStatus) as caught:
        bridge.client(**options)
    response = caught.value.response
    assert response.status_code == status
    body = bytes(response.body or b"").decode()
    assert text in body
    assert body.count("\n") == 1


def test_both_sub_protocols_are_served_and_the_newer_is_preferred(bridge: Running) -> None:
    for offered, chosen in (
        (("foxglove.websocket.v1",), "foxglove.websocket.v1"),
        (("foxglove.sdk.v1",), "foxglove.sdk.v1"),
        (("x", "foxglove.websocket.v1", "foxglove.sdk.v1"), "foxglove.sdk.v1"),
    ):
        client = bridge.client(subprotocols=tuple(map(Subprotocol, offered)))
        assert client.socket.subprotocol == chosen
        client.next("serverInfo")


def test_page_that_an_option_would_admit_is_named_in_the_terminal(
    run_bridge: Callable[..., Running], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.runtime.transport.rate_limited_logger.INTERVAL_SECONDS", 1e9)
    bridge = run_bridge()
    for origin in ("null", "https://other.example"):
        with pytest.raises(InvalidStatus) as caught:
            bridge.client(additional_headers={"Origin": origin})
        assert caught.value.response.status_code == 403
    warnings = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert warnings == [
        "refused: a page that was opened from a file (Origin: null) may not connect: start the bridge with --origin null"
    ]  # the second one within the interval is only counted


def test_wrong_token_is_refused_and_never_logged(
    run_bridge: Callable[..., Running], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("DEBUG")
    bridge = run_bridge(access=Access(write_token="right-token-000", requires_token=True))
    for options in ({}, {"path": "/?token=wrong-token-000"}):
        with pytest.raises(InvalidStatus) as caught:
            bridge.client(**options)
        assert caught.value.response.status_code == 401
    for options in (
        {"path": "/?token=right-token-000"},
        {"additional_headers": {"Authorization": "Bearer right-token-000"}},
        {"subprotocols": ("foxglove.sdk.v1", "minirospy.token.right-token-000")},
    ):
        client = bridge.client(**options)
        assert client.socket.subprotocol in ("foxglove.sdk.v1", "foxglove.websocket.v1")
        client.next("serverInfo")
    ours = [record.getMessage() for record in caplog.records if record.name.startswith("minirospy")]
    assert any("401" in text for text in ours)
    assert not [text for text in ours if "token-000" in text]


@pytest.mark.parametrize(
    "request_",
    [
        b"nonsense\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\nhi",
        b"GET /" + b"a" * 9000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 200 + b"\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nBad Header\r\n\r\n",
        b"GET //[ HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://[\r\n\r\n",
        b"GET /?" + b"a=1&" * 100 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\0" * 60 + b"\r\n",
    ],
)
def test_invalid_http_gets_a_clear_status(bridge: Running, request_: bytes) -> None:
    answer = raw_answer(bridge.port, request_)
    assert answer.startswith((b"HTTP/1.1 4", b"HTTP/1.1 5")), answer[:80]
    assert_alive(bridge.client())


def test_pages_of_the_server(bridge: Running) -> None:
    assert page(bridge.port, "/nothing") == (
        404,
        "there is no such page; WebSocket clients are served here\n",
    )
    status, body = page(bridge.port, "/status")
    assert status == 200
    assert json.loads(body)["node"] == "/bridge"
    assert page(bridge.port, "/status", Host="evil.example")[0] == 403
    assert page(bridge.port, "/status", Origin="https://evil.example")[0] == 403


def test_oversize_and_broken_frames_end_their_connection_alone(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(message=1000))
    other = bridge.client()
    client = bridge.client()
    client.send_binary(bytes(2000))
    with pytest.raises(ConnectionClosed) as caught:
        client.next("never")
    assert caught.value.rcvd is not None
    assert caught.value.rcvd.code == 1009

    for frame, code in ((b"\x81\x81\0\0\0\0\xff", 1007), (b"\x83\x80\0\0\0\0", 1002), (b"\x81\x01x", 1002)):
        answer = raw_answer(bridge.port, HANDSHAKE.encode() + frame)
        assert code.to_bytes(2, "big") in answer[-40:], (frame, answer[-40:])
    assert_alive(other)


def test_fragments_of_a_message_are_joined(bridge: Running) -> None:
    client = bridge.client()
    client.socket.send(
        part for part in ('{"op": "getPara', 'meters", "parameterNames": [], "id"', ': "joined"}')
    )
    assert client.next("parameterValues")["id"] == "joined"


def fragment(length: int, *, starts: bool = False) -> bytes:
    """Return a frame that is a part of a binary message, but not the last part."""
    return (
        bytes([Opcode.BINARY if starts else Opcode.CONT, 0xFE])
        + length.to_bytes(2, "big")
        + bytes(4 + length)
    )


def test_unfinished_messages_of_all_clients_are_limited(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(memory=1_000_000))
    listener = bridge.bridge.listeners["foxglove"]

    def wait_for_unfinished(total: int) -> None:
        wait_until(
            lambda: bridge.call(lambda: sum(each.unfinished for each in listener.connections)) == total
        )

    other = bridge.client()
    with contextlib.ExitStack() as stack:
        socks = [
            stack.enter_context(socket.create_connection(("127.0.0.1", bridge.port), 30)) for _ in range(20)
        ]
        for sock in socks:
            sock.sendall(HANDSHAKE.encode() + fragment(30_000, starts=True))
        # Responses count too until they are sent, so the sum stays below the limit by a margin.
        socks[7].sendall(fragment(30_000) * 10)
        wait_for_unfinished(900_000)

        socks[3].sendall(fragment(30_000) * 5)
        wait_for_unfinished(19 * 30_000 + 150_000)
        answer = read_all(socks[7])
        assert (1013).to_bytes(2, "big") + b"too many unfinished messages" in answer
        assert_alive(other)
    wait_for_unfinished(0)
    assert_alive(other)


def test_client_that_answers_pings_stays_connected(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(ping_seconds=0.05))
    client = bridge.client()
    client.next("serverInfo")
    client.socket.ping().wait(30)
    (connection,) = bridge.bridge.listeners["foxglove"].connections
    # From now on, the connection sends nothing without a request.
    liveness = connection.liveness
    heard = liveness.received
    wait_until(lambda: liveness.received > heard)
    assert_alive(client)


def test_clients_that_answer_no_ping_are_disconnected(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(ping_seconds=0.05, silent_seconds=0.2))
    with socket.create_connection(("127.0.0.1", bridge.port), 30) as silent:
        silent.sendall(HANDSHAKE.encode())
        data = read_all(silent)
    assert bytes([0x80 | Opcode.PING, 9]) + b"minirospy" in data


@pytest.fixture
def strangers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the listeners treat the test's clients as clients of another user."""
    monkeypatch.setattr("minirospy.web.server.listener.is_own_user", lambda peer, here: False)


@pytest.mark.usefixtures("strangers")
def test_connections_beyond_the_limit_are_refused(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(connections=10, reserve=10, handshake_seconds=1000.0))
    first = bridge.client()
    # This is the number of connections that an address may have without a request.
    held = [bridge.client().socket.socket for _ in range(3)]
    held += [socket.create_connection(("127.0.0.1", bridge.port), 30) for _ in range(16)]
    for _ in range(200):
        answer = raw_answer(bridge.port, b"")
        assert answer.startswith(b"HTTP/1.1 503 "), answer
    listener = bridge.bridge.listeners["foxglove"]
    assert len(listener.connections) == 20
    assert listener.refused >= 200
    assert_alive(first)
    for sock in held:
        sock.close()
    wait_until(lambda: bridge.call(lambda: len(listener.connections)) <= 1)
    assert_alive(bridge.client())


@pytest.mark.usefixtures("strangers")
def test_silent_connections_give_way_to_clients(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(connections=20, reserve=0, handshake_seconds=1000.0))
    first = bridge.client()
    held = [socket.create_connection(("127.0.0.1", bridge.port), 30) for _ in range(19)]
    listener = bridge.bridge.listeners["foxglove"]
    wait_until(lambda: bridge.call(lambda: len(listener.connections)) == 20)

    def age() -> None:
        for each in listener.connections:
            each.active -= 10.0

    bridge.call(age)
    clients = [bridge.client() for _ in range(19)]
    for client in (first, *clients):
        assert_alive(client)
    assert raw_answer(bridge.port, b"").startswith(b"HTTP/1.1 503 ")
    for sock in held:
        with contextlib.suppress(ConnectionError):
            assert read_all(sock) == b""
        sock.close()


@pytest.mark.usefixtures("strangers")
def test_thousand_connections_leave_the_first_ones_unaffected(
    run_bridge: Callable[..., Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    bridge = run_bridge(limits=Limits(handshake_seconds=1000.0, connection_burst=2000))
    first = bridge.client()
    first.next("serverInfo")
    listener = bridge.bridge.listeners["foxglove"]
    with contextlib.ExitStack() as stack:
        socks = [
            stack.enter_context(socket.create_connection(("127.0.0.1", bridge.port), 30)) for _ in range(1000)
        ]
        # The limit is 256 clients, and 32 more until their requests are known. The oldest are closed for the newest.
        for sock in socks[: 1000 - 287]:
            with contextlib.suppress(ConnectionError):
                assert read_all(sock) == b""
        assert bridge.call(lambda: len(listener.connections)) == 288
        assert_alive(first)
        assert_alive(bridge.client())


def idle_clients(bridge: Running, count: int) -> list[socket.socket]:
    """Return clients that have been served and are idle."""
    socks = []
    for _ in range(count):
        socks.append(socket.create_connection(("127.0.0.1", bridge.port), 30))
        socks[-1].sendall(HANDSHAKE.encode())
        assert socks[-1].recv(12) == b"HTTP/1.1 101"
    return socks


@pytest.mark.usefixtures("strangers")
def test_idle_clients_do_not_block_new_ones(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(connections=20))
    listener = bridge.bridge.listeners["foxglove"]
    with contextlib.ExitStack() as stack:
        idle = [stack.enter_context(sock) for sock in idle_clients(bridge, 20)]
        answer = raw_answer(bridge.port, HANDSHAKE.encode())
        assert answer.startswith(b"HTTP/1.1 503 ")
        assert b"\r\nRetry-After: 5\r\n" in answer
        assert answer.endswith(b"\r\n\r\ntoo many connections.\n")
        assert listener.refused == 1

        def age() -> None:
            for number, each in enumerate(sorted(listener.connections, key=lambda each: each.active)):
                each.active -= 60.0 - number

        bridge.call(age)
        # The client that has been idle longest is closed, with a message that says why.
        assert_alive(bridge.client())
        assert (1013).to_bytes(2, "big") + b"another client needs the place" in read_all(idle[0])
        assert bridge.call(lambda: len(listener.connections)) == 20
        clients = [bridge.client() for _ in range(19)]
        for client in clients:
            assert_alive(client)
        with pytest.raises(InvalidStatus, match="503"):
            bridge.client()


@pytest.mark.usefixtures("strangers")
def test_owner_is_admitted_if_others_occupy_all_connections(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(
        limits=Limits(connections=20, reserve=2), access=Access(write_token="right-token-000")
    )
    listener = bridge.bridge.listeners["foxglove"]
    with contextlib.ExitStack() as stack:
        for sock in idle_clients(bridge, 20):
            stack.enter_context(sock)
        with pytest.raises(InvalidStatus, match="503"):
            bridge.client()
        owners = [bridge.client(path="/?token=right-token-000") for _ in range(20)]
        for owner in owners:
            assert_alive(owner)
        assert bridge.call(lambda: {each.rank for each in listener.connections}) == {Rank.OWN}
        # These clients do not displace each other.
        with pytest.raises(InvalidStatus, match="503"):
            bridge.client(path="/?token=right-token-000")


@pytest.mark.skipif(sys.platform != "linux", reason="the user of a client is known on Linux alone")
def test_programs_of_the_same_user_get_in_and_stay(
    run_bridge: Callable[..., Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    bridge = run_bridge(limits=Limits(connections=20, reserve=2))
    listener = bridge.bridge.listeners["foxglove"]
    own: set[int] = set()

    def is_own_user(peer: tuple[str, int], here: tuple[str, int]) -> bool:
        # In the kernel's table, one user owns all clients of this test.
        return owners.is_own_user(peer, here) and peer[1] in own

    monkeypatch.setattr("minirospy.web.server.listener.is_own_user", is_own_user)
    with contextlib.ExitStack() as stack:
        for sock in idle_clients(bridge, 20):
            stack.enter_context(sock)
        for _ in range(2):
            stack.enter_context(socket.create_connection(("127.0.0.1", bridge.port), 30))
        bridge.call(lambda: setattr(listener, "rate", ConnectionRate(0, 0, time.monotonic)))
        assert raw_answer(bridge.port, b"").startswith(b"HTTP/1.1 429 ")

        with socket.socket() as mine:
            mine.bind(("127.0.0.1", 0))
            own.add(mine.getsockname()[1])
            mine.settimeout(30)
            mine.connect(("127.0.0.1", bridge.port))
            mine.sendall(HANDSHAKE.encode())
            assert mine.recv(12) == b"HTTP/1.1 101"
            # However long it is idle, no other user's client displaces it.
            bridge.call(lambda: setattr(listener, "rate", ConnectionRate(1000, 1000, time.monotonic)))

            def age() -> None:
                for each in listener.connections:
                    each.active -= 60.0 if each.endpoints.peer_port in own else 50.0

            bridge.call(age)
            for sock in idle_clients(bridge, 19):
                stack.enter_context(sock)
            assert raw_answer(bridge.port, HANDSHAKE.encode()).startswith(b"HTTP/1.1 503 ")
            assert [each.rank for each in bridge.call(lambda: list(listener.connections))].count(
                Rank.OWN
            ) == 1


def test_connections_that_send_nothing_are_closed(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(handshake_seconds=0.1))
    assert raw_answer(bridge.port, b"") == b""
    # If the server has closed before this arrives, it resets the connection.
    with contextlib.suppress(ConnectionError):
        assert raw_answer(bridge.port, b"GET / HTTP/1.1\r\n") == b""


def test_connection_that_a_browser_opened_in_advance_outlives_its_use() -> None:
    # This is Chromium's net::kUnusedIdleSocketTimeout; a busy machine needs more.
    assert Limits().handshake_seconds >= 2 * 10


def test_client_that_opens_and_closes_leaves_nothing_behind(bridge: Running) -> None:
    talker = bridge.node("talker")
    bridge.publisher(talker, "/t", String)
    steady = bridge.client()
    steady.subscribe("/t")
    for number in range(100):
        with socket.create_connection(("127.0.0.1", bridge.port), 30) as sock:
            if number % 2:
                sock.sendall(HANDSHAKE.encode())
                assert sock.recv(12) == b"HTTP/1.1 101"
            if number % 3 == 0:
                sock.setsockopt(
                    socket.SOL_SOCKET,
                    socket.SO_LINGER,
                    b"\1\0\0\0\0\0\0\0" if sys.platform != "win32" else b"\1\0\0\0",
                )
    listener = bridge.bridge.listeners["foxglove"]
    wait_until(lambda: bridge.call(lambda: len(listener.connections)) <= 1)
    assert len(bridge.bridge.foxglove.sessions) == 1
    assert_alive(steady)


@pytest.mark.usefixtures("strangers")
def test_connections_that_come_too_often_are_refused(bridge: Running) -> None:
    now = 0.0
    listener = bridge.bridge.listeners["foxglove"]
    first = bridge.client()
    bridge.call(lambda: setattr(listener, "rate", ConnectionRate(50, 10, lambda: now)))
    request = b"GET /none HTTP/1.1\r\nHost: localhost\r\n\r\n"
    # A request is refused before it has arrived.
    answers = [raw_answer(bridge.port, request if number < 10 else b"") for number in range(300)]
    statuses = [answer.split(b" ")[1] for answer in answers]
    assert statuses == [b"404"] * 10 + [b"429"] * 290
    assert answers[-1].startswith(b"HTTP/1.1 429 Too Many Requests\r\n")
    assert b"Retry-After: 1\r\n" in answers[-1]
    assert answers[-1].endswith(b"\r\n\r\ntoo many new connections from this address: wait a second\n")
    assert listener.refused == 290
    assert len(listener.rate) == 1
    assert_alive(first)
    now = 1.0
    assert_alive(bridge.client())
    wait_until(lambda: bridge.call(lambda: len(listener.connections)) <= 2)


def test_message_rate_is_held_back_and_nothing_is_lost(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(messages_a_second=50))
    start_time, all_sent = time.monotonic(), threading.Event()
    client, other = bridge.client(), bridge.client()
    bridge.loop.post(all_sent.wait)
    for number in range(120):
        client.send(op="getParameters", parameterNames=["/none"], id=str(number))
    all_sent.set()
    assert_alive(other)
    answers = [client.next("parameterValues")["id"] for _ in range(120)]
    assert time.monotonic() - start_time >= 2.0
    assert sorted(answers, key=int) == [str(number) for number in range(120)]
    (state,) = [each for each in bridge.bridge.status()["clients"] if each["received"] >= 120]  # type: ignore[attr-defined]
    assert state["held_back"] >= 1


class Turns:
    """A loop whose iterations are run by the test."""

    def __init__(self) -> None:
        self.now = 0.0
        self.frames = 0
        self.soon: list[Callable[[], None]] = []

    def time(self) -> float:
        return self.now

    def call_soon(self, function: Callable[[], None]) -> None:
        self.soon.append(function)

    def call_later(self, delay: float, function: Callable[[], None]) -> Mock:
        return Mock()

    def iterate(self) -> None:
        ready, self.soon = self.soon, []
        for function in ready:
            function()


def test_messages_that_take_long_are_handled_in_turns() -> None:
    loop, pipe = Turns(), Mock(is_full=False, endpoints=Endpoints(1, "127.0.0.1", 2))
    site = Mock(limits=Limits(), turns=FairTurns(loop.call_soon, loop.time))
    site.check.return_value = Grant.READ
    site.admit.return_value = None
    handled: list[str] = []

    def handle(text: str) -> None:
        handled.append(text)
        loop.now += 0.004

    endpoint = Mock()
    endpoint.select.return_value = "foxglove.sdk.v1"
    endpoint.open.return_value.received_text = handle
    site.endpoints = [endpoint]
    connection = Connection(site, pipe, "127.0.0.1", loop)  # type: ignore[arg-type]
    connection.received(HANDSHAKE.encode())
    pipe.resume.reset_mock()
    texts = [str(number) for number in range(100)]
    frames = b"".join(bytes((0x81, 0x80 | len(text), 0, 0, 0, 0)) + text.encode() for text in texts)

    connection.received(frames[:500])
    assert 1 <= len(handled) <= 3
    pipe.pause.assert_called()
    # Data received from now on follows the queued data.
    connection.received(frames[500:])
    assert len(handled) <= 3
    while len(handled) < len(texts):
        before = len(handled)
        loop.iterate()
        assert before < len(handled) <= before + 3
    assert handled == texts
    loop.iterate()
    pipe.resume.assert_called_once()


EMPTY_FRAMES = {
    "continuations": bytes((0x01, 0x80, 0, 0, 0, 0)) + bytes((0x00, 0x80, 0, 0, 0, 0)) * 9999,
    "pings": bytes((0x89, 0x80, 0, 0, 0, 0)) * 10_000,
    "pongs": bytes((0x8A, 0x80, 0, 0, 0, 0)) * 10_000,
    "texts": bytes((0x81, 0x80, 0, 0, 0, 0)) * 10_000,
}


def connected(
    limits: Limits, seconds_of_frame: float, grant: Grant = Grant.READ, account: Account | None = None
) -> tuple[Turns, Connection, Mock]:
    """Return a loop, a connection after its handshake, and its pipe. Each frame advances the loop's clock by some seconds."""
    loop, pipe = Turns(), Mock(is_full=False, unsent=0, endpoints=Endpoints(1, "127.0.0.1", 2))
    site = Mock(limits=limits, turns=FairTurns(loop.call_soon, loop.time), account=account or Mock())
    site.check.return_value = grant
    site.admit.return_value = None
    endpoint = Mock()
    endpoint.select.return_value = "foxglove.sdk.v1"
    site.endpoints = [endpoint]
    connection = Connection(site, pipe, "127.0.0.1", loop)  # type: ignore[arg-type]
    connection.received(HANDSHAKE.encode())
    loop.iterate()
    pipe.reset_mock()
    framed = connection.framed

    def counted(frame: Frame) -> None:
        loop.frames += 1
        loop.now += seconds_of_frame
        framed(frame)

    connection.framed = counted  # type: ignore[method-assign]
    return loop, connection, pipe


@pytest.mark.parametrize("kind", EMPTY_FRAMES)
def test_frames_of_any_kind_are_handled_in_turns(kind: str) -> None:
    loop, connection, pipe = connected(Limits(), 0.00001)
    connection.received(EMPTY_FRAMES[kind])
    assert 0 < loop.frames <= 11
    pipe.pause.assert_called()
    while loop.frames < 10_000:
        before = loop.frames
        loop.iterate()
        # One iteration handles 4 ms of frames that take 10 us each, and one more slice.
        assert before < loop.frames <= before + 411
    loop.iterate()
    pipe.resume.assert_called()
    pipe.close.assert_not_called()


@pytest.mark.parametrize("kind", EMPTY_FRAMES)
def test_frames_of_any_kind_count_toward_the_rate(kind: str) -> None:
    loop, connection, pipe = connected(Limits(messages_a_second=4000), 0.0)
    connection.received(EMPTY_FRAMES[kind])
    assert loop.frames == 4000
    assert connection.traffic.held_back == 1
    pipe.pause.assert_called()
    pipe.resume.assert_not_called()
    loop.now += 1.0
    connection.go_on()
    assert loop.frames == 8000
    loop.now += 1.0
    connection.go_on()
    assert loop.frames == 10_000
    pipe.resume.assert_called()


@pytest.mark.parametrize(("grant", "weight"), [(Grant.READ, 1.0), (Grant.WRITE, 4.0), (Grant.OWN, 64.0)])
def test_clients_with_more_rights_have_more_of_the_loop_and_longer_messages(
    grant: Grant, weight: float
) -> None:
    _, connection, _ = connected(Limits(), 0.0, grant)
    assert connection.turn.weight == weight
    new = Connection(connection.site, Mock(is_full=False), "127.0.0.1", connection.loop)
    assert new.turn.weight < 1.0
    connection.received(b"\x81\xff" + (65_537).to_bytes(8, "big") + bytes(4))
    connection.received(bytes(100))
    assert connection.is_open is (grant is not Grant.READ)


def test_work_for_a_client_is_done_in_its_turn_and_bounded() -> None:
    loop, connection, pipe = connected(Limits(queue=1000, messages_a_second=5), 0.0)
    done: list[int] = []

    def work(number: int) -> None:
        done.append(number)
        loop.now += 0.01

    # The first piece of work is done immediately, which uses up the allowance.
    for number in range(8):
        connection.in_turn(partial(work, number), bytes(300))
    assert done == [0]
    assert connection.queue.dropped == 4
    loop.iterate()
    assert done == [0, 5]
    # Responses are also sent while the client has used up its quota, and before the data that it has sent is handled.
    connection.received(EMPTY_FRAMES["pongs"])
    for _ in range(3):
        loop.iterate()
    assert done == [0, 5, 6, 7]
    loop.iterate()
    assert loop.frames == 5
    connection.in_turn(partial(work, 9), bytes(300))
    for _ in range(3):
        loop.iterate()
    assert done[-1] == 9
    assert loop.frames == 5
    pipe.close.assert_not_called()


def test_messages_that_wait_for_their_turn_are_in_the_account_of_memory() -> None:
    account = Account(limit=1_000_000)
    loop, connection, _ = connected(Limits(), 0.0, account=account)
    done: list[int] = []

    def work(number: int) -> None:
        done.append(number)
        loop.now += 0.01

    connection.in_turn(partial(work, 0), bytes(400_000))
    assert account.total == 0
    connection.in_turn(partial(work, 1), bytes(400_000))
    connection.in_turn(partial(work, 2), bytes(20_000))
    assert 420_000 <= account.total <= 421_000
    loop.iterate()
    assert 20_000 <= account.total <= 21_000
    loop.iterate()
    assert done == [0, 1, 2]
    assert account.total == 0

    # Beyond the limit the jobs are dropped, like queued messages.
    loop.now += 1.0
    for number in range(3, 7):
        connection.in_turn(partial(work, number), bytes(400_000))
    assert account.total == 0
    assert connection.queue.dropped == 3
    loop.iterate()
    assert done == [0, 1, 2, 3]
    assert connection.is_open

    connection.in_turn(partial(work, 7), bytes(400_000))
    assert account.total > 400_000
    connection.ended()
    assert account.total == 0


def test_work_is_held_while_the_last_of_it_goes_on_in_a_thread() -> None:
    loop, connection, pipe = connected(Limits(), 0.0)
    done: list[int] = []

    def start(number: int) -> None:
        done.append(number)
        connection.hold_jobs(are_held=True)
        connection.in_turn(partial(done.append, 2), b"2")

    connection.in_turn(partial(start, 1), b"1")
    connection.in_turn(partial(done.append, 3), b"3")
    connection.received(EMPTY_FRAMES["pings"][:60])
    for _ in range(3):
        loop.iterate()
    assert (done, loop.frames) == ([1], 10)
    assert not loop.soon
    connection.hold_jobs(are_held=False)
    loop.iterate()
    assert done == [1, 2, 3]
    pipe.close.assert_not_called()


def test_work_that_fails_ends_its_client_alone(caplog: pytest.LogCaptureFixture) -> None:
    loop, connection, _ = connected(Limits(), 0.0)

    def fail() -> None:
        raise ValueError("a fault")

    connection.in_turn(fail, b"1")
    loop.iterate()
    assert not connection.is_open
    assert "a fault" in caplog.text


def test_fast_reading_clients_are_sent_to_in_turns() -> None:
    loop, connection, pipe = connected(Limits(), 0.0)
    sent = 0

    def write(pieces: list[bytes]) -> None:
        nonlocal sent
        sent += sum(map(len, pieces))

    pipe.write.side_effect = write
    for _ in range(1000):
        connection.answer((bytes(10_000),))
    loop.iterate()
    assert 1_000_000 <= sent <= 1_400_000
    iterations = 1
    while sent < 10_000_000:
        loop.iterate()
        iterations += 1
    assert 7 <= iterations <= 10


def test_client_that_reads_no_pongs_leaves_the_newest_waiting() -> None:
    _, connection, pipe = connected(Limits(), 0.0)
    pipe.is_full = True
    for number in range(5000):
        connection.received(bytes((0x89, 0x84, 0, 0, 0, 0)) + number.to_bytes(4, "big"))
    assert len(connection.queue) == 1
    pipe.is_full = False
    pipe.write.side_effect = lambda _: setattr(pipe, "is_full", True)
    connection.writable()
    assert b"".join(pipe.write.call_args.args[0]) == b"\x8a\x04" + (4999).to_bytes(4, "big")


def test_clients_are_pinged_before_they_are_disconnected() -> None:
    """After the machine was suspended, the last data is old, although no ping has been sent since."""
    loop, pipe = Turns(), Mock(is_full=False, endpoints=Endpoints(1, "127.0.0.1", 2))
    site = Mock(limits=Limits(), turns=FairTurns(loop.call_soon, loop.time))
    site.check.return_value = Grant.READ
    site.admit.return_value = None
    endpoint = Mock()
    endpoint.select.return_value = "foxglove.sdk.v1"
    site.endpoints = [endpoint]
    connection = Connection(site, pipe, "127.0.0.1", loop)  # type: ignore[arg-type]
    connection.received(HANDSHAKE.encode())
    loop.iterate()

    loop.now = 1000.0
    connection.ping()
    loop.iterate()
    assert pipe.write.call_args.args[0][-1].endswith(b"minirospy")
    pipe.close.assert_not_called()
    loop.now = 1020.0
    connection.ping()
    pipe.close.assert_called_once_with(flush=False)


def test_stuck_client_among_ten_loses_its_own_messages_alone(run_bridge: Callable[..., Running]) -> None:
    limit = 3_000_000
    bridge = run_bridge(limits=Limits(queue=limit, silent_seconds=1000.0))
    publisher = bridge.publisher(bridge.node("camera"), "/image", UInt8MultiArray, queue_size=1000)
    small = bridge.publisher(bridge.node("small"), "/small", String)
    clients = [bridge.client() for _ in range(9)]
    # This client subscribes and does not read.
    stuck = bridge.client(max_queue=1, close_timeout=0.1)
    for client in (*clients, stuck):
        client.subscribe("/image", 1)
        client.subscribe("/small", 2)
    bridge.run(publisher.wait_for_subscribers())
    bridge.run(small.wait_for_subscribers())

    data = bytes(200_000)
    for number in range(100):
        bridge.run(small.publish(str(number)))
        bridge.run(publisher.publish(data=data))
        for client in clients:
            client.next_binary(1)
            client.next_binary(1)
        assert all(
            connection.queue.size <= limit for connection in bridge.bridge.listeners["foxglove"].connections
        )
    states = sorted(bridge.bridge.status()["clients"], key=lambda each: each["dropped"])  # type: ignore[call-overload]
    assert [each["dropped"] for each in states[:9]] == [0] * 9
    assert states[9]["dropped"] > 0

    # The client reads again, and receives the newest message on both topics.
    last = b""
    while b"99" not in last[13:]:
        last = stuck.next_binary(1)
        if len(last) > 1000:
            last = b""
    stuck.next("status", lambda each: "messages dropped, most of /image" in each["message"])
    stuck.next("removeStatus")


def test_disconnected_client_leaves_no_messages_in_memory(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(limits=Limits(silent_seconds=1000.0))
    publisher = bridge.publisher(bridge.node("camera"), "/image", UInt8MultiArray, queue_size=1000)
    stuck = bridge.client(max_queue=1, close_timeout=0.1)
    stuck.subscribe("/image")
    bridge.run(publisher.wait_for_subscribers())
    (connection,) = bridge.bridge.listeners["foxglove"].connections
    while bridge.call(lambda: len(connection.queue)) < 5:
        bridge.run(publisher.publish(data=bytes(200_000)))
    stuck.close()
    wait_until(lambda: not bridge.call(lambda: len(bridge.bridge.listeners["foxglove"].connections)))
    assert (len(connection.queue), connection.queue.size) == (0, 0)


@pytest.mark.usefixtures("strangers")
def test_encrypted_connections_are_served(run_bridge: Callable[..., Running], tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    bridge = run_bridge(certificate=str(certificate), key=str(key))
    context = ssl.create_default_context(cafile=str(certificate))
    bridge.publisher(bridge.node("talker"), "/t", UInt8MultiArray, latch=True)
    publisher = bridge.publisher(bridge.nodes[-1], "/big", UInt8MultiArray, latch=True)
    data = bytes(range(256)) * 20_000
    bridge.run(publisher.publish(data=data))
    client = bridge.client(scheme="wss", ssl=context)
    client.subscribe("/big")
    assert client.next_binary(1).endswith(data)
    connection = HTTPSConnection("127.0.0.1", bridge.port, timeout=30, context=context)
    connection.request("GET", "/status")
    assert connection.getresponse().status == 200
    connection.close()
    listener = bridge.bridge.listeners["foxglove"]
    bridge.call(lambda: setattr(listener, "rate", ConnectionRate(1, 0, lambda: 0.0)))
    with (
        socket.create_connection(("127.0.0.1", bridge.port), 30) as sock,
        context.wrap_socket(sock, server_hostname="127.0.0.1") as encrypted,
    ):
        answer = b"".join(iter(partial(encrypted.recv, 4096), b""))
    assert answer.startswith(b"HTTP/1.1 429 ")
    assert answer.endswith(b"too many new connections from this address: wait a second\n")
    bridge.call(lambda: setattr(listener, "rate", ConnectionRate(1, 5, lambda: 0.0)))
    assert not raw_answer(bridge.port, b"GET / HTTP/1.1\r\n\r\n").startswith(b"HTTP/1.1 2")


def test_faults_at_the_start_are_one_clear_error(run_bridge: Callable[..., Running], tmp_path: Path) -> None:
    (tmp_path / "bad.pem").write_text("nonsense")
    with pytest.raises(BridgeError, match=r"the certificate cannot be used: .*bad\.pem"):
        run_bridge(certificate=str(tmp_path / "bad.pem"))
    with pytest.raises(BridgeError, match=r"none\.pem: No such file"):
        run_bridge(certificate=str(tmp_path / "none.pem"))
    with pytest.raises(BridgeError, match="key is given without its certificate"):
        run_bridge(key="x")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(BridgeError, match=rf"cannot listen at 127\.0\.0\.1:{port}: .* give another port"):
            run_bridge(foxglove_port=port)


def make_certificate(folder: Path) -> tuple[Path, Path]:
    """Return a certificate for 127.0.0.1 and its key, made with openssl."""
    certificate, key = folder / "cert.pem", folder / "key.pem"
    command = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=localhost",
    ]
    command += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("openssl is not installed")
    return certificate, key
