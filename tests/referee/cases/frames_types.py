"""tf and tf2 return Python floats for any input type; wrong arguments, and missing conversions."""

import geometry_msgs.msg as geometry
import numpy
import rospy
import tf
import tf.transformations
import tf2_py
import tf2_ros
from referee import outcome, show


def stamped(child, translation, rotation, seconds=1):
    message = geometry.TransformStamped()
    message.header.frame_id, message.child_frame_id = "map", child
    message.header.stamp = rospy.Time(seconds)
    message.transform.translation = geometry.Vector3(*translation)
    message.transform.rotation = geometry.Quaternion(*rotation)
    return message


rospy.init_node("case", disable_rosout=True)
core = tf2_py.BufferCore(rospy.Duration(10))
core.set_transform(stamped("integers", (1, 2, 3), (0, 0, 0, 1)), "me")
core.set_transform(stamped("numpy", numpy.array([1.5, 2, 3]), numpy.array([0.0, 0, 0, 1])), "me")
core.set_transform_static(stamped("static", (4, 5, 6), (0, 0, 0, 1)), "me")
for child in ("integers", "numpy", "static"):
    for names in (("map", child), (child, "map")):
        found = core.lookup_transform_core(*names, rospy.Time(0)).transform
        show(names, found.translation.x, type(found.translation.z).__name__)
        show(found.rotation.w, type(found.rotation.x).__name__)
for authority in (5, None, b"me"):
    outcome(authority, lambda a=authority: core.set_transform(stamped("x", (1, 2, 3), (0, 0, 0, 1)), a))
    outcome(
        authority, lambda a=authority: core.set_transform_static(stamped("x", (1, 2, 3), (0, 0, 0, 1)), a)
    )
show(core._allFramesAsDot().count("Broadcaster: me"))

transformer = tf.Transformer()
transformer.setTransform(stamped("turned", (1, 2, 3), tf.transformations.quaternion_from_euler(0, 0, 1)))
where, turn = transformer.lookupTransform("map", "turned", rospy.Time(0))
show(where, {type(each).__name__ for each in turn})
outcome("convert", lambda: tf2_ros.convert(5, float))
outcome("convert", lambda: tf2_ros.convert(5, int))
try:
    tf.transformations.shear_from_matrix(numpy.diag([1.0, 2.0, 3.0, 1.0]))
except ValueError as error:
    # The numbers behind it depend on the version of numpy.
    show("shear raises ValueError", str(error).partition("[")[0])
