"""Joints over WebSocket: read from robot_description, set, published."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest
from sensor_msgs.msg import JointState
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from minirospy.base.name_filter import NameFilter
from minirospy.introspect.snapshot import fetch
from minirospy.ros.robot_state_publisher.joints import read_joints
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.access import Access
from minirospy.web.dashboard.joint_endpoint import SUBPROTOCOL, JointEndpoint
from minirospy.web.graph import Filters
from minirospy.workspace.packages import Packages
from tests.waiting import wait_until
from tests.web.dashboard.robot import ROBOT

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served


class Client:
    """A page's connection."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    def send(self, op: str, **fields: object) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def next(self, name: str, accepts: Callable[[Any], object] = lambda _: True) -> Any:
        """Return the next value with this name that ``accepts`` accepts."""
        while True:
            found: dict[str, Any] = json.loads(self.socket.recv(timeout=60))
            if name in found and accepts(found[name]):
                return found[name]


@pytest.fixture
def client(serve: Callable[..., Served]) -> Iterator[Callable[..., Client]]:
    with contextlib.ExitStack() as opened:

        def start(served: Served, token: str = "") -> Client:
            names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
            address = f"ws://127.0.0.1:{served.port}/"
            return Client(
                opened.enter_context(connect(address, subprotocols=names, compression=None, open_timeout=100))
            )

        yield start


def set_params(served: Served, **values: object) -> None:
    async def work() -> None:
        for name, value in values.items():
            await served.node_of_dashboard.set_param(name, value)

    served.run(work())


def listening(served: Served) -> Callable[[Callable[[dict[str, float]], bool]], dict[str, float]]:
    node = served.node("listener")

    async def listen() -> Any:
        return await node.subscribe("/joint_states", JointState)

    subscription = served.run(listen())

    def until(accepts: Callable[[dict[str, float]], bool]) -> dict[str, float]:
        while True:
            state = served.run(subscription.next(50))
            found = dict(zip(state.name, state.position, strict=True))
            if accepts(found):
                return found

    return until


def test_joints_are_those_of_the_description(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, zeros={"shoulder": 0.5}, rate=50)
    page = client(served)
    joints = page.next("joints")
    assert joints["robot"] == "crane"
    assert joints["rate"] == 50
    rows = {name: (kind, limits) for name, kind, limits in joints["rows"]}
    assert rows["shoulder"] == ("revolute", [-1, 2, 0.5])
    assert rows["wheel"][0] == "continuous"
    assert rows["lift"] == ("prismatic", [0.1, 0.3, pytest.approx(0.2)])
    assert rows["finger"] == ("revolute", None)
    assert "bolt" not in rows


def test_description_is_read_outside_the_loop(
    serve: Callable[..., Served], client: Callable[..., Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    threads = []

    def read(*args: Any) -> Any:
        threads.append(threading.get_ident())
        return read_joints(*args)

    monkeypatch.setattr("minirospy.web.dashboard.joint_endpoint.read_joints", read)
    served = serve()
    set_params(served, robot_description=ROBOT)
    assert client(served).next("joints")["robot"] == "crane"

    async def loops() -> int:
        return threading.get_ident()

    assert threads
    assert served.run(loops()) not in threads


def test_description_that_is_read_slowly_is_sent_complete(
    serve: Callable[..., Served], client: Callable[..., Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    is_reading, may_end = threading.Event(), threading.Event()

    def read(*args: Any) -> Any:
        is_reading.set()
        assert may_end.wait(60)
        return read_joints(*args)

    monkeypatch.setattr("minirospy.web.dashboard.joint_endpoint.read_joints", read)
    served = serve()
    set_params(served, robot_description=ROBOT)
    page = client(served)
    assert is_reading.wait(60)
    page.send("publish", on=True)
    page.next("state", lambda state: state["publishing"])
    may_end.set()
    assert page.next("joints")["robot"] == "crane"


def test_positions_are_published_only_on_request(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, rate=50)
    until = listening(served)
    page = client(served)
    page.next("joints")
    page.send("set", positions={"shoulder": 1.5, "lift": 99})
    page.next("state", lambda state: state["positions"]["shoulder"] == 1.5 and not state["publishing"])
    page.send("publish", on=True)
    found = until(lambda _: True)
    assert found["shoulder"] == 1.5
    assert found["lift"] == 0.3
    assert found["finger"] == pytest.approx(-2.9)
    page.send("center")
    until(lambda each: each["shoulder"] == 0)
    page.send("randomize")
    until(lambda each: each["shoulder"] != 0 and -1 <= each["shoulder"] <= 2)
    page.send("publish", on=False)
    page.next("state", lambda state: not state["publishing"])


def test_sources_move_the_joints(serve: Callable[..., Served], client: Callable[..., Client]) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, source_list=["/from_robot"])
    page = client(served)
    page.next("joints")
    node = served.node("arm")

    async def publish() -> None:
        publisher = await node.advertise("/from_robot", JointState, latch=True)
        await publisher.publish(JointState(name=["wheel"], position=[0.75]))

    served.run(publish())
    page.next("state", lambda state: state["positions"].get("wheel") == 0.75)


def test_position_that_json_has_not_is_null(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, source_list=["/from_robot"])
    page = client(served)
    page.next("joints")
    node = served.node("arm")

    async def publish() -> None:
        publisher = await node.advertise("/from_robot", JointState, latch=True)
        await publisher.publish(JointState(name=["wheel"], position=[float("nan")]))

    served.run(publish())
    page.next("state", lambda state: state["positions"]["wheel"] is None)


def test_topics_are_left_with_the_page_and_the_parameter(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, source_list=["/from_robot"])
    node = served.node("other")

    def topics() -> tuple[object, object]:
        state = served.run(fetch(node.call_master))
        return state.publishers.get("/joint_states"), state.subscribers.get("/from_robot")

    page = client(served)
    page.next("joints")
    page.send("publish", on=True)
    while not all(topics()):
        page.next("state")
        page.send("randomize")
    set_params(served, source_list=["/from_other"])
    page.next("joints")
    page.socket.close()
    wait_until(lambda: not any(topics()))

    def is_followed() -> bool:
        return "/from_other" in served.run(fetch(node.call_master)).subscribers

    wait_until(lambda: not is_followed())
    client(served)
    wait_until(is_followed)


def test_description_that_comes_later_or_is_broken_is_followed(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    page = client(served)
    while "why" not in (found := json.loads(page.socket.recv(timeout=60))):
        pass
    assert "robot_description parameter is required" in found["why"]
    set_params(served, robot_description="<robot>")
    while "robot_description" not in found.get("why", "") or "required" in found["why"]:
        found = json.loads(page.socket.recv(timeout=60))
    set_params(served, robot_description=ROBOT)
    assert page.next("joints", bool)["robot"] == "crane"


@pytest.mark.parametrize(
    "fields",
    [
        {"op": "set"},
        {"op": "set", "positions": {"none": 1}},
        {"op": "set", "positions": {"wheel": "x"}},
        {"op": "set", "positions": {"wheel": float("nan")}},
        {"op": "set", "positions": {"wheel": 10**400}},
        {"op": "set", "positions": [1]},
        {"op": "fly"},
        {},
    ],
)
def test_invalid_operation_is_refused_with_one_line(
    serve: Callable[..., Served], client: Callable[..., Client], fields: dict[str, object]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT)
    page = client(served)
    page.next("joints")
    page.socket.send(json.dumps(fields))
    assert "\n" not in page.next("error")


def test_read_only_client_sets_nothing(serve: Callable[..., Served], client: Callable[..., Client]) -> None:
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    page = client(serve(access=access), "read-token-00")
    assert page.next("writes") is False
    page.send("publish", on=True)
    assert "read-only" in page.next("error")


def test_source_with_an_illegal_name_is_warned_of_and_the_others_followed(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, source_list=["no name!", "/from_robot", ""])
    page = client(served)
    warnings = page.next("joints")["warnings"]
    assert [each for each in warnings if "[no name!]: that is not a legal name" in each]
    page.send("set", positions={"shoulder": 1.5})
    page.next("state", lambda state: state["positions"]["shoulder"] == 1.5)
    set_params(served, source_list=[])
    page.next("joints", lambda joints: joints["sources"] == [])


@pytest.mark.parametrize("name", ["rate", "delta"])
def test_parameter_that_is_no_number_is_named(
    serve: Callable[..., Served], client: Callable[..., Client], name: str
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT, **{name: float("nan")})
    page = client(served)
    found = page.next("why", bool)
    assert f"The {name} parameter is [nan]: it is a number" in found


def test_joints_are_set_all_or_none(serve: Callable[..., Served], client: Callable[..., Client]) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT)
    page = client(served)
    page.next("joints")
    page.send("set", positions={"shoulder": 1.5, "none": 1})
    assert "there is no joint [none]" in page.next("error")
    page.send("set", positions={"lift": 0.2})
    page.send("set", positions={"lift": 0.15})
    state = page.next("state", lambda state: state["positions"]["lift"] == 0.15)
    assert state["positions"]["shoulder"] == 0


def test_topic_that_clients_may_not_publish_is_not_published(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve(filters=Filters(publishable=NameFilter.of(deny=["/joint_states"])))
    set_params(served, robot_description=ROBOT)
    page = client(served)
    page.next("joints")
    page.send("publish", on=True)
    assert "topic [/joint_states] may not be published by clients" in page.next("error")


def test_another_publisher_of_the_joints_is_named(
    serve: Callable[..., Served], client: Callable[..., Client]
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT)
    page = client(served)
    page.next("joints")
    node = served.node("arm")

    async def advertise() -> None:
        await node.advertise("/joint_states", JointState)

    served.run(advertise())
    page.next("state", lambda state: state["others"] == ["/arm"])


def test_node_of_launch_files_publishes_without_a_page(master: str) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.set_param("/robot_description", ROBOT)
    proxy.set_param("/joint_state_publisher_gui/zeros", {"wheel": 0.25})
    proxy.close()
    program = Packages().find_executable("joint_state_publisher_gui", "joint_state_publisher_gui")
    command = [*program, "--page", "--no-browser", "--port", "0"]
    node = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    try:
        assert node.stdout
        assert re.match(
            r"Open in a browser: http://127\.0\.0\.1:\d+/#/joints\?token=[\w-]{22}$", node.stdout.readline()
        )
        reading = (
            "import rospy; from sensor_msgs.msg import JointState; rospy.init_node('reader', disable_rosout=True);"
            "state = rospy.wait_for_message('joint_states', JointState);"
            "print(dict(zip(state.name, state.position))['wheel'], state._connection_header['callerid'])"
        )
        done = subprocess.run(
            [sys.executable, "-c", reading], capture_output=True, text=True, timeout=90, check=True
        )
        assert done.stdout == "0.25 /joint_state_publisher_gui\n"
    finally:
        node.terminate()
        node.communicate(timeout=60)
    assert node.returncode == 0 or sys.platform == "win32"


def test_joints_are_followed_after_a_fault(
    serve: Callable[..., Served], client: Callable[..., Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = serve()
    set_params(served, robot_description=ROBOT)
    faults = iter([ZeroDivisionError])
    load = JointEndpoint.load

    async def failing(endpoint: JointEndpoint, *, is_forced: bool = False) -> None:
        for fault in faults:
            raise fault
        await load(endpoint, is_forced=is_forced)

    monkeypatch.setattr(JointEndpoint, "load", failing)
    assert client(served).next("joints", bool)["rows"]
