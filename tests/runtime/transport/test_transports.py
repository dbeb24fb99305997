"""Two nodes on one machine connect by a Unix socket; other nodes use TCP."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import functools
import os
import signal
import socket
import subprocess
import sys
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import RpcUnreachable, UsageError, WireError
from minirospy.core.wire.framing import Pieces, SplitFrame, serialize_frame
from minirospy.core.wire.header import Header, serialize_header
from minirospy.core.wire.service import serialize_response
from minirospy.core.wire.tcpros import InterfaceType, service_client_header
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.service_client import ServiceClient
from minirospy.runtime.node.services import AsyncServiceClient, LoopServiceServer
from minirospy.runtime.node.slave import SlaveApi
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport import local, sockets
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.tcp import Listener
from tests.runtime.node.test_topics import STRING, Box, graph, listen, publish, run
from tests.waiting import until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="abstract Unix sockets are Linux'")

HERE = local.this_host()
TCP, UNIX, ELSEWHERE = ["TCPROS"], ["UNIXROS", HERE], ["UNIXROS", HERE + "0"]


@pytest.mark.parametrize(
    ("transport", "offered", "chosen"),
    [
        ("", [TCP], "TCPROS"),
        ("", [TCP, UNIX], "UNIXROS"),
        ("", [UNIX], "UNIXROS"),
        ("", [TCP, ELSEWHERE], "TCPROS"),
        ("", [["UDPROS", "x"], TCP], "TCPROS"),
        ("", [ELSEWHERE], None),
        ("", [["UNIXROS"]], None),
        ("tcp", [TCP, UNIX], "TCPROS"),
        ("tcp", [UNIX], None),
    ],
)
def test_the_publisher_chooses(
    transport: str, offered: list[list[str]], chosen: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_TRANSPORT", transport)

    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            await publish(a, "/t")
            code, text, value = SlaveApi(a).dispatch("requestTopic", ["/b", "/t", offered])
            if chosen is None:
                assert (code, text, value) == (0, "no supported protocol implementations", [])
            elif chosen == "TCPROS":
                assert (code, value) == (1, ["TCPROS", "127.0.0.1", a.tcpros_port])
            else:
                assert (code, value) == (1, ["UNIXROS", a.unix_name, "127.0.0.1", a.tcpros_port])

    run(scene)


def test_the_send_buffer_of_a_unix_socket_is_enlarged_and_of_tcp_is_not() -> None:
    one, other = socket.socketpair()
    with one, other, socket.socket() as tcp:
        for sock, is_larger in ((one, True), (tcp, False)):
            before = sock.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
            sockets.enlarge_send_buffer(sock)
            assert (sock.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) > before) is is_larger


def test_a_publisher_enlarges_the_send_buffer_of_a_unix_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    enlarged: list[int] = []
    monkeypatch.setattr(sockets, "enlarge_send_buffer", lambda sock: enlarged.append(sock.family))

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            box = Box()
            publication = await publish(a, "/t")
            await listen(b, "/t", box)
            await until(lambda: publication.links)

    run(scene)
    assert enlarged == [socket.AF_UNIX]


@pytest.mark.parametrize(
    ("of_a", "of_b", "transport"),
    [("", "", "UNIXROS"), ("auto", "auto", "UNIXROS"), ("tcp", "", "TCPROS"), ("", "tcp", "TCPROS")],
)
def test_both_sides_have_to_want_it(
    of_a: str, of_b: str, transport: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            for node, name in ((a, of_a), (b, of_b)):
                # This has the same effect as starting the node with this setting.
                if name == "tcp":
                    node.this_host = ""
            box = Box()
            publication = await publish(a, "/t")
            subscription = await listen(b, "/t", box)
            await until(lambda: publication.links)
            publication.publish(serialize_frame(b"hello"))
            await until(lambda: box.bodies)
            assert (publication.links[0].transport, subscription.links[0].transport) == (transport, transport)
            ((_, _, rows), (_, _, others)) = (SlaveApi(node).get_bus_info("/c") for node in (a, b))
            assert [row[3] for row in rows + others] == ["TCPROS", "TCPROS"]
            assert all(row[6].startswith(f"{transport} connection ") for row in rows + others)

    run(scene)


def test_tcp_is_used_if_the_socket_is_unreachable(monkeypatch: pytest.MonkeyPatch) -> None:
    """This simulates a sandbox that isolates processes."""

    def refuse(name: str) -> Any:
        raise PermissionError(name)

    monkeypatch.setattr(local, "connect", refuse)

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t")
            box = Box()
            await listen(b, "/t", box)
            await until(lambda: publication.links)
            assert publication.links[0].transport == "TCPROS"
            publication.publish(serialize_frame(b"hello"))
            await until(lambda: box.bodies == [b"hello"])

    run(scene)


@pytest.mark.parametrize(
    ("of_server", "of_client", "family"),
    [
        ("", "", socket.AF_UNIX),
        ("tcp", "", socket.AF_INET),
        ("", "tcp", socket.AF_INET),
    ],
)
def test_services_and_slave_api_are_reached_by_unix_socket(
    of_server: str, of_client: str, family: socket.AddressFamily, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_TRANSPORT", of_server)
    families: list[socket.AddressFamily] = []

    async def echo(request: bytes, _: Header) -> bytes:
        return request

    def call(node: Node) -> None:
        same_host = not of_client
        client = ServiceClient(node.service_uri, "/s", "*", "/c", same_host=same_host)
        families.append(client._sock.family)
        assert client.call(b"abc") == b"abc"
        client.close()
        slave = RpcClient(node.uri, same_host=same_host)
        assert slave.call("getPid", "/c")[2] == os.getpid()
        families.append(slave.idle[0].family)
        slave.close()

    async def scene() -> None:
        async with graph("/a") as (_, (node,)):
            types = {"request_type": "std_srvs/EmptyRequest", "response_type": "std_srvs/EmptyResponse"}
            service = LoopServiceServer("/s", STRING, node.name, echo, workers=node.workers, **types)
            await node.serve(service)
            await asyncio.get_running_loop().run_in_executor(None, call, node)
            client = await AsyncServiceClient.connect(
                node.service_uri, "/s", "*", "/c", same_host=not of_client
            )
            families.append(client._sock.family)
            assert await client.call(b"abc") == b"abc"
            client.close()

    run(scene)
    assert families == [family] * 3


def test_an_answer_is_expected_awake_and_not_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = 0

    def answer_at_third_turn() -> None:
        nonlocal turns
        turns += 1
        if turns == 3:
            other.send(b"x")

    monkeypatch.setattr(os, "sched_yield", answer_at_third_turn)
    monkeypatch.setattr(sockets, "BUSY_POLL_SECONDS", 60.0)
    one, other = socket.socketpair()
    with one, other:
        sockets.busy_poll(one)  # a socket of this process is not polled
        assert turns == 0
        monkeypatch.setattr(sockets, "peer", lambda _: sockets.Peer(process=0, user=0, group=0))
        sockets.busy_poll(one)
        assert (turns, one.recv(1)) == (3, b"x")
        monkeypatch.setattr(sockets, "BUSY_POLL_SECONDS", 0.0)
        sockets.busy_poll(one)  # no response arrives
        assert turns == 4
        with pytest.raises(BlockingIOError):
            sockets.busy_receive(one, memoryview(bytearray(1)))
        assert turns == 5
    with socket.socket() as tcp:
        monkeypatch.setattr(sockets, "BUSY_POLL_SECONDS", 60.0)
        sockets.busy_poll(tcp)
    assert turns == 5


@pytest.mark.parametrize("uri", ["http://localhost:{}", "http://127.0.0.1:{}/", "http://LocalHost:{}"])
def test_a_master_is_reached_by_each_of_its_names(uri: str) -> None:
    async def scene() -> None:
        async with graph() as (master, _):
            client = RpcClient(uri.format(master.port))
            answer = await asyncio.get_running_loop().run_in_executor(None, client.call, "getPid", "/c")
            assert answer[2] == os.getpid()
            assert client.idle[0].family == socket.AF_UNIX
            client.close()

    run(scene)


def test_a_socket_name_of_another_user_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    # This has the same effect as a process that took the name and belongs to a user other than this one and root.
    monkeypatch.setattr(local, "TRUSTED_USERS", frozenset())
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        taken = local.bind("127.0.0.1", port)
        assert taken
        with taken:
            taken.listen()
            assert local.reach("127.0.0.1", port) is None
            assert local.bind("localhost", port) is None


OWN = f"test-{os.getpid()}"  # a host name that no other test uses


def program(text: str, **environment: str) -> str:
    """Return a program's output."""
    return subprocess.run(
        [sys.executable, "-c", text],
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root becomes somebody else")
@pytest.mark.parametrize("user", [65534, 2**32 - 6])
def test_each_user_believes_himself_and_root(user: int) -> None:
    printed = program(
        f"""
import os
from minirospy.runtime.transport import local
OWN = {OWN!r}
server = local.bind(OWN, 2)
os.setresuid({user}, {user}, 0)
server.listen()
print(local.reach(OWN, 2) is not None)
os.seteuid(0)
print(local.reach(OWN, 2) is not None)
"""
    )
    assert printed.split() == ["True", "False"]


@pytest.mark.parametrize("name", ["/tmp/.X11-unix/X0", "dbus-x", "", "minirospy", "xminirospy-a:1"])
def test_publisher_chooses_no_other_socket_of_this_machine(name: str) -> None:
    assert local.parse_answer([1, "", ["UNIXROS", name, "robot", 1]]) is None
    assert local.parse_answer([1, "", ["UNIXROS", "minirospy-robot:1", "robot", 1]]) is not None


def test_without_unix_sockets_there_is_tcp(monkeypatch: pytest.MonkeyPatch) -> None:
    """This simulates systemd's RestrictAddressFamilies, or a process without free file descriptors."""

    def restricted(*_: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    with monkeypatch.context() as patch:
        patch.setattr(socket, "socket", restricted)
        assert local.bind(OWN, 2) is None
        assert local.reach(OWN, 2) is None


def test_a_name_is_the_same_in_every_locale() -> None:
    printed = program(
        """
import os
from minirospy.runtime.transport import local
host, port = "\\u00fc\\u0431", os.getpid()
print(local.bind(host, port).getsockname() == f"\\0minirospy-{host}:{port}".encode())
""",
        LC_ALL="C",
        PYTHONCOERCECLOCALE="0",
        PYTHONUTF8="0",
    )
    assert printed == "True\n"


@pytest.mark.parametrize("host", ["a..b", "a" * 64, "\u00fc" * 64, "\udcff", "a\0b"])
def test_an_impossible_host_name_is_reported_as_unreachable(host: str) -> None:
    async def scene() -> None:
        uri, service = f"http://{host}:9/", f"rosrpc://{host}:9"
        with pytest.raises(RpcUnreachable):
            RpcClient(uri).call("getPid", "/c")
        with pytest.raises((OSError, WireError)):
            ServiceClient(service, "/s", "*", "/c")
        with pytest.raises((OSError, WireError)):
            await AsyncServiceClient.connect(service, "/s", "*", "/c")
        client = AsyncRpcClient()
        with pytest.raises(RpcUnreachable) as caught:
            await client.call(uri, "getPid", "/c")
        assert "timed out" not in str(caught.value)
        await client.close()

    run(scene)


def test_a_client_whose_unix_socket_has_a_name_is_served() -> None:
    own = b"\0" + OWN.encode()
    where: list[str] = []

    async def accept(sock: socket.socket, address: str) -> None:
        where.append(address)
        sock.close()

    async def scene() -> None:
        server = RpcServer(lambda *_: 5, access=Access.parse("10.0.0.0/8"), known_as=["127.0.0.1"])
        await server.start()
        with socket.socket(socket.AF_UNIX) as named:
            named.bind(own)
            named.connect(b"\0" + local.name_of("127.0.0.1", server.port).encode())
            await until(lambda: server.clients == 1)
        listener, beside = Listener(accept), local.bind(OWN, 2)
        assert beside
        listener.listen(beside)
        with socket.socket(socket.AF_UNIX) as named:
            named.bind(own)
            named.connect(b"\0" + local.name_of(OWN, 2).encode())
            await until(lambda: where)
        await listener.close()
        await server.close()

    run(scene)
    assert where == ["this machine"]


def test_large_request_is_not_copied_for_each_partial_send() -> None:
    size = 8_000_000

    async def scene() -> None:
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            beside = local.bind("127.0.0.1", port)
            assert beside
            with beside:
                beside.listen()
                client, body = AsyncRpcClient(), bytes(size)
                tracemalloc.start()
                call = client.start(f"http://127.0.0.1:{port}/", body, 5.0, lambda _: None)
                peak = tracemalloc.get_traced_memory()[1]
                tracemalloc.stop()
                call.cancel()
                await client.close()
        # The request itself is one copy.
        assert peak < 1.5 * size

    run(scene)


def test_a_node_that_ends_gives_its_name_free_before_its_port(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the next server on that port would have no Unix socket."""
    order: list[str] = []
    close = Listener.close

    async def scene() -> None:
        async with graph("/a") as (_, (node,)):

            async def closing(listener: Listener) -> None:
                order.append("name" if listener is node.unix_listener else "port")
                await close(listener)

            monkeypatch.setattr(Listener, "close", closing)

    run(scene)
    assert order == ["name", "port"]


TCP_ALONE = """
import asyncio
from minirospy import aio
from minirospy.runtime.transport import local
import rospy, std_srvs.srv

local.reach = lambda *address: print("looked for", address)
rospy.init_node("n")
rospy.Service("/s", std_srvs.srv.Empty, lambda _: [])
rospy.wait_for_service("/s", 100)
rospy.ServiceProxy("/s", std_srvs.srv.Empty)()

async def main():
    async with aio.Node("m") as node:
        await node.wait_for_service("/s", 100)
        await node.service_proxy("/s", std_srvs.srv.Empty)()

asyncio.run(main())
print("called")
"""


def test_a_node_on_tcp_looks_for_no_unix_socket() -> None:
    async def scene() -> None:
        async with graph() as (master, _):
            environment = {
                "ROS_MASTER_URI": f"http://127.0.0.1:{master.port}",
                "ROS_IP": "127.0.0.1",
                "MINIROSPY_TRANSPORT": "tcp",
            }
            printed = await asyncio.get_running_loop().run_in_executor(
                None, functools.partial(program, TCP_ALONE, **environment)
            )
            assert printed == "called\n"

    run(scene)


@pytest.mark.parametrize("transport", ["auto", "unix", "tcp"])
@pytest.mark.parametrize("kind", ["image", "cloud"])
def test_image_or_cloud_arrives_by_unix_socket_without_a_copy(
    kind: str, transport: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_TRANSPORT", transport)
    from sensor_msgs.msg import Image, PointCloud2, PointField

    sent: Image | PointCloud2
    if kind == "image":
        sent = Image(height=480, width=640, encoding="rgb8", step=1920, data=os.urandom(921_600))
    else:
        sent = PointCloud2(
            width=40_000,
            height=1,
            fields=[PointField("x", 0, PointField.FLOAT32, 1)],
            point_step=4,
            data=os.urandom(160_000),
            is_dense=True,
        )
    message_class = type(sent)
    pieces = Pieces()
    sent.serialize(pieces)
    got: list[tuple[Any, Image | PointCloud2]] = []

    async def scene() -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            publication = await publish(a, "/t")
            await listen(b, "/t", lambda frame, _: got.append((frame, message_class().deserialize(frame))))
            await until(lambda: publication.links)
            publication.publish(pieces.frame(1 if kind == "cloud" else 0))
            await until(lambda: got)

    run(scene)
    ((frame, received),) = got
    if transport != "tcp":
        assert isinstance(frame, SplitFrame)
        assert received.data is frame.array
    assert received == sent
    assert message_class().deserialize(bytes(frame)) == sent


LISTENER = """
import os, sys, time, rospy
from sensor_msgs.msg import Image
rospy.init_node("listener", anonymous=True)
def callback(message):
    print("image", flush=True)
    time.sleep(60)
rospy.Subscriber("/t", Image, callback)
rospy.spin()
"""


@pytest.mark.parametrize("transport", ["auto", "unix", "tcp"])
def test_a_subscriber_that_is_killed_in_the_middle_of_a_message(
    transport: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_TRANSPORT", transport)
    from sensor_msgs.msg import Image

    async def scene() -> None:
        async with graph("/a", "/b") as (master, (a, b)):
            box = Box()
            publication = await publish(a, "/t", queue_size=2)
            publication.type = publication.type._replace(
                name=Image._type, md5sum=Image._md5sum, definition=Image._full_text
            )
            loop = asyncio.get_running_loop()
            process = await loop.run_in_executor(None, start_listener, master.port)

            try:
                await until(lambda: publication.links)
                pieces = Pieces()
                Image(data=bytes(20_000_000)).serialize(pieces)
                frame = pieces.frame()
                await loop.run_in_executor(None, publication.publish, frame)
                assert process.stdout
                await loop.run_in_executor(None, process.stdout.readline)
                # The callback sleeps, so this thread stays in the middle of publishing.
                await loop.run_in_executor(None, publication.publish, frame)
                link = publication.links[0]
                assert link.waiting == 1
                process.send_signal(signal.SIGKILL)
                await until(lambda: not publication.links)
            finally:
                process.kill()
                process.communicate()

            assert link.waiting == 0
            # Other subscribers are not affected.
            subscription = b.make_subscription("/t", publication.type, box)
            await b.subscribe(subscription)
            await until(lambda: publication.links)
            await loop.run_in_executor(None, publication.publish, frame)
            await until(lambda: box.bodies)
            assert box.bodies == [b"".join(pieces)]

    run(scene)


def start_listener(master_port: int) -> subprocess.Popen[str]:
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://127.0.0.1:{master_port}",
        "ROS_IP": "127.0.0.1",
    }
    return subprocess.Popen(
        [sys.executable, "-c", LISTENER], env=environment, stdout=subprocess.PIPE, text=True
    )


def test_the_environment_names_a_transport_that_there_is() -> None:
    assert Environment.read({"MINIROSPY_TRANSPORT": "TCP"}).transport == "tcp"
    with pytest.raises(UsageError, match=r"MINIROSPY_TRANSPORT \[shm\] is neither 'tcp', 'unix' nor 'auto'"):
        Environment.read({"MINIROSPY_TRANSPORT": "shm"})


def _received_before_the_header(sock: socket.socket, ahead: bytes) -> bytes:
    """Return the data that a client of "/s" sends after its header before it receives one; ``ahead`` is expected."""
    header = serialize_header(service_client_header("/s", "*", "/c"))
    got = b""
    sock.settimeout(30)
    while len(got) < len(header + ahead):
        got += sock.recv(1000)
    sock.settimeout(0.2)
    with contextlib.suppress(TimeoutError):
        while not ahead and (more := sock.recv(1000)):
            got += more
    assert got.startswith(header)
    return got.removeprefix(header)


@pytest.mark.parametrize(("family", "ahead"), [(socket.AF_UNIX, b"\5\0\0\0hello"), (socket.AF_INET, b"")])
def test_a_request_goes_ahead_of_the_servers_header_by_a_unix_socket_alone(family: int, ahead: bytes) -> None:
    """A rospy server may lose data that arrives with the header."""
    with socket.create_server(("127.0.0.1", 0)) as server, contextlib.ExitStack() as closing:
        listening, port = server, server.getsockname()[1]
        if family == socket.AF_UNIX:
            beside = local.bind("127.0.0.1", port)
            assert beside
            listening = closing.enter_context(beside)
            listening.setblocking(True)
            listening.listen()

        def serve() -> bytes:
            with listening.accept()[0] as sock:
                before = _received_before_the_header(sock, ahead)
                sock.sendall(serialize_header({"callerid": "/s", "md5sum": "*", "type": "a/B"}))
                sock.settimeout(100)
                request = before or sock.recv(1000)
                # A response that arrives together with the header, or directly after it, must be found.
                sock.sendall(serialize_response(request))
            return before

        with ThreadPoolExecutor() as pool:
            served = pool.submit(serve)
            client = ServiceClient(f"rosrpc://127.0.0.1:{port}", "/s", "*", "/c", waits=False)
            client.finish(b"hello")
            assert client.call(b"hello") == b"\5\0\0\0hello"
            client.close()
            assert served.result(100) == ahead


def test_a_request_that_went_ahead_is_sent_once_and_the_next_one_too() -> None:
    async def scene() -> None:
        async with graph("/a") as (_, (a,)):
            got: list[bytes] = []

            def handle(request: memoryview, _: Header) -> bytes:
                got.append(bytes(request))
                return bytes(request)[::-1]

            type_ = InterfaceType("a/B", "0" * 32)
            await a.serve(a.make_service("/s", type_, handle, request_type="a/Q", response_type="a/R"))

            def calls() -> None:
                client = ServiceClient(a.service_uri, "/s", "*", "/c", persistent=True, waits=False)
                client.finish(b"")
                assert client.call(b"") == b""
                assert client.call(b"abc") == b"cba"
                client.close()

            await asyncio.to_thread(calls)
            assert got == [b"", b"abc"]

    run(scene)
