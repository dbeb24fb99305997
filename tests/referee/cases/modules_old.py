"""Imports of old scripts: roslib.scriptutil's master, which answers with triples, and messages by name."""

import genpy
import genpy.message
import roslib

roslib.load_manifest("std_msgs")
import roslib.message
import roslib.rosenv
import roslib.scriptutil
import rosnode
from geometry_msgs.msg import PolygonStamped, Pose, PoseWithCovariance
from referee import outcome, show
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, UInt8MultiArray

show("# the master")
master = roslib.scriptutil.get_master()
code, text, state = master.getSystemState("/tester")
show(code, text, [len(side) >= 0 for side in state])
show(master.lookupNode("/tester", "/nobody")[0], master.getPublishedTopics("/tester", "/nothing")[::2])
parameters = roslib.scriptutil.get_param_server()
show(parameters.setParam("/tester", "/old", 5)[0], parameters.getParam("/tester", "/old")[::2])
show(
    rosnode._succeed(master.getParam("/tester", "/old")),
    roslib.scriptutil.script_resolve_name("tester", "old"),
)

show("# filling")


def filled(message, values):
    genpy.message.fill_message_args(message, values, keys={"now": genpy.Time(7, 8), "auto": Header(seq=3)})
    return str(message)


for make, values in (
    (Header, [{"seq": 1, "stamp": 5}]),
    (Header, [{"stamp": {"secs": 1, "nsecs": 2}}]),
    (Header, [{"stamp": "now"}]),
    (Header, [1, 5, "f"]),
    (Header, [1]),
    (Header, [{"nope": 1}]),
    (Header, []),
    (Pose, [[1, 2, 3], [0, 0, 0, 1]]),
    (JointState, [{"header": "auto", "name": ["a", "b"], "position": [1, 2]}]),
    (PolygonStamped, [{"polygon": {"points": [{"x": 1}, [1, 2, 3]]}}]),
    (UInt8MultiArray, [{"data": [1, 2, 3]}]),
    (PoseWithCovariance, [{"covariance": [0] * 36}]),
    (PoseWithCovariance, [{"covariance": [0] * 3}]),
):
    outcome(f"{make.__name__} {values}", lambda m=make, v=values: filled(m(), v))
outcome("names", lambda: genpy.message.get_printable_message_args(Pose()))
outcome("class", lambda: roslib.message.get_message_class("std_msgs/Header") is Header)
show(
    roslib.message.strify_message(Header(frame_id="a")),
    roslib.rosenv.get_master_uri(),
)
