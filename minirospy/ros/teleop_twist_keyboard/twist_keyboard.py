"""teleop_twist_keyboard: converts terminal keys to `cmd_vel`.

Parameters: ~speed (0.5), ~turn (1.0), ~speed_limit, ~turn_limit (1000), ~repeat_rate (0: only when something changes),
~key_timeout (0.5 s without a key: stop), ~stamped (false: Twist), ~frame_id. Source:
http://wiki.ros.org/teleop_twist_keyboard.
"""

from __future__ import annotations

import sys
import threading
import time
from typing import NamedTuple

from geometry_msgs.msg import Twist, TwistStamped

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.base.keyboard import LOOK_SECONDS, Keys

__all__ = ["HELP", "Direction", "KeyTeleop", "main"]

HELP = """
Reading from the keyboard  and Publishing to Twist!
---------------------------
Moving around:
   u    i    o
   j    k    l
   m    ,    .

For Holonomic mode (strafing), hold down the shift key:
---------------------------
   U    I    O
   J    K    L
   M    <    >

t : up (+z)
b : down (-z)

anything else : stop

q/z : increase/decrease max speeds by 10%
w/x : increase/decrease only linear speed by 10%
e/c : increase/decrease only angular speed by 10%

CTRL-C to quit
"""

_HELP_EVERY = 15  # the help text is printed again after this many speed changes

_QUIT = "\x03"


class Direction(NamedTuple):
    """A direction of motion: signs (-1, 0 or 1) for x (forward), y (left), z (up) and yaw (left turn)."""

    x: int = 0
    y: int = 0
    z: int = 0
    turn: int = 0


_MOVES = {
    "u": Direction(1, turn=1),
    "i": Direction(1),
    "o": Direction(1, turn=-1),
    "j": Direction(turn=1),
    "l": Direction(turn=-1),
    "m": Direction(-1, turn=-1),
    ",": Direction(-1),
    ".": Direction(-1, turn=1),
    "U": Direction(1, 1),
    "I": Direction(1),
    "O": Direction(1, -1),
    "J": Direction(0, 1),
    "L": Direction(0, -1),
    "M": Direction(-1, 1),
    "<": Direction(-1),
    ">": Direction(-1, -1),
    "t": Direction(z=1),
    "b": Direction(z=-1),
}
_SPEEDS = {"q": (1.1, 1.1), "z": (0.9, 0.9), "w": (1.1, 1), "x": (0.9, 1), "e": (1, 1.1), "c": (1, 0.9)}


class Motion(NamedTuple):
    """The published motion: m/s along x, y and z, and rad/s about z."""

    x: float
    y: float
    z: float
    turn: float


class KeyTeleop:
    """Converts keys to motions and to lines to print. Performs no I/O."""

    def __init__(
        self, speed: float, turn: float, speed_limit: float = 1000, turn_limit: float = 1000
    ) -> None:
        self._speed, self._turn = speed, turn
        self._limits = speed_limit, turn_limit
        self._direction = Direction()
        self._changes = 0

    @property
    def motion(self) -> Motion:
        """Return the motion that results from all keys pressed so far."""
        x, y, z, turn = self._direction
        return Motion(x * self._speed, y * self._speed, z * self._speed, turn * self._turn)

    @property
    def speeds(self) -> str:
        """Return the line that shows the speeds."""
        return f"currently:\tspeed {self._speed}\tturn {self._turn} "

    def press(self, key: str) -> list[str] | None:
        """Process a key, or "" after a timeout. Return the lines to print, or None if there is nothing to publish."""
        if key in _MOVES:
            self._direction = _MOVES[key]
            return []
        if key in _SPEEDS:
            return self._change(*_SPEEDS[key])
        if not key and self._direction == Direction():
            return None
        self._direction = Direction()
        return []

    def _change(self, speed: float, turn: float) -> list[str]:
        speed_limit, turn_limit = self._limits
        self._speed = min(speed_limit, self._speed * speed)
        self._turn = min(turn_limit, self._turn * turn)
        lines = []
        if self._speed == speed_limit:
            lines.append("Linear speed limit reached!")
        if self._turn == turn_limit:
            lines.append("Angular speed limit reached!")
        lines.append(self.speeds)
        if self._changes == _HELP_EVERY - 1:
            lines.append(HELP)
        self._changes = (self._changes + 1) % _HELP_EVERY
        return lines


class _ParameterError(MinirospyError):
    pass


class _Output:
    """Publishes each new motion, and repeats the last one at ``rate`` Hz (0: never)."""

    def __init__(self, rate: float) -> None:
        self._is_stamped = bool(rospy.get_param("~stamped", False))
        self._frame_id = str(rospy.get_param("~frame_id", ""))
        kind = TwistStamped if self._is_stamped else Twist
        self._publisher: rospy.Publisher[Twist | TwistStamped] = rospy.Publisher(
            "cmd_vel", kind, queue_size=1
        )
        self._period = 1 / rate if rate > 0 else None
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._motion: Motion | None = None
        self._is_closed = False
        if self._period is not None:
            threading.Thread(target=self._repeat, daemon=True).start()

    def wait_for_subscribers(self) -> None:
        """Wait for a subscriber; print a line every 2.5 seconds."""
        waited = 0
        while not self._publisher.get_num_connections() and not rospy.is_shutdown():
            if waited % 50 == 40:
                print(f"Waiting for subscriber to connect to {self._publisher.name}", flush=True)
            time.sleep(LOOK_SECONDS)
            waited += 1

    def set(self, motion: Motion) -> None:
        """Publish a motion."""
        with self._lock:
            self._motion = motion
            self._publish(motion)
            self._changed.notify()

    def close(self) -> None:
        """Publish zero velocity as the last message."""
        with self._lock:
            self._is_closed = True
            self._publish(Motion(0, 0, 0, 0))
            self._changed.notify()

    def _repeat(self) -> None:
        with self._lock:
            while not self._is_closed and not rospy.is_shutdown():
                was_set = self._changed.wait(self._period)
                if not was_set and self._motion is not None and not self._is_closed:
                    self._publish(self._motion)

    def _publish(self, motion: Motion) -> None:
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = motion.x, motion.y, motion.z
        twist.angular.z = motion.turn
        message: Twist | TwistStamped = twist
        if self._is_stamped:
            message = TwistStamped(twist=twist)
            message.header.stamp = rospy.Time.now()
            message.header.frame_id = self._frame_id
        try:
            self._publisher.publish(message)
        except rospy.ROSException:
            # The node is shutting down.
            pass


def main() -> int:
    """Run the node until Ctrl-C. Return the exit status: 1 if there is no terminal or a parameter is invalid."""
    if sys.stdin is None or not sys.stdin.isatty():
        print(
            "teleop_twist_keyboard: ERROR: keys come from a terminal, which standard input is not: "
            "`rosrun teleop_twist_keyboard teleop_twist_keyboard.py` in a separate terminal",
            file=sys.stderr,
        )
        return 1
    try:
        rospy.init_node("teleop_twist_keyboard")
        _run()
    except _ParameterError as error:
        rospy.logerr("%s", error)
        return 1
    except OSError:
        # The terminal window is closed, so no more keys can arrive.
        rospy.signal_shutdown("the terminal is closed")
    except rospy.ROSInterruptException:
        pass
    return 0


def _number(name: str, default: float) -> float:
    value = rospy.get_param(f"~{name}", default)
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise _ParameterError(f"The {name} parameter is [{value}]: it is a number")
    return value


def _run() -> None:
    teleop = KeyTeleop(
        _number("speed", 0.5), _number("turn", 1.0), _number("speed_limit", 1000), _number("turn_limit", 1000)
    )
    timeout = _number("key_timeout", 0.5)
    output = _Output(_number("repeat_rate", 0.0))
    output.wait_for_subscribers()
    if rospy.is_shutdown():
        return
    rospy.on_shutdown(output.close)
    output.set(teleop.motion)

    # Set up the terminal before printing the help, because the setup discards pending input.
    with Keys(end=_QUIT) as keys:
        print(HELP)
        print(teleop.speeds, flush=True)
        while not rospy.is_shutdown():
            key = _next_key(keys, timeout)
            if key == _QUIT:
                break
            lines = teleop.press(key)
            if lines is not None:
                for line in lines:
                    print(line, flush=True)
                output.set(teleop.motion)
    rospy.signal_shutdown("quit")


def _next_key(keys: Keys, timeout: float) -> str:
    """Return a key, or "" if none is pressed within ``timeout`` seconds."""
    end = time.monotonic() + timeout
    while not (key := keys.next()) and time.monotonic() < end and not rospy.is_shutdown():
        pass
    return key
