"""libgazebo_ros_control.so: a controller manager for a simulated robot.

Parameters: robotNamespace (default: the model's name), robotParam (robot_description), controlPeriod (the step), eStopTopic,
legacyModeNS, robotSimType (only the default). Gains: NAMESPACE/gazebo_ros_control/pid_gains/JOINT.
"""

from __future__ import annotations

import threading
from functools import partial

from std_msgs.msg import Bool

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import UrdfError
from minirospy.base.times import Duration
from minirospy.core.control.controller import ControllerError
from minirospy.core.control.limits import LimitEnforcer
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.pid import Pid, PidGains
from minirospy.core.control.transmissions import Transmission, read_transmissions
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.controller_manager.loop import limits_of_parameters
from minirospy.ros.controller_manager.manager import ControllerManager, find_description
from minirospy.ros.gazebo_ros.messages import time_of
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError
from minirospy.ros.gazebo_ros_control.hardware import SimulatedHardware

__all__ = ["GazeboRosControl"]

_DEFAULT_TYPE = "gazebo_ros_control/DefaultRobotHWSim"
_WARN_SECONDS = 10.0  # seconds between warnings about non-finite commands
_POLL_SECONDS = 0.1  # seconds between checks for the robot description


class GazeboRosControl(ModelPlugin):
    """Runs a control cycle in each control period: reads the joints, updates the controllers and writes the joints."""

    def load(self) -> None:
        """Start once the parameter with the robot description exists."""
        rospy.loginfo("Loading gazebo_ros_control plugin")
        self.default_namespace = self.model.name
        kind = self.text("robotSimType", _DEFAULT_TYPE)
        if kind != _DEFAULT_TYPE:
            rospy.logwarn("%s is not part of minirospy: %s is used", kind, _DEFAULT_TYPE)
        self._parameter = self.text("robotParam", "robot_description")
        self._last_update = self._last_write = 0
        self._was_stopped = self._is_reset = False
        self._manager: ControllerManager | None = None
        self._hardware: SimulatedHardware | None = None
        self._is_closed = SignalSafeEvent()
        step = self.simulation.physics.step
        self._period_ns = round(self.number("controlPeriod", step) * 1e9)
        for is_wrong, log, word in (
            (self._period_ns < round(step * 1e9), rospy.logerr, "faster"),
            (self._period_ns > round(step * 1e9), rospy.logwarn, "slower"),
        ):
            if is_wrong:
                log(
                    f"Desired controller update period ({self._period_ns / 1e9:.9f} s) is {word} than the gazebo "
                    f"simulation period ({step:.9f} s)."
                )
        rospy.loginfo("Starting gazebo_ros_control plugin in namespace: %s", self.namespace or "/")
        if (description := self._find_description()) is not None:
            self._start(description)
            return
        rospy.loginfo(
            "gazebo_ros_control plugin is waiting for model URDF in parameter [%s] on the ROS param server.",
            self._parameter,
        )
        threading.Thread(target=self._wait_for_description, name="robot description", daemon=True).start()

    def _find_description(self) -> str | None:
        return find_description(self.namespace or "/", self._parameter)

    def _wait_for_description(self) -> None:
        while not self._is_closed.wait(_POLL_SECONDS):
            description = self._find_description()
            if description is not None:
                self.call(partial(self._start_later, description))
                return

    def _start_later(self, description: str) -> None:
        if self._is_closed.is_set():
            return
        try:
            self._start(description)
        except PluginError as error:
            rospy.logerr("gazebo_ros_control of model '%s' is not active: %s", self.model.name, error)

    def _start(self, description: str) -> None:
        try:
            robot = parse_robot(description, self._parameter)
            found = read_transmissions(description, lambda line: rospy.logwarn("%s", line), self._parameter)
        except UrdfError as error:
            raise PluginError(str(error)) from error
        namespace = self.namespace or "/"
        hardware = SimulatedHardware(self.model, robot, self._usable(found), self._find_pid)
        limits = limits_of_parameters(hardware, namespace)
        hardware.set_limits(limits)
        self._limits = LimitEnforcer(hardware.joints.values(), limits)
        self._manager = ControllerManager(hardware, namespace)
        if topic := self.text("eStopTopic"):
            self.subscribe_to(topic, Bool, self._on_stop)
        self._hardware = hardware
        self._last_update = self._last_write = self.simulation.time_ns
        rospy.loginfo("Loaded gazebo_ros_control.")

    def _usable(self, transmissions: list[Transmission]) -> list[Transmission]:
        """Return the first transmission of each joint. Raise PluginError if the model has no such joint, or it cannot move."""
        found: dict[str, Transmission] = {}
        for each in transmissions:
            joint = self.model.joints.get(each.joint)
            if joint is None or not joint.has_axis:
                raise PluginError(
                    f'This robot has a joint named "{each.joint}" which is not in the gazebo model.'
                )
            found.setdefault(each.joint, each)
        return list(found.values())

    def _find_pid(self, joint: str) -> Pid | None:
        base = "" if self.flag("legacyModeNS", False) else self.namespace
        namespace = f"{base}/gazebo_ros_control/pid_gains/{joint}"
        values = rospy.get_param(namespace, None)
        if not isinstance(values, dict):
            return None
        try:
            gains = PidGains.read(Parameters(namespace, values))
        except (ControllerError, ValueError) as error:
            rospy.logwarn("%s", error)
            return None
        pid = Pid()
        pid.gains = gains
        return pid

    def _on_stop(self, message: Bool) -> None:
        def stop() -> None:
            if self._hardware is not None:
                self._hardware.is_stopped = message.data

        self.call(stop)

    def update(self) -> None:
        """Run a control cycle if the period has elapsed, and write the commands."""
        manager, hardware = self._manager, self._hardware
        if manager is None or hardware is None:
            return
        now_ns = self.simulation.time_ns
        now = time_of(now_ns)
        if now_ns - self._last_update >= self._period_ns:
            period = Duration(*divmod(now_ns - self._last_update, 1_000_000_000))
            self._last_update = now_ns
            hardware.read(now, period)
            is_reset = self._is_reset or (self._was_stopped and not hardware.is_stopped)
            self._was_stopped, self._is_reset = hardware.is_stopped, False
            manager.update(now, period, is_reset)
            if invalid := self._limits.enforce(period):
                rospy.logwarn_throttle(
                    _WARN_SECONDS,
                    f"model '{self.model.name}': commands that are not finite were replaced, joints: {', '.join(invalid)}",
                )
        hardware.write(now, Duration(*divmod(max(now_ns - self._last_write, 0), 1_000_000_000)))
        self._last_write = now_ns

    def reset(self) -> None:
        """Start new periods now, and let the next update restart the controllers."""
        self._last_update = self._last_write = self.simulation.time_ns
        self._is_reset = True

    def close(self) -> None:
        """Stop the controllers and shut down the controller manager's services."""
        self._is_closed.set()
        if self._manager is not None:
            self._manager.close(self.now)
            self._manager.unregister()
            self._manager = None
        super().close()
