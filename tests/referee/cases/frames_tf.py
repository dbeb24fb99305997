"""tf: the older API, without a node's topics: transformers of tuples and of messages."""

import geometry_msgs.msg as geometry
import rospy
import sensor_msgs.msg
import tf
import tf.transformations
from referee import outcome, show


def near(value):
    if isinstance(value, float):
        return f"{round(value, 9) + 0.0:.9f}"
    if isinstance(value, (tuple, list)):
        return [near(each) for each in value]
    return value


def stamped(parent, child, seconds, translation, angles):
    message = geometry.TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = rospy.Time(seconds)
    message.transform.translation = geometry.Vector3(*translation)
    message.transform.rotation = geometry.Quaternion(
        *tf.transformations.quaternion_from_euler(*angles).tolist()
    )
    return message


rospy.init_node("case", disable_rosout=True)
transformer = tf.TransformerROS(True, rospy.Duration(20))
for seconds in (1, 2, 3, 4):
    transformer.setTransform(stamped("/map", "base", seconds, (seconds, 2.0, 0.5), (0.1, 0.2, seconds * 0.3)))
    transformer.setTransform(
        stamped("base", "laser", seconds, (0.1, seconds * 0.1, 0.3), (0.0, 0.5, 0.0)), "me"
    )
now = rospy.Time(0)
between = rospy.Time(2, 500000000)

for time in (now, between, rospy.Time(9)):
    outcome("lookup", lambda t=time: near(transformer.lookupTransform("/map", "/laser", t)))
    show(transformer.canTransform("map", "/laser", time))
outcome(
    "full",
    lambda: near(transformer.lookupTransformFull("/laser", rospy.Time(3), "base", rospy.Time(1), "/map")),
)
outcome("nowhere", lambda: transformer.lookupTransform("/map", "nowhere", now))
show(transformer.canTransformFull("/laser", rospy.Time(3), "base", rospy.Time(1), "/map"))
show(transformer.frameExists("base"), transformer.frameExists("map"), sorted(transformer.getFrameStrings()))
show(transformer.getLatestCommonTime("/map", "/laser"), transformer.chain("map", now, "laser", now, "base"))
show(transformer.allFramesAsString(), transformer.allFramesAsDot(), transformer.getTFPrefix())
show(transformer.allFramesAsDot(rospy.Time(5)).count("sec old"))
outcome("twist", lambda: near(transformer.lookupTwist("laser", "map", rospy.Time(0), rospy.Duration(1))))
outcome("twist", lambda: near(transformer.lookupTwist("base", "map", rospy.Time(2), rospy.Duration(1))))
outcome(
    "full twist",
    lambda: near(
        transformer.lookupTwistFull(
            "laser", "map", "base", (0, 0, 0), "laser", rospy.Time(3), rospy.Duration(0, 500000000)
        )
    ),
)
outcome("wait", lambda: transformer.waitForTransform("map", "laser", now, rospy.Duration(1)))
transformer.setUsingDedicatedThread(True)
outcome("wait", lambda: transformer.waitForTransform("map", "laser", now, rospy.Duration(1)))
outcome("wait", lambda: transformer.waitForTransform("map", "nowhere", now, rospy.Duration(0, 50000000)))
outcome(
    "wait",
    lambda: transformer.waitForTransformFull("map", now, "no", now, "map", rospy.Duration(0, 50000000), None),
)

header = geometry.PointStamped().header
header.frame_id, header.stamp = "/laser", between
point = geometry.PointStamped(header, geometry.Point(1, 2, 3))
moved = transformer.transformPoint("map", point)
show(moved.header.frame_id, moved.header.stamp, near([moved.point.x, moved.point.y, moved.point.z]))
turned = transformer.transformVector3("/map", geometry.Vector3Stamped(header, geometry.Vector3(1, 2, 3)))
show(turned.header.frame_id, near([turned.vector.x, turned.vector.y, turned.vector.z]))
quaternion = geometry.Quaternion(0.0, 0.6, 0.0, 0.8)
orientation = transformer.transformQuaternion(
    "map", geometry.QuaternionStamped(header, quaternion)
).quaternion
show(near([orientation.x, orientation.y, orientation.z, orientation.w]))
pose = transformer.transformPose(
    "map", geometry.PoseStamped(header, geometry.Pose(geometry.Point(1, 2, 3), quaternion))
)
where, turn = pose.pose.position, pose.pose.orientation
show(near([where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w]), pose.header.frame_id)
cloud = sensor_msgs.msg.PointCloud(
    header=header, points=[geometry.Point32(1, 2, 3), geometry.Point32(0, 0, 0)]
)
for each in transformer.transformPointCloud("map", cloud).points:
    show(type(each).__name__, near([each.x, each.y, each.z]))
show(near(transformer.asMatrix("map", header).tolist()))
show(near(transformer.fromTranslationRotation((1, 2, 3), (0.0, 0.0, 0.6, 0.8)).tolist()))
transformer.clear()
outcome("cleared", lambda: transformer.lookupTransform("/map", "/laser", now))

for name in ("Exception", "LookupException", "ConnectivityException", "ExtrapolationException"):
    show(name, getattr(tf, name).__name__, issubclass(getattr(tf, name), tf.Exception))
listener = tf.TransformListener(True, rospy.Duration(5))
broadcaster = tf.TransformBroadcaster()
while broadcaster.tf2_broadcaster.pub_tf.get_num_connections() < 1:
    rospy.sleep(0.01)
broadcaster.sendTransform((1, 2, 3), (0.0, 0.0, 0.6, 0.8), rospy.Time(7), "child", "parent")
listener.waitForTransform("parent", "child", rospy.Time(7), rospy.Duration(30))
show(near(listener.lookupTransform("/parent", "child", rospy.Time(0))))
