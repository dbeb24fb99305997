"""A node with topics, services and parameters of every kind for the tools to show; runs on rospy and on minirospy."""

from __future__ import annotations

from typing import Any
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from geometry_msgs.msg import Point32, PolygonStamped
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import (
    Bool,
    ByteMultiArray,
    Char,
    Duration,
    Empty,
    Float64,
    Int8MultiArray,
    String,
    Time,
    UInt8MultiArray,
)
from std_srvs.srv import Empty as EmptySrv
from std_srvs.srv import SetBool, Trigger

rospy.init_node("scene")
kept: list[object] = []


def latch(topic: str, message: Any) -> None:
    publisher = rospy.Publisher(topic, type(message), queue_size=1, latch=True)
    publisher.publish(message)
    kept.append(publisher)


def connected_topics() -> set[str]:
    with ServerProxy(rospy.get_node_uri() or "") as own:
        answer: Any = own.getBusInfo("/scene")
    return {row[4] for row in answer[2] if row[5]}


def fail(request: object) -> Any:
    raise ValueError("bad thing")


polygon = PolygonStamped()
polygon.header.stamp = rospy.Time(1, 2)
polygon.header.frame_id = "map"
polygon.polygon.points = [Point32(1, 2, 3), Point32(4, 5, 6)]
scan = LaserScan(ranges=[0.1, float("inf"), float("nan"), 1.0], angle_min=-1.5)
joints = JointState(name=["a", "b c", "d,e", "yes", "5", "x: y"], position=[1, 2.5])

latch("/button_state", Bool(True))
latch("/ns/chatter", String('x,"y"\nz: \xe9 \\ \t'))
latch("/poly", polygon)
latch("/scan", scan)
latch("/joints", joints)
latch("/image", Image(data=b"\x01\x02\xff", width=3, encoding="rgb8"))
latch("/duration", Duration(rospy.Duration(-1, 500000000)))
latch("/time", Time(rospy.Time(5, 7)))
latch("/bytes", UInt8MultiArray(data=b"abc"))
latch("/int8s", Int8MultiArray(data=[-1, 2]))
latch("/signed_bytes", ByteMultiArray(data=[1, -2]))
latch("/char", Char(65))
latch("/tiny", Float64(1e-20))
latch("/empty", Empty())
kept.append(rospy.Subscriber("/listen", Bool, lambda message: None))
kept.append(rospy.Subscriber("/button_state", Bool, lambda message: None))
kept.append(rospy.Subscriber("/any", rospy.AnyMsg, lambda message: None))
kept.append(
    rospy.Service("/set_led_state", SetBool, lambda r: {"success": r.data, "message": f"done: {r.data}"})
)
kept.append(rospy.Service("/ns/empty", EmptySrv, lambda request: {}))
kept.append(rospy.Service("/fail", Trigger, fail))
rospy.set_param(
    "/p",
    {
        "i": 5, "f": 1.0, "b": True, "s": "hello world", "n": "5", "e": "", "u": "\xfcn\xef", "ml": "l1\nl2\n",
        "l": [1, "a: b", [2, 3]], "d": {"q": {"r": 1e-7}, "t": "yes"}, "big": 1e20,
    },
)  # fmt: skip
# Wait for the connections that the tools list: the node's own, and that of roscore's rosout node, if it runs.
wanted = {"/button_state", "/rosout"} & {topic for topic, _ in rosgraph.Master("/scene").getSystemState()[1]}
while not wanted <= connected_topics():
    rospy.sleep(0.02)
print("ready", flush=True)
rospy.spin()
