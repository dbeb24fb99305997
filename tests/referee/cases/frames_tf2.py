"""tf2_ros: buffers, and the types that tf2_geometry_msgs and tf2_sensor_msgs register."""

import struct

import geometry_msgs.msg as geometry
import rospy
import sensor_msgs.msg as sensor
import tf2_geometry_msgs
import tf2_py
import tf2_ros
import tf2_sensor_msgs.tf2_sensor_msgs
from referee import outcome, show
from tf2_msgs.srv import FrameGraph


def near(value):
    if isinstance(value, float):
        return f"{round(value, 9) + 0.0:.9f}"
    if isinstance(value, (tuple, list)):
        return [near(each) for each in value]
    if hasattr(value, "__slots__"):
        return [near(getattr(value, name)) for name in value.__slots__]
    return str(value)


def stamped(parent, child, seconds, x, z=0.0, w=1.0):
    message = geometry.TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = rospy.Time(seconds)
    message.transform.translation.x = x
    message.transform.rotation.z, message.transform.rotation.w = z, w
    return message


rospy.init_node("case", disable_rosout=True)
buffer = tf2_ros.Buffer(rospy.Duration(30))
for seconds in (1, 2, 3):
    buffer.set_transform(stamped("map", "base", seconds, float(seconds), 0.6, 0.8), "me")
buffer.set_transform_static(stamped("base", "laser", 0, 0.5), "static")
now = rospy.Time(0)
show(rospy.ServiceProxy("/case/tf2_frames", FrameGraph)().frame_yaml)

show(near(buffer.lookup_transform("map", "laser", now)))
show(near(buffer.lookup_transform("map", "laser", rospy.Time(1, 500000000), rospy.Duration(1))))
show(
    near(
        buffer.lookup_transform_full("laser", rospy.Time(3), "laser", rospy.Time(1), "map", rospy.Duration(1))
    )
)
short = rospy.Duration(0, 50000000)
outcome("late", lambda: buffer.lookup_transform("map", "laser", rospy.Time(5), short))
outcome("unknown", lambda: buffer.lookup_transform_full("map", now, "no", now, "map", short))
show(buffer.can_transform("map", "laser", now), buffer.can_transform("map", "no", now, short))
show(buffer.can_transform("map", "laser", rospy.Time(5), short, True))
show(buffer.can_transform_full("map", now, "laser", now, "base"))
show(buffer.can_transform_full("map", now, "no", now, "base", short, return_debug_tuple=True))

header = geometry.PointStamped().header
header.frame_id, header.stamp, header.seq = "laser", rospy.Time(2), 7
quaternion = geometry.Quaternion(0.0, 0.6, 0.0, 0.8)
for thing in (
    geometry.PointStamped(header, geometry.Point(1, 2, 3)),
    geometry.Vector3Stamped(header, geometry.Vector3(1, 2, 3)),
    geometry.PoseStamped(header, geometry.Pose(geometry.Point(1, 2, 3), quaternion)),
    geometry.WrenchStamped(header, geometry.Wrench(geometry.Vector3(1, 2, 3), geometry.Vector3(4, 5, 6))),
):
    moved = buffer.transform(thing, "map")
    show(type(moved).__name__, near(moved))
    show(near(buffer.transform_full(thing, "laser", rospy.Time(3), "map")))
point = geometry.PointStamped(header, geometry.Point(1, 2, 3))
show(near(buffer.transform(point, "map", new_type=geometry.PointStamped)))
outcome("not registered", lambda: buffer.transform(geometry.TwistStamped(header), "map"))
outcome("not convertible", lambda: buffer.transform(point, "map", new_type=geometry.Twist))
show(near(tf2_geometry_msgs.do_transform_point(point, buffer.lookup_transform("map", "laser", now))))

fields = [
    sensor.PointField(name, 4 * n, sensor.PointField.FLOAT32, 1)
    for n, name in enumerate(("x", "y", "z", "i"))
]
data = struct.pack("<12f", 1, 2, 3, 10, 4, 5, 6, 11, 7, 8, 9, 12)
cloud = sensor.PointCloud2(header, 1, 3, fields, False, 16, 48, data, True)
moved = tf2_sensor_msgs.tf2_sensor_msgs.do_transform_cloud(
    cloud, buffer.lookup_transform("map", "laser", now)
)
show(moved.header.frame_id, moved.height, moved.width, moved.point_step, moved.row_step, len(moved.fields))
show([round(each, 4) + 0.0 for each in struct.unpack("<12f", moved.data)])
show([round(each, 4) + 0.0 for each in struct.unpack("<12f", buffer.transform(cloud, "map").data)])
fields[3] = sensor.PointField("i", 14, sensor.PointField.UINT16, 1)
data = struct.pack(">3fHHI", 1, 2, 3, 9, 10, 11)
cloud = sensor.PointCloud2(header, 1, 1, fields, True, 20, 20, data, True)
moved = buffer.transform(cloud, "map")
show(moved.is_dense, moved.is_bigendian, moved.point_step, moved.row_step, bytes(moved.data[12:]).hex())

for name in ("TransformException", "LookupException", "ExtrapolationException", "TimeoutException"):
    kind = getattr(tf2_ros, name)
    show(name, kind is getattr(tf2_py, name), [each.__name__ for each in kind.__mro__], kind.__module__)
show(tf2_ros.TypeException("text").errstr, tf2_ros.NotImplementedException().errstr)
show(near(tf2_ros.Stamped(geometry.PointStamped(), rospy.Time(3), "frame").header.frame_id))
outcome("interface", lambda: tf2_ros.BufferInterface().lookup_transform("a", "b", now))
outcome("time", lambda: buffer.lookup_transform("map", "base", 5.0))

listener = tf2_ros.TransformListener(buffer)
broadcaster, static = tf2_ros.TransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
while broadcaster.pub_tf.get_num_connections() < 1 or static.pub_tf.get_num_connections() < 1:
    rospy.sleep(0.01)
broadcaster.sendTransform(stamped("map", "robot", 8, 4.0))
broadcaster.sendTransform([stamped("map", "robot", 9, 5.0), stamped("robot", "arm", 9, 1.0)])
static.sendTransform(stamped("arm", "hand", 0, 0.25))
show(near(buffer.lookup_transform("map", "hand", rospy.Time(9), rospy.Duration(30))))
