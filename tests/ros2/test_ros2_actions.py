"""Actions of the ROS 2 bridge with a fake backend in place of rclpy: goals, cancels, results; the pure parts."""

from __future__ import annotations

import asyncio
import builtins
import queue
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from actionlib_msgs.msg import GoalStatusArray
from actionlib_tutorials.msg import FibonacciAction, FibonacciActionGoal, FibonacciActionResult, FibonacciGoal

from minirospy import Node
from minirospy.base.errors import BridgeError, DeserializationError
from minirospy.core.graph.goals import GoalState
from minirospy.introspect.snapshot import Snapshot
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError
from minirospy.ros2.action_codecs import empty_message
from minirospy.ros2.action_links import ActionLink, action_links
from minirospy.ros2.action_messages import (
    GoalId,
    Status,
    goal_message,
    parse_goal,
    parse_status_and_body,
    parse_statuses,
    status_and_body,
    statuses_message,
)
from minirospy.ros2.bridge import Ros2Bridge, Ros2Options
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.links import BRIDGE_PREFIX, Direction
from minirospy.ros2.rclpy_actions import ABORTED, CANCELED, SUCCEEDED, GoalOfRos2
from minirospy.ros2.rclpy_actions import ActionClient as Ros2ActionClient
from minirospy.ros2.rclpy_actions import ActionServer as Ros2ActionServer
from minirospy.ros2.rules import BUILT_IN, parse_rules
from minirospy.ros2.side import RclpySide
from tests.ros2.ros2_definitions import catalogue
from tests.ros2.test_ros2_bridge import FakeSide
from tests.waiting import until

FIBONACCI = "example_interfaces/Fibonacci"
SEND_GOAL = {"/fly/_action/send_goal": "example_interfaces/Fibonacci_SendGoal"}
LIMIT = 60.0


def data_of(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


# --- pure


def test_an_action_of_one_side_alone_is_linked() -> None:
    server = Snapshot(
        {"/fly/result": ("/n",)}, {"/fly/goal": ("/n", "/echo")}, {}, {"/fly/goal": "a_msgs/FlyActionGoal"}
    )
    client = Snapshot({"/fly/goal": ("/n",)}, {"/fly/result": ("/n",)}, {}, server.types)

    def of(ros1: Snapshot, ros2: dict[str, str]) -> list[ActionLink]:
        return action_links(ros1, ros2, lambda type_, _: type_)

    assert of(server, {}) == [ActionLink("/fly", Direction.TO_ROS1, "a_msgs/Fly", "a_msgs/Fly")]
    assert of(client, SEND_GOAL) == [ActionLink("/fly", Direction.TO_ROS2, FIBONACCI, FIBONACCI)]
    assert of(server, SEND_GOAL) == []
    assert of(client, {}) == []
    own = f"/{BRIDGE_PREFIX}"
    bridged = Snapshot({"/fly/result": (own,)}, {"/fly/goal": (own,)}, {}, server.types)
    assert of(bridged, {}) == []


def test_messages_of_actions_are_those_of_the_generated_classes() -> None:
    goal = FibonacciActionGoal(goal=FibonacciGoal(order=3))
    goal.goal_id.id, goal.goal_id.stamp.secs = "g", 4
    goal.header.stamp.secs = 4
    assert parse_goal(data_of(goal)) == (GoalId("g", 4, 0), b"\3\0\0\0")
    assert goal_message(GoalId("g", 4, 0), b"\3\0\0\0") == data_of(goal)

    statuses = [Status(GoalId("a", 1, 2), 3, "done"), Status(GoalId("b"), 1)]
    data = statuses_message(7, 8, statuses)
    found = GoalStatusArray().deserialize(data)
    assert [(each.goal_id.id, each.status, each.text) for each in found.status_list] == [
        ("a", 3, "done"), ("b", 1, ""),
    ]  # fmt: skip
    assert parse_statuses(data) == statuses

    body = status_and_body(7, 8, statuses[0], b"\0\0\0\0")
    result = FibonacciActionResult().deserialize(body)
    assert (result.status.goal_id.id, result.status.text) == ("a", "done")
    assert parse_status_and_body(body) == (statuses[0], b"\0\0\0\0")


def test_messages_of_actions_that_end_too_early_are_refused() -> None:
    data = statuses_message(7, 8, [Status(GoalId("a", 1, 2), 3, "done")])
    for cut in range(len(data)):
        with pytest.raises(DeserializationError):
            parse_statuses(data[:cut])


@pytest.mark.parametrize(
    "name", ["actionlib_tutorials/FibonacciResult", "nav_msgs/Odometry", "std_msgs/Header", "sensor_msgs/Imu"]
)
def test_an_empty_message_is_that_of_the_generated_class(name: str) -> None:
    from minirospy.core.idl.load import message_class

    assert empty_message(catalogue().message(name), catalogue().message) == data_of(message_class(name)())


def test_rules_name_actions_and_their_fields() -> None:
    rules = BUILT_IN.with_(
        parse_rules(
            "- {ros1_package_name: a, ros1_action_name: Fly, ros2_package_name: b, ros2_action_name: Soar, "
            "goal_fields_1_to_2: {height: altitude}}",
            "rules.yaml",
        )
    )
    assert rules.ros2_actions("a/Fly") == ("b/Soar",)
    assert rules.ros1_actions("b/Soar") == ("b/Soar", "a/Fly")
    assert rules.message("a/FlyGoal").fields == {"height": "altitude"}
    assert BUILT_IN.ros2_actions("actionlib_tutorials/Fibonacci") == (FIBONACCI,)


# --- the bridge


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the limits, so that no request is sent before the server can be reached."""
    monkeypatch.setattr("minirospy.ros2.reach.MAX_SECONDS", LIMIT)


def bridged(scene: Callable[[Node, FakeSide, Ros2Bridge], Any]) -> None:
    side = FakeSide()

    async def run() -> None:
        async with Node("other", rosout=False) as node, Node(BRIDGE_PREFIX, rosout=False) as own:
            bridge = Ros2Bridge(own, side, Ros2Options(), catalogue())
            try:
                await asyncio.wait_for(scene(node, side, bridge), LIMIT)
            finally:
                await bridge.close()

    asyncio.run(run())


async def sent(side: FakeSide, number: int) -> Any:
    """Return a goal that ROS 2 has received: its CDR, its feedback callback and its handle."""
    await until(lambda: len(side.action_clients["/fly"].goals) > number)
    return side.action_clients["/fly"].goals[number]


def cdr(*numbers: int) -> bytes:
    return b"\0\1\0\0" + b"".join(number.to_bytes(4, "little") for number in (len(numbers), *numbers))


@pytest.mark.usefixtures("master")
def test_goals_of_ros1_go_to_ros2_and_come_to_an_end() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = SEND_GOAL
        assert await bridge.look()
        async with ActionClient(node, "/fly", FibonacciAction) as client:
            await client.wait_for_server()

            reached = client.send(FibonacciGoal(order=3))
            data, feedback, handle = await sent(side, 0)
            assert data == b"\0\1\0\0\3\0\0\0"
            feedback(cdr(1))
            assert list((await reached.__anext__()).sequence) == [1]
            handle.ended.set_result((SUCCEEDED, cdr(1, 2)))
            assert list((await reached).sequence) == [1, 2]

            for number, (end, state) in enumerate(
                [(CANCELED, GoalState.PREEMPTED), (ABORTED, GoalState.ABORTED)], 1
            ):
                goal = client.send(FibonacciGoal(order=3))
                _, _, handle = await sent(side, number)
                goal.cancel()
                await until(lambda handle=handle: handle.is_cancelled)  # type: ignore[misc]
                handle.ended.set_result((end, cdr(7)))
                assert await end_of(goal) == (state, [7])

            side.action_clients["/fly"].accepts = False
            assert await end_of(client.send(FibonacciGoal(order=3))) == (GoalState.REJECTED, [])

    bridged(scene)


async def end_of(goal: Any) -> tuple[GoalState, list[int]]:
    with pytest.raises(GoalError) as caught:
        await goal
    return caught.value.state, list(getattr(caught.value.result, "sequence", []))


@pytest.mark.usefixtures("master")
def test_a_goal_waits_until_responses_of_the_server_arrive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros2.action_to_ros2.REACH_SECONDS", 0.01)
    monkeypatch.setattr("minirospy.ros2.reach.AGAIN_SECONDS", 0.01)

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = SEND_GOAL
        side.has_found_client = False
        assert await bridge.look()
        there = side.action_clients["/fly"]
        probe = there.prober
        assert probe
        async with ActionClient(node, "/fly", FibonacciAction) as client:
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=3))
            # Requests are sent one after the other but get no response.
            await until(lambda: len(probe.reaching) >= 3 and goal.state is GoalState.PENDING)
            assert not there.goals
            probe.answers = True
            _, _, handle = await sent(side, 0)
            handle.ended.set_result((SUCCEEDED, cdr(1)))
            assert list((await goal).sequence) == [1]

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_goals_of_ros1_are_aborted_when_the_server_of_ros2_ends() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = SEND_GOAL
        await bridge.look()
        async with ActionClient(node, "/fly", FibonacciAction) as client:
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=3))
            await sent(side, 0)
            side.offered = {}
            assert await bridge.look()
            assert (await end_of(goal))[0] is GoalState.ABORTED
            assert "in ROS 2 has ended" in goal.text
            assert side.action_clients["/fly"].is_closed

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_goals_of_ros2_go_to_ros1_and_come_to_an_end() -> None:
    async def execute(goal: Any) -> dict[str, list[int]]:
        await goal.publish_feedback([goal.request.order])
        if goal.request.order == 2:
            raise GoalError("no", {"sequence": [2]})
        if goal.request.order == 3:
            with pytest.raises(asyncio.CancelledError):
                await asyncio.sleep(LIMIT)
        return {"sequence": [goal.request.order]}

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        server = await ActionServer(
            node, "/fly", FibonacciAction, execute, accepts=lambda goal: bool(goal.order)
        )
        await bridge.look()
        feedback: asyncio.Queue[bytes] = asyncio.Queue()

        async def accepted(order: int) -> Any:
            goal = b"\0\1\0\0" + order.to_bytes(4, "little")
            return await asyncio.wrap_future(
                side.action_servers["/fly"].accept(goal, lambda data: feedback.put_nowait(data[4:]))
            )

        goal = await accepted(1)
        assert await asyncio.wrap_future(goal.ended) == (SUCCEEDED, cdr(1))
        assert await feedback.get() == cdr(1)[4:]
        goal = await accepted(2)
        assert await asyncio.wrap_future(goal.ended) == (ABORTED, cdr(2))
        goal = await accepted(3)
        while (await feedback.get()) != cdr(3)[4:]:
            pass
        goal.cancel()
        assert await asyncio.wrap_future(goal.ended) == (CANCELED, cdr(3))
        assert await accepted(0) is None
        await server.close()
        assert await bridge.look()
        assert side.action_servers["/fly"].is_closed

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_result_that_has_come_when_the_link_ends_is_not_lost() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        ending = asyncio.Event()

        async def execute(_: Any) -> dict[str, list[int]]:
            await ending.wait()
            return {}

        server = await ActionServer(node, "/fly", FibonacciAction, execute)
        await bridge.look()
        accept = side.action_servers["/fly"].accept
        goal = await asyncio.wrap_future(accept(cdr()[:4] + bytes(4), lambda _: None))
        goals: Any = accept.__self__  # type: ignore[attr-defined]
        result = FibonacciActionResult()
        result.status.goal_id.id = goal.id.id
        result.status.status = GoalState.SUCCEEDED
        result.result.sequence = [1, 2]
        goals._take_result(data_of(result))
        await goals.close()
        assert goal.ended.result(0) == (SUCCEEDED, cdr(1, 2))
        ending.set()
        await server.close()

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_the_loop_goes_on_while_an_action_leaves_ros2() -> None:
    """A ROS 2 action server blocks until it has sent its results."""

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        async def execute(_: Any) -> dict[str, list[int]]:
            return {}

        server = await ActionServer(node, "/fly", FibonacciAction, execute)
        await bridge.look()
        await server.close()
        there = side.action_servers["/fly"]
        there.may_close.clear()
        looking = asyncio.ensure_future(bridge.look())
        await until(lambda: there.closing)
        with pytest.raises(BridgeError, match="not bridged any more"):
            await asyncio.wrap_future(there.accept(cdr()[:4] + bytes(4), lambda _: None))
        there.may_close.set()
        assert await looking
        assert there.is_closed

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_goal_that_comes_as_its_link_is_closed_is_answered() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        async def execute(_: Any) -> dict[str, list[int]]:
            return {}

        await ActionServer(node, "/fly", FibonacciAction, execute)
        await bridge.look()
        closing = asyncio.ensure_future(bridge.actions.close())
        answered = side.action_servers["/fly"].accept(cdr()[:4] + bytes(4), lambda _: None)
        await closing
        assert answered.cancelled()

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_types_of_actions_that_do_not_map_are_listed_with_the_reason() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = {**SEND_GOAL, "/odd/_action/send_goal": "odd_msgs/Odd_SendGoal"}
        pairs = [pair for pair in await bridge.pairs() if isinstance(pair.link, ActionLink)]
        assert [(pair.link.action, pair.link.ros1_type) for pair in pairs] == [
            ("/fly", "actionlib_tutorials/Fibonacci"), ("/odd", "odd_msgs/Odd"),
        ]  # fmt: skip
        assert not pairs[0].reason
        assert pairs[1].reason.startswith("[odd_msgs/OddGoal] is not defined here")

    bridged(scene)


class LateServer:
    """Replaces rclpy's action client; its server responds when the test requests it."""

    def __init__(self, *_: object, **__: object) -> None:
        self.answered: list[Callable[[Any], None]] = []
        self.cancelled = 0
        self.accepted = True

    def send_goal_async(self, _: object, *, goal_uuid: object) -> Any:
        return SimpleNamespace(add_done_callback=self.answered.append)

    def cancel_goal_async(self) -> None:
        self.cancelled += 1


def rclpy_client(monkeypatch: pytest.MonkeyPatch, class_: type) -> Ros2ActionClient:
    """Return the bridge's client with a class in place of rclpy's."""
    monkeypatch.setitem(sys.modules, "rclpy", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "rclpy.action", SimpleNamespace(ActionClient=class_))
    uuids = SimpleNamespace(UUID=lambda **_: None)
    monkeypatch.setitem(sys.modules, "unique_identifier_msgs", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "unique_identifier_msgs.msg", uuids)

    node = SimpleNamespace(create_subscription=lambda *_, **__: None)
    executor = SimpleNamespace(create_task=lambda function, *words: function(*words))
    calls: Any = SimpleNamespace(
        node=node,
        executor=executor,
        options={"callback_group": None, "qos_profile": None},
        deserialize=lambda data, _: data,
    )
    fibonacci: Any = SimpleNamespace(Impl=SimpleNamespace(FeedbackMessage=None), Goal=None)
    return Ros2ActionClient(calls, "/fly", fibonacci)


def test_client_of_rclpy_that_the_executor_sees_too_early_has_a_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    class Early:
        _lock: threading.Lock

        def __init__(self, *_: object, **__: object) -> None:
            # As in rclpy, the executor's thread may call it from now on.
            with self._lock:
                pass
            self._lock = threading.Lock()

    assert rclpy_client(monkeypatch, Early)


def test_server_of_rclpy_that_the_executor_sees_too_early_has_a_logger(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Early:
        _logger: Any

        def __init__(self, *_: object, **__: object) -> None:
            # As in rclpy, the executor's thread may call it from now on.
            self._logger.debug("a goal")

    monkeypatch.setitem(sys.modules, "rclpy", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "rclpy.action", SimpleNamespace(ActionServer=Early))
    monkeypatch.setitem(sys.modules, "rclpy.qos", SimpleNamespace(QoSProfile=lambda **_: None))
    lines: list[str] = []
    node = SimpleNamespace(get_logger=lambda: SimpleNamespace(debug=lines.append))
    calls: Any = SimpleNamespace(node=node, options={"callback_group": None, "qos_profile": None})
    server: Any = Ros2ActionServer(calls, "/fly", cast("Any", None), cast("Any", None))
    assert server
    assert lines == ["a goal"]


def test_server_of_rclpy_is_destroyed_once_results_are_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sending a result takes several iterations of the executor. If the server is destroyed earlier, its client hangs."""
    monkeypatch.setattr("minirospy.ros2.rclpy_actions.CLOSE_SECONDS", LIMIT)
    order: list[str] = []
    tasks: queue.Queue[Callable[[], object] | None] = queue.Queue()

    class Server:
        def __init__(self, *_: object, **__: object) -> None:
            pass

        def destroy(self) -> None:
            order.append("destroyed")

    monkeypatch.setitem(sys.modules, "rclpy", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "rclpy.action", SimpleNamespace(ActionServer=Server))
    monkeypatch.setitem(sys.modules, "rclpy.qos", SimpleNamespace(QoSProfile=lambda **_: None))
    node = SimpleNamespace(get_logger=lambda: None)
    options = {"callback_group": None, "qos_profile": None}
    closing = threading.Event()

    def end(task: Callable[[], object]) -> None:
        tasks.put(task)
        closing.set()

    calls: Any = SimpleNamespace(node=node, options=options, end=end)
    server: Any = Ros2ActionServer(calls, "/fly", cast("Any", None), cast("Any", None))

    def goal(*, is_ended: bool) -> Any:
        ended: Future[object] = Future()
        if is_ended:
            ended.set_result(None)
        return None, SimpleNamespace(ended=ended), None

    def answer(rounds: int) -> None:
        if rounds:
            tasks.put(lambda: answer(rounds - 1))
        else:
            del server._goals[1]
            order.append("sent")

    server._goals = {1: goal(is_ended=True), 2: goal(is_ended=False)}
    tasks.put(lambda: closing.wait(LIMIT))
    answer(5)
    thread = threading.Thread(target=lambda: [task() for task in iter(tasks.get, None)])
    thread.start()
    server.close()
    tasks.put(None)
    thread.join()
    assert order == ["sent", "destroyed"]


def test_a_goal_that_is_accepted_too_late_is_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    client = rclpy_client(monkeypatch, LateServer)
    server: Any = client._client

    accepted = client.send(b"", lambda _: None)
    server.answered.pop()(SimpleNamespace(result=lambda: server))
    assert isinstance(accepted.result(0), GoalOfRos2)
    assert (server.cancelled, len(client._callbacks)) == (0, 1)

    client.send(b"", lambda _: None).cancel()
    server.answered.pop()(SimpleNamespace(result=lambda: server))
    assert (server.cancelled, len(client._callbacks)) == (1, 1)


@pytest.mark.parametrize(
    "type_",
    ["", "/", "/x", ".a/b", "os.path/x", "std_srvs/a.b", "a b/c", "a/\x00", "A_msgs/B", "a__b/C", "a_/B"],
)
def test_a_type_that_is_not_a_name_is_never_imported(type_: str) -> None:
    for found in (RclpySide.message_class, RclpySide.service_class, RclpySide.action_class):
        with pytest.raises(TypesDiffer):
            found(type_)


def test_only_packages_of_interfaces_are_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("plain_tool", "fly_msgs"):
        for folder in (tmp_path / package, tmp_path / package / "msg"):
            folder.mkdir()
            (folder / "__init__.py").write_text(
                f"import builtins\nbuiltins.imported_by_name.add({package!r})\n"
            )
    imported: set[str] = set()
    monkeypatch.setattr(builtins, "imported_by_name", imported, raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))

    for type_ in ("plain_tool/Fly", "fly_msgs/Fly", "antigravity/Fly", "this/Fly", "nothing_of_the_name/Fly"):
        with pytest.raises(TypesDiffer):
            RclpySide.message_class(type_)
    assert not imported
    assert "antigravity" not in sys.modules

    (tmp_path / "fly_msgs" / "fly_msgs_s__rosidl_typesupport_c.so").write_text("")
    with (tmp_path / "fly_msgs" / "msg" / "__init__.py").open("a") as file:
        file.write("class Fly:\n    get_fields_and_field_types = lambda: {}\n")
    assert RclpySide.message_class("fly_msgs/Fly").__name__ == "Fly"
    assert imported == {"fly_msgs"}
    for name in ("fly_msgs.msg", "fly_msgs"):
        sys.modules.pop(name)


@pytest.mark.usefixtures("master")
def test_goals_of_ros1_at_a_time_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros2.action_to_ros2.MAX_GOALS", 2)

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered = SEND_GOAL
        await bridge.look()
        async with ActionClient(node, "/fly", FibonacciAction) as client:
            await client.wait_for_server()
            kept = [client.send(FibonacciGoal(order=number)) for number in (1, 2)]
            handles = [(await sent(side, number))[2] for number in (0, 1)]

            late = client.send(FibonacciGoal(order=3))
            assert await end_of(late) == (GoalState.REJECTED, [])
            assert late.text == "the bridge passes on 2 goals of action /fly already"
            assert len(side.action_clients["/fly"].goals) == 2

            for number, handle in enumerate(handles):
                handle.ended.set_result((SUCCEEDED, cdr(number)))
            assert [list((await goal).sequence) for goal in kept] == [[0], [1]]

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_goals_of_ros2_at_a_time_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros2.action_to_ros1.MAX_GOALS", 1)

    async def execute(_: Any) -> dict[str, list[int]]:
        await asyncio.sleep(LIMIT)
        return {"sequence": []}

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        server = await ActionServer(node, "/fly", FibonacciAction, execute, concurrent=True)
        await bridge.look()
        accept = side.action_servers["/fly"].accept
        goal = b"\0\1\0\0\1\0\0\0"
        first = await asyncio.wrap_future(accept(goal, lambda _: None))
        assert first
        with pytest.raises(BridgeError, match="passes on 1 goals already"):
            await asyncio.wrap_future(accept(goal, lambda _: None))
        first.cancel()
        await asyncio.wrap_future(first.ended)
        again = accept(goal, lambda _: None)
        assert await asyncio.wrap_future(again)
        await server.close()

    bridged(scene)
