"""Publications, subscriptions and nodes: links between nodes on one loop, with real sockets, and how links are closed."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
import struct
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import (
    HandshakeRefused,
    MasterUnreachableError,
    RpcUnreachable,
    ThreadLimitError,
    WireError,
)
from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.header import Header, serialize_header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.master.master import Master
from minirospy.runtime.node import subscription as subscription_module
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.subscription import Subscription
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.transport import tcp
from minirospy.runtime.transport.links import OutLink
from minirospy.runtime.transport.loop import new_event_loop
from tests.conftest import free_port
from tests.manual_loop import ManualLoop, run_manually, until

BOOL = InterfaceType("std_msgs/Bool", "8b94c1b53db61fb6aed406028ad6332a", "bool data\n")
STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
FOREIGN = {"md5sum": ANY, "type": STRING.name, "callerid": "/foreign"}


@pytest.fixture(params=["auto", "unix", "tcp"])
def transport(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nodes on this machine use any transport, no shared memory, or only TCP."""
    monkeypatch.setenv("MINIROSPY_TRANSPORT", request.param)


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a new loop."""
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()


def environment(master: Master) -> Environment:
    return Environment.read(
        {
            "ROS_MASTER_URI": f"http://127.0.0.1:{master.port}",
            "ROS_IP": "127.0.0.1",
            "MINIROSPY_TRANSPORT": os.environ.get("MINIROSPY_TRANSPORT", ""),
        }
    )


@contextlib.asynccontextmanager
async def graph(
    *names: str, watch_seconds: float = 60.0, port: int = 0
) -> AsyncIterator[tuple[Master, list[Node]]]:
    """Run a master and some nodes on this loop.

    A master that restarts needs a ``port`` that the system assigns to no other socket.
    """
    master = Master(host="127.0.0.1", port=port)
    await master.start()
    nodes = [Node(name, environment(master), watch_seconds=watch_seconds) for name in names]
    try:
        for node in nodes:
            await node.start()
        yield master, nodes
    finally:
        for node in nodes:
            await node.close()
        await master.close()


class Box:
    """Records the delivered messages."""

    def __init__(self) -> None:
        self.bodies: list[bytes] = []
        self.headers: list[Header] = []

    def __call__(self, frame: memoryview, header: Header) -> None:
        self.bodies.append(bytes(frame))
        self.headers.append(header)


async def listen(node: Node, topic: str, deliver: Callable[[memoryview, Header], None]) -> Subscription:
    subscription = node.make_subscription(topic, STRING, deliver)
    await node.subscribe(subscription)
    return subscription


async def publish(node: Node, topic: str, **options: Any) -> Publication:
    publication = Publication(topic, STRING, **options)
    await node.advertise(publication)
    return publication


class Foreign:
    """A publisher on raw sockets: ``serve(connection)`` runs after the subscriber's header."""

    def __init__(self, serve: Callable[[socket.socket], Coroutine[Any, Any, None]]) -> None:
        self.connections = 0
        self._serve = serve
        self._listener = tcp.Listener(self._accept)
        self._listener.open("127.0.0.1")

    async def answer(self, *_: Any) -> Any:
        return [1, "ready", ["TCPROS", "127.0.0.1", self._listener.port]]

    async def _accept(self, sock: socket.socket, _address: str) -> None:
        self.connections += 1
        await tcp.receive_header(sock)
        with contextlib.suppress(OSError, WireError):
            await self._serve(sock)
        sock.close()

    async def close(self) -> None:
        await self._listener.close()


async def subscribe_to(
    foreign: Foreign,
    monkeypatch: pytest.MonkeyPatch,
    node: Node,
    deliver: Callable[[memoryview, Header], None],
    *,
    on_loop: bool = False,
) -> Subscription:
    """Return a subscription that was notified of one publisher, which is simulated by ``foreign``."""
    subscription = node.make_subscription("/t", STRING, deliver, on_loop=on_loop)
    monkeypatch.setattr(subscription.rpc, "call", foreign.answer)
    subscription.publishers_changed(["http://127.0.0.1:1/"])
    return subscription


@pytest.mark.usefixtures("transport")
def test_messages_go_from_node_to_node() -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            box = Box()
            publication = await publish(a, "/t")
            await listen(b, "/t", box)
            await until(lambda: publication.links)
            publication.publish(serialize_frame(b"one"))
            publication.publish(serialize_frame(b"two"))
            await until(lambda: len(box.bodies) == 2)
            assert box.bodies == [b"one", b"two"]
            assert (box.headers[0]["callerid"], box.headers[0]["topic"]) == ("/a", "/t")

    run(scene)


@pytest.mark.usefixtures("transport")
def test_a_publisher_that_closes_the_connection_is_connected_again() -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            box = Box()
            publication = await publish(a, "/t")
            await listen(b, "/t", box)
            for number in range(3):
                await until(lambda: publication.links)
                publication.publish(serialize_frame(b"%d" % number))
                await until(lambda number=number: len(box.bodies) == number + 1)
                publication.links[0].close()
            assert box.bodies == [b"0", b"1", b"2"]

    run(scene)


def test_a_refused_subscriber_logs_why_and_retries_only_after_a_change(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = Publication("/t", BOOL)
            await a.advertise(publication)
            subscription = await listen(b, "/t", Box())
            await until(lambda: "refused the connection" in caplog.text)
            assert not publication.links
            # The connecting task has logged this; it finishes one loop iteration later.
            await until(lambda: not subscription.connecting)
            await a.unadvertise(publication)
            right = await publish(a, "/t")
            await until(lambda: right.links)

    run(scene)
    assert "topic types do not match: [std_msgs/String] vs. [std_msgs/Bool]" in caplog.text


@pytest.mark.parametrize("on_loop", [False, True])
def test_publisher_of_garbage_is_reported_and_retried_with_backoff(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, on_loop: bool
) -> None:
    delays: list[float] = []

    async def garbage(sock: socket.socket) -> None:
        await tcp.send_header(sock, FOREIGN)
        await asyncio.get_running_loop().sock_sendall(sock, struct.pack("<I", 0xFFFFFFFF) + b"xxxx")
        await tcp.receive_header(sock)

    async def scene() -> None:
        monkeypatch.setattr("minirospy.core.graph.subscription.FIRST_DELAY", 0.001)
        async with graph("/b") as (_, (b,)):
            foreign, box = Foreign(garbage), Box()
            subscription = await subscribe_to(foreign, monkeypatch, b, box, on_loop=on_loop)
            start = subscription.start_connecting
            monkeypatch.setattr(
                subscription, "start_connecting", lambda action: (delays.append(action.delay), start(action))
            )
            await until(lambda: len(delays) >= 4)
            subscription.close()
            await foreign.close()
            assert box.bodies == []

    run(scene)
    assert delays[:4] == [0.001, 0.002, 0.004, 0.008]
    assert "a message of 4294967295 bytes is over the limit" in caplog.text


@pytest.mark.parametrize("answer", [b"", b"\x05\0\0\0ab", b"HTTP/1.1 400 Bad Request\r\n\r\n"])
def test_a_publisher_whose_header_is_none_is_diagnosed_in_one_line(
    answer: bytes, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def bad_header(sock: socket.socket) -> None:
        await asyncio.get_running_loop().sock_sendall(sock, answer)

    async def scene() -> None:
        monkeypatch.setattr("minirospy.core.graph.subscription.FIRST_DELAY", 0.001)
        async with graph("/b") as (_, (b,)):
            foreign = Foreign(bad_header)
            subscription = await subscribe_to(foreign, monkeypatch, b, Box())
            await until(lambda: foreign.connections >= 6)
            subscription.close()
            await foreign.close()

    run(scene)
    lines = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    (line,) = [line for line in lines if "cannot connect to the publisher of /t" in line]
    assert "Its address is right" in line


@pytest.mark.parametrize(
    ("uri", "advice"),
    [
        ("http://no-such-host.invalid:5/", "does not know the name 'no-such-host.invalid'"),
        (
            "http://127.0.0.1:1/",
            "'127.0.0.1' is this machine: if the publisher runs on another one, set ROS_IP",
        ),
    ],
)
def test_an_address_that_cannot_be_reached_is_diagnosed_in_one_line(
    uri: str, advice: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        monkeypatch.setattr("minirospy.core.graph.subscription.FIRST_DELAY", 0.001)
        async with graph("/b") as (_, (b,)):
            subscription = b.make_subscription("/t", STRING, Box())
            subscription.publishers_changed([uri])
            await until(lambda: subscription.plan.failures(uri) >= 5)
            subscription.close()

    run(scene)
    lines = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert len(lines) == 1
    assert lines[0].startswith(f"cannot connect to the publisher of /t at {uri}: ")
    assert advice in lines[0]


@pytest.mark.parametrize(
    ("count", "topics"),
    [
        (1, "/t0"),
        (5, "/t0, /t1, /t2, /t3, /t4"),
        (6, "/t0, /t1, /t2, /t3, /t4 and 1 more topic"),
        (40, "/t0, /t1, /t2, /t3, /t4 and 35 more topics"),
    ],
)
def test_a_publisher_of_many_topics_that_cannot_be_reached_is_one_line(
    count: int, topics: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    uri = "http://127.0.0.1:1/"

    async def scene() -> None:
        # The delay lasts until the node closes.
        monkeypatch.setattr("minirospy.runtime.node.unreachable.TOGETHER_SECONDS", 1e6)
        async with graph("/b") as (_, (b,)):
            for number in range(count):
                subscription = b.make_subscription(f"/t{number}", STRING, Box())
                b.subscriptions[subscription.topic] = subscription
                subscription.plan.publishers_changed([uri])
                subscription.retry(uri, TimeoutError("no answer"))

    run(scene)
    lines = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert [line.partition(" at ")[0] for line in lines] == [f"cannot connect to the publisher of {topics}"]


def test_many_publishers_that_cannot_be_reached_are_some_lines_and_a_number(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    uris = [f"http://127.0.0.1:1/{number}" for number in range(30)]

    async def scene() -> None:
        async with graph("/b") as (_, (b,)):
            subscription = b.make_subscription("/t", STRING, Box())
            subscription.plan.publishers_changed(uris)
            for uri in uris:
                subscription.retry(uri, TimeoutError("no answer"))
            subscription.close()

    monkeypatch.setattr("minirospy.runtime.transport.rate_limited_logger.INTERVAL_SECONDS", 1e9)
    run(scene)
    lines = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert len(lines) == 11
    assert all("cannot connect to the publisher of /t" in line for line in lines[:10])
    assert lines[10] == "20 more like the last ones"


@pytest.mark.usefixtures("transport")
def test_newest_keeps_the_newest_however_slow_the_receiver() -> None:
    started, go_on = threading.Event(), threading.Event()
    bodies: list[bytes] = []

    def slow(frame: memoryview, _header: Header) -> None:
        bodies.append(bytes(frame[:4]))
        started.set()
        go_on.wait(30)

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t", queue_size=2)
            subscription = b.make_subscription("/t", STRING, slow, newest=1)
            await b.subscribe(subscription)
            await until(lambda: publication.links)
            publication.publish(serialize_frame(b"0000" + bytes(1_000_000)))
            await asyncio.get_running_loop().run_in_executor(None, started.wait, 30)
            for number in range(1, 101):
                publication.publish(serialize_frame(b"%04d" % number + bytes(1_000_000)))
            # 100 MB were published; the queue bounds the waiting data.
            assert publication.links[0].waiting <= 3
            go_on.set()
            await until(lambda: bodies[-1] == b"0100")
            assert len(bodies) <= 4

    run(scene)


def test_a_slow_reader_costs_the_publisher_no_more_than_its_queue() -> None:
    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            publication = await publish(a, "/t", queue_size=5)
            sock = await raw_subscriber(a)
            await until(lambda: publication.links)
            link = publication.links[0]
            for _ in range(100):
                publication.publish(serialize_frame(bytes(1_000_000)))
            assert link.waiting <= 6
            assert link.dropped >= 80
            sock.close()
            await until(lambda: not publication.links)
            publication.publish(serialize_frame(b"to nobody"))

    run(scene)


def test_without_a_queue_publish_waits_for_the_reader() -> None:
    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            publication = await publish(a, "/t", queue_size=None)
            sock = await raw_subscriber(a)
            await until(lambda: publication.links)
            loop = asyncio.get_running_loop()
            whole = serialize_frame(bytes(30_000_000))
            done = loop.run_in_executor(None, publication.publish, whole)
            await until(lambda: publication.links[0].waiting)
            assert not done.done()
            received = 0
            while received < len(whole):
                received += len(await loop.sock_recv(sock, 1 << 20))
            await done
            # The wait must also end if the reader disconnects.
            done = loop.run_in_executor(None, publication.publish, whole)
            await until(lambda: publication.links[0].waiting)
            sock.close()
            await done

    run(scene)


async def raw_subscriber(node: Node, **changes: str) -> socket.socket:
    """Return a connection that has exchanged headers as a subscriber to /t, and from which nothing more is read."""
    sock = await tcp.connect("127.0.0.1", node.tcpros_port)
    fields = {"topic": "/t", "md5sum": STRING.md5sum, "type": STRING.name, "callerid": "/raw", **changes}
    await tcp.send_header(sock, fields)
    await tcp.receive_header(sock)
    return sock


def test_a_publisher_with_an_invalid_address_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        async with graph("/a") as (_, (node,)):
            subscription = await listen(node, "/t", Box())
            subscription.publishers_changed(["nonsense"])
            await until(lambda: "not the address of a node" in caplog.text)

    run(scene)


@pytest.mark.parametrize("latch", [False, True])
def test_subscriber_receives_all_messages_after_its_header(*, latch: bool) -> None:
    rounds = 200

    def subscribe_and_publish(publication: Publication, port: int) -> None:
        header = serialize_header(
            {"topic": "/t", "md5sum": STRING.md5sum, "type": STRING.name, "callerid": "/raw"}
        )
        for number in range(rounds):
            with socket.create_connection(("127.0.0.1", port)) as sock, sock.makefile("rb") as stream:
                sock.settimeout(30)
                sock.sendall(header)
                (length,) = struct.unpack("<I", stream.read(4))
                stream.read(length)
                publication.publish(serialize_frame(b"%d" % number))
                # A latched topic's last message arrives first.
                wanted = [number] if not latch or not number else [number - 1, number]
                for each in wanted:
                    (length,) = struct.unpack("<I", stream.read(4))
                    assert stream.read(length) == b"%d" % each

    async def scene() -> None:
        async with graph("/a") as (_, (node,)):
            publication = await publish(node, "/t", latch=latch)
            await asyncio.get_running_loop().run_in_executor(
                None, subscribe_and_publish, publication, node.tcpros_port
            )

    run(scene)


@pytest.mark.usefixtures("transport")
def test_the_last_message_of_a_latched_topic_is_kept_on_both_sides() -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t", latch=True)
            publication.publish(serialize_frame(b"old"))
            publication.publish(serialize_frame(b"new"))
            box = Box()
            subscription = await listen(b, "/t", box)
            await until(lambda: box.bodies)
            assert box.bodies == [b"new"]
            assert subscription.links[0].latched == b"new"

    run(scene)


def test_a_publisher_update_that_overtakes_the_answer_is_not_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            ask = b.registrations.call

            async def answer_late(method: str, *args: Any) -> Any:
                answer = await ask(method, *args)
                if not a.publications:
                    await publish(a, "/t")
                    await until(lambda: b.subscriptions["/t"].links)
                return answer

            monkeypatch.setattr(b.registrations, "call", answer_late)
            subscription = await listen(b, "/t", Box())
            assert [(link.uri, link.closed) for link in subscription.links] == [(a.uri, False)]

    run(scene)


def test_a_refusal_that_a_new_list_overtakes_is_not_the_last_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """The publisher unregistered and registered again; the update about this arrived during the handshake."""

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            await publish(a, "/t")
            subscription = b.make_subscription("/t", STRING, Box())
            open_link = subscription.open_link

            async def refuse_once(uri: str) -> Any:
                monkeypatch.setattr(subscription, "open_link", open_link)
                subscription.publishers_changed([a.uri])
                raise HandshakeRefused("[/a] is not a publisher of [/t]")

            monkeypatch.setattr(subscription, "open_link", refuse_once)
            await b.subscribe(subscription)
            await until(lambda: subscription.links)

    run(scene)


def test_publisher_list_of_an_earlier_subscription_is_queried_again() -> None:
    """rosmaster queues its lists, so they may arrive after the response to a later registration."""

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            await publish(a, "/t")
            await b.unsubscribe(await listen(b, "/t", Box()))
            subscription = await listen(b, "/t", Box())
            await until(lambda: subscription.links)
            b.publishers_changed("/t", [])
            assert not subscription.links
            await until(lambda: subscription.links)

    run(scene)


def test_publisher_listed_again_while_connecting_is_connected_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            await publish(a, "/t")
            subscription = b.make_subscription("/t", STRING, Box())
            open_link, opening, opened = subscription.open_link, 0, 0
            is_named_again = asyncio.Event()

            async def open_all_the_same(uri: str) -> Any:
                nonlocal opening, opened
                opening += 1
                # Before Python 3.12, asyncio.wait_for may do this.
                with contextlib.suppress(asyncio.CancelledError):
                    await is_named_again.wait()
                link = await open_link(uri)
                opened += 1
                return link

            monkeypatch.setattr(subscription, "open_link", open_all_the_same)
            await b.subscribe(subscription)
            await until(lambda: opening)
            subscription.publishers_changed([])
            subscription.publishers_changed([a.uri])
            is_named_again.set()
            await until(lambda: opened == 2)
            await until(lambda: len(a.publications["/t"].links) == len(subscription.links) == 1)

    run(scene)


def slow(node: Node, monkeypatch: pytest.MonkeyPatch, slow_calls: str) -> None:
    """Delay a node's calls to its master if the method has this prefix; they are not cancelled."""
    ask = node.registrations.call

    async def ask_late(method: str, *args: Any) -> Any:
        await asyncio.sleep(0.05)
        return await ask(method, *args)

    async def master(method: str, *args: Any) -> Any:
        if method.startswith(slow_calls):
            return await asyncio.shield(asyncio.ensure_future(ask_late(method, *args)))
        return await ask(method, *args)

    monkeypatch.setattr(node.registrations, "call", master)


async def offer(node: Node, kind: str) -> Callable[[], Coroutine[Any, Any, None]]:
    """Register an object of this kind; return a function that unregisters it."""
    if kind == "publisher":
        publication = await publish(node, "/x")
        return lambda: node.unadvertise(publication)
    if kind == "subscriber":
        subscription = await listen(node, "/x", Box())
        return lambda: node.unsubscribe(subscription)
    service = node.make_service("/x", STRING, lambda *_: b"", request_type="r", response_type="r")
    await node.serve(service)
    return lambda: node.unserve(service)


def known(master: Master) -> dict[str, list[str]]:
    """Return a dict from kind to the nodes that are registered for /x."""
    registry = master.registry
    tables = {
        "publisher": registry.publishers(),
        "subscriber": registry.subscribers(),
        "service": registry.services(),
    }
    return {kind: list(table["/x"]) for kind, table in tables.items() if "/x" in table}


KINDS = ["publisher", "subscriber", "service"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_registration_does_not_overtake_the_unregistration_before(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    async def scene() -> None:
        async with graph("/a") as (master, (a,)):
            end = await offer(a, kind)
            slow(a, monkeypatch, "unregister")
            ending = asyncio.ensure_future(end())
            await asyncio.sleep(0)
            await offer(a, kind)
            await ending
            assert known(master) == {kind: ["/a"]}

    run(scene)


@pytest.mark.parametrize("kind", KINDS)
def test_the_shutdown_of_the_node_does_not_overtake_a_registration(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    async def scene() -> None:
        async with graph("/a") as (master, (a,)):
            slow(a, monkeypatch, "register")
            offering = asyncio.ensure_future(offer(a, kind))
            await asyncio.sleep(0.01)
            offering.cancel()
            await a.close()
            with contextlib.suppress(asyncio.CancelledError, MasterUnreachableError):
                await offering
            # If another call overtook it, it has arrived by then.
            await asyncio.sleep(0.1)
            assert not known(master)

    run(scene)


def test_close_gives_up_registrations_with_a_silent_master(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Calls in progress and queued calls are given up within the documented ten seconds."""

    async def scene(clock: ManualLoop) -> None:
        async with graph("/a") as (_, (a,)):

            async def silent(uri: str, method: str, *_: Any, timeout: float) -> Any:
                await asyncio.sleep(timeout)
                raise RpcUnreachable(uri, f"{method}: timed out")

            monkeypatch.setattr(a.rpc, "call", silent)
            offering = asyncio.ensure_future(offer(a, "publisher"))
            await asyncio.sleep(0)
            closing = asyncio.ensure_future(a.close())
            for _ in range(20):
                await clock.advance(0.5)
            assert closing.done()
            assert isinstance(
                (await asyncio.gather(offering, return_exceptions=True))[0], MasterUnreachableError
            )

    run_manually(scene)


@pytest.mark.parametrize("kind", KINDS)
def test_a_master_that_was_away_gets_the_registrations_it_missed(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """The master kept its tables, so it still knows the node."""

    async def scene() -> None:
        async with graph("/a", watch_seconds=0.05) as (master, (a,)):
            await publish(a, "/known")
            ask, is_away = a.registrations.call, True

            async def be_away(method: str, *args: Any) -> Any:
                if is_away:
                    raise MasterUnreachableError("http://there")
                return await ask(method, *args)

            monkeypatch.setattr(a.registrations, "call", be_away)
            with pytest.raises(MasterUnreachableError):
                await offer(a, kind)
            is_away = False
            await until(lambda: known(master) == {kind: ["/a"]})
            is_away = True
            part = {"publisher": a.publications, "subscriber": a.subscriptions, "service": a.services}[kind][
                "/x"
            ]
            end = {"publisher": a.unadvertise, "subscriber": a.unsubscribe, "service": a.unserve}[kind]
            with pytest.raises(MasterUnreachableError):
                await end(part)  # type: ignore[operator]
            is_away = False
            await until(lambda: not known(master))

    run(scene)


def test_a_restarted_master_that_knows_one_new_topic_gets_all_others() -> None:
    async def scene() -> None:
        async with graph("/a", watch_seconds=0.3, port=free_port()) as (master, (a,)):
            await offer(a, "service")
            await publish(a, "/old")
            port = master.port
            await master.close()
            restarted = Master(host="127.0.0.1", port=port)
            await restarted.start()
            try:
                await publish(a, "/new")
                await until(lambda: known(restarted) == {"service": ["/a"]})
                await until(lambda: set(restarted.registry.publishers()) == {"/old", "/new"})
            finally:
                await restarted.close()

    run(scene)


def test_a_node_whose_service_another_node_took_notices_a_restarted_master() -> None:
    """The master lists the service for the other node, which keeps it after the restart."""

    async def scene() -> None:
        async with graph("/a", "/b", watch_seconds=0.05, port=free_port()) as (master, (a, b)):
            await offer(a, "service")
            await offer(a, "publisher")
            await offer(b, "service")
            await until(lambda: a.registrations.taken)
            port = master.port
            await master.close()
            restarted = Master(host="127.0.0.1", port=port)
            await restarted.start()
            try:
                await until(lambda: known(restarted) == {"publisher": ["/a"], "service": ["/b"]})
                await a.registrations.register_all(again=True)
                assert known(restarted)["service"] == ["/b"]
            finally:
                await restarted.close()

    run(scene)


def test_closing_the_last_topic_is_not_taken_for_a_new_master(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene() -> None:
        async with graph("/a", watch_seconds=0.02) as (_, (a,)):
            end, call, looked = await offer(a, "publisher"), a.registrations.call_master, asyncio.Event()

            async def end_first(method: str, *args: Any, **limits: float) -> Any:
                if method == "lookupNode" and a.publications:
                    await end()
                    asyncio.get_running_loop().call_soon(looked.set)
                return await call(method, *args, **limits)

            monkeypatch.setattr(a.registrations, "call_master", end_first)
            await looked.wait()
            await asyncio.sleep(0.05)

    run(scene)
    assert not caplog.text


def test_a_node_of_an_illegal_name_is_not_taken_for_forgotten(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The master refuses each lookup of such a name, but rospy lets the node run."""

    async def scene() -> None:
        async with graph("/led actuator", watch_seconds=0.02) as (_, (a,)):
            await publish(a, "/t")
            look, looks = a.registrations._look, asyncio.Queue[str]()

            async def counted(method: str, *args: Any) -> Any:
                looks.put_nowait(method)
                return await look(method, *args)

            monkeypatch.setattr(a.registrations, "_look", counted)
            for _ in range(3):
                assert await looks.get() == "lookupNode"

    run(scene)
    assert "has restarted" not in caplog.text


def test_a_master_that_forgot_everything_gets_all_registrations_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def scene() -> None:
        async with graph("/a", "/b", watch_seconds=0.05, port=free_port()) as (master, (a, b)):
            box = Box()
            publication = await publish(a, "/t")
            subscription = await listen(b, "/t", box)
            again = threading.Event()
            b.when_registered_again.append(again.set)
            # The publisher's end opens a moment before the subscriber's.
            await until(lambda: publication.links and subscription.links)
            link = subscription.links[0]
            port = master.port
            await master.close()
            await until(lambda: "What is connected goes on" in caplog.text)
            publication.publish(serialize_frame(b"without a master"))
            await until(lambda: len(box.bodies) == 1)
            restarted = Master(host="127.0.0.1", port=port)
            await restarted.start()

            try:
                await until(lambda: restarted.registry.publishers().get("/t"))
                await until(lambda: restarted.registry.subscribers().get("/t"))
                await asyncio.get_running_loop().run_in_executor(None, again.wait, 30)
                publication.publish(serialize_frame(b"after"))
                await until(lambda: len(box.bodies) == 2)

                assert subscription.links == (link,), "the connection outlived the master"
                late = Box()
                await listen(a, "/t", late)
                await until(lambda: len(publication.links) == 2)
            finally:
                await restarted.close()

    run(scene)
    assert "has restarted: registered again" in caplog.text


def test_node_at_the_limit_of_threads_registers_with_restarted_masters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object) -> None:
        raise ThreadLimitError(1, [])

    async def restarted(port: int) -> None:
        master = Master(host="127.0.0.1", port=port)
        await master.start()
        try:
            await until(lambda: set(master.registry.publishers()) == {"/t"})
            # The watch has checked once more.
            await asyncio.sleep(0.2)
        finally:
            await master.close()

    async def scene() -> None:
        async with graph("/a", watch_seconds=0.05, port=free_port()) as (master, (a,)):
            await publish(a, "/t")
            a.when_registered_again.append(int)
            port = master.port
            await master.close()
            with monkeypatch.context() as patch:
                patch.setattr(a.workers, "start", refuse)
                for _ in range(2):
                    await restarted(port)

    run(scene)


def test_a_list_that_is_still_filling_drops_no_connected_publisher(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subscription_module, "SETTLE_SECONDS", 0.01)

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t")
            subscription = await listen(b, "/t", Box())
            # The publisher's end opens a moment before the subscriber's.
            await until(lambda: publication.links and subscription.links)
            subscription.registered_again([])
            subscription.publishers_changed(["http://127.0.0.1:1/"])
            await until(lambda: subscription.settling is None)
            assert [link.uri for link in subscription.links] == [a.uri]
            assert subscription.plan.lost(a.uri) is None  # the master no longer lists it
            # The node that the master lists again is already connected.
            subscription.publishers_changed([a.uri])
            assert not subscription.connecting.get(a.uri)
            publication.links[0].close()
            await until(lambda: len(publication.links) == 1)

    run(scene)


def test_ports_out_of_a_range() -> None:
    async def scene() -> None:
        master = Master(host="127.0.0.1")
        await master.start()
        with socket.create_server(("127.0.0.1", 0)) as taken:
            first = taken.getsockname()[1]
            ports = range(first, first + 20)
            settings = environment(master)._replace(ports=ports)
            node = Node("/ranged", settings)
            await node.start()
            try:
                assert node.tcpros_port in ports
                assert int(node.uri.rsplit(":", 1)[1].strip("/")) in ports
                assert first not in (node.tcpros_port, int(node.uri.rsplit(":", 1)[1].strip("/")))
            finally:
                await node.close()
                await master.close()

    run(scene)


@pytest.mark.skipif(not socket.has_ipv6, reason="this Python has no IPv6")
def test_nodes_meet_over_ipv6() -> None:
    async def scene() -> None:
        master = Master(host="127.0.0.1")
        await master.start()
        settings = Environment.read(
            {"ROS_MASTER_URI": f"http://127.0.0.1:{master.port}", "ROS_IP": "::1", "ROS_IPV6": "on"}
        )
        node = Node("/six", settings)

        try:
            await node.start()
        except OSError:
            await master.close()
            pytest.skip("this machine has no IPv6 loopback")

        try:
            assert node.uri.startswith("http://[::1]:")
            rpc = AsyncRpcClient()
            assert await rpc.call(node.uri, "getName", "/test") == [1, "", "/six"]
            await rpc.close()
            box = Box()
            publication = await publish(node, "/t")
            await listen(node, "/t", box)
            await until(lambda: publication.links)
            publication.publish(serialize_frame(b"six"))
            await until(lambda: box.bodies)
        finally:
            await node.close()
            await master.close()

    run(scene)


def test_many_publishers_that_answer_nonsense_are_summed_up(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def answer(uri: str, *_: object) -> object:
        return [1, "", uri]

    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            subscription = a.make_subscription("/t", STRING, Box())
            monkeypatch.setattr(subscription.rpc, "call", answer)
            subscription.publishers_changed(f"http://127.0.0.1:{port}/" for port in range(1, 101))
            await until(lambda: not subscription.connecting)
            subscription.close()

    monkeypatch.setattr("minirospy.runtime.transport.rate_limited_logger.INTERVAL_SECONDS", 1e9)
    run(scene)
    lines = [r.getMessage() for r in caplog.records if r.name == "minirospy.runtime.node.subscription"]
    assert len(lines) == 11
    assert lines[0].startswith(
        "no connection for /t: http://127.0.0.1:1/ answered requestTopic for /t with [1, "
    )
    assert lines[-1] == "90 more like the last ones"


@pytest.mark.usefixtures("transport")
def test_subscription_closed_while_connecting_leaves_no_link() -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t")
            for _ in range(30):
                subscription = await listen(b, "/t", Box())
                await until(lambda: publication.links)
                await b.unsubscribe(subscription)
                await until(lambda: not publication.links)

    run(scene)


def test_a_closed_node_connects_to_nothing_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pending connections are closed by then; otherwise their tasks would be left in the program's loop."""
    ended: list[str] = []
    cancelled, released = asyncio.Event(), asyncio.Event()

    async def connect(_: Subscription, uri: str) -> None:
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()
            await released.wait()
            ended.append(uri)

    async def scene() -> None:
        monkeypatch.setattr(Subscription, "open_link", connect)
        async with graph("/a", "/b") as (_, (a, b)):
            await publish(a, "/t")
            subscription = await listen(b, "/t", Box())
            await until(lambda: subscription.connecting)
            await asyncio.sleep(0)
            closing = asyncio.ensure_future(b.close())
            await cancelled.wait()
            await asyncio.sleep(0)
            assert not closing.done()
            released.set()
            await closing
            assert ended == [a.uri]

    run(scene)


def test_a_subscriber_that_comes_again_takes_the_place_of_its_stalled_link() -> None:
    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            publication = await publish(a, "/t", queue_size=None)
            first = await raw_subscriber(a)
            other = await raw_subscriber(a, callerid="/other")
            await until(lambda: len(publication.links) == 2)
            loop = asyncio.get_running_loop()
            whole = serialize_frame(bytes(30_000_000))
            done = loop.run_in_executor(None, publication.publish, whole)
            await until(lambda: all(link.waiting for link in publication.links))
            second = await raw_subscriber(a)
            await until(lambda: len(publication.links) == 2)
            assert [link.peer for link in publication.links] == ["/other", "/raw"]
            other.close()
            await done
            first.close()
            second.close()

    run(scene)


def test_messages_sent_before_a_publisher_unregistered_are_delivered(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        has_unregistered = asyncio.Event()

        async def serve(sock: socket.socket) -> None:
            await tcp.send_header(sock, FOREIGN)
            await has_unregistered.wait()
            await clock.sock_sendall(sock, serialize_frame(b"late"))

        foreign, box = Foreign(serve), Box()
        async with graph("/n") as (_, (node,)):
            subscription = await subscribe_to(foreign, monkeypatch, node, box)
            await until(lambda: subscription.links)
            subscription.publishers_changed([])
            assert not subscription.links
            has_unregistered.set()
            await until(lambda: box.bodies == [b"late"])
            await until(lambda: not subscription._leaving)
            assert foreign.connections == 1
            subscription.close()
        await foreign.close()

    run_manually(scene)


def test_a_publisher_that_unregistered_and_stays_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        has_ended = False

        async def serve(sock: socket.socket) -> None:
            nonlocal has_ended
            await tcp.send_header(sock, FOREIGN)
            assert await clock.sock_recv(sock, 1) == b""
            has_ended = True

        foreign = Foreign(serve)
        async with graph("/n") as (_, (node,)):
            subscription = await subscribe_to(foreign, monkeypatch, node, Box())
            await until(lambda: subscription.links)
            subscription.publishers_changed([])
            await clock.advance(9.9)
            assert not has_ended
            await clock.advance(0.2)
            await until(lambda: has_ended)
            subscription.close()
        await foreign.close()

    run_manually(scene)


@pytest.mark.parametrize("is_kept", [True, False])
def test_a_publisher_that_registers_again_is_connected_once(
    monkeypatch: pytest.MonkeyPatch, is_kept: bool
) -> None:
    """``is_kept``: whether the publisher keeps its existing connection."""

    async def scene(clock: ManualLoop) -> None:
        is_back = asyncio.Event()

        async def serve(sock: socket.socket) -> None:
            await tcp.send_header(sock, FOREIGN)
            await is_back.wait()
            if is_kept or foreign.connections == 2:
                await clock.sock_sendall(sock, serialize_frame(b"back"))
                await clock.sock_recv(sock, 1)

        foreign, box = Foreign(serve), Box()
        async with graph("/n") as (_, (node,)):
            subscription = await subscribe_to(foreign, monkeypatch, node, box)
            await until(lambda: subscription.links)
            subscription.publishers_changed([])
            subscription.publishers_changed(["http://127.0.0.1:1/"])
            is_back.set()
            await until(lambda: box.bodies == [b"back"])
            assert foreign.connections == (1 if is_kept else 2)
            assert len(subscription.links) == 1
            subscription.close()
        await foreign.close()

    run_manually(scene)


def test_subscriber_whose_listener_fails_is_not_counted_and_the_fault_is_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The publisher's own function raises: the connection is closed, and the node can still be closed."""

    async def scene() -> None:
        async with graph("/talker") as (_, (talker,)):
            publication = Publication("/t", STRING, on_link=fail)
            await talker.advertise(publication)
            sock = await raw_subscriber(talker)
            with sock, contextlib.suppress(ConnectionResetError):
                while await asyncio.get_running_loop().sock_recv(sock, 1000):
                    pass
            assert publication.links == ()

    def fail(_link: OutLink, is_up: bool) -> None:
        if is_up:
            raise LookupError("a faulty listener")

    run(scene)
    assert caplog.text.count("LookupError: a faulty listener") == 1
