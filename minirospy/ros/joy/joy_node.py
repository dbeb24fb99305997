"""joy_node: publishes a joystick as `joy` (sensor_msgs/Joy), and its state on /diagnostics.

`joy/set_feedback` (sensor_msgs/JoyFeedbackArray) runs the joystick's motors: ID 0 is the strong one, any other ID the weak
one.

Parameters: ~dev (/dev/input/js0), ~dev_ff (the event device that belongs to ~dev), ~dev_name, ~deadzone (0.05),
~autorepeat_rate (0: none), ~coalesce_interval (0.001 s), ~default_trig_val, ~sticky_buttons (false).
Source: http://wiki.ros.org/joy.
"""

from __future__ import annotations

import math
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import Joy, JoyFeedback, JoyFeedbackArray

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.ros.joy.devices import Device, DeviceError, find_by_name, open_device
from minirospy.ros.joy.joystick import Joystick, JoystickOptions
from minirospy.ros.joy.rumble import RumbleError

__all__ = ["JoyNode", "Motors", "main"]

_LOOK_SECONDS = 0.2  # maximum seconds until the node notices a shutdown

_RETRY_SECONDS = 1.0
_DIAGNOSTIC_SECONDS = 1.0
# Seconds between motor commands: half the time for which the device runs the motors per command.
_RUMBLE_SECONDS = 0.5


def main() -> int:
    """Run the node until it shuts down; return the exit status."""
    try:
        rospy.init_node("joy_node")
        JoyNode().run()
    except rospy.ROSInterruptException:
        pass
    rospy.loginfo("joy_node shut down.")
    return 0


def _number(name: str, default: float) -> float:
    value = rospy.get_param(name, default)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else default


def _flag(name: str) -> bool:
    value = rospy.get_param(name, False)
    return value if isinstance(value, bool) else False


class JoyNode:
    """Opens the device, reopens it after a disconnection, and publishes its state."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("joy", Joy, queue_size=1)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
        self._motors = Motors()
        self._feedback_path = str(rospy.get_param("~dev_ff", ""))
        options = JoystickOptions(
            _number("~deadzone", 0.05),
            _number("~autorepeat_rate", 0.0),
            _number("~coalesce_interval", 0.001),
            _flag("~default_trig_val"),
            _flag("~sticky_buttons"),
        )
        self._options, warnings = options.checked()
        for line in warnings:
            rospy.logwarn("%s", line)
        self._device_name = str(rospy.get_param("~dev_name", ""))
        self._path = self._chosen_path()
        self._is_open = False
        self._ended = SignalSafeEvent()
        rospy.on_shutdown(self._ended.set)
        self._events = self._published = 0
        self._last_diagnostics = time.monotonic()
        rospy.Subscriber("joy/set_feedback", JoyFeedbackArray, self._motors.set)

    def _chosen_path(self) -> str:
        if self._device_name:
            for name, path in find_by_name():
                rospy.loginfo("Found joystick: %s (%s).", name, path)
                if name == self._device_name:
                    rospy.loginfo("Using %s as joystick device.", path)
                    return path
            rospy.logerr(
                "Couldn't find a joystick with name %s. Falling back to default device.", self._device_name
            )
        return str(rospy.get_param("~dev", "/dev/input/js0"))

    def run(self) -> None:
        """Publish until the node shuts down."""
        while not rospy.is_shutdown():
            self._report()
            device = self._open()
            if device is None:
                return
            try:
                self._follow(device)
            except DeviceError:
                self._is_open = False
                if not rospy.is_shutdown():
                    rospy.logerr("Connection to joystick device lost unexpectedly. Will reopen.")
            finally:
                device.close()

    def _open(self) -> Device | None:
        """Wait until the device can be opened and return it; return None at shutdown."""
        is_first = True
        while not rospy.is_shutdown():
            try:
                device = open_device(self._path, self._feedback_path)
            except DeviceError as error:
                if is_first:
                    text = "Couldn't open joystick %s. Will retry every second. (%s)"
                    rospy.logerr(text, self._path, error)
                is_first = False
                self._report_if_due()
                self._ended.wait(_RETRY_SECONDS)
                continue
            name, deadzone = device.name, self._options.deadzone
            rospy.loginfo("Opened joystick: %s (%s). deadzone_: %f.", self._path, name, deadzone)
            self._is_open = True
            self._report()
            return device
        return None

    def _follow(self, device: Device) -> None:
        """Publish a device's events until the node shuts down. Raise DeviceError if the device is lost."""
        joystick = Joystick(self._options, time.monotonic())
        while not rospy.is_shutdown():
            now = time.monotonic()
            self._motors.run(device, now)
            left = _LOOK_SECONDS if joystick.deadline is None else joystick.deadline - now
            event = device.wait(min(max(left, 0.0), _LOOK_SECONDS))
            now = time.monotonic()
            if event is None:
                is_due = joystick.is_due(now)
            else:
                self._events += 1
                try:
                    is_due = joystick.handle(event, now)
                except ValueError as error:
                    rospy.logwarn("joy_node: %s", error)
                    continue
            if is_due:
                self._publish(joystick)
            self._report_if_due()

    def _publish(self, joystick: Joystick) -> None:
        message = Joy(axes=list(joystick.axes), buttons=list(joystick.buttons))
        message.header.stamp = rospy.Time.now()
        message.header.frame_id = self._path
        self._publisher.publish(message)
        self._published += 1

    def _report_if_due(self) -> None:
        if time.monotonic() >= self._last_diagnostics + _DIAGNOSTIC_SECONDS:
            self._report()

    def _report(self) -> None:
        now = time.monotonic()
        seconds = max(now - self._last_diagnostics, 1e-9)
        options = self._options
        values = {
            "topic": self._publisher.resolved_name,
            "device": self._path,
            "device name": self._device_name,
            "dead zone": f"{options.deadzone:g}",
            "autorepeat rate (Hz)": f"{options.autorepeat_rate:g}",
            "coalesce interval (s)": f"{options.coalesce_interval:g}",
            "recent joystick event rate (Hz)": f"{self._events / seconds:g}",
            "recent publication rate (Hz)": f"{self._published / seconds:g}",
            "subscribers": str(self._publisher.get_num_connections()),
            "default trig val": str(options.default_trig_val),
            "sticky buttons": str(options.sticky_buttons),
        }

        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if self._is_open else DiagnosticStatus.ERROR,
            name=f"{rospy.get_name().lstrip('/')}: Joystick Driver Status",
            message="OK" if self._is_open else "Joystick not open.",
            hardware_id="none",
            values=[KeyValue(key, value) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
        self._events = self._published = 0
        self._last_diagnostics = now


class Motors:
    """The joystick's motors, in the state requested on `joy/set_feedback`.

    As in the real node, they run until a message changes that state.
    """

    def __init__(self) -> None:
        self._wanted = (0.0, 0.0)
        self._running = (0.0, 0.0)
        self._again = 0.0

    def set(self, message: JoyFeedbackArray) -> None:
        """Process a message: use each motor's last intensity (0 to 1) and ignore other feedback."""
        strong, weak = self._wanted
        for each in message.array:
            if each.type == JoyFeedback.TYPE_RUMBLE and not math.isnan(each.intensity):
                strong, weak = (each.intensity, weak) if each.id == 0 else (strong, each.intensity)
        self._wanted = strong, weak

    def run(self, device: Device, now: float) -> None:
        """Apply the requested state; restart the motors before the device stops them. ``now`` is in seconds."""
        wanted = self._wanted
        if wanted == self._running and (wanted == (0.0, 0.0) or now < self._again):
            return
        self._running, self._again = wanted, now + _RUMBLE_SECONDS
        try:
            device.rumble(*wanted)
        except RumbleError as error:
            rospy.logwarn_throttle(60, f"joy_node: the joystick does not rumble: {error}")
