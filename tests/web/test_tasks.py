"""The bridges' long-running tasks: an unexpected exception is reported in one line, and the task continues."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal

from minirospy import Node
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.core.graph.goals import GoalState
from minirospy.fleet.contents import Robot
from minirospy.fleet.exporter import Exporter
from minirospy.fleet.gateway import Gateway, GatewayOptions
from minirospy.fleet.importer import Importer
from minirospy.fleet.keys import Claim
from minirospy.fleet.network import QueryFailed
from minirospy.fleet.rules import GatewayRules
from minirospy.ros.actionlib.actionlib.aio import ActionClient
from minirospy.ros2.bridge import Ros2Bridge
from minirospy.ros2.links import Ros2Topic
from minirospy.web.graph import SharedGraph
from tests.fleet.test_fleet_hostile import CLAIM, stub
from tests.ros2.test_ros2_actions import SEND_GOAL, end_of
from tests.ros2.test_ros2_bridge import STRING, FakeActionClient, FakePublisher, FakeSide, bridged, raw
from tests.waiting import until

if TYPE_CHECKING:
    from tests.web.conftest import Running

LIMIT = 60.0


class Failing:
    """A function that raises an unexpected exception in the calls with these numbers, and sets an event in its last call."""

    def __init__(self, fails_at: set[int], calls: int, returns: object = None) -> None:
        self._fails_at = fails_at
        self._calls = calls
        self._count = 0
        self._returns = returns
        self.done = asyncio.Event()

    async def __call__(self, *_: object) -> Any:
        return self.now()

    def now(self, *_: object) -> Any:
        self._count += 1
        if self._count >= self._calls:
            self.done.set()
        if self._count in self._fails_at:
            raise ZeroDivisionError("nobody foresaw this")
        return self._returns

    async def wait(self) -> None:
        await asyncio.wait_for(self.done.wait(), LIMIT)


def reported(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [each.getMessage() for each in caplog.records if "ZeroDivisionError" in each.getMessage()]


def test_work_that_fails_is_started_again_and_reported_in_one_line(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        work = Failing({1, 2}, 3)
        await keep_running(work, ErrorReporter(logging.getLogger("here"), "the work"), pause=0.0)
        assert work.done.is_set()

    asyncio.run(run())
    (line,) = reported(caplog)
    assert line.startswith("the work failed at test_tasks.py:")
    assert line.endswith(": ZeroDivisionError: nobody foresaw this")


def test_work_that_is_cancelled_ends() -> None:
    async def run() -> None:
        started = asyncio.Event()

        async def work() -> None:
            started.set()
            await asyncio.sleep(LIMIT)

        task = asyncio.ensure_future(keep_running(work, ErrorReporter(logging.getLogger("here"), "the work")))
        await started.wait()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(run())


def test_text_of_an_error_is_one_line_without_control_characters(caplog: pytest.LogCaptureFixture) -> None:
    ErrorReporter(logging.getLogger("here"), "the work").report(
        ValueError("two\nlines \x1b[31m" + "x" * 5000)
    )
    (record,) = caplog.records
    assert record.getMessage().isprintable()
    assert len(record.getMessage()) < 600


# --- the fleet


class Network:
    """A network that receives nothing."""

    def __getattr__(self, _: str) -> Callable[..., Any]:
        return lambda *_: stub(undeclare=lambda: None)


def test_watch_of_a_robots_graph_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        made = Exporter(
            stub(), cast(Any, Network()), stub(), stub(), stub(), CLAIM, GatewayRules(), list, lambda _: None
        )
        look = Failing({2}, 3)
        made.look = look  # type: ignore[method-assign]
        await made.start()
        await look.wait()
        await made.close()

    asyncio.run(run())
    assert len(reported(caplog)) == 1


async def nothing(*_: object) -> object:
    return {}


def importer(spawn: Callable[[Any], Any] = lambda work: work.close()) -> Importer:
    return Importer(
        stub(parameters=stub(listeners=[], add=nothing), get_param=nothing),
        cast(Any, Network()),
        stub(),
        stub(),
        stub(),
        "0" * 16,
        "",
        GatewayRules(),
        spawn,
        lambda: 0,
    )


def test_watch_of_the_fleets_robots_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def run() -> None:
        made = importer()
        made._snapshot = snapshot = Failing({1}, 2)  # type: ignore[method-assign]
        await made.start()
        await snapshot.wait()
        await made.close()

    monkeypatch.setattr("minirospy.fleet.importer.LOOK_SECONDS", 0.01)
    asyncio.run(run())
    assert len(reported(caplog)) == 1


def test_query_of_the_fleet_that_fails_is_no_answer_of_any_robot() -> None:
    async def fail(*_: object, **__: object) -> None:
        raise QueryFailed("the session has ended")

    async def run() -> None:
        made = importer()
        made._network.queries = fail  # type: ignore[assignment]
        assert await made._answering() is None

    asyncio.run(run())


def test_robot_that_cannot_be_shown_does_not_affect_others(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("minirospy.fleet.importer.AGAIN_SECONDS", 0.01)

    async def run() -> None:
        made = importer(asyncio.ensure_future)
        robots = {name: Robot(Claim(name, "0" * 16, 1, "1" * 16), {}, {}) for name in ("a", "b")}
        shown: list[str] = []
        fails = True

        async def update(robot: Any) -> None:
            if robot.robot.claim.name == "a" and fails:
                raise ZeroDivisionError
            shown.append(robot.robot.claim.name)

        made._update = update  # type: ignore[method-assign]
        made.contents.robots = lambda _lost=(): robots  # type: ignore[method-assign]
        await made._reconcile()
        assert shown == ["b"]
        # The request is retried without a new token.
        fails = False
        await until(lambda: "a" in shown)
        await made.close()

    asyncio.run(asyncio.wait_for(run(), LIMIT))
    assert len(reported(caplog)) == 1


def test_task_of_a_gateway_that_fails_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        gateway = Gateway(stub(), GatewayOptions("robot1"))
        await gateway._spawn(Failing({1}, 1)())

    asyncio.run(run())
    assert len(reported(caplog)) == 1


# --- the graph of the clients


def test_watch_of_the_graph_and_its_listeners_goes_on(
    bridge: Running, caplog: pytest.LogCaptureFixture
) -> None:
    async def run() -> None:
        graph = SharedGraph(bridge.bridge.node, max_refresh_interval=0.05)
        first, second = Failing({1}, 1), Failing(set(), 1)
        look = graph.look

        async def failing() -> None:
            if not first.done.is_set():
                first.now()
            await look()

        graph.look = failing  # type: ignore[method-assign]
        broken = Failing({1}, 1)
        graph._listeners.append(broken.now)
        graph.watch(second.now)
        await second.wait()
        assert broken.done.is_set()
        await graph.close()

    bridge.run(run())
    lines = reported(caplog)
    assert lines
    assert lines[0].startswith("a task of the bridge failed at test_tasks.py:")


def test_task_of_a_client_that_fails_is_reported(bridge: Running, caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        await bridge.bridge.graph.spawn(Failing({1}, 1)())

    bridge.run(run())
    assert len(reported(caplog)) == 1


# --- ROS 2


@pytest.mark.usefixtures("master")
def test_watch_of_both_graphs_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        bridge.look = look = Failing({2}, 3)  # type: ignore[method-assign]
        await bridge.start()
        await look.wait()

    bridged(scene)
    assert len(reported(caplog)) == 1


@pytest.mark.usefixtures("master")
def test_link_that_rclpy_refuses_does_not_affect_others() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        made = side.publisher

        def publisher(topic: str, type_: str, *, depth: int, is_latched: bool) -> FakePublisher:
            if topic == "/a":
                raise RuntimeError("rcl refuses\nthis name")
            return made(topic, type_, depth=depth, is_latched=is_latched)

        side.publisher = publisher  # type: ignore[method-assign]
        for topic in ("/a", "/b"):
            await node.advertise(topic, raw("std_msgs/String"))
            side.graph[topic] = Ros2Topic(subscribers=(STRING,))
        await bridge.look()
        assert [link.topic for link in bridge.topics.links] == ["/b"]
        assert list(bridge.topics.refused.values()) == ["RuntimeError: rcl refuses this name"]

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_goal_that_rclpy_cannot_send_comes_to_an_end(caplog: pytest.LogCaptureFixture) -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = SEND_GOAL
        await bridge.look()
        there: FakeActionClient = side.action_clients["/fly"]
        there.send = Failing({1}, 1).now  # type: ignore[method-assign]
        async with ActionClient(node, "/fly", FibonacciAction) as client:
            await client.wait_for_server()
            assert (await end_of(client.send(FibonacciGoal(order=3))))[0] is GoalState.REJECTED

    bridged(scene)
    assert len(reported(caplog)) == 1


@pytest.mark.usefixtures("master")
def test_statuses_of_goals_are_published_after_a_fault(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        broken = Failing({1}, 2, b"")
        monkeypatch.setattr("minirospy.ros2.action_to_ros2.statuses_message", broken.now)
        side.offered = SEND_GOAL
        await bridge.look()
        await broken.wait()

    bridged(scene)
    assert len(reported(caplog)) == 1
