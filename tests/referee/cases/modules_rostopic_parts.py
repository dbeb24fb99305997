"""rostopic's functions that plot, read paths, and publish, in programs that call them."""

import io
import sys

import rospy
import rostopic
from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped
from referee import outcome, printed, show
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Bool, Empty, Float32, Header, Int8MultiArray, String, UInt8MultiArray

rospy.init_node("parts")
now, offset = rospy.Time(100, 5), rospy.Time(90)

show("# plots")
points = PolygonStamped()
points.polygon.points = [Point32(1, 2, 3), Point32(4, 5, 6)]
points.header.stamp = rospy.Time(95)
no_text = rostopic.create_field_filter(True, False)
no_arrays = rostopic.create_field_filter(False, True)
for value in (
    Bool(True),
    Float32(1.5),
    String("a b"),
    Empty(),
    JointState(name=["a", "b"], position=[1.0, 2.0]),
    points,
    PoseStamped(header=Header(frame_id="map")),
    Image(data=b"ab"),
    UInt8MultiArray(data=b"ab"),
    Int8MultiArray(data=[1, 2]),
    True,
    5,
    "text",
    [1, 2],
    [True, False],
    ["a"],
    [[1]],
    [],
    (1.5, 2.5),
    rospy.Time(3),
    rospy.Duration(3),
    [rospy.Time(91), rospy.Time(92)],
    [Point32(1, 2, 3)],
    None,
    {"a": 1},
):
    label = getattr(value, "_type", repr(value))
    outcome(f"fields {label}", lambda v=value: rostopic._str_plot_fields(v, "f", None))
    outcome(f"values {label}", lambda v=value: rostopic._str_plot(v, current_time=now))
    outcome(f"offset {label}", lambda v=value: rostopic._str_plot(v, offset, now))
    outcome(
        f"parts {label}",
        lambda v=value: (rostopic._sub_str_plot(v, None, None), rostopic._sub_str_plot_fields(v, "f", None)),
    )
for chosen in (no_text, no_arrays):
    outcome(
        "fields", lambda c=chosen: rostopic._str_plot_fields(JointState(name=["a"], position=[1]), "f", c)
    )
    outcome("values", lambda c=chosen: rostopic._str_plot(JointState(name=["a"], position=[1]), None, now, c))
outcome("own time", lambda: rostopic._str_plot(points))
outcome("own time", lambda: rostopic._str_plot(points, offset))

show("# paths")
for text in ("", "1", "-1", "a", "1:", ":", ":2", "1:2:3", "::-1", "a:1", "1:a", "1:2:a", "1:2:3:4"):
    outcome(f"index {text!r}", lambda t=text: rostopic._get_array_index_or_slice_object(t))
for path in ("header/stamp/secs", "header", "nope", "header/nope"):
    outcome(path, lambda p=path: str(rostopic._get_nested_attribute(points, p)))
outcome("strings", lambda: [rostopic._isstring_type(each) for each in (str, bytes, int, str)])
outcome("bytes", lambda: rostopic._convert_getattr(Image(data=b"ab"), "data", "uint8[]"))
outcome("text", lambda: rostopic._convert_getattr(String("ab"), "data", "string"))
outcome(
    "table",
    lambda: rostopic._get_ascii_table(["topic", "rate"], {"topic": ["/a", "/longer"], "rate": ["1.0", "2"]}),
)

show("# what is published")


class Publisher:
    """Prints what is published."""

    def __init__(self):
        self.count = 0

    def publish(self, message):
        self.count += 1
        show("publishes", repr(str(message)))

    def get_num_connections(self):
        return 1


publisher = Publisher()
show(rostopic.SUBSCRIBER_TIMEOUT)
outcome("waits", lambda: rostopic.wait_for_subscriber(publisher, 5))
printed("once", lambda: rostopic.publish_message(publisher, Float32, [1.5], None, True))
printed("once", lambda: rostopic.publish_message(publisher, Float32, [1.5], None, True, True))
printed("wrong", lambda: rostopic.publish_message(publisher, Float32, [1, 2], None, True))
printed("argv", lambda: rostopic.argv_publish(publisher, Float32, [2.5], None, True, False))
message = PoseStamped()
outcome("filled", lambda: rostopic._fillMessageArgs(message, ["auto", [[1, 2, 3], [0, 0, 0, 1]]]))
show(message.header.stamp.secs > 0, message.pose.position.z)

with open("two.yaml", "w") as stream:
    stream.write("data: 1.0\n---\ndata: 2.0\n")
with open("bad.yaml", "w") as stream:
    stream.write("a: [\n")
outcome("documents", lambda: list(rostopic.file_yaml_arg("two.yaml")()))
outcome("no file", lambda: rostopic.file_yaml_arg("/nope.yaml"))
outcome("bad file", lambda: type(rostopic.file_yaml_arg("bad.yaml")).__name__)
printed("file", lambda: rostopic.stdin_publish(publisher, Float32, 50, False, "two.yaml", False))
printed("file", lambda: rostopic.stdin_publish(publisher, Float32, None, True, "two.yaml", False))
printed("no file", lambda: rostopic.stdin_publish(publisher, Float32, None, True, "/nope.yaml", False))

rospy.set_param("/value", {"data": 3.5})
rospy.set_param("/number", 5)
printed("no parameter", lambda: rostopic.param_publish_once(publisher, Float32, "/nope", False))
printed("no parameter", lambda: rostopic.param_publish(publisher, Float32, "/nope", None, False))
printed("wrong parameter", lambda: rostopic.param_publish(publisher, Float32, "/number", None, False))
