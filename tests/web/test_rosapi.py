"""rosapi's services, and tf2_web_republisher: pure parts, and real calls through a bridge."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage
from tf2_web_republisher.msg import TFSubscriptionAction, TFSubscriptionGoal
from tf2_web_republisher.srv import RepublishTFsRequest

from minirospy.base.name_filter import NameFilter
from minirospy.base.times import Duration
from minirospy.core.idl.load import message_class
from minirospy.ros.actionlib.actionlib.aio import ActionClient, GoalError
from minirospy.web.graph import Filters
from minirospy.web.rosapi.typedefs import describe
from minirospy.web.tf_republisher.pairs import FramePair
from minirospy.web.tf_republisher.republisher import Republisher

if TYPE_CHECKING:
    from tests.web.conftest import Running


# --- type definitions


def test_typedefs_list_a_type_and_all_in_it() -> None:
    found = {each.type: each for each in describe(PoseStamped, message_class)}
    assert list(found) == [
        *("geometry_msgs/PoseStamped", "std_msgs/Header", "time", "geometry_msgs/Pose"),
        *("geometry_msgs/Point", "geometry_msgs/Quaternion"),
    ]
    header = found["std_msgs/Header"]
    assert (header.names, header.types) == (["seq", "stamp", "frame_id"], ["uint32", "time", "string"])
    assert (header.lengths, header.examples) == ([-1, -1, -1], ["0", "{}", ""])
    assert found["time"].types == ["int32", "int32"]


def test_typedefs_give_lengths_of_arrays_and_constants() -> None:
    camera = describe(CameraInfo, message_class)[0]
    at = camera.names.index
    assert (camera.lengths[at("K")], camera.lengths[at("D")], camera.examples[at("K")]) == (9, 0, "[]")
    log = describe(Log, message_class)[0]
    assert log.constants == [("DEBUG", "1"), ("ERROR", "8"), ("FATAL", "16"), ("INFO", "2"), ("WARN", "4")]


# --- transforms


def test_pair_is_sent_if_it_moved_enough() -> None:
    def at(x: float, z: float = 0.0) -> Transform:
        return Transform(Vector3(x, 0, 0), Quaternion(0, 0, z, (1 - z * z) ** 0.5))

    pair = FramePair("camera", "world", 0.1, 0.1)
    moves = [at(0), at(0.05), at(0.11), at(0.11, 0.05), at(0.11, 0.2)]
    assert [pair.is_to_be_sent(move) for move in moves] == [True, False, True, False, True]
    always = FramePair("camera", "world", 0.0, 0.1)
    assert [always.is_to_be_sent(at(0)) for _ in range(2)] == [True, True]


# --- calls


class RefusedCall(Exception):
    """The response to a call is an error."""


@pytest.fixture
def api(run_bridge: Callable[..., Running]) -> Callable[..., Any]:
    """Return a function that calls a rosapi service and returns its values; a talker and a server are running."""
    bridge = run_bridge(
        rosapi=True,
        filters=Filters(NameFilter.of((), ["/hidden*"]), parameters=NameFilter.of((), ["/secret*"])),
    )
    node = bridge.node("talker")
    bridge.publisher(node, "/chatter", String)
    bridge.publisher(node, "/hidden", String)

    async def serve() -> None:
        await node.serve("/set", SetBool, lambda request: (True, ""))
        await node.set_param("/speed", {"max": 1.5})
        await node.set_param("/secret", 1)

    bridge.run(serve())
    client = bridge.rosbridge()

    def call(service: str, /, **args: Any) -> Any:
        answer = client.call(f"/rosapi/{service}", args)
        if not answer["result"]:
            raise RefusedCall(answer["values"])
        return answer["values"]

    return call


def test_topics_and_types_are_listed(api: Callable[..., Any]) -> None:
    topics = api("topics")
    found = dict(zip(topics["topics"], topics["types"], strict=True))
    assert found["/chatter"] == "std_msgs/String"
    assert "/hidden" not in found
    assert api("topics_for_type", type="std_msgs/String") == {"topics": ["/chatter"]}
    assert api("topic_type", topic="/chatter") == {"type": "std_msgs/String"}
    assert api("topic_type", topic="/nothing") == {"type": ""}
    assert api("publishers", topic="/chatter") == {"publishers": ["/talker"]}
    assert api("subscribers", topic="/chatter") == {"subscribers": []}
    raw = api("topics_and_raw_types")
    assert raw["typedefs_full_text"][raw["topics"].index("/chatter")] == "string data\n"
    assert api("action_servers") == {"action_servers": []}


def test_nodes_and_services_are_listed(api: Callable[..., Any]) -> None:
    assert {"/talker", "/bridge"} <= set(api("nodes")["nodes"])
    details = api("node_details", node="/talker")
    assert (details["publishing"], "/set" in details["services"]) == (["/chatter"], True)
    assert "/set" in api("services")["services"]
    assert api("services_for_type", type="std_srvs/SetBool") == {"services": ["/set"]}
    assert api("service_type", service="/set") == {"type": "std_srvs/SetBool"}
    assert api("service_type", service="/nothing") == {"type": ""}
    assert api("service_providers", service="std_srvs/SetBool") == {"providers": ["/talker"]}
    assert api("service_node", service="/set") == {"node": "/talker"}
    assert api("service_host", service="/set")["host"]
    assert api("service_host", service="/nothing") == {"host": ""}


def test_types_are_described(api: Callable[..., Any]) -> None:
    assert api("message_details", type="std_msgs/String")["typedefs"] == [
        {
            "type": "std_msgs/String",
            "fieldnames": ["data"],
            "fieldtypes": ["string"],
            "fieldarraylen": [-1],
            "examples": [""],
            "constnames": [],
            "constvalues": [],
        }
    ]
    assert api("service_request_details", type="std_srvs/SetBool")["typedefs"][0]["fieldtypes"] == ["bool"]
    response = api("service_response_details", type="std_srvs/SetBool")["typedefs"][0]
    assert response["fieldnames"] == ["success", "message"]
    with pytest.raises(RefusedCall, match="Unable to load the manifest for package nowhere_msgs"):
        api("message_details", type="nowhere_msgs/Thing")


def test_parameters_are_json(api: Callable[..., Any]) -> None:
    assert json.loads(api("get_param", name="/speed")["value"]) == {"max": 1.5}
    assert api("get_param", name="/nothing") == {"value": "null"}
    assert api("get_param", name="/nothing", default="[1]") == {"value": "[1]"}
    assert api("get_param", name="/secret", default="2") == {"value": "null"}
    api("set_param", name="/speed/min", value="0.5")
    assert json.loads(api("get_param", name="/speed")["value"]) == {"max": 1.5, "min": 0.5}
    with pytest.raises(RefusedCall, match="must be a JSON-formatted string"):
        api("set_param", name="/speed", value="{")
    assert api("has_param", name="/speed/min") == {"exists": True}
    assert api("search_param", name="speed") == {"global_name": "/speed"}
    api("delete_param", name="/speed/min")
    assert api("has_param", name="/speed/min") == {"exists": False}
    names = api("get_param_names")["names"]
    assert ("/speed/max" in names, "/secret" in names) == (True, False)
    assert api("get_time")["time"]["secs"] > 0


def test_topic_of_a_request_is_registered_before_the_answer(bridge: Running) -> None:
    node = bridge.node("republisher")

    async def request() -> bool:
        republisher = Republisher(node)
        await republisher.start()
        answer: Any = await republisher._republish(
            RepublishTFsRequest(source_frames=["/camera"], target_frame="world", timeout=Duration(60))
        )
        topic = node._published.get(answer["topic_name"])
        is_registered = topic is not None and topic._registration.done()
        await republisher.close()
        return is_registered

    assert bridge.run(request())


def test_transforms_are_sent_by_action_and_by_topic(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(transforms=True)
    node = bridge.node("robot")
    transform = TransformStamped(child_frame_id="camera")
    transform.header.frame_id = "world"
    transform.transform = Transform(Vector3(1.5, 0, 0), Quaternion(0, 0, 0, 1))
    static = bridge.publisher(node, "/tf_static", TFMessage, latch=True)
    bridge.run(static.publish(TFMessage([transform])))

    wanted = {"source_frames": ["/camera"], "target_frame": "world", "rate": 100.0}
    client = bridge.rosbridge()
    answer = client.call("/republish_tfs", {**wanted, "timeout": {"secs": 60, "nsecs": 0}})
    topic = answer["values"]["topic_name"]
    assert topic == "/tf2_web_republisher/tf_repub_0"
    client.send(op="subscribe", topic=topic)
    (found,) = client.next("publish")["msg"]["transforms"]
    assert (found["header"]["frame_id"], found["child_frame_id"]) == ("world", "camera")
    assert found["transform"]["translation"]["x"] == 1.5

    many = {**wanted, "source_frames": ["/camera"] * 1001}
    assert "1000 frames at most" in client.call("/republish_tfs", many)["values"]

    async def refused() -> str:
        async with ActionClient(node, "/tf2_web_republisher", TFSubscriptionAction) as action:
            await action.wait_for_server(30)
            async with action.send(TFSubscriptionGoal(**many)) as goal:  # type: ignore[arg-type]
                with pytest.raises(GoalError) as caught:
                    await goal
                return str(caught.value)

    assert "1000 frames at most" in bridge.run(asyncio.wait_for(refused(), 30))

    async def follow() -> float:
        async with ActionClient(node, "/tf2_web_republisher", TFSubscriptionAction) as action:
            await action.wait_for_server(30)
            async with action.send(TFSubscriptionGoal(**wanted)) as goal:  # type: ignore[arg-type]
                async for feedback in goal:
                    return float(feedback.transforms[0].transform.translation.x)
        raise AssertionError

    assert bridge.run(asyncio.wait_for(follow(), 30)) == 1.5
