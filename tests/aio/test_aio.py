"""The asyncio API: nodes that share a loop communicate with each other and with nodes of the rospy API, over real sockets."""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Header, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger

import minirospy
from minirospy import Node
from minirospy.aio.raw import RawService, raw_class
from minirospy.base import clock as clock_module
from minirospy.base.clock import SILENT_CLOCK
from minirospy.base.errors import (
    MasterUnreachableError,
    ROSException,
    ROSInitException,
    ROSInterruptException,
    ROSSerializationException,
    ROSTimeMovedBackwardsException,
    RpcRefused,
    ServiceException,
)
from minirospy.base.times import Duration, Time
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.master_proxy import MasterProxy, SlaveProxy
from tests.waiting import until

SECONDS = 100.0

Main = Callable[[], Coroutine[Any, Any, None]]


def run(main: Main) -> None:
    """Run a test's coroutine in a new loop; assert that no tasks remain."""

    async def bounded() -> None:
        await asyncio.wait_for(main(), SECONDS)
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not left

    asyncio.run(bounded(), debug=True)


@pytest.fixture
def graph(master: str) -> Iterator[MasterProxy]:
    """Yield a proxy of the master, for the test's own thread."""
    proxy = MasterProxy(master, "/test")
    yield proxy
    proxy.close()


def test_aio_is_an_attribute_of_the_package() -> None:
    from minirospy import aio

    assert minirospy.Node is aio.Node
    assert "Node" in dir(minirospy)


def test_importing_rospy_does_not_import_aio() -> None:
    code = "import rospy, sys; sys.exit('minirospy.aio' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# --- life


def test_call_master_calls_any_method_as_the_node(graph: MasterProxy) -> None:
    async def main() -> None:
        async with Node("n") as node:
            await node.advertise("t", String)
            assert await node.call_master("lookupNode", "/n") == node.uri
            with pytest.raises(RpcRefused):
                await node.call_master("lookupNode", "/nobody")

    run(main)


def test_run_threadsafe_runs_a_coroutine_on_the_loop(master: str) -> None:
    threads = []

    async def work() -> int:
        threads.append(threading.current_thread())
        return 7

    async def main() -> None:
        node = Node("n")
        with pytest.raises(ROSInitException):
            node.run_threadsafe(work())
        async with node:
            assert await asyncio.to_thread(lambda: node.run_threadsafe(work()).result(SECONDS)) == 7
            assert node.master_uri == master
        assert threads == [threading.current_thread()]

    run(main)


def test_node_is_registered_only_inside_its_block(graph: MasterProxy) -> None:
    async def main() -> None:
        node = Node("n", namespace="robot")
        assert node.name == "/robot/n"
        with pytest.raises(ROSInitException):
            _ = node.uri
        async with node:
            await node.advertise("t", String)
            assert graph.lookup_node("/robot/n") == node.uri
            with pytest.raises(ROSInitException, match="started before"):
                await node.start()
        with pytest.raises(RpcRefused):
            graph.lookup_node("/robot/n")
        await node.close()
        with pytest.raises(ROSInitException, match="started before"):
            await node.start()

    run(main)


@pytest.mark.parametrize("name", ["", "a/b", "/a"])
def test_bad_names_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match="name"):
        Node(name)


def test_node_takes_remappings_of_a_command_line(graph: MasterProxy) -> None:
    async def main() -> None:
        argv = ["x.py", "__name:=renamed", "__ns:=/ns", "a:=b", "~p:=/q", "_speed:=1.5", "plain"]
        async with Node("n", argv=argv) as node:
            assert node.name == "/ns/renamed"
            assert [node.resolve(name) for name in ("a", "~p", "c", "~c", "/d")] == [
                "/ns/b", "/q", "/ns/c", "/ns/renamed/c", "/d",
            ]  # fmt: skip
            assert await node.get_param("~speed") == 1.5
        async with Node("n", anonymous=True) as one, Node("n", anonymous=True, namespace="x") as two:
            assert one.name.startswith("/n_")
            assert two.name.startswith("/x/n_")

    run(main)


def test_node_waits_for_a_master(caplog: pytest.LogCaptureFixture) -> None:
    async def main() -> None:
        starting = asyncio.ensure_future(Node("n").start())
        await until(lambda: "no ROS master answers" in caplog.text)
        await asyncio.sleep(0.1)
        assert not starting.done()
        starting.cancel()
        await asyncio.gather(starting, return_exceptions=True)

    run(main)


def test_external_shutdown_ends_waiting_calls(graph: MasterProxy) -> None:
    async def main() -> None:
        async with Node("n") as node:
            subscription = await node.subscribe("/t", String)

            async def listen() -> str:
                async for _ in subscription:
                    pass
                return "ended"

            waiting = [
                asyncio.ensure_future(work)
                for work in (
                    listen(),
                    node.spin(),
                    node.sleep(100),
                    node.wait_for_service("/nothing"),
                    node.wait_for_message("/nothing", String),
                )
            ]
            await asyncio.sleep(0)
            slave = SlaveProxy(graph.lookup_node("/n"), "/test")
            await asyncio.to_thread(slave.shutdown, "enough")
            slave.close()
            results = await asyncio.gather(*waiting, return_exceptions=True)
            assert results[:2] == ["ended", None]
            assert [type(each) for each in results[2:]] == [ROSInterruptException] * 3
            assert node.is_shutdown

    run(main)


def test_second_node_of_a_name_shuts_down_the_first(graph: MasterProxy) -> None:
    async def main() -> None:
        async with Node("n") as first:
            await first.advertise("/t", String)
            async with Node("n") as second:
                await second.advertise("/t", String)
                await first.spin()
                assert not second.is_shutdown

    run(main)


PROGRAM = """
import asyncio
from minirospy import Node
from std_msgs.msg import String

async def main():
    async with Node("program") as node:
        await node.advertise("/t", String)
        print("ready", flush=True)
        await node.spin()

asyncio.run(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals between processes")
def test_ctrl_c_unregisters_the_node(graph: MasterProxy) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout
    assert process.stdout.readline() == "ready\n"
    graph.lookup_node("/program")
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert errors.rstrip().endswith("KeyboardInterrupt")
    with pytest.raises(RpcRefused):
        graph.lookup_node("/program")


# --- topics


def test_messages_arrive_in_order_and_typed(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String, queue_size=100)
            subscription = await b.subscribe("/t", String, queue_size=100)
            await publisher.wait_for_subscribers()
            for number in range(50):
                await publisher.publish(str(number))
            await publisher.publish(String("object"))
            await publisher.publish(data="keyword")
            got = [(await subscription.next()).data for _ in range(52)]
            assert got == [*map(str, range(50)), "object", "keyword"]
            assert subscription.dropped == 0
            assert (publisher.num_connections, subscription.num_connections) == (1, 1)

    run(main)


def test_connection_header_and_sequence_numbers(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", Header, headers={"cookie": "yes"})
            stamped = a.advertise("/scan", LaserScan)
            subscription = b.subscribe("/t", Header)
            scans = b.subscribe("/scan", LaserScan)
            await publisher.wait_for_subscribers()
            await stamped.wait_for_subscribers()
            await publisher.publish(Header(frame_id="x"))
            header = (await subscription.next())._connection_header
            assert (header["callerid"], header["cookie"], header["topic"]) == ("/a", "yes", "/t")
            for _ in range(2):
                await stamped.publish(LaserScan(ranges=[1.0, 2.0]))
            assert [(await scans.next()).header.seq for _ in range(2)] == [1, 2]

    run(main)


def test_slow_reader_gets_the_newest_messages(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String, queue_size=0)
            subscription = await b.subscribe("/t", String, queue_size=3)
            await publisher.wait_for_subscribers()
            for number in range(100):
                await publisher.publish(str(number))
            await until(lambda: subscription.dropped == 97)
            assert [(await subscription.next()).data for _ in range(3)] == ["97", "98", "99"]

    run(main)


def test_queue_size_zero_is_refused(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a:
            with pytest.raises(ValueError, match="queue_size is 0"):
                a.subscribe("/t", String, queue_size=0)

    run(main)


def test_publish_waits_with_queue_size_none(master: str) -> None:
    """Send messages of 3 MB to a reader that has stopped reading. Data counts as written once its socket has accepted it."""

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String, queue_size=None)
            subscription = await b.subscribe("/t", String, queue_size=5)
            await publisher.wait_for_subscribers()
            for number in range(5):
                await publisher.publish(str(number) * 3_000_000)
            assert [(await subscription.next()).data[0] for _ in range(5)] == list("01234")

    run(main)


def test_latched_messages_reach_late_subscribers(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = await a.advertise("/t", String, latch=True)
            await publisher.publish("kept")
            assert (await b.wait_for_message("/t", String, 5)).data == "kept"

    run(main)


def test_two_subscriptions_of_a_topic_share_a_connection(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String)
            one, two = b.subscribe("/t", String), b.subscribe("/t", String)
            await publisher.wait_for_subscribers()
            await publisher.publish("x")
            first, second = await one.next(), await two.next()
            assert first.data == second.data == "x"
            assert first is not second
            assert publisher.num_connections == 1
            await one.close()
            await publisher.publish("y")
            assert (await two.next()).data == "y"
            assert [message async for message in one] == []

    run(main)


def test_leaving_the_loop_unsubscribes(graph: MasterProxy) -> None:
    async def main() -> None:
        async with Node("a") as a:
            publisher = await a.advertise("/t", String, latch=True)
            await publisher.publish("x")
            async for message in a.subscribe("/t", String):
                assert message.data == "x"
                break
            gc.collect()
            await until(lambda: "/t" not in graph.get_system_state().subscribers)

    run(main)


def test_node_logs_as_many_registration_faults_as_asked(caplog: pytest.LogCaptureFixture) -> None:
    faults = Node("fleet_control", registration_fault_lines=1).registration_faults
    for name in "abc":
        faults.warning("/%s is not registered", name)
    faults.close()
    assert caplog.messages == ["/a is not registered", "2 more like the last ones"]


def test_publishers_of_a_topic_share_its_registration(graph: MasterProxy) -> None:
    async def main() -> None:
        async with Node("a") as a:
            one = await a.advertise("/t", String)
            two = await a.advertise("/t", String)
            with pytest.raises(ValueError, match="publishes /t as std_msgs/String already"):
                a.advertise("/t", Bool)
            await one.close()
            await one.close()
            assert graph.get_system_state().publishers["/t"] == ["/a"]
            with pytest.raises(ROSException, match="closed topic"):
                await one.publish("x")
            await two.publish("x")
            async with two:
                pass
            assert "/t" not in graph.get_system_state().publishers
            again = await a.advertise("/t", Bool)
            assert again.num_connections == 0

    run(main)


def test_node_publish_reaches_subscribers(master: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.aio.topics.JOIN_SECONDS", 60.0)

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            subscription = await b.subscribe("/t", String)
            await a.publish("/t", String("first"))
            await a.publish("/t", String("second"))
            assert [(await subscription.next()).data for _ in range(2)] == ["first", "second"]

    run(main)


def test_wrong_values_are_refused_immediately(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String)
            subscription = b.subscribe("/t", String)
            await publisher.wait_for_subscribers()
            with pytest.raises(ROSSerializationException):
                await publisher.publish(5)
            with pytest.raises(TypeError):
                await publisher.publish("a", "b")
            await publisher.publish("fine")
            assert (await subscription.next()).data == "fine"

    run(main)


def test_undecodable_message_is_logged(master: str, caplog: pytest.LogCaptureFixture) -> None:
    class Wrong(String):
        """The bytes of a String, which are deserialized as a count that is too large."""

        def deserialize(self, data: Any) -> Any:
            raise ValueError("no such bytes")

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String, latch=True)
            await publisher.publish("x")
            while "a message on /t from /a does not fit std_msgs/String: no such bytes" not in caplog.text:
                with pytest.raises(TimeoutError, match="waiting for message on topic /t"):
                    await b.wait_for_message("/t", Wrong, 0.3)

    run(main)


def test_topic_is_unsubscribed_and_subscribed_again_immediately(graph: MasterProxy) -> None:
    """Several tasks do this before the registration has reached the master and during the unregistration."""

    async def main() -> None:
        async with Node("a") as node, Node("b") as other:
            for again in range(8):

                async def come_and_go(again: int = again) -> None:
                    for turn in range(3):
                        async with node.subscribe("t", String), node.advertise("u", String):
                            await asyncio.sleep(0.001 * ((turn + again) % 3))
                        subscription, publisher = node.subscribe("t", String), node.advertise("u", String)
                        await asyncio.gather(subscription.close(), publisher.close())

                await asyncio.gather(*(come_and_go() for _ in range(3)))
            for join in (lambda: node.subscribe("t", String), lambda: node.advertise("u", String)):
                closing = asyncio.ensure_future(join().close())
                await asyncio.sleep(0)
                async with join():
                    await closing
            assert not {"/t", "/u"} & {topic for topic, _ in graph.get_published_topics()}
            assert "/t" not in graph.get_system_state().subscribers
            async with other.advertise("t", String, latch=True) as publisher:
                await publisher.publish("x")
                assert (await node.wait_for_message("t", String, 10)).data == "x"

    run(main)


def test_cancelled_close_still_unregisters(graph: MasterProxy, monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        async with Node("n") as node:
            ask = node._node.registrations.call
            slowly = asyncio.Event()

            async def answer_late(method: str, *args: Any) -> Any:
                answer = await ask(method, *args)
                await slowly.wait()
                return answer

            monkeypatch.setattr(node._node.registrations, "call", answer_late)
            for handle in (node.subscribe("t", String), node.advertise("u", String)):
                await until(lambda: bool(graph.get_system_state().subscribers.get("/t")))
                with pytest.raises(asyncio.TimeoutError):
                    await asyncio.wait_for(handle.close(), 0.01)
            slowly.set()
            await until(lambda: not graph.get_system_state().subscribers.get("/t"))
            await until(lambda: not graph.get_system_state().publishers.get("/u"))
            async with node.subscribe("t", String), node.advertise("u", String):
                assert graph.get_system_state().publishers["/u"] == ["/n"]

    run(main)


def test_node_shutdown_ends_waiting_for_peers(master: str) -> None:
    async def main() -> None:
        async with Node("n") as node:
            publisher, subscription = node.advertise("t", String), node.subscribe("u", String)
            waits = [
                asyncio.ensure_future(publisher.wait_for_subscribers()),
                asyncio.ensure_future(subscription.wait_for_publishers()),
            ]
            await publisher
            await subscription
            node.shutdown()
            for wait in waits:
                with pytest.raises(ROSInterruptException):
                    await asyncio.wait_for(wait, 30)

    run(main)


def test_first_messages_all_arrive(master: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.aio.topics.JOIN_SECONDS", 60.0)

    async def main() -> None:
        async with Node("a") as talker, Node("b") as listener:
            subscription = await listener.subscribe("t", String)
            await asyncio.gather(*(talker.publish("t", String(text)) for text in "abc"))
            assert [(await subscription.next(SECONDS)).data for _ in "abc"] == ["a", "b", "c"]

    run(main)


def test_waiting_can_be_cancelled(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            publisher = a.advertise("/t", String)
            subscription = b.subscribe("/t", String)
            await publisher.wait_for_subscribers()
            waiting = asyncio.ensure_future(subscription.next())
            await asyncio.sleep(0)
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)
            await publisher.publish("after")
            assert (await subscription.next()).data == "after"
            with pytest.raises(TimeoutError, match="2 subscribers of topic /t"):
                await publisher.wait_for_subscribers(2, timeout=0.05)

    run(main)


# --- services


async def set_flag(request: SetBoolRequest) -> tuple[bool, str]:
    return request.data, f"flag: {request.data}"


def test_services_of_both_kinds(master: str) -> None:
    threads = []

    def in_a_worker(request: SetBoolRequest) -> dict[str, Any]:
        threads.append(threading.current_thread())
        return {"success": True, "message": request._connection_header["callerid"]}

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            await a.serve("/async", SetBool, set_flag)
            await a.serve("~sync", SetBool, in_a_worker)
            assert (await b.call("/async", SetBool, data=True)).message == "flag: True"
            assert (await b.call("/async", SetBool, SetBoolRequest(False))).message == "flag: False"
            response = await b.call("/a/sync", SetBool, True)
            assert response.message == "/b"
            assert response._connection_header["callerid"] == "/a"
            assert threads[0] is not threading.current_thread()
            for persistent in (False, True):
                proxy = b.service_proxy("/async", SetBool, persistent=persistent, headers={"k": "v"})
                assert [(await proxy(flag)).success for flag in (True, False)] == [True, False]
                proxy.close()

    run(main)


class Turn:
    """A service whose request and response start with a header."""

    _type = "p/Turn"
    _md5sum = PoseStamped._md5sum
    _request_class = PoseStamped
    _response_class = PoseStamped


def test_headers_of_requests_and_responses_are_numbered(master: str) -> None:
    async def turn(request: PoseStamped) -> PoseStamped:
        numbers.append(request.header.seq)
        response = PoseStamped()
        response.header.frame_id = None  # type: ignore[assignment]
        return response

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            await a.serve("/turn", Turn, turn)
            proxy = b.service_proxy("/turn", Turn)
            responses = [await proxy() for _ in range(2)]
            responses.append(await b.call("/turn", Turn))
            assert [each.header.seq for each in responses] == [1, 2, 3]
            assert responses[0].header.frame_id == "0"

    numbers: list[int] = []
    run(main)
    assert numbers == [1, 2, 1]


def test_errors_of_a_service_call(master: str, caplog: pytest.LogCaptureFixture) -> None:
    async def fails(request: SetBoolRequest) -> None:
        if request.data:
            raise ValueError("bad thing")

    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            with pytest.raises(ServiceException, match=r"^service \[/s\] unavailable$"):
                await b.call("/s", SetBool, True)
            await a.serve("/s", SetBool, fails)

            for name, arguments, error in (
                ("/s", (True,), r"responded with an error: b'error processing request: bad thing'"),
                ("/s", (False,), r"b'service cannot process request: service handler returned None'"),
            ):
                with pytest.raises(ServiceException, match=error):
                    await b.call(name, SetBool, *arguments)

            with pytest.raises(ServiceException, match=r"remote error reported: .*md5sums do not match"):
                await b.call("/s", Trigger)
            with pytest.raises(TypeError):
                await b.call("/s", SetBool, True, False)
            with pytest.raises(ROSSerializationException):
                await b.call("/s", SetBool, "text")
            with pytest.raises(ServiceException, match="already registered"):
                a.serve("/s", SetBool, fails)
            graph = MasterProxy(os.environ["ROS_MASTER_URI"], "/test")
            await asyncio.to_thread(
                graph.call, "registerService", "/dead", "rosrpc://localhost:1", "http://x:1/"
            )
            graph.close()
            with pytest.raises(ServiceException, match="unable to connect to service"):
                await b.call("/dead", SetBool, True)

    run(main)
    assert "Error processing request: bad thing" in caplog.text


def test_service_is_registered_once_and_can_be_closed(graph: MasterProxy) -> None:
    """Also close it before the master has registered it."""

    async def main() -> None:
        async with Node("n") as node:
            service = node.serve("s", SetBool, set_flag)
            with pytest.raises(ServiceException, match="already registered"):
                node.serve("s", SetBool, set_flag)
            await service.close()
            assert "/s" not in graph.get_system_state().services
            async with node.serve("s", SetBool, set_flag):
                assert (await node.call("s", SetBool, True)).success
            assert "/s" not in graph.get_system_state().services

    run(main)


def test_calls_run_at_the_same_time(master: str) -> None:
    async def main() -> None:
        inside = 0
        all_in = asyncio.Event()

        async def together(request: SetBoolRequest) -> SetBoolResponse:
            nonlocal inside
            inside += 1
            if inside == 5:
                all_in.set()
            await all_in.wait()
            return SetBoolResponse(True, "")

        async with Node("a") as a, Node("b") as b:
            await a.serve("/s", SetBool, together)
            answers = await asyncio.gather(*(b.call("/s", SetBool, True) for _ in range(5)))
            assert [answer.success for answer in answers] == [True] * 5

    run(main)


def test_a_cancelled_call_does_not_disturb_the_next(master: str) -> None:
    async def main() -> None:
        called, gate = asyncio.Event(), asyncio.Event()

        async def slow(request: SetBoolRequest) -> tuple[bool, str]:
            if request.data:
                called.set()
                await gate.wait()
            return request.data, ""

        async with Node("a") as a, Node("b") as b:
            await a.serve("/s", SetBool, slow)
            proxy = b.service_proxy("/s", SetBool, persistent=True)
            waiting = asyncio.ensure_future(proxy(True))
            await called.wait()
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)
            assert (await proxy(False)).success is False
            gate.set()
            proxy.close()

    run(main)


def test_persistent_proxies_outlive_a_server(master: str) -> None:
    async def main() -> None:
        async with Node("b") as b:
            proxy = b.service_proxy("/s", SetBool, persistent=True)
            for name in ("one", "two"):
                async with Node(name) as server, server.serve("/s", SetBool, set_flag):
                    assert (await proxy(True)).success
            with pytest.raises(ServiceException, match="unavailable"):
                await proxy(True)

    run(main)


def test_closing_a_persistent_proxy_ends_the_call_of_another_task(master: str) -> None:
    async def main() -> None:
        called, gate = asyncio.Event(), asyncio.Event()

        async def slow(request: object) -> tuple[bool, str]:
            called.set()
            await gate.wait()
            return True, "late"

        async with Node("a") as a, Node("b") as b:
            await a.serve("/s", Trigger, slow)
            proxy = b.service_proxy("/s", Trigger, persistent=True)
            call = asyncio.ensure_future(proxy())
            await called.wait()
            proxy.close()
            with pytest.raises(ServiceException, match="unable to receive data from sender"):
                await asyncio.wait_for(call, 30)
            gate.set()
            assert (await proxy()).message == "late"
            proxy.close()

    run(main)


def test_closing_a_service_lets_its_calls_finish(graph: MasterProxy) -> None:
    async def main() -> None:
        called, gate = asyncio.Event(), asyncio.Event()

        async def slow(request: object) -> tuple[bool, str]:
            called.set()
            await gate.wait()
            return True, "late"

        async with Node("a") as a, Node("b") as b:
            service = await a.serve("/s", Trigger, slow)
            call = asyncio.ensure_future(b.call("/s", Trigger))
            await called.wait()
            await service.close()
            await service.close()
            assert "/s" not in graph.get_system_state().services
            gate.set()
            assert (await call).message == "late"
            await a.serve("/s", Trigger, slow)

    run(main)


def test_closing_a_node_ends_its_calls(master: str) -> None:
    async def main() -> None:
        called = asyncio.Event()
        ended = []

        async def slow(request: object) -> None:
            called.set()
            try:
                await asyncio.Event().wait()
            finally:
                ended.append(True)

        async with Node("b") as b:
            async with Node("a") as a:
                await a.serve("/s", Trigger, slow)
                call = asyncio.ensure_future(b.call("/s", Trigger))
                await called.wait()
            with pytest.raises(ServiceException, match="unable to receive data from sender"):
                await call
            assert ended == [True]

    run(main)


def test_wait_for_service(master: str) -> None:
    async def main() -> None:
        async with Node("a") as a, Node("b") as b:
            with pytest.raises(TimeoutError, match="timeout exceeded while waiting for service /s"):
                await b.wait_for_service("s", 0.05)
            waiting = asyncio.ensure_future(b.wait_for_service("s"))
            await a.serve("s", SetBool, set_flag)
            await waiting

    run(main)


# --- parameters, time, log lines


def test_parameters(master: str) -> None:
    async def main() -> None:
        async with Node("n", namespace="ns") as node:
            await node.set_param("~p", {"a": [1, 2.5, "x"], "b": True})
            assert await node.get_param("~p/a") == [1, 2.5, "x"]
            assert await node.get_param("/ns/n/p") == {"a": [1, 2.5, "x"], "b": True}
            assert await node.get_param("nothing", None) is None
            with pytest.raises(KeyError):
                await node.get_param("nothing")
            assert await node.has_param("~p")
            await node.set_param("/ns/speed", 1)
            assert await node.search_param("speed") == "/ns/speed"
            assert await node.search_param("nothing") is None
            assert "/ns/n/p/b" in await node.get_param_names()
            await node.delete_param("~p")
            assert not await node.has_param("~p")
            with pytest.raises(KeyError):
                await node.delete_param("~p")

    run(main)


def test_wall_time(master: str) -> None:
    async def main() -> None:
        async with Node("n") as node:
            before = node.now()
            await node.sleep(0.02)
            await node.sleep(Duration(0, 20_000_000))
            assert node.now() - before >= Duration(0, 39_000_000)
            await node.sleep(-1)
            turns = []
            async for turn in node.rate(200):
                turns.append(turn)
                if turn == 4:
                    break
            assert turns == [0, 1, 2, 3, 4]
            with pytest.raises(ValueError, match="above 0"):
                node.rate(0)
            node.shutdown()
            assert len([turn async for turn in node.rate(1)]) == 1

    run(main)


def test_simulated_time(master: str) -> None:
    async def main() -> None:
        async with Node("clock") as clock:
            await clock.set_param("/use_sim_time", True)
            ticks = clock.advertise("/clock", Clock, latch=True)

            async with Node("n") as node:
                assert node.now() == Time()
                await ticks.wait_for_subscribers()
                await ticks.publish(Time(10))
                await until(lambda: node.now() == Time(10))
                sleeping = asyncio.ensure_future(node.sleep(5))
                await ticks.publish(Time(14))
                await until(lambda: node.now() == Time(14))

                assert not sleeping.done()
                await ticks.publish(Time(15))
                await sleeping
                sleeping = asyncio.ensure_future(node.sleep(5))
                await asyncio.sleep(0)
                for seconds in (19, 16, 3):
                    await ticks.publish(Time(seconds))
                    await until(lambda: node.now() == Time(seconds))  # noqa: B023 - it is called in this turn
                with pytest.raises(ROSTimeMovedBackwardsException) as raised:
                    await sleeping
                assert raised.value.time == 12

    run(main)


def test_silent_clock_is_reported_once(
    master: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(clock_module, "SILENT_SECONDS", 0.0)

    async def main() -> None:
        async with Node("n") as setting:
            await setting.set_param("/use_sim_time", True)
        async with Node("n") as node:
            sleeping = [asyncio.ensure_future(node.sleep(5)) for _ in range(2)]
            await until(lambda: SILENT_CLOCK in caplog.messages)
            assert not any(sleep.done() for sleep in sleeping)
            node.shutdown()
            assert [type(error) for error in await asyncio.gather(*sleeping, return_exceptions=True)] == [
                ROSInterruptException
            ] * 2
        assert caplog.messages.count(SILENT_CLOCK) == 1

    run(main)


def test_log_lines(master: str, capsys: pytest.CaptureFixture[str]) -> None:
    async def main() -> None:
        async with Node("b", rosout=False) as b, Node("a") as a:
            lines = await b.subscribe("/rosout", Log)
            a.log.info("hello %s", "you")
            line = await lines.next()
            assert (line.name, line.msg, line.level, line.function) == ("/a", "hello you", Log.INFO, "main")
            assert line.file == "test_aio.py"
            assert "/rosout" in line.topics
            a.log.debug("too quiet")
            await asyncio.to_thread(a.log.error, "from a thread")
            line = await lines.next()
            assert (line.msg, line.level) == ("from a thread", Log.ERROR)
        assert not logging.getLogger("rosout.a").handlers

    run(main)


# --- beside the rospy API

PEER = """
import sys
import rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool

rospy.init_node("peer")
publisher = rospy.Publisher("/from_peer", String, queue_size=10)
rospy.Subscriber("/to_peer", String, lambda message: publisher.publish("heard " + message.data))
rospy.Service("/peer_flag", SetBool, lambda request: (request.data, "peer"))
print("ready", flush=True)
for line in sys.stdin:
    print(rospy.ServiceProxy("/aio_flag", SetBool, persistent=True)(True).message, flush=True)
"""


def test_aio_node_and_rospy_node_exchange_messages(master: str) -> None:
    async def main() -> None:
        peer = await asyncio.create_subprocess_exec(
            sys.executable, "-c", PEER, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert peer.stdin
        assert peer.stdout
        assert await peer.stdout.readline() == b"ready\n"

        async with Node("aio") as node:
            await node.serve("/aio_flag", SetBool, set_flag)
            publisher = node.advertise("/to_peer", String)
            answers = await node.subscribe("/from_peer", String)
            await publisher.wait_for_subscribers()
            await until(lambda: answers.num_connections == 1)
            await publisher.publish("this")
            assert (await answers.next()).data == "heard this"
            await node.wait_for_service("/peer_flag", 30)
            assert (await node.call("/peer_flag", SetBool, True)).message == "peer"
            peer.stdin.write(b"call\n")
            assert await peer.stdout.readline() == b"flag: True\n"

        peer.stdin.close()
        assert await peer.wait() == 0

    run(main)


def test_unreachable_master_is_an_error() -> None:
    async def main() -> None:
        master = Master()
        await master.start()
        async with Node("n", master_uri=f"http://localhost:{master.port}", rosout=False) as node:
            await master.close()
            with pytest.raises(MasterUnreachableError):
                await node.get_param("/x")

    run(main)


def test_raw_parts_report_their_peers_and_answer(master: str) -> None:
    async def main() -> None:
        async with Node("relay", rosout=False) as relay, Node("user", rosout=False) as user:
            changed: list[str] = []
            bodies: list[bytes] = []
            type_ = InterfaceType(String._type, String._md5sum, String._full_text)
            publisher = await relay.advertise(
                "/out", raw_class(type_), latch=True, on_change=lambda: changed.append("subscriber")
            )
            subscription = await relay.subscribe_raw(
                "/in",
                lambda frame, _: bodies.append(bytes(frame)),
                type_=type_,
                on_change=lambda: changed.append("publisher"),
            )
            received = await user.subscribe("/out", String)
            sent = await user.advertise("/in", String)
            await sent.wait_for_subscribers(1, SECONDS)
            await sent.publish("x")
            await until(lambda: bodies == [b"\1\0\0\0x"])
            await publisher.wait_for_subscribers(1, SECONDS)
            publisher.publish_raw(b"\1\0\0\0y")
            assert (await received.next(SECONDS)).data == "y"
            assert set(changed) == {"subscriber", "publisher"}
            assert publisher.subscribers == ["/user"]

            publisher.forget_latched()
            await received.close()
            again = await user.subscribe("/out", String)
            await again.wait_for_publishers(1, SECONDS)
            publisher.publish_raw(b"\1\0\0\0z")
            assert (await again.next(SECONDS)).data == "z"

            async def answer(request: bytes, _: object) -> bytes:
                if request == b"\0":
                    raise ServiceException("not now")
                return b"\1\4\0\0\0done"

            service = await RawService(relay, "/flag", InterfaceType(SetBool._type, SetBool._md5sum), answer)
            assert (await user.call("/flag", SetBool, True)).message == "done"
            with pytest.raises(ServiceException, match="not now"):
                await user.call("/flag", SetBool, False)
            await service.close()
            await subscription.close()
            with pytest.raises(ServiceException, match="unavailable"):
                await user.call("/flag", SetBool, True)

    run(main)
