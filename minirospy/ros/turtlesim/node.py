"""turtlesim_node: receives velocities and service calls, publishes turtles' poses and colours, and draws them in a terminal.

Parameters: ~background_r, ~background_g, ~background_b (69, 86, 255; read when the canvas is cleared), ~headless (false: draw
if stdin and stdout are a terminal). Source: http://wiki.ros.org/turtlesim.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from geometry_msgs.msg import Twist
from std_srvs.srv import Empty, EmptyResponse
from turtlesim.msg import Color as ColorMessage
from turtlesim.msg import Pose as PoseMessage
from turtlesim.srv import (
    Kill,
    KillRequest,
    KillResponse,
    SetPen,
    SetPenRequest,
    SetPenResponse,
    Spawn,
    SpawnRequest,
    SpawnResponse,
    TeleportAbsolute,
    TeleportAbsoluteRequest,
    TeleportAbsoluteResponse,
    TeleportRelative,
    TeleportRelativeRequest,
    TeleportRelativeResponse,
)

from minirospy import client as rospy
from minirospy.base.keyboard import has_own_terminal
from minirospy.base.names import join
from minirospy.ros.turtlesim.canvas import Color
from minirospy.ros.turtlesim.world import BACKGROUND, STEP_SECONDS, Reading, Velocity, World, WorldError

__all__ = ["Simulator", "main"]

_LATE_SECONDS = 0.2  # in seconds; after a longer suspension, the missed steps are skipped

_T = TypeVar("_T")


def main() -> int:
    """Run the node until it shuts down; return the exit status."""
    try:
        rospy.init_node("turtlesim")
        is_headless = bool(rospy.get_param("~headless", False)) or not has_own_terminal(sys.argv)
        simulator = Simulator()
        with contextlib.ExitStack() as drawing:
            if not is_headless:
                from minirospy.ros.turtlesim.view import Screen

                drawing.enter_context(Screen(simulator.world, simulator.lock))
            simulator.start()
            simulator.run()
    except rospy.ROSInterruptException:
        pass
    return 0


def _background() -> Color:
    """Return the background colour set by the parameters. If a parameter is not an integer, return ROS's default colour."""
    values = [rospy.get_param(f"~background_{part}", usual) for part, usual in BACKGROUND._asdict().items()]
    chosen = [
        value & 255 if isinstance(value, int) and not isinstance(value, bool) else usual
        for value, usual in zip(values, BACKGROUND, strict=True)
    ]
    return Color(*chosen)


class Simulator:
    """Connects the world to ROS: the services for all turtles, and each turtle's topics and services."""

    def __init__(self) -> None:
        self.lock = threading.Lock()  # guards the world
        for part, usual in BACKGROUND._asdict().items():
            if not rospy.has_param(f"~background_{part}"):
                rospy.set_param(f"~background_{part}", usual)
        self.world = World(_background())
        # Serialises changes to the set of turtles; the world keeps stepping meanwhile.
        self._changing = threading.Lock()
        self._ends: dict[str, _Ends] = {}
        self._services: list[rospy.Service[object]] = []

    def start(self) -> None:
        """Advertise the services and add the first turtle."""
        with self._changing:  # a concurrent call of /spawn must not add the first turtle
            self._services = [
                rospy.Service("clear", Empty, self._clear),
                rospy.Service("reset", Empty, self._reset),
                rospy.Service("spawn", Spawn, self._spawn),
                rospy.Service("kill", Kill, self._kill),
            ]
            rospy.loginfo("Starting turtlesim with node name %s", rospy.get_name())
            self._add(self.world.spawn_first)

    def run(self) -> None:
        """Step the world every 16 ms of real time until the node shuts down."""
        due = time.monotonic()
        while not rospy.is_shutdown():
            with contextlib.suppress(rospy.ROSException):
                # _step() raises an exception while the node shuts down.
                self._step()
            due += STEP_SECONDS
            late = time.monotonic() - due
            if late < 0:
                time.sleep(-late)
            elif late > _LATE_SECONDS:
                due += late

    def _step(self) -> None:
        with self.lock:
            readings = self.world.step(time.monotonic())
            for reading in readings:
                if ends := self._ends.get(reading.name):
                    ends.publish(reading)
        for reading in readings:
            if reading.warning:
                rospy.logwarn("%s", reading.warning)

    def _add(self, spawn: Callable[[], str]) -> str:
        with self.lock:
            name = spawn()
            x, y, theta = self.world.pose(name)
        if name not in self._ends:
            ends = _Ends(name, self)
            with self.lock:
                self._ends[name] = ends
        rospy.loginfo("Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]", name, x, y, theta)
        return name

    def _remove(self, name: str) -> None:
        with self.lock:
            ends = self._ends.pop(name)
        ends.close()

    def _clear(self, _request: object) -> EmptyResponse:
        rospy.loginfo("Clearing turtlesim.")
        self._wipe()
        return EmptyResponse()

    def _wipe(self) -> None:
        background = _background()
        with self.lock:
            self.world.clear(background)

    def _reset(self, _request: object) -> EmptyResponse:
        rospy.loginfo("Resetting turtlesim.")
        with self._changing:
            with self.lock:
                self.world.remove_all()
            # Reuse the topics of an earlier turtle with the same name, so that existing subscribers receive every message.
            first = self._add(self.world.spawn_first)
            for name in set(self._ends) - {first}:
                self._remove(name)
        self._wipe()
        return EmptyResponse()

    def _spawn(self, request: SpawnRequest) -> SpawnResponse:
        def spawn() -> str:
            spaces = {rospy.resolve_name(name) for name in self.world.names}
            if request.name and rospy.resolve_name(request.name) in spaces:
                # The name may be another spelling of an existing one, such as /turtle1 for turtle1.
                raise WorldError(f"A turtled named [{request.name}] already exists")
            return self.world.spawn(request.name, request.x, request.y, request.theta)

        with self._changing:
            return SpawnResponse(refusing(lambda: self._add(spawn)))

    def _kill(self, request: KillRequest) -> KillResponse:
        with self._changing:
            with self.lock:
                refusing(lambda: self.world.kill(request.name))
            self._remove(request.name)
        return KillResponse()


def refusing(request: Callable[[], _T]) -> _T:
    """Return the result of a request to the world. If the world rejects it, log the error and raise ServiceException."""
    try:
        return request()
    except WorldError as error:
        rospy.logerr("%s", error)
        raise rospy.ServiceException(str(error)) from None


class _Ends:
    """One turtle's topics and services."""

    def __init__(self, name: str, simulator: Simulator) -> None:
        self._name = name
        self._world, self._lock = simulator.world, simulator.lock
        # Resolve the name as a namespace, so that remappings apply and ~ is resolved.
        space = rospy.resolve_name(name)
        self._poses = rospy.Publisher(join(space, "pose"), PoseMessage, queue_size=1)
        self._colors = rospy.Publisher(join(space, "color_sensor"), ColorMessage, queue_size=1)
        self._commands = rospy.Subscriber(join(space, "cmd_vel"), Twist, self._command, queue_size=1)
        self._services: list[rospy.Service[object]] = [
            rospy.Service(join(space, "set_pen"), SetPen, self._set_pen),
            rospy.Service(join(space, "teleport_relative"), TeleportRelative, self._teleport_relative),
            rospy.Service(join(space, "teleport_absolute"), TeleportAbsolute, self._teleport_absolute),
        ]

    def publish(self, reading: Reading) -> None:
        """Publish a turtle's pose and colour."""
        x, y, theta = reading.pose
        self._poses.publish(PoseMessage(x, y, theta, reading.linear, reading.angular))
        self._colors.publish(ColorMessage(*reading.color))

    def close(self) -> None:
        """Unregister all of the turtle's topics and services."""
        self._commands.unregister()
        for service in self._services:
            service.shutdown()
        self._poses.unregister()
        self._colors.unregister()

    def _command(self, twist: Twist) -> None:
        velocity = Velocity(twist.linear.x, twist.linear.y, twist.angular.z)
        try:
            with self._lock:
                self._world.command(self._name, velocity, time.monotonic())
        except WorldError as error:
            rospy.logwarn_throttle(1, f"cmd_vel of [{self._name}] is ignored: {error}")

    def _set_pen(self, request: SetPenRequest) -> SetPenResponse:
        with self._lock:
            color = Color(request.r, request.g, request.b)
            refusing(lambda: self._world.set_pen(self._name, color, request.width, is_off=bool(request.off)))
        return SetPenResponse()

    def _teleport_absolute(self, request: TeleportAbsoluteRequest) -> TeleportAbsoluteResponse:
        with self._lock:
            refusing(lambda: self._world.teleport_absolute(self._name, request.x, request.y, request.theta))
        return TeleportAbsoluteResponse()

    def _teleport_relative(self, request: TeleportRelativeRequest) -> TeleportRelativeResponse:
        with self._lock:
            refusing(lambda: self._world.teleport_relative(self._name, request.linear, request.angular))
        return TeleportRelativeResponse()
