"""libgazebo_ros_joint_pose_trajectory.so: sets joint positions from a trajectory, without forces."""

from __future__ import annotations

from gazebo_msgs.srv import (
    SetJointTrajectory,
    SetJointTrajectoryRequest,
    SetJointTrajectoryResponse,
)
from trajectory_msgs.msg import JointTrajectory

from minirospy import client as rospy
from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_ros.messages import pose_of
from minirospy.ros.gazebo_ros.physics import SimJoint, SimLink, State
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError

__all__ = ["JointPoseTrajectory"]

_WORLD = ("", "world", "map")
_ZERO = (0.0, 0.0, 0.0)


class JointPoseTrajectory(ModelPlugin):
    """Moves a model's joints along a trajectory. Parameters: topicName, serviceName.

    As in Gazebo's plugin, each point is held for its ``time_from_start`` before the next one. While a trajectory runs, the link
    in ``header.frame_id``, or the whole model, keeps its pose. Gazebo's plugin stops the physics of the whole world for that
    time; here, only the model stops.
    """

    def load(self) -> None:
        """Subscribe to the topic."""
        self.reset()
        name = "set_joint_trajectory"
        self.subscribe_to(self.text("topicName", name), JointTrajectory, self._on_message)
        self.serve(self.text("serviceName", name), SetJointTrajectory, self._on_request)

    def reset(self) -> None:
        """End the trajectory."""
        self._message: JointTrajectory | None = None
        self._index = 0
        self._start_ns = 0
        self._joints: list[SimJoint | None] = []
        self._positions: list[float] = []
        self._link: SimLink | None = None
        self._held: Pose | None = None

    def update(self) -> None:
        """Move the joints to the current trajectory point, and hold them until the next one."""
        message = self._message
        if message is None:
            return
        if self.simulation.time_ns < self._start_ns:
            if self._index:
                self._hold()
            return
        if self._index >= len(message.points):
            self.reset()
            return
        point = message.points[self._index]
        if len(point.positions) == len(self._joints):
            self._positions = list(point.positions)
        else:
            rospy.logerr(
                "point[%d] in JointTrajectory has different number of joint names[%d] and positions[%d].",
                self._index,
                len(self._joints),
                len(point.positions),
            )
        self._start_ns += point.time_from_start.to_nsec()
        self._index += 1
        self._hold()

    def _on_message(self, message: JointTrajectory) -> None:
        self.call(lambda: self._begin(message))

    def _on_request(self, request: SetJointTrajectoryRequest) -> SetJointTrajectoryResponse:
        name = request.model_name
        if name not in ("", self.model.name):
            text = f"SetJointTrajectory: this is model '{self.model.name}', not '{name}'"
            return SetJointTrajectoryResponse(success=False, status_message=text)

        def begin() -> bool:
            if request.set_model_pose:
                self.model.set_state(State(pose_of(request.model_pose), _ZERO, _ZERO))
            return self._begin(request.joint_trajectory)

        is_begun = self.call(begin)
        text = "" if is_begun else "SetJointTrajectory: the reference link does not exist"
        return SetJointTrajectoryResponse(success=is_begun, status_message=text)

    def _begin(self, message: JointTrajectory) -> bool:
        self.reset()
        frame = message.header.frame_id.lstrip("/")
        if frame not in _WORLD:
            try:
                self._link, _ = self.link(frame)
            except PluginError:
                rospy.logerr(
                    "ros_joint_trajectory plugin needs a reference link [%s] as frame_id, aborting.\n", frame
                )
                return False
        self._joints = [self.model.joints.get(name) for name in message.joint_names]
        missing = [name for name in message.joint_names if name not in self.model.joints]
        if missing:
            rospy.logwarn("model '%s' has no joints %s: ignored", self.model.name, ", ".join(missing))
        self._held = self._link.pose if self._link is not None else self.model.pose
        self._start_ns = max(message.header.stamp.to_nsec(), self.simulation.time_ns)
        self._message = message
        return True

    def _hold(self) -> None:
        if self._held is None:
            return
        for joint, position in zip(self._joints, self._positions, strict=False):
            if joint is not None:
                joint.set_state(position)
        state = State(self._held, _ZERO, _ZERO)
        if self._link is not None:
            self._link.set_state(state)
        elif not self.model.is_static:
            self.model.set_state(state)
