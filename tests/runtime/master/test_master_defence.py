"""Invalid input from clients: the responses that docs/master.md lists, and no lost registrations."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import sys
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy, dumps

import psutil
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from minirospy.base.environment import Environment
from minirospy.base.errors import RpcFault, UsageError
from minirospy.base.steps import finish
from minirospy.core.wire.xmlrpc import parse_response, serialize_response
from minirospy.runtime.master.master import Master
from minirospy.runtime.master.replay import Replay, changes_to
from minirospy.runtime.node.node import Node
from minirospy.runtime.rpc import connection as connections
from minirospy.runtime.rpc import server as rpc_server
from minirospy.runtime.transport.access import Access, listening_lines, own_addresses
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import modules_loaded_by
from tests.waiting import wait_until

DOCS = Path(__file__).parents[3] / "docs" / "master.md"


def post(body: bytes, headers: bytes = b"") -> bytes:
    return b"POST / HTTP/1.1\r\n" + headers + b"Content-Length: %d\r\n\r\n" % len(body) + body


def called(method: str, *args: Any) -> bytes:
    return post(dumps(args, method).encode())


def valued(value: bytes) -> bytes:
    return post(
        b"<methodCall><methodName>setParam</methodName><params><param><value>/x</value></param>"
        b"<param><value>/p</value></param><param>" + value + b"</param></params></methodCall>"
    )


def deep(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = {"a": value}
    return value


LAUGHS = b'<!DOCTYPE a [<!ENTITY a "ha">' + b"".join(
    b'<!ENTITY %c "%s">' % (98 + n, b"&%c;" % (97 + n) * 10) for n in range(9)
)
BAD: dict[str, tuple[bytes, str]] = {
    "not HTTP": (b"\x16\x03\x01 hello\r\n\r\n", "400 not HTTP"),
    "HTTP/2": (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "400 not HTTP"),
    "another method than POST": (b"GET / HTTP/1.1\r\n\r\n", "405 this is an XML-RPC server"),
    "a header without a colon": (b"POST / HTTP/1.1\r\nnonsense\r\n\r\n", "400 not an HTTP header"),
    "a header with a space before its colon": (
        b"POST / HTTP/1.1\r\nContent-Length : 3\r\n\r\nabc",
        "400 not an HTTP header",
    ),
    "headers of more than 64 KiB": (b"POST / HTTP/1.1\r\nX: " + b"x" * 70_000, "400 HTTP header too long"),
    "a Content-Length that is not a number": (
        b"POST / HTTP/1.1\r\nContent-Length: \xb2\r\n\r\n",
        "400 bad Content-Length",
    ),
    "a negative Content-Length": (b"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", "400 bad Content-Length"),
    "two Content-Lengths that differ": (
        b"POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nab",
        "400 two Content-Lengths",
    ),
    "a body of more than 64 MiB": (
        b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n",
        "413 an HTTP body of",
    ),
    "a chunk of more than 64 MiB": (
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nfffffffff\r\n",
        "413 an HTTP body of",
    ),
    "a chunk size that is not a number": (
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n+5\r\n",
        "400 bad chunk size",
    ),
    "a chunk that is longer than it says": (
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n2\r\nabc\r\n",
        "400 a chunk is longer",
    ),
    "no body": (b"POST / HTTP/1.1\r\n\r\n", "400 not XML-RPC"),
    "a body that is not XML": (post(b"hello"), "400 not XML-RPC"),
    "an encoding that nobody knows": (
        post(b"<?xml version='1.0' encoding='x-none'?><a/>"),
        "400 not XML-RPC",
    ),
    "entities inside entities (billion laughs)": (post(LAUGHS + b"]><a>&j;</a>"), "400 a document type"),
    "one long entity, many times (quadratic blow-up)": (
        post(b'<!DOCTYPE a [<!ENTITY a "' + b"x" * 9999 + b'">]><a>' + b"&a;" * 9999 + b"</a>"),
        "400 a document type",
    ),
    "an entity out of a file": (
        post(b'<!DOCTYPE a [<!ENTITY a SYSTEM "file:///etc/passwd">]><a>&a;</a>'),
        "400 a document type",
    ),
    "values nested deeper than 64 levels": (
        valued(b"<value><array><data>" * 100 + b"</data></array></value>" * 100),
        "400 a value is nested deeper",
    ),
    "more than a million elements": (
        valued(b"<value><array><data>" + b"<value/>" * 1_000_001 + b"</data></array></value>"),
        "400 more than 1000000 elements",
    ),
    "an answer instead of a call": (post(serialize_response(1)), "400 not an XML-RPC method call"),
    "a call without a method": (
        post(b"<methodCall><params/></methodCall>"),
        "400 not an XML-RPC method call",
    ),
    "a number that is none": (valued(b"<value><int>x</int></value>"), "400 not XML-RPC"),
    "nil": (valued(b"<value><nil/></value>"), "400 ROS has no nil"),
    "a method that is not there": (called("nope", "/x"), "fault"),
    "a call without a caller_id": (called("getPid"), "missing required caller_id parameter"),
    "a caller_id that is not text": (called("getPid", 5), "caller_id must be a string"),
    "too few or too many arguments": (called("registerPublisher", "/x", "/t"), "Error: bad call arity"),
    "a name with a space or colon": (
        called("registerPublisher", "/x", "/t a", "a/B", "http://x:1/"),
        "ERROR: parameter [topic] contains illegal chars",
    ),
    "a name with a line feed": (
        called("registerPublisher", "/x", "/t\n+PUB [/forged]", "a/B", "http://x:1/"),
        "ERROR: parameter [topic] contains illegal chars",
    ),
    "a name with a terminal's control sequence of one character": (
        called("registerService", "/x", "/t\x9b2J", "rosrpc://x:1", "http://x:1/"),
        "ERROR: parameter [service] contains illegal chars",
    ),
    "a caller_id with a line feed": (
        called("registerPublisher", "/x\ny", "/t", "a/B", "http://x:1/"),
        "caller_id contains illegal chars",
    ),
    "a type with a line feed": (
        called("registerPublisher", "/x", "/t", "a/B\n", "http://x:1/"),
        "ERROR: parameter [topic_type] is not a valid package resource name",
    ),
    "a URI with a header of HTTP": (
        called("registerPublisher", "/x", "/t", "a/B", "http://x:1/ HTTP/1.1\r\nX: y"),
        "ERROR: parameter [caller_api] contains illegal chars",
    ),
    "a URI that is none": (
        called("registerPublisher", "/x", "/t", "a/B", "file:///x"),
        "ERROR: parameter [caller_api] is not an RPC URI",
    ),
    "a number of more than 32 bits as a parameter": (
        valued(b"<value><i8>4294967296</i8></value>"),
        "Error: invalid arguments: the integer 4294967296",
    ),
    "parameters nested deeper than 56 levels": (
        called("setParam", "/x", "/a" * 40, deep(20)),
        "Error: invalid arguments: a parameter is nested deeper",
    ),
    "a multicall inside a multicall": (
        called("system.multicall", [{"methodName": "system.multicall", "params": [[]]}]),
        "system.multicall inside itself",
    ),
}


def result_of(answer: Any) -> Any:
    """Return the result of a call, whether it is computed in one step or in several."""
    return finish(answer) if isinstance(answer, Generator) else answer


def exchange(uri: str, data: bytes) -> bytes:
    """Return the master's response, up to the end of the connection or response."""
    port = int(uri.rsplit(":", 1)[1])
    # Reading a million elements takes seconds, many times that on a busy machine.
    with socket.create_connection(("127.0.0.1", port), 100) as sock:
        sock.sendall(data)
        answer = b""
        while more := sock.recv(65536):
            answer += more
            head, _, body = answer.partition(b"\r\n\r\n")
            length = re.search(rb"Content-Length: (\d+)", head)
            if length and len(body) == int(length[1]):
                break
        return answer


@pytest.mark.parametrize("what", BAD)
def test_bad_requests_get_an_answer_and_do_no_harm(master: str, what: str) -> None:
    request, expected = BAD[what]
    with ServerProxy(master) as proxy:
        proxy.setParam("/test", "/kept", 1)
        start_time = time.process_time()
        status, _, text = exchange(master, request).partition(b"\r\n")
        shown = status.split(b" ", 2)[1].decode() + " " + text.partition(b"\r\n\r\n")[2].decode()
        if expected == "fault":
            assert shown.startswith("200")
            assert "<fault>" in shown
        elif expected[:3].isdigit():
            assert shown.startswith(expected)
        else:
            assert shown.startswith("200")
            assert expected in shown
        assert time.process_time() - start_time < 10
        assert proxy.getParam("/test", "/kept") == [1, "Parameter [/kept]", 1]
        assert proxy.getParam("/test", "/")[0] == 1  # type: ignore[index]


def test_the_docs_list_them_all() -> None:
    rows = [line.split("|")[1].strip() for line in DOCS.read_text().splitlines() if line.startswith("| ")]
    assert len(BAD) >= 24
    assert [row for row in rows if row in BAD] == list(BAD)


# --- clients that take their time


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread("defence")
    yield thread
    thread.close()


def test_a_request_that_never_ends_is_hung_up_on(monkeypatch: pytest.MonkeyPatch, master: str) -> None:
    monkeypatch.setattr(connections, "REQUEST_SECONDS", 0.05)
    assert exchange(master, b"POST / HTTP/1.1\r\nContent-Length: 10\r\n\r\nabc") == b""


def test_a_client_that_never_reads_is_hung_up_on(monkeypatch: pytest.MonkeyPatch, master: str) -> None:
    with ServerProxy(master) as proxy:
        proxy.setParam("/test", "/large", "x" * 1_000_000)
        monkeypatch.setattr(connections, "REQUEST_SECONDS", 0.3)
        with socket.create_connection(("127.0.0.1", int(master.rsplit(":", 1)[1])), 20) as sock:
            hung_up = False
            while not hung_up:
                try:
                    sock.sendall(called("getParam", "/x", "/large"))
                except (BrokenPipeError, ConnectionError):
                    hung_up = True
        monkeypatch.undo()
        assert proxy.getPid("/test")[0] == 1  # type: ignore[index]


def test_of_many_connections_the_longest_silent_go(loop: LoopThread) -> None:
    async def start() -> Master:
        serving = Master(max_clients=20)
        await serving.start()
        return serving

    serving = loop.run(start())
    uri = f"http://127.0.0.1:{serving.port}"
    with ServerProxy(uri) as proxy:
        crowd = []
        for _ in range(100):
            crowd.append(socket.create_connection(("127.0.0.1", serving.port), 100))
            assert proxy.getPid("/test")[0] == 1  # type: ignore[index]
        status: Any = proxy.minirospy.status("/test")
        assert status[2]["clients"] == 20
        # The oldest connections are closed, but not the newest.
        assert crowd[0].recv(1) == b""
        crowd[-1].sendall(called("getPid", "/x"))
        assert crowd[-1].recv(12) == b"HTTP/1.1 200"
    for sock in crowd:
        sock.close()
    loop.run(serving.close())


def test_large_requests_are_refused_while_too_many_are_on_their_way(
    monkeypatch: pytest.MonkeyPatch, master: str
) -> None:
    monkeypatch.setattr(rpc_server, "MAX_HELD", 100_000)
    monkeypatch.setattr(rpc_server, "LARGE_REQUEST", 50_000)
    half = post(b"x" * 300_000)[:150_000]
    assert exchange(master, half).startswith(b"HTTP/1.1 503")
    with ServerProxy(master) as proxy:
        assert proxy.getPid("/test")[0] == 1  # type: ignore[index]


# --- who may connect


def test_networks() -> None:
    access = Access.parse("192.168.65.0/24, 10.0.0.7 2001:db8::/32")
    allowed = [
        "192.168.65.1",
        "10.0.0.7",
        "127.0.0.1",
        "::1",
        "2001:db8::5",
        "::ffff:192.168.65.9",
        "127.1.2.3",
    ]
    refused = [
        "192.168.66.1",
        "10.0.0.8",
        "8.8.8.8",
        "2001:db9::1",
        "::ffff:8.8.8.8",
        "nonsense",
        "fe80::1%eth0",
    ]

    assert [access.allows(peer) for peer in allowed] == [True] * len(allowed)
    assert [access.allows(peer) for peer in refused] == [False] * len(refused)
    # This machine may connect to itself at any of its addresses.
    assert access.allows("172.16.0.5", "172.16.0.5")
    assert Access().allows("8.8.8.8")

    for wrong in ("192.168.65.0/33", "here", "http://x"):
        with pytest.raises(UsageError, match="is not a network"):
            Access.parse(wrong)
    for empty in (" ", ",", " , ,"):
        with pytest.raises(UsageError, match="names no network"):
            Access.parse(empty)
    assert Access.parse("").allows("8.8.8.8")


def test_the_start_up_line_warns_of_the_open_internet(monkeypatch: pytest.MonkeyPatch) -> None:
    from minirospy.runtime.transport import access

    assert listening_lines("127.0.0.1", 1, Access()) == [
        "listening on 127.0.0.1:1, open to this machine alone"
    ]
    monkeypatch.setattr(access, "own_addresses", lambda: ["127.0.0.1", "192.168.1.5", "fe80::1%eth0"])
    assert len(listening_lines("0.0.0.0", 1, Access())) == 1
    monkeypatch.setattr(access, "own_addresses", lambda: ["127.0.0.1", "9.9.9.9", "2620:fe::9"])
    _, warning = listening_lines("0.0.0.0", 1, Access())
    assert warning.startswith("WARNING: the open internet reaches this master at 9.9.9.9, 2620:fe::9,")
    assert listening_lines("0.0.0.0", 1, Access(["10.0.0.0/8"])) == [
        "listening on 0.0.0.0:1, open to 10.0.0.0/8"
    ]
    assert len(listening_lines("9.9.9.9", 1, Access())) == 2


@pytest.mark.skipif(sys.platform != "linux", reason="other systems use psutil")
def test_own_addresses_are_those_of_psutil() -> None:
    def addresses_of_psutil() -> set[str]:
        families = {socket.AF_INET, socket.AF_INET6}
        found = [each for interface in psutil.net_if_addrs().values() for each in interface]
        return {each.address.partition("%")[0] for each in found if each.family in families}

    # Another process may add an interface in the meantime.
    wait_until(lambda: set(own_addresses()) == addresses_of_psutil())


@pytest.mark.skipif(sys.platform != "linux", reason="other systems use psutil")
def test_own_addresses_come_from_psutil_if_the_kernel_does_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    from minirospy.runtime.transport import access

    asked = []

    def refuse() -> list[str]:
        asked.append("IPv4")
        raise OSError("no ioctl here")

    monkeypatch.setattr(access, "_linux_ipv4_addresses", refuse)
    assert "127.0.0.1" in own_addresses()
    assert asked == ["IPv4"]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems use psutil")
def test_start_up_line_does_not_import_psutil() -> None:
    code = (
        "from minirospy.runtime.transport.access import Access, listening_lines; "
        "listening_lines('0.0.0.0', 1, Access())"
    )
    assert "psutil" not in modules_loaded_by(code)


class _Stranger(Access):
    """Treats every peer as if it connected from 8.8.8.8."""

    def allows(self, peer: str, here: str = "") -> bool:
        return super().allows("8.8.8.8")


def test_master_and_nodes_hang_up_on_strangers(
    master: str, loop: LoopThread, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_ALLOW", "192.168.65.0/24")
    monkeypatch.setattr("minirospy.runtime.node.node.Access", _Stranger)

    async def start() -> tuple[Master, Node]:
        serving = Master(access=_Stranger(["192.168.65.0/24"]))
        await serving.start()
        node = Node("/node", Environment.read())
        await node.start()
        return serving, node

    serving, node = loop.run(start())
    for port in (serving.port, int(node.uri.rstrip("/").rsplit(":", 1)[1]), node.tcpros_port):
        with socket.create_connection(("127.0.0.1", port), 5) as sock:
            try:
                assert sock.recv(1) == b""
            except ConnectionResetError:
                pass
    assert serving.dispatch("minirospy.status", ["/x"])[2]["refused"] == 1
    loop.run(node.close())
    loop.run(serving.close())


# --- anything at all


PIECES = st.sampled_from(
    [
        *(request for request, _ in BAD.values() if len(request) < 5000),
        called("getSystemState", "/x"),
        called("setParam", "/x", "/p", {"a": [1, "x", 2.5, True]}),
        b"POST / HTTP/1.1\r\n",
        b"Content-Length: 5\r\n",
        b"Transfer-Encoding: chunked\r\n",
        b"Expect: 100-continue\r\n",
        b"\r\n",
        b"5\r\n",
        b"0\r\n\r\n",
        b"<methodCall>",
        b"<value><string>",
    ]
)


@settings(max_examples=300, deadline=None)
@given(st.lists(PIECES | st.binary(max_size=30), max_size=6))
def test_any_bytes_are_answered_or_refused(pieces: list[bytes]) -> None:
    async def test() -> None:
        master = Master()
        master.notifier.send = lambda notice: None  # type: ignore[method-assign]
        await master.start()
        ours, theirs = socket.socketpair()
        ours.setblocking(False)

        with theirs:
            theirs.setblocking(False)
            connection = connections.Connection(master.server, ours, asyncio.get_running_loop())
            master.server.connections[connection] = None

            for piece in pieces:
                if connection._state is connections.State.OPEN:
                    connection.received(piece)
                with contextlib.suppress(BlockingIOError):
                    theirs.recv(1 << 20)

            connection.end()

        assert master.server.held == 0
        assert master.dispatch("getSystemState", ["/x"])[0] == 1
        parse_response(serialize_response(master.dispatch("getParam", ["/x", "/"])))
        await master.close()

    asyncio.run(test())


TEXT = st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff"), max_size=6)
WORDS = st.sampled_from(
    ["/a", "/a/b", "a", "~p", "/", "", "//", "a/B", "*", "http://127.0.0.1:1/", "rosrpc://x:1"]
)
VALUES = st.recursive(
    st.integers(-(2**40), 2**40)
    | st.booleans()
    | TEXT
    | WORDS
    | st.floats(allow_nan=False)
    | st.binary(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT | WORDS, inner, max_size=3),
    max_leaves=6,
)
METHODS = [
    *sorted(set(Master().dispatcher.methods) - {"shutdown"}),
    "system.multicall",
    "system.listMethods",
    "nope",
]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(METHODS), st.lists(WORDS | VALUES, max_size=5)), max_size=12))
def test_any_call_is_answered(calls: list[tuple[str, list[Any]]]) -> None:
    async def test() -> None:
        master = Master()
        master.notifier.send = lambda notice: None  # type: ignore[method-assign]
        for method, args in calls:
            try:
                answer = result_of(master.dispatch(method, args))
            except RpcFault:
                continue
            parse_response(serialize_response(answer))
            if method in master.dispatcher.methods:
                assert answer[0] in (1, 0, -1)
                assert isinstance(answer[1], str)
                assert len(answer) == 3
        again = Master()
        replay = Replay(again.registry, again.parameters)
        for record in changes_to(master.registry, master.parameters):
            replay.apply(*record)
        for question in ("getSystemState", "getTopicTypes", "getParamNames"):
            assert again.dispatch(question, ["/x"]) == master.dispatch(question, ["/x"])

    asyncio.run(test())
