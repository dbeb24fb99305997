"""Gateways on loopback, with real Zenoh sessions, masters and nodes."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal, FibonacciResult
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse
from tf2_msgs.msg import TFMessage

from minirospy.base.errors import ServiceException
from minirospy.core.idl.load import class_from_text
from minirospy.fleet.rules import GatewayRules
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError
from tests.fleet.fleet import SECONDS, Fleet, Place

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    """Yield masters, gateways and nodes on one loop."""
    running = Fleet()
    yield running
    running.close()


def collect(fleet: Fleet, place: Place, topic: str, cls: type, name: str = "reader") -> list[Any]:
    """Subscribe; return the list to which messages are appended."""
    found: list[Any] = []
    node = place.node(name)

    async def start() -> None:
        subscription = await node.subscribe(topic, cls, queue_size=1000)

        async def read() -> None:
            async for message in subscription:
                found.append(message)  # noqa: PERF401 - seen by the test meanwhile

        node._spawn(read())

    fleet.run(start())
    return found


def publisher(fleet: Fleet, place: Place, topic: str, cls: type, name: str = "writer", **options: Any) -> Any:
    node = place.node(name)

    async def start() -> Any:
        return await node.advertise(topic, cls, **options)

    return fleet.run(start())


def test_a_topic_of_a_robot_is_shown_and_passed_on_demand(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    scans = publisher(fleet, robot, "/scan", LaserScan)
    control.gateway(listens=True)
    gateway = robot.gateway("robot1")
    fleet.until_shown(control, "/robot1/scan")
    assert gateway.exporter is not None
    assert gateway.exporter.outbound == {}

    found = collect(fleet, control, "/robot1/scan", LaserScan)
    fleet.run(scans.wait_for_subscribers(1, SECONDS))
    fleet.run(scans.publish(LaserScan(range_max=3.0)))
    fleet.until(lambda: found)
    assert found[0].range_max == 3.0
    assert found[0]._connection_header["message_definition"]


def test_a_command_reaches_the_robot(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    control.gateway(listens=True)
    robot.gateway("robot1")
    found = collect(fleet, robot, "/cmd_vel", Twist)
    fleet.until_shown(control, "/robot1/cmd_vel")
    commands = publisher(fleet, control, "/robot1/cmd_vel", Twist)
    fleet.run(commands.wait_for_subscribers(1, SECONDS))
    message = Twist()
    message.linear.x = 0.5
    fleet.run(commands.publish(message))
    fleet.until(lambda: found)
    assert found[0].linear.x == 0.5


def test_a_service_answers_and_its_error_arrives(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    node = robot.node("lamp")

    async def switch(request: Any) -> SetBoolResponse:
        if not request.data:
            raise ServiceException("the lamp is stuck")
        return SetBoolResponse(True, "on")

    async def serve() -> None:
        await node.serve("/lamp", SetBool, switch)

    fleet.run(serve())
    control.gateway(listens=True)
    robot.gateway("robot1")
    client = control.node("client")
    fleet.run(client.wait_for_service("/robot1/lamp", SECONDS))
    assert fleet.run(client.call("/robot1/lamp", SetBool, True)).message == "on"
    with pytest.raises(ServiceException, match="the lamp is stuck"):
        fleet.run(client.call("/robot1/lamp", SetBool, False))


def test_latched_topics_reach_late_subscribers(fleet: Fleet) -> None:
    robot, first, second = fleet.place(), fleet.place(), fleet.place()
    maps = publisher(fleet, robot, "/map", OccupancyGrid, latch=True)
    fleet.run(maps.publish(OccupancyGrid(data=[1, 2, 3])))
    first.gateway(listens=True)
    second.gateway()
    robot.gateway("robot1")
    for place in (first, second):
        fleet.until_shown(place, "/robot1/map")
        found = collect(fleet, place, "/robot1/map", OccupancyGrid)
        fleet.until(lambda found=found: found)
        assert list(found[0].data) == [1, 2, 3]
    again = collect(fleet, first, "/robot1/map", OccupancyGrid, "late")
    fleet.until(lambda: again)
    assert len(again) == 1


def test_frames_get_the_prefix_of_the_robot(fleet: Fleet) -> None:
    control = fleet.place()
    control.gateway(listens=True)
    found = collect(fleet, control, "/tf_static", TFMessage)
    for name in ("robot1", "robot2"):
        robot = fleet.place()
        statics = publisher(fleet, robot, "/tf_static", TFMessage, latch=True)
        transform = TransformStamped(child_frame_id="laser")
        transform.header.frame_id = "base_link"
        fleet.run(statics.publish(TFMessage([transform])))
        robot.gateway(name, rules=GatewayRules(has_frames=True))

    def frames() -> set[str]:
        return {each.child_frame_id for message in found for each in message.transforms}

    fleet.until(lambda: frames() == {"robot1/laser", "robot2/laser"})
    late = collect(fleet, control, "/tf_static", TFMessage, "late")
    fleet.until(lambda: late)
    assert {each.header.frame_id for each in late[0].transforms} == {"robot1/base_link", "robot2/base_link"}


def test_strings_flow_both_ways_without_loops(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    control.gateway(listens=True)
    heard = collect(fleet, robot, "/chat", String)
    # Start it before the gateway: the gateway queries a publisher that starts later for its header, and then counts
    # as a subscriber, too.
    said = publisher(fleet, robot, "/chat", String)
    robot.gateway("robot1")
    fleet.until_shown(control, "/robot1/chat")
    there = collect(fleet, control, "/robot1/chat", String)
    back = publisher(fleet, control, "/robot1/chat", String)
    fleet.run(said.wait_for_subscribers(2, SECONDS))
    # The control room's gateway subscribes once it sees the publisher; the reader in the same room subscribes
    # immediately.
    fleet.run(back.wait_for_subscribers(2, SECONDS))
    fleet.run(said.publish("from the robot"))
    fleet.run(back.publish("from the room"))
    fleet.until(lambda: len(heard) >= 2 and len(there) >= 2)
    # Messages that returned to their origin would arrive before these.
    fleet.run(said.publish("again from the robot"))
    fleet.run(back.publish("again from the room"))
    both = ["again from the robot", "again from the room", "from the robot", "from the room"]
    fleet.until(lambda: {each.data for each in heard} == {each.data for each in there} == set(both))
    assert sorted(each.data for each in heard) == both
    assert sorted(each.data for each in there) == both


def test_a_type_that_is_not_installed_passes(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    text = "int8 x\nstd_msgs/String[] words\n" + "=" * 80 + "\nMSG: std_msgs/String\nstring data\n"
    cls = class_from_text("my_msgs/Thing", text)
    things = publisher(fleet, robot, "/things", cls)
    control.gateway(listens=True)
    robot.gateway("robot1")
    fleet.until_shown(control, "/robot1/things")
    found = collect(fleet, control, "/robot1/things", cls)
    fleet.run(things.wait_for_subscribers(1, SECONDS))
    fleet.run(things.publish(5, [String("a")]))
    fleet.until(lambda: found)
    assert (found[0].x, found[0].words[0].data) == (5, "a")
    assert found[0]._connection_header["message_definition"] == text


def test_an_action_runs_on_a_robot_and_is_cancelled(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    control.gateway(listens=True)
    robot.gateway("robot1")
    server_node, client_node = robot.node("server"), control.node("client")

    async def execute(goal: Any) -> Any:
        await goal.publish_feedback(sequence=[0, 1])
        if goal.request.order > 10:
            await asyncio.sleep(3600)
        return FibonacciResult(sequence=[0, 1, 1])

    async def act() -> None:
        async with (
            ActionServer(server_node, "fibonacci", FibonacciAction, execute) as server,
            ActionClient(client_node, "robot1/fibonacci", FibonacciAction) as client,
        ):
            await client.wait_for_server(SECONDS)
            # By then, only the status has arrived.
            await server._feedback.wait_for_subscribers(1, SECONDS)
            await server._result.wait_for_subscribers(1, SECONDS)
            goal = client.send(FibonacciGoal(order=3))
            assert list((await anext(aiter(goal))).sequence) == [0, 1]
            assert list((await goal).sequence) == [0, 1, 1]
            endless = client.send(FibonacciGoal(order=100))
            await anext(aiter(endless))
            endless.cancel()
            with pytest.raises(GoalError):
                await endless

    fleet.run(act())


def test_a_robot_sees_the_control_room_where_it_imports(fleet: Fleet) -> None:
    robot, room = fleet.place(), fleet.place()
    node = room.node("office")

    async def grant(_: Any) -> SetBoolResponse:
        return SetBoolResponse(True, "granted")

    async def serve() -> None:
        await node.serve("/door", SetBool, grant)

    fleet.run(serve())
    news = publisher(fleet, room, "/news", String, latch=True)
    fleet.run(news.publish("hello robots"))
    room.gateway("base", listens=True, imports=True)
    robot.gateway("robot1", imports=True)
    found = collect(fleet, robot, "/base/news", String)
    fleet.until(lambda: found)
    client = robot.node("client")
    fleet.run(client.wait_for_service("/base/door", SECONDS))
    assert fleet.run(client.call("/base/door", SetBool, True)).message == "granted"
    # If the topic from the other side were exported to it again, it would arrive before this later topic.
    publisher(fleet, robot, "/later", String)
    fleet.until_shown(room, "/robot1/later")
    publisher(fleet, room, "/back", String, name="another")
    fleet.until_shown(robot, "/base/back")
    assert not {name for name in room.names() if name.startswith("/robot1/base")}
    assert not {name for name in robot.names() if name.startswith("/base/robot1")}
