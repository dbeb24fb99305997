"""turtle_teleop_key: publishes `turtle1/cmd_vel` from a terminal's arrow keys.

Parameters: scale_linear (2 m/s), scale_angular (2 rad/s); both are in the node's namespace, not private. Source:
http://wiki.ros.org/turtlesim.
"""

from __future__ import annotations

import sys

from geometry_msgs.msg import Twist

from minirospy import client as rospy
from minirospy.base.keyboard import Keys

__all__ = ["DIRECTIONS", "main"]

_HELP = """Reading from keyboard
---------------------------
Use arrow keys to move the turtle. 'q' to quit."""

_QUIT = "q"
_USUAL_SCALE = 2.0

DIRECTIONS = {"up": (1.0, 0.0), "down": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
"""For each key: the signs of the forward motion and of the turn to the left."""


def main() -> int:
    """Run the node until q or Ctrl-C; return the exit status, which is 1 without a terminal."""
    if sys.stdin is None or not sys.stdin.isatty():
        print(
            "turtle_teleop_key: ERROR: keys come from a terminal, which standard input is not: "
            "`rosrun turtlesim turtle_teleop_key` in a separate terminal",
            file=sys.stderr,
        )
        return 1
    try:
        rospy.init_node("teleop_turtle")
        _run()
    except OSError:
        # The terminal window was closed, so no more keys can arrive.
        rospy.signal_shutdown("the terminal is closed")
    except rospy.ROSException:
        # The node is shutting down.
        pass
    return 0


def _run() -> None:
    linear, angular = _scale("scale_linear"), _scale("scale_angular")
    publisher = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=1)
    # Set up the terminal before showing the help, because the setup discards pending input.
    with Keys(end=_QUIT) as keys:
        print(_HELP, flush=True)
        while not rospy.is_shutdown():
            key = keys.next()
            if key == _QUIT:
                break
            if key in DIRECTIONS:
                forward, turn = DIRECTIONS[key]
                twist = Twist()
                twist.linear.x, twist.angular.z = linear * forward, angular * turn
                publisher.publish(twist)
    rospy.signal_shutdown("quit")


def _scale(name: str) -> float:
    value = rospy.get_param(name, _USUAL_SCALE)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else _USUAL_SCALE
