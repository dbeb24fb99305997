"""static_transform_publisher: tf's program publishes periodically on /tf, tf2_ros's once on /tf_static, latched.

Source: http://wiki.ros.org/tf#static_transform_publisher, http://wiki.ros.org/tf2_ros#static_transform_publisher.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.core.urdf.poses import quaternion_from_rpy
from minirospy.core.urdf.values import NotANumberError, as_float
from minirospy.ros.tf2_ros.tf2_ros.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["main_tf", "main_tf2"]

_NAME = "static_transform_publisher"
_WRONG_COUNT = f"{_NAME} exited due to not having the right number of arguments"
_ABOUT = """
This transform is the transform of the coordinate frame from frame_id into the coordinate frame 
of the child_frame_id.  """  # noqa: W291 - as ROS prints it
_TF_USAGE = f"""\
A command line utility for manually sending a transform.
It will periodicaly republish the given transform. 
Usage: {_NAME} x y z yaw pitch roll frame_id child_frame_id  period(milliseconds) 
OR 
Usage: {_NAME} x y z qx qy qz qw frame_id child_frame_id  period(milliseconds) 
{_ABOUT}"""  # noqa: W291
_TF2_USAGE = f"""\
A command line utility for manually sending a transform.
Usage: {_NAME} x y z qx qy qz qw frame_id child_frame_id 
OR 
Usage: {_NAME} x y z yaw pitch roll frame_id child_frame_id 
OR 
Usage: {_NAME} /param_name 
{_ABOUT}"""  # noqa: W291

_MIN_PERIOD = 0.001
"""Minimum period in seconds: a period of 0 would overload this process and all listeners."""
_TOLERANCE = 0.01
"""Maximum deviation of a quaternion's squared length from 1: listeners reject a transform that exceeds it."""


def main_tf(words: Sequence[str] | None = None) -> int:
    """Run tf's program: x y z and a yaw pitch roll or a quaternion, then FRAME CHILD PERIOD_MS; return the exit status."""
    return run_program(_run_tf, words)


def main_tf2(words: Sequence[str] | None = None) -> int:
    """Run tf2_ros's program, whose arguments are those of tf's without the period, or a parameter; return the exit status."""
    return run_program(_run_tf2, words)


def _run_tf(words: Sequence[str]) -> None:
    if len(words) not in (9, 10):
        raise ToolError(_WRONG_COUNT, text=_TF_USAGE)
    *numbers, parent, child, period = words
    transform = _transform(numbers, parent, child)
    seconds = max(_number(period, "period"), 1000 * _MIN_PERIOD) / 1000

    rospy.init_node(_NAME, anonymous=True)
    broadcaster = TransformBroadcaster()
    # Stamp the transform in the future, so that it stays valid until the next message.
    ahead = rospy.Duration.from_sec(seconds)
    broadcaster.pub_tf.wait_for_subscribers(timeout=seconds)
    while not rospy.is_shutdown():
        transform.header.stamp = rospy.Time.now() + ahead
        broadcaster.sendTransform(transform)
        try:
            rospy.sleep(seconds)
        except rospy.ROSTimeMovedBackwardsException:
            pass


def _run_tf2(words: Sequence[str]) -> None:
    if len(words) not in (1, 8, 9):
        raise ToolError(_WRONG_COUNT, text=_TF2_USAGE)
    if len(words) > 1:
        *numbers, parent, child = words
        transform = _transform(numbers, parent, child)
    rospy.init_node(_NAME, anonymous=True)
    if len(words) == 1:
        transform = _transform_of_parameter(words[0])

    transform.header.stamp = rospy.Time.now()
    StaticTransformBroadcaster().sendTransform(transform)
    rospy.loginfo(
        "Spinning until killed publishing %s to %s", transform.header.frame_id, transform.child_frame_id
    )
    rospy.spin()


def _transform(numbers: Sequence[str], parent: str, child: str) -> TransformStamped:
    """Return the transform for the numbers x y z yaw pitch roll, or x y z qx qy qz qw.

    Raise ToolError if the arguments are invalid.
    """
    x, y, z, *turn = (
        _number(number, what) for number, what in zip(numbers, _names(len(numbers)), strict=True)
    )
    if len(turn) == 3:
        yaw, pitch, roll = turn
        rotation = quaternion_from_rpy(roll, pitch, yaw)
    else:
        qx, qy, qz, qw = turn
        rotation = (qx, qy, qz, qw)
    return _checked(
        TransformStamped(Header(frame_id=parent), child, Transform(Vector3(x, y, z), Quaternion(*rotation)))
    )


def _names(count: int) -> tuple[str, ...]:
    turn = ("yaw", "pitch", "roll") if count == 6 else ("qx", "qy", "qz", "qw")
    return ("x", "y", "z", *turn)


def _number(text: str, what: str) -> float:
    try:
        return as_float(text)
    except NotANumberError:
        raise ToolError(f"{what} is [{text}], which is not a number") from None


def _checked(transform: TransformStamped) -> TransformStamped:
    """Return the transform unchanged. Raise ToolError if listeners would reject it."""
    parent, child = transform.header.frame_id, transform.child_frame_id
    # Compare without leading slashes, which listeners ignore.
    if parent.removeprefix("/") == child.removeprefix("/"):
        why = f"target_frame and source frame are the same ({parent}, {child}) this cannot work"
        raise ToolError(why, level="FATAL", status=1)
    if not parent or not child:
        raise ToolError("the name of a frame is empty: listeners would ignore it", level="FATAL", status=1)
    q = transform.transform.rotation
    if not abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < _TOLERANCE:
        shown = f"{q.x:g} {q.y:g} {q.z:g} {q.w:g}"
        why = f"the quaternion ({shown}) is not of length 1: listeners would ignore it"
        raise ToolError(why, level="FATAL", status=1)
    return transform


def _transform_of_parameter(name: str) -> TransformStamped:
    """Return the transform stored in a parameter with the fields of a TransformStamped.

    Raise ToolError if the parameter is not set or invalid.
    """
    rospy.loginfo("Looking for TF in parameter: %s", name)
    try:
        value = rospy.get_param(name, None)
    except (MinirospyError, rospy.ROSException) as error:
        raise ToolError(f"Could not read TF from parameter server: {name}: {error}", level="FATAL") from error
    if not isinstance(value, Mapping):
        raise ToolError(f"Could not read TF from parameter server: {name}", level="FATAL")

    try:
        translation, rotation = value["transform"]["translation"], value["transform"]["rotation"]
        place = Vector3(*(float(translation[key]) for key in "xyz"))
        turn = Quaternion(*(float(rotation[key]) for key in "xyzw"))
        parent, child = value["header"]["frame_id"], value["child_frame_id"]
        if not isinstance(parent, str) or not isinstance(child, str):
            raise TypeError("frame_id and child_frame_id are texts")
    except (KeyError, TypeError, ValueError) as error:
        lacks = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        why = f"Could not validate XmlRpcC for TF data: {value}: {lacks}"
        raise ToolError(why, level="FATAL") from error
    return _checked(TransformStamped(Header(frame_id=parent), child, Transform(place, turn)))
