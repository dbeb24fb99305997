"""runtime/master/master over real sockets: the responses of real rosmaster (master_answers.json), and its calls to nodes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import queue
import random
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import Binary, DateTime, Fault, ServerProxy
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest

from minirospy.base.escape import has_controls
from minirospy.base.steps import finish
from minirospy.core.wire.xmlrpc import Serialized, serialize_response
from minirospy.runtime.master import notifier
from minirospy.runtime.master.master import Master
from minirospy.runtime.master.replay import Replay, changes_to
from tests.runtime.master.master_calls import CALLS, SCENE

HERE = Path(__file__).parent


def plain(value: Any) -> Any:
    """Return a response as JSON represents it."""
    match value:
        case Binary():
            return {"binary": value.data.hex()}
        case DateTime():
            return {"date": value.value}
        case list() | tuple():
            return [plain(item) for item in value]
        case dict():
            return {key: plain(item) for key, item in value.items()}
    return value


def answers(uri: str) -> list[Any]:
    """Return the response to each call; replace values that differ between processes."""
    found: list[Any] = []
    with ServerProxy(uri) as proxy:
        for method, *args in CALLS:
            try:
                answer: Any = getattr(proxy, method)(*args)
            except Fault as fault:
                answer = ["fault", fault.faultCode, fault.faultString]
            if method in ("getPid", "getUri") and answer[0] == 1:
                answer[2] = "its own"
            found.append(plain(answer))
    return found


def notices(uri: str, expected: list[list[Any]] | None = None) -> list[list[Any]]:
    """Return the notifications that the nodes in SCENE receive after each call, sorted; wait for ``expected`` of them."""
    nodes = [Slave(), Slave()]
    found: list[list[Any]] = []

    def shown(value: Any) -> Any:
        text = json.dumps(value)
        for number, node in enumerate(nodes):
            text = text.replace(node.uri, f"{{{number}}}")
        return json.loads(text)

    try:
        with ServerProxy(uri) as proxy:
            for at, (method, *args) in enumerate(SCENE):
                words = [a.format(*(n.uri for n in nodes)) if isinstance(a, str) else a for a in args]
                getattr(proxy, method)(*words)
                received = [
                    [n, *node.next()] for n, node in enumerate(nodes) for _ in range(counted(expected, at, n))
                ]
                if expected is None:
                    received = [[n, *each] for n, node in enumerate(nodes) for each in node.all_until_quiet()]
                found.append(sorted((shown(each) for each in received), key=str))
        for node in nodes:
            assert node.called.empty()
    finally:
        for node in nodes:
            node.close()
    return found


def counted(expected: list[list[Any]] | None, at: int, node: int) -> int:
    return sum(each[0] == node for each in expected[at]) if expected else 0


def without_controls(value: Any) -> Any:
    """Return a response of rosmaster without the rows whose names minirospy refuses."""
    if not isinstance(value, list):
        return value
    return [
        without_controls(item)
        for item in value
        if not (isinstance(item, list) and item and isinstance(item[0], str) and has_controls(item[0]))
    ]


def test_every_answer_is_that_of_real_rosmaster(master: str) -> None:
    golden = json.loads((HERE / "master_answers.json").read_text())["answers"]
    calls = CALLS
    assert len(golden) == len(calls) > 400
    for call, ours, real in zip(calls, answers(master), golden, strict=True):
        if ours != without_controls(real):
            # rosmaster accepts a name with a tab or a line feed; minirospy refuses it.
            assert ours[0] == -1, call
            assert any(isinstance(arg, str) and has_controls(arg) for arg in call[1:]), call


def test_nodes_are_notified_as_by_real_rosmaster(master: str) -> None:
    golden = json.loads((HERE / "master_answers.json").read_text())["notices"]
    for call, ours, real in zip(SCENE, notices(master, golden), golden, strict=True):
        assert ours == real, call


class Slave:
    """A node's Slave API that records its calls."""

    def __init__(self) -> None:
        self.called: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()

        class Quiet(SimpleXMLRPCRequestHandler):
            def log_message(self, format: str, *args: object) -> None:
                pass

        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), Quiet)
        self._server.register_instance(self)
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()

    def _dispatch(self, method: str, args: tuple[Any, ...]) -> list[Any]:
        self.called.put((method, *args))
        return [1, "", 0]

    def next(self) -> tuple[Any, ...]:
        return self.called.get(timeout=30)

    def all_until_quiet(self) -> list[tuple[Any, ...]]:
        """Return the calls received within half a second; only used for recording."""
        found = []
        with contextlib.suppress(queue.Empty):
            while True:
                found.append(self.called.get(timeout=0.5))
        return found

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def slaves() -> Iterator[list[Slave]]:
    found = [Slave(), Slave()]
    yield found
    for slave in found:
        slave.close()


@pytest.fixture
def proxy(master: str) -> Iterator[ServerProxy]:
    with ServerProxy(master) as found:
        yield found


def test_subscribers_get_the_full_list_each_time(proxy: ServerProxy, slaves: list[Slave]) -> None:
    subscriber, publisher = slaves
    proxy.registerSubscriber("/sub", "/t", "std_msgs/Bool", subscriber.uri)
    proxy.registerPublisher("/pub", "/t", "std_msgs/Bool", publisher.uri)
    assert subscriber.next() == ("publisherUpdate", "/master", "/t", [publisher.uri])
    proxy.registerPublisher("/other", "/t", "std_msgs/Bool", "http://127.0.0.1:1/")
    assert subscriber.next() == ("publisherUpdate", "/master", "/t", [publisher.uri, "http://127.0.0.1:1/"])
    proxy.unregisterPublisher("/other", "/t", "http://127.0.0.1:1/")
    assert subscriber.next() == ("publisherUpdate", "/master", "/t", [publisher.uri])
    proxy.unregisterPublisher("/pub", "/t", publisher.uri)
    assert subscriber.next() == ("publisherUpdate", "/master", "/t", [])


def test_the_older_node_of_a_name_is_shut_down(proxy: ServerProxy, slaves: list[Slave]) -> None:
    old, new = slaves
    proxy.registerPublisher("/same", "/t", "std_msgs/Bool", old.uri)
    proxy.registerPublisher("/same", "/u", "std_msgs/Bool", new.uri)
    method, caller, reason = old.next()
    assert (method, caller) == ("shutdown", "/master")
    assert "new node registered with same name" in reason
    state: Any = proxy.getSystemState("/test")
    assert state[2][0] == [["/u", ["/same"]]]
    # The old node's late unregistration does not affect the new node.
    assert proxy.unregisterPublisher("/same", "/u", old.uri)[2] == 0  # type: ignore[index]


def test_a_subscriber_that_never_answers_delays_no_other(proxy: ServerProxy, slaves: list[Slave]) -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        dead = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        proxy.registerSubscriber("/dead", "/t", "std_msgs/Bool", dead)
        proxy.registerSubscriber("/sub", "/t", "std_msgs/Bool", slaves[0].uri)
        proxy.registerPublisher("/pub", "/t", "std_msgs/Bool", slaves[1].uri)
        assert slaves[0].next() == ("publisherUpdate", "/master", "/t", [slaves[1].uri])


def test_an_update_does_not_meet_the_answer_to_a_registration(
    proxy: ServerProxy, slaves: list[Slave], monkeypatch: pytest.MonkeyPatch
) -> None:
    # If real rospy received the update first and then the older response, it would lose the publisher.
    old, fresh = slaves
    monkeypatch.setattr(notifier, "HOLD_SECONDS", 0.0)
    proxy.registerSubscriber("/old", "/t", "std_msgs/Bool", old.uri)
    proxy.registerSubscriber("/fresh", "/before", "std_msgs/Bool", fresh.uri)
    monkeypatch.setattr(notifier, "HOLD_SECONDS", 3600.0)
    proxy.registerSubscriber("/fresh", "/t", "std_msgs/Bool", fresh.uri)
    proxy.subscribeParam("/fresh", fresh.uri, "/p")
    proxy.setParam("/other", "/p", 1)
    proxy.registerPublisher("/pub", "/t", "std_msgs/Bool", "http://127.0.0.1:1/")
    assert old.next() == ("publisherUpdate", "/master", "/t", ["http://127.0.0.1:1/"])
    proxy.registerPublisher("/pub", "/before", "std_msgs/Bool", "http://127.0.0.1:1/")
    assert fresh.next() == ("publisherUpdate", "/master", "/before", ["http://127.0.0.1:1/"])
    assert fresh.called.empty()


def test_a_deferred_update_is_sent_a_moment_later(proxy: ServerProxy, slaves: list[Slave]) -> None:
    node = slaves[0]
    for number in range(20):
        proxy.registerSubscriber("/node", f"/t{number}", "std_msgs/Bool", node.uri)
        proxy.subscribeParam("/node", node.uri, f"/p{number}")
        proxy.registerPublisher("/pub", f"/t{number}", "std_msgs/Bool", "http://127.0.0.1:1/")
        proxy.setParam("/other", f"/p{number}", 1)
    found = sorted(node.next() for _ in range(40))
    assert found == sorted(
        [("paramUpdate", "/master", f"/p{number}/", 1) for number in range(20)]
        + [("publisherUpdate", "/master", f"/t{number}", ["http://127.0.0.1:1/"]) for number in range(20)]
    )
    assert node.called.empty()


def test_param_updates(proxy: ServerProxy, slaves: list[Slave]) -> None:
    node = slaves[0]
    proxy.subscribeParam("/node", node.uri, "/a/b")
    proxy.setParam("/other", "/a/b", {"c": 1})
    assert node.next() == ("paramUpdate", "/master", "/a/b/", {"c": 1})
    proxy.setParam("/other", "/a/b/c", 2)
    assert node.next() == ("paramUpdate", "/master", "/a/b/c/", 2)
    proxy.setParam("/other", "/a", {"b": 3})
    assert node.next() == ("paramUpdate", "/master", "/a/b/", 3)
    # The node that sets the parameter is not notified; another node deletes it.
    proxy.setParam("/node", "/a/b", 4)
    proxy.deleteParam("/other", "/a/b")
    assert node.next() == ("paramUpdate", "/master", "/a/b/", {})


def test_many_calls_in_one(proxy: ServerProxy) -> None:
    answer: Any = proxy.system.multicall(
        [
            {"methodName": "setParam", "params": ["/test", "/p", 1]},
            {"methodName": "getParam", "params": ["/test", "/p"]},
            {"methodName": "nonsense", "params": []},
            {},
        ]
    )
    assert answer[:2] == [[[1, "parameter /p set", 0]], [[1, "Parameter [/p]", 1]]]
    assert [set(entry) for entry in answer[2:]] == [{"faultCode", "faultString"}] * 2


@pytest.mark.parametrize(
    ("request_bytes", "status"),
    [
        (b"garbage\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\n\r\n", b"405"),
        (b"POST / HTTP/1.1\r\nContent-Length: 3\r\n\r\nabc", b"400"),
        (b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n", b"413"),
        (b"POST / HTTP/1.1\r\nContent-Length: x\r\n\r\n", b"400"),
        (b'POST / HTTP/1.1\r\nContent-Length: 41\r\n\r\n<!DOCTYPE a [<!ENTITY b "c">]><methodCall>', b"400"),
    ],
)
def test_bad_requests_are_refused_and_do_no_harm(master: str, request_bytes: bytes, status: bytes) -> None:
    port = int(master.rsplit(":", 1)[1])

    with socket.create_connection(("127.0.0.1", port), 5) as sock:
        sock.sendall(request_bytes)
        answer = b""
        while more := sock.recv(4096):
            answer += more

    assert answer.split(b" ", 2)[1] == status
    with ServerProxy(master) as proxy:
        assert proxy.getPid("/test")[0] == 1  # type: ignore[index]


def test_the_kept_answer_to_get_system_state_is_never_an_old_one() -> None:
    """After each change, replaying the journal must lead to the same graph, with the same names."""
    rng = random.Random(1)
    nodes, uris, topics = ("/a", "/b", "/c"), ("http://h:1/", "http://h:2/"), ("/t", "/u", "/v")

    async def scene() -> None:
        master = Master()
        master.notifier.send = lambda notice: None  # type: ignore[method-assign]

        for number in range(2000):
            node, uri, topic = rng.choice(nodes), rng.choice(uris), rng.choice(topics)
            calls: tuple[tuple[str, ...], ...] = (
                ("registerPublisher", node, topic, "a/B", uri),
                ("registerSubscriber", node, topic, "*", uri),
                ("registerService", node, topic, f"rosrpc:{uri[5:]}", uri),
                ("subscribeParam", node, uri, topic),
                ("unregisterPublisher", node, topic, uri),
                ("unregisterSubscriber", node, topic, uri),
                ("unregisterService", node, topic, f"rosrpc:{uri[5:]}"),
                ("unsubscribeParam", node, uri, topic),
                ("",),
            )
            method, *args = rng.choice(calls)
            if method:
                assert master.serve(method, args)[0] == 1
            else:
                master._forget(node, uri)
            state = master.get_system_state("/x")
            served = master.serve("getSystemState", ["/x"])
            written = served if isinstance(served, Serialized) else finish(served)
            assert serialize_response(written) == serialize_response(state)

            if number % 100 == 0:
                successor = Master()
                replay = Replay(successor.registry, successor.parameters)
                for record in changes_to(master.registry, master.parameters):
                    replay.apply(*record)
                assert successor.get_system_state("/x") == state
                assert successor.registry.nodes() == master.registry.nodes()

    asyncio.run(scene())


def test_tables_of_a_large_graph_come_in_steps() -> None:
    async def scene() -> None:
        master = Master()
        topics = [f"/large/t{number}" for number in range(2_000)]
        for topic in topics:
            master.serve("registerPublisher", ["/x", topic, "a/B", "http://x:1/"])
        for call, text in (
            (("getTopicTypes", "/x"), "current system state"),
            (("getPublishedTopics", "/x", "/large"), "current topics"),
        ):
            found = list(master.serve(call[0], call[1:]))
            assert len(found) >= 4
            assert finish(master.serve(call[0], call[1:])) == [1, text, [[topic, "a/B"] for topic in topics]]
        assert finish(master.serve("getPublishedTopics", ["/x", "/larg"])) == [1, "current topics", []]

    asyncio.run(scene())
