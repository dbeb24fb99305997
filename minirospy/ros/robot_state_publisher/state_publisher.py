"""robot_state_publisher: subscribes to joint_states and publishes the frames of a robot's links.

Parameters: ~publish_frequency (at most 50 Hz per joint), ~use_tf_static (true: publish fixed joints once, latched, on
/tf_static; false: on /tf, every period, stamped half a second ahead), ~ignore_timestamp (false), and tf_prefix, searched
from the node's name upwards. Source: http://wiki.ros.org/robot_state_publisher.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from minirospy import client as rospy
from minirospy.base.times import Time
from minirospy.core.urdf.model import JointType, Robot
from minirospy.ros.robot_state_publisher.description import DescriptionError, robot_of_parameter
from minirospy.ros.robot_state_publisher.frames import LinkPose, RobotFrames, prefixed

__all__ = ["StatePublisher", "main"]

_AHEAD = rospy.Duration(0, 500_000_000)
"""Fixed frames on /tf have stamps this far in the future, so that they stay valid until the next message."""

_OLD = rospy.Duration(30)
_CONNECT_SECONDS = 0.5
# Seconds to cache tf_prefix. ROS instead queries the master for each message.
_PREFIX_SECONDS = 1.0


def main(name: str = "robot_state_publisher") -> int:
    """Run the node until it shuts down; return 1 if there is no robot, else 0."""
    try:
        rospy.init_node(name)
        robot = robot_of_parameter()
        _warn_of(robot)
        StatePublisher(RobotFrames(robot))
        rospy.spin()
    except DescriptionError as error:
        for line in error.lines:
            rospy.logerr("%s", line)
        return 1
    except rospy.ROSInterruptException:
        pass
    return 0


def _warn_of(robot: Robot) -> None:
    """Warn, in ROS's words, about features of a robot that frames cannot express."""
    if robot.links[robot.root].inertial:
        rospy.logwarn(
            "The root link %s has an inertia specified in the URDF, but KDL does not support a root link with an inertia.  "
            "As a workaround, you can add an extra dummy link to your URDF.",
            robot.root,
        )
    for joint in robot.joints.values():
        if joint.type in (JointType.PLANAR, JointType.FLOATING):
            rospy.logwarn("Converting unknown joint type of joint '%s' into a fixed joint", joint.name)
        if joint.type is JointType.FLOATING:
            rospy.loginfo(
                "Floating joint. Not adding segment from %s to %s. This TF can not be published based on joint_states info",
                joint.parent,
                joint.child,
            )
    for problem in robot.problems:
        rospy.logwarn("%s (line %d)", problem, problem.line)


class StatePublisher:
    """Publishes a robot's frames on /tf and /tf_static, computed from its joint states."""

    def __init__(self, frames: RobotFrames) -> None:
        self._frames = frames
        frequency = _number("~publish_frequency", 50.0)
        self._period = rospy.Duration.from_sec(1.0 / max(frequency, 1.0))
        self._is_static = bool(rospy.get_param("~use_tf_static", True))
        self._ignores_stamps = bool(rospy.get_param("~ignore_timestamp", False))
        self._prefix = ""
        self._prefix_until = 0.0
        self._last_call = rospy.Time()
        self._published: dict[str, rospy.Time] = {}

        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        if self._is_static:
            self._tf_static = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)
            self._tf_static.publish(TFMessage(self._stamped(frames.fixed(), rospy.Time.now())))
        else:
            self._timer = rospy.Timer(self._period, self._publish_fixed, reset=True)
        # Wait for existing subscribers to connect, so that they receive the first frames.
        self._tf.wait_for_subscribers(timeout=_CONNECT_SECONDS)
        self._subscriber = rospy.Subscriber(
            "joint_states", JointState, self.publish, queue_size=1, tcp_nodelay=True
        )

    def publish(self, state: JointState) -> None:
        """Publish the frames for a joint state, unless frames were last published less than a period ago."""
        if not self._is_valid(state):
            return
        now = rospy.Time.now()
        if self._last_call > now:
            rospy.logwarn(
                "Moved backwards in time (probably because ROS clock was reset), re-publishing joint transforms!"
            )
            self._published.clear()
        stamp = rospy.Time(state.header.stamp.secs, state.header.stamp.nsecs)
        if stamp + _OLD < now:
            rospy.logwarn_throttle(10, f"Received JointState is {(now - stamp).to_sec():f} seconds old.")
        self._last_call = now

        last = min((self._published.get(name, rospy.Time()) for name in state.name), default=now)
        if not self._ignores_stamps and stamp < min(last, now) + self._period:
            return
        # As in ROS, use the first position of a joint that is listed twice.
        positions = dict(zip(reversed(state.name), reversed(state.position), strict=True))
        for name in self._frames.unknown(positions):
            rospy.logwarn_throttle(10, f'Joint state with name: "{name}" was received but not found in URDF')
        self._tf.publish(TFMessage(self._stamped(self._frames.moving(positions), stamp)))
        for name in state.name:
            self._published[name] = stamp

    def _is_valid(self, state: JointState) -> bool:
        if len(state.name) == len(state.position):
            return True
        if not state.position:
            rospy.logwarn_throttle(
                300,
                f'Robot state publisher ignored a JointState message about joint(s) "{state.name[0]}"(,...) whose position '
                "member was empty. This message will not reappear for 300 seconds.",
            )
        else:
            rospy.logerr("Robot state publisher ignored an invalid JointState message")
        return False

    def _publish_fixed(self, _event: object) -> None:
        fixed = self._stamped(self._frames.fixed(), rospy.Time.now() + _AHEAD)
        self._tf.publish(TFMessage(fixed))

    def _stamped(self, poses: Iterable[LinkPose], stamp: Time) -> list[TransformStamped]:
        prefix = self._current_prefix()
        return [
            TransformStamped(
                Header(0, stamp, prefixed(prefix, each.parent)),
                prefixed(prefix, each.child),
                Transform(Vector3(*each.pose.translation), Quaternion(*each.pose.rotation)),
            )
            for each in poses
        ]

    def _current_prefix(self) -> str:
        if time.monotonic() >= self._prefix_until:
            key = rospy.search_param("tf_prefix")
            value = rospy.get_param(key, "") if key else ""
            self._prefix = value if isinstance(value, str) else ""
            self._prefix_until = time.monotonic() + _PREFIX_SECONDS
        return self._prefix


def _number(name: str, default: float) -> float:
    """Return a numeric parameter; if it has another type, return the default, as in roscpp."""
    value = rospy.get_param(name, default)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else default
