"""Actions and parameters in the bridge over Zenoh, and the topics of every robot, with a node that writes each byte itself.

Its keys and messages are those of rcl_action, rmw_zenoh and the definitions of ROS 2 Kilted, whose hashes are here.
"""

from __future__ import annotations

import asyncio
import queue
import struct
import uuid
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from minirospy import Node
from minirospy.aio.raw import call_raw
from minirospy.base.errors import ServiceException
from minirospy.core.graph.goals import GoalState
from minirospy.core.idl.load import service_class
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError
from minirospy.ros2.bridge import Ros2Bridge, Ros2Options
from minirospy.ros2.definitions import Definitions
from minirospy.ros2.links import BRIDGE_PREFIX
from minirospy.ros2.rules import BUILT_IN, parse_rules
from minirospy.ros2.zenoh_keys import attachment
from minirospy.ros2.zenoh_side import ZenohSide
from minirospy.zenoh.library import NetworkOptions
from tests.ros2.ros2_definitions import catalogue, typestore
from tests.ros2.test_ros2_zenoh import GID, LIMIT, RmwNode, called, domain, endpoint, node, zenoh
from tests.ros2.test_ros2_zenoh_keys import ACTION_HASHES, SERVICE_HASHES
from tests.waiting import until, wait_until

__all__ = ["domain", "endpoint", "node"]  # fixtures

RULES = """
- {ros1_package_name: actionlib_tutorials, ros1_action_name: Fibonacci, ros2_package_name: test_msgs, ros2_action_name: Fibonacci}
"""
ROBOT_RULES = BUILT_IN.with_(parse_rules(RULES, "rules"))
PARTS = {
    "send_goal": "test_msgs::action::dds_::Fibonacci_SendGoal_",
    "get_result": "test_msgs::action::dds_::Fibonacci_GetResult_",
    "cancel_goal": "action_msgs::srv::dds_::CancelGoal_",
    "feedback": "test_msgs::action::dds_::Fibonacci_FeedbackMessage_",
    "status": "action_msgs::msg::dds_::GoalStatusArray_",
}
TOPICS = ("feedback", "status")
HEADER = b"\0\1\0\0"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time limits above a machine's stalls."""
    for module, name in (("zenoh_actions", "CLOSE_SECONDS"), ("zenoh_parameters", "ANSWER_SECONDS")):
        monkeypatch.setattr(f"minirospy.ros2.{module}.{name}", LIMIT)


def key_of(part: str) -> str:
    return f"0/fly/_action/{part}/{PARTS[part]}/{ACTION_HASHES[part]}"


def numbers(*values: int) -> bytes:
    """Return a serialized sequence of int32."""
    return struct.pack(f"<I{len(values)}i", len(values), *values)


def bridged(
    node: RmwNode, endpoint: str, scene: Callable[[Node, RmwNode, Ros2Bridge], Awaitable[None]]
) -> None:
    async def run() -> None:
        side = ZenohSide(BRIDGE_PREFIX, NetworkOptions((endpoint,)), Definitions(ROBOT_RULES, catalogue()))
        async with Node("other", rosout=False) as other, Node(BRIDGE_PREFIX, rosout=False) as own:
            bridge = Ros2Bridge(own, side, Ros2Options(rules=ROBOT_RULES), catalogue())
            try:
                await bridge.start()
                await asyncio.wait_for(scene(other, node, bridge), 2 * LIMIT)
            finally:
                await bridge.close()

    asyncio.run(run())


async def in_thread(work: Callable[..., Any], *words: object) -> Any:
    return await asyncio.get_running_loop().run_in_executor(None, work, *words)


async def end_of(goal: Any) -> tuple[GoalState, list[int]]:
    with pytest.raises(GoalError) as caught:
        await goal
    return caught.value.state, list(getattr(caught.value.result, "sequence", []))


# --- goals of ROS 1


class Server:
    """A ROS 2 server of /fly. It rejects a negative order, aborts 13, finishes 3 on request, and finishes 7 when it is cancelled.

    Feedback and result use different routes, so tests await a goal's feedback before the goal finishes.
    """

    def __init__(self, node: RmwNode) -> None:
        self.node = node
        self.goals: dict[bytes, int] = {}
        self.waiting: dict[bytes, Any] = {}
        self.cancelled: list[bytes] = []
        self.publisher = node.session.declare_publisher(key_of("feedback"))
        answers = {"send_goal": self.send_goal, "get_result": self.get_result, "cancel_goal": self.cancel}
        for id, (part, answer) in enumerate(answers.items(), 1):
            node.kept.append(node.session.declare_queryable(key_of(part), answer, complete=True))
            node.end(id, "SS", key_of(part))
        for id, part in enumerate(TOPICS, 4):
            node.end(id, "MP", key_of(part))

    def reply(self, query: Any, part: str, data: bytes) -> None:
        query.reply(key_of(part), HEADER + data, attachment=query.attachment)
        query.drop()

    def send_goal(self, query: Any) -> None:
        data = query.payload.to_bytes()
        assert data[:4] == HEADER
        id, (order,) = data[4:20], struct.unpack("<i", data[20:])
        self.goals[id] = order
        self.reply(query, "send_goal", struct.pack("<?xxxiI", order >= 0, 12, 34))
        for count in range(1, order + 1):
            self.publisher.put(HEADER + id + numbers(*range(count)))

    def get_result(self, query: Any) -> None:
        id = query.payload.to_bytes()[4:]
        if self.goals[id] in (3, 7):
            self.waiting[id] = query
        else:
            self.end(query, ABORTED if self.goals[id] == 13 else SUCCEEDED, self.goals[id])

    def end(self, query: Any, status: int, order: int) -> None:
        self.reply(query, "get_result", struct.pack("<bxxx", status) + numbers(*range(order)))

    def cancel(self, query: Any) -> None:
        id = query.payload.to_bytes()[4:20]
        self.cancelled.append(id)
        self.reply(query, "cancel_goal", struct.pack("<bxxxI", 0, 1) + id + bytes(8))
        self.end(self.waiting.pop(id), CANCELED, 3)


@pytest.mark.usefixtures("master")
def test_goals_of_ros1_reach_a_server_over_zenoh(node: RmwNode, endpoint: str) -> None:
    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        server = await in_thread(Server, peer)
        async with ActionClient(other, "/fly", FibonacciAction) as client:
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=3))
            feedback = aiter(goal)
            for count in (1, 2, 3):
                assert list((await anext(feedback)).sequence) == list(range(count))
            await until(lambda: bool(server.waiting))
            server.end(server.waiting.popitem()[1], SUCCEEDED, 3)
            assert [each async for each in feedback] == []
            assert list((await goal).sequence) == [0, 1, 2]
            assert await end_of(client.send(FibonacciGoal(order=13))) == (
                GoalState.ABORTED,
                list(range(13)),
            )
            assert await end_of(client.send(FibonacciGoal(order=-1))) == (GoalState.REJECTED, [])

            goal = client.send(FibonacciGoal(order=7))
            await until(lambda: bool(server.waiting))
            goal.cancel()
            assert await end_of(goal) == (GoalState.PREEMPTED, [0, 1, 2])
            assert [server.goals[id] for id in server.cancelled] == [7]

            goal = client.send(FibonacciGoal(order=7))
            await until(lambda: bool(server.waiting))
            await in_thread(peer.session.close)
            assert (await end_of(goal))[0] is GoalState.ABORTED
            assert "has ended" in goal.text

    bridged(node, endpoint, scene)


# --- goals of ROS 2


class Client:
    """A ROS 2 client of /fly."""

    def __init__(self, node: RmwNode) -> None:
        self.node = node
        self.feedback = node.subscribe(key_of("feedback"))
        self.statuses: queue.Queue[Any] = queue.Queue()
        node.kept.append(
            zenoh.ext.declare_advanced_subscriber(
                node.session,
                key_of("status"),
                self.statuses.put,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
                subscriber_detection=True,
            )
        )
        wait_until(lambda: len([each for each in node.tokens() if "fly%_action" in each]) == 5)
        querier = node.session.declare_querier(key_of("send_goal"))
        wait_until(lambda: querier.matching_status.matching)

    def call(self, part: str, data: bytes) -> bytes:
        replies = self.node.session.get(
            key_of(part),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            payload=HEADER + data,
            attachment=attachment(1, 1, GID),
            timeout=LIMIT,
        )
        found = next(iter(replies)).ok.payload.to_bytes()
        assert found[:4] == HEADER
        return bytes(found[4:])

    def send(self, order: int, id: bytes = b"") -> bytes:
        """Send a goal; return its id, or an empty one if it is rejected."""
        id = id or uuid.uuid4().bytes
        found = self.call("send_goal", id + struct.pack("<i", order))
        is_accepted, sec, _ = struct.unpack("<?xxxiI", found)
        assert sec
        return id if is_accepted else b""

    def result(self, id: bytes) -> tuple[int, bytes]:
        found = self.call("get_result", id)
        return found[0], found[4:]

    def cancel(self, id: bytes) -> tuple[int, list[bytes]]:
        found = self.call("cancel_goal", id + bytes(8))
        code, count = struct.unpack_from("<bxxxI", found)
        return code, [found[8 + 24 * each : 24 + 24 * each] for each in range(count)]

    def said(self, id: bytes) -> bytes:
        """Return the next feedback on a goal."""
        data = self.feedback.get(timeout=LIMIT).payload.to_bytes()
        assert data[4:20] == id
        return bytes(data[20:])

    def until_status(self, id: bytes, status: int) -> None:
        store = typestore()
        while True:
            data = self.statuses.get(timeout=LIMIT).payload.to_bytes()
            listed = store.deserialize_cdr(data, "action_msgs/msg/GoalStatusArray").status_list
            if (id, status) in [(bytes(each.goal_info.goal_id.uuid), each.status) for each in listed]:
                return


@pytest.mark.usefixtures("master")
def test_goals_over_zenoh_reach_a_server_of_ros1(node: RmwNode, endpoint: str) -> None:
    async def execute(goal: Any) -> dict[str, list[int]]:
        order = goal.request.order
        for count in range(1, order + 1):
            await goal.publish_feedback(list(range(count)))
        if order == 13:
            raise GoalError("unlucky", {"sequence": [13]})
        if order == 7:
            with pytest.raises(asyncio.CancelledError):
                await asyncio.sleep(LIMIT)
        return {"sequence": list(range(order))}

    def use(client: Client) -> None:
        id = client.send(3)
        assert [client.said(id) for _ in range(3)] == [numbers(0), numbers(0, 1), numbers(0, 1, 2)]
        assert client.result(id) == (SUCCEEDED, numbers(0, 1, 2))
        client.until_status(id, SUCCEEDED)
        # The result is stored for late clients, and a goal's id can be used only once.
        assert client.result(id) == (SUCCEEDED, numbers(0, 1, 2))
        assert not client.send(3, id)
        assert not client.send(-1)
        assert client.result(bytes(range(16))) == (0, numbers())

        id = client.send(7)
        for count in range(1, 8):
            assert client.said(id) == numbers(*range(count))
        assert client.cancel(bytes(range(1, 17))) == (2, [])
        assert client.cancel(id) == (0, [id])
        assert client.result(id) == (CANCELED, numbers(*range(7)))
        client.until_status(id, CANCELED)
        assert client.cancel(id) == (3, [])

        id = client.send(13)
        for _ in range(13):
            client.said(id)
        assert client.result(id) == (ABORTED, numbers(13))

    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        server = await ActionServer(
            other, "/fly", FibonacciAction, execute, accepts=lambda goal: goal.order >= 0
        )
        client = await in_thread(Client, peer)
        await in_thread(use, client)
        id = await in_thread(client.send, 7)
        await in_thread(client.until_status, id, 2)
        # Active goals are aborted when the bridge closes. If only its actions were closed, its next refresh would
        # offer them again.
        await bridge.close()
        await in_thread(client.until_status, id, ABORTED)
        await in_thread(wait_until, lambda: not any("fly%_action" in each for each in peer.tokens()))
        await server.close()

    bridged(node, endpoint, scene)


# --- parameters

TEXT = struct.Struct("<I")
VALUES = get_typestore(Stores.ROS2_KILTED)
VALUES.register(
    {
        **get_types_from_msg("rcl_interfaces/ParameterValue[] values", "rcl_interfaces/msg/Values"),
        **get_types_from_msg("rcl_interfaces/Parameter[] parameters", "rcl_interfaces/msg/Parameters"),
    }
)
"""Register the requests and responses of services, which rosbags lacks."""


def text(value: str) -> bytes:
    data = value.encode() + b"\0"
    return TEXT.pack(len(data)) + data


@pytest.mark.usefixtures("master")
def test_parameters_of_ros1_are_those_of_the_bridge_over_zenoh(node: RmwNode, endpoint: str) -> None:
    def call(service: str, part: str, request: bytes) -> bytes:
        type_ = f"rcl_interfaces::srv::dds_::{part}_"
        key = f"0/{BRIDGE_PREFIX}/{service}/{type_}/{SERVICE_HASHES[f'rcl_interfaces/{part}']}"
        found = called(node, key, HEADER + request, attachment(1, 1, GID)).ok.payload.to_bytes()
        assert found[:4] == HEADER
        return bytes(found[4:])

    def value_of(name: str) -> Any:
        """Return the result of ``get_parameters`` for one parameter, as rosbags reads it."""
        request = TEXT.pack(1) + text(name)
        found = call("get_parameters", "GetParameters", request)
        assert TEXT.unpack(found[:4]) == (1,)
        (value,) = VALUES.deserialize_cdr(HEADER + found, "rcl_interfaces/msg/Values").values
        return value

    def set_to(name: str, value: Any) -> bytes:
        made = VALUES.types["rcl_interfaces/msg/Parameter"](name, value)
        request = VALUES.types["rcl_interfaces/msg/Parameters"]([made])
        data = bytes(VALUES.serialize_cdr(request, "rcl_interfaces/msg/Parameters"))[4:]
        return call("set_parameters", "SetParameters", data)

    def use() -> None:
        wait_until(
            lambda: sum(f"%{BRIDGE_PREFIX}%" in each and "/SS/" in each for each in node.tokens()) == 6
        )
        listed = call("list_parameters", "ListParameters", TEXT.pack(1) + text("robot") + bytes(14))
        names = ["robot.ids", "robot.name", "robot.on", "robot.speed"]
        assert all(text(name) in listed for name in names)
        speed = value_of("robot.speed")
        assert (speed.type, speed.double_value) == (3, 1.5)
        assert value_of("robot.name").string_value == "r2"
        assert list(value_of("robot.ids").integer_array_value) == [1, 2]
        assert value_of("robot.none").type == 0
        assert call("get_parameter_types", "GetParameterTypes", TEXT.pack(1) + text("robot.on")) == (
            TEXT.pack(1) + b"\1"
        )
        described = call("describe_parameters", "DescribeParameters", TEXT.pack(1) + text("robot.on"))
        assert described.startswith(TEXT.pack(1) + text("robot.on"))
        assert text("a parameter of ROS 1") in described

        speed.type, speed.integer_value = 2, 3
        assert set_to("robot.speed", speed) == TEXT.pack(1) + b"\1\0\0\0" + text("")
        assert value_of("robot.speed").integer_value == 3
        speed.integer_value = 2**40
        refused = set_to("robot.speed", speed)
        assert refused[4] == 0
        assert b"does not fit into the 32 bits" in refused
        # An invalid request is rejected, and the next one gets a response.
        key = f"0/{BRIDGE_PREFIX}/get_parameters/rcl_interfaces::srv::dds_::GetParameters_"
        key += f"/{SERVICE_HASHES['rcl_interfaces/GetParameters']}"
        broken = called(node, key, HEADER + b"\xff\xff\xff\xff", attachment(1, 1, GID))
        assert broken.err.payload.to_bytes() == b"the message ends too early"
        assert value_of("robot.speed").integer_value == 3

    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        await other.set_param("/robot", {"speed": 1.5, "name": "r2", "ids": [1, 2], "on": True})
        await in_thread(use)

    bridged(node, endpoint, scene)


@pytest.mark.usefixtures("master")
def test_parameters_over_zenoh_are_reached_by_services_of_ros1(node: RmwNode, endpoint: str) -> None:
    asked: list[bytes] = []

    def serve(id: int, service: str, part: str, answer: Callable[[bytes], bytes]) -> None:
        key = (
            f"0/peer/{service}/rcl_interfaces::srv::dds_::{part}_/{SERVICE_HASHES[f'rcl_interfaces/{part}']}"
        )

        def arrived(query: Any) -> None:
            asked.append(query.payload.to_bytes()[4:])
            query.reply(key, HEADER + answer(asked[-1]), attachment=query.attachment)
            query.drop()

        node.kept.append(node.session.declare_queryable(key, arrived, complete=True))
        node.end(id, "SS", key)

    def values(request: bytes) -> bytes:
        types = VALUES.types
        empty: dict[str, Any] = {f"{kind}_value": 0 for kind in ("bool", "integer", "double")}
        kinds = {"byte": np.uint8, "bool": np.bool_, "integer": np.int64, "double": np.float64}
        arrays: dict[str, Any] = {f"{kind}_array_value": np.array([], of) for kind, of in kinds.items()}
        kind = 3 if text("gain") in request else 0
        value = types["rcl_interfaces/msg/ParameterValue"](
            **{
                **empty,
                **arrays,
                "type": kind,
                "double_value": 0.5,
                "string_value": "",
                "string_array_value": [],
            }
        )
        message = types["rcl_interfaces/msg/Values"]([value])
        return bytes(VALUES.serialize_cdr(message, "rcl_interfaces/msg/Values"))[4:]

    def results(request: bytes) -> bytes:
        is_known = text("gain") in request
        return TEXT.pack(1) + bytes((is_known, 0, 0, 0)) + text("" if is_known else "not declared")

    serve(1, "list_parameters", "ListParameters", lambda _: TEXT.pack(1) + text("gain") + bytes(7))
    serve(2, "get_parameters", "GetParameters", values)
    serve(3, "set_parameters", "SetParameters", results)

    async def scene(other: Node, peer: RmwNode, bridge: Ros2Bridge) -> None:
        async def call(service: str, *texts: str) -> bytes:
            type_ = "rosapi/" + service.title().replace("_", "")
            request = b"".join(TEXT.pack(len(each)) + each.encode() for each in texts)
            md5 = service_class(type_)._md5sum
            return await call_raw(other, f"/{BRIDGE_PREFIX}/{service}", md5, request)

        await until(lambda: len(bridge.side.services()) == 3)
        assert await call("get_param_names") == TEXT.pack(1) + TEXT.pack(10) + b"/peer:gain"
        assert await call("get_param", "/peer:gain", "") == TEXT.pack(3) + b"0.5"
        assert await call("get_param", "/peer:none", "7") == TEXT.pack(1) + b"7"
        assert await call("set_param", "/peer:gain", "0.75") == b""
        assert struct.pack("<d", 0.75) in asked[-1]
        with pytest.raises(ServiceException, match=r"refuses \[none\]: not declared"):
            await call("set_param", "/peer:none", "1")

    bridged(node, endpoint, scene)
