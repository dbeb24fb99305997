"""Tools of the programs that test controllers: a node, a robot's hardware, and a controller whose time the program holds."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from rosgraph_msgs.msg import Clock

from minirospy.base.errors import MinirospyError
from minirospy.core.control.controller import ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import COMMAND_INTERFACES, RobotHardware
from minirospy.core.control.parameters import Parameters
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.controller_manager.plugins import find_plugins

rospy.init_node("rig", argv=[])

_JOINTS = (
    ("lift", "prismatic", '<limit lower="0" upper="1" effort="5" velocity="1"/>'),
    ("elbow", "revolute", '<limit lower="-3.1" upper="3.1" effort="5" velocity="1"/>'),
    ("wrist", "continuous", ""),
)
_LINKS = "".join(
    f'<link name="{name}_link"/><joint name="{name}" type="{kind}"><parent link="base"/><child link="{name}_link"/>'
    f'<axis xyz="0 0 1"/>{limit}</joint>'
    for name, kind, limit in _JOINTS
)
ARM = f'<robot name="r"><link name="base"/>{_LINKS}</robot>'


def show(value: object) -> None:
    """Print the value that the test gets."""
    print(json.dumps(value))


class Received:
    """The messages of a topic."""

    def __init__(self, topic: str, message_class: Any) -> None:
        self._changed = threading.Condition()
        self.messages: list[Any] = []
        self._subscriber = rospy.Subscriber(topic, message_class, self._receive)

    def _receive(self, message: Any) -> None:
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait(self, count: int = 1) -> Any:
        """Wait until this many messages have arrived; return the last."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.messages) >= count, 30), self.messages
            return self.messages[-1]


class Publisher:
    """A topic that is connected to its subscriber."""

    def __init__(self, topic: str, message_class: Any) -> None:
        self._publisher = rospy.Publisher(topic, message_class, queue_size=10)
        wait_until(lambda: self._publisher.get_num_connections() > 0)

    def send(self, message: Any, has_arrived: Callable[[], bool]) -> None:
        """Publish a message and wait for its effect."""
        self._publisher.publish(message)
        wait_until(has_arrived)


class Rig:
    """A robot of joints with all interfaces, and one controller ``/c``. Time starts at 100 s, and ``cycle`` advances it."""

    def __init__(
        self,
        kind: str,
        parameters: Mapping[str, Any],
        joints: str,
        urdf: str = "",
        hardware: RobotHardware | None = None,
    ) -> None:
        self.hardware = hardware or RobotHardware()
        for name in joints.split():
            self.hardware.add_joint(name, *COMMAND_INTERFACES)
        rospy.set_param("/c", dict(parameters))
        self.resources = Resources(self.hardware)
        self.nanoseconds = 100_000_000_000
        self._clock: Publisher | None = None
        self.controller: Any = find_plugins()[kind].load()()
        self._urdf = urdf
        self.context = ControllerContext("/c", "/", "c", Parameters("/c", parameters), self._robot)
        try:
            self.controller.init(self.resources, self.context)
        except Exception:
            self.controller.close()
            raise

    def _robot(self) -> Any:
        if not self._urdf:
            raise ControllerError("Could not find parameter robot_description on parameter server")
        return parse_robot(self._urdf)

    @property
    def now(self) -> rospy.Time:
        """The held time."""
        return rospy.Time(*divmod(self.nanoseconds, 1_000_000_000))

    def show_time(self) -> None:
        """Publish the held time on /clock, and wait until the node has it. Do nothing in a node with wall time."""
        if rospy.rostime.is_wallclock():
            return
        if self._clock is None:
            self._clock = Publisher("/clock", Clock)
        self._clock.send(Clock(self.now), lambda: bool(rospy.get_rostime() == self.now))

    def joint(self, name: str) -> Any:
        """Return a joint."""
        return self.hardware.joints[name]

    def start(self) -> None:
        """Start the controller."""
        self.controller.starting(self.now)

    def cycle(self, count: int = 1, milliseconds: int = 10) -> None:
        """Update the controller in this many cycles."""
        for _ in range(count):
            self.nanoseconds += milliseconds * 1_000_000
            self.controller.update(self.now, rospy.Duration(0, milliseconds * 1_000_000))


def failure(call: Callable[[], object]) -> str:
    """Return the text of the error that a call raises."""
    try:
        call()
    except (MinirospyError, ValueError) as error:
        return str(error)
    raise AssertionError("no error")


class Logged(logging.Handler):
    """The lines that the node logs from now on."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.lines: list[str] = []
        logging.getLogger("rosout").addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Add a line."""
        self.lines.append(f"{record.levelname}: {record.getMessage()}")

    def has(self, count: int) -> Callable[[], bool]:
        """Return a condition: this many lines have been logged."""
        return lambda: len(self.lines) >= count


def wait_until(condition: Any) -> None:
    """Wait until a condition holds."""
    for _ in range(3000):
        if condition():
            return
        threading.Event().wait(0.01)
    raise AssertionError("the condition does not become true")
