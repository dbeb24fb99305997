"""libgazebo_ros_vacuum_gripper.so: while switched on, it pulls nearby links along with the gripper."""

from __future__ import annotations

import math

from std_msgs.msg import Bool
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from minirospy import client as rospy
from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_ros.physics import SimLink, State
from minirospy.ros.gazebo_ros.plugins import ModelPlugin

__all__ = ["VacuumGripper"]

REACH = 0.05  # m; links whose origin is within this distance of the gripper's are pulled
SNAP = 0.01  # m; links within this distance move to the gripper's origin
MAX_FORCE = 20.0  # N


class VacuumGripper(ModelPlugin):
    """Pulls links to the gripper. Parameters: bodyName, topicName. Services in the plugin's namespace: on, off."""

    def load(self) -> None:
        """Find the link."""
        body, topic = (self.required(tag, "vacuum_gripper plugin") for tag in ("bodyName", "topicName"))
        self._link, _ = self.link(body)
        self._is_on = False
        self._publisher = self.publish_to(topic, Bool)
        self.serve("on", Empty, lambda request: self._switch(request, is_on=True))
        self.serve("off", Empty, lambda request: self._switch(request, is_on=False))

    def update(self) -> None:
        """Pull the links within reach, and publish whether there are any."""
        is_holding = self._is_on and self._attract()
        if self._publisher.get_num_connections():
            self._publisher.publish(Bool(is_holding))

    def _attract(self) -> bool:
        state = self._link.state
        links = [
            link
            for model in self.simulation.models.values()
            if model is not self.model and not model.is_static
            for link in model.links.values()
            if math.dist(link.pose.position, state.pose.position) < REACH
        ]
        for link in links:
            self._pull(link, state)
        return bool(links)

    @staticmethod
    def _pull(link: SimLink, target: State) -> None:
        pose = link.pose
        distance = math.dist(pose.position, target.pose.position)
        if distance < SNAP:
            pose = Pose(target.pose.position, pose.orientation)
        link.set_state(State(pose, target.linear, target.angular))
        if distance > 0:
            force = min(1 / distance, MAX_FORCE) / distance
            x, y, z = (
                force * (end - start)
                for start, end in zip(link.pose.position, target.pose.position, strict=True)
            )
            link.push((x, y, z))

    def _switch(self, _request: EmptyRequest, *, is_on: bool) -> EmptyResponse:
        return self.call(lambda: self._set(is_on))

    def _set(self, is_on: bool) -> EmptyResponse:
        name = "on" if is_on else "off"
        if self._is_on == is_on:
            rospy.logwarn("gazebo_ros_vacuum_gripper: already status is '%s'", name)
        else:
            rospy.loginfo("gazebo_ros_vacuum_gripper: status: %s", "off -> on" if is_on else "on -> off")
        self._is_on = is_on
        return EmptyResponse()
