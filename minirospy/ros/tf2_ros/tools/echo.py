"""tf's tf_echo and tf2_tools' echo.py: print the transform between two frames periodically.

Source: http://wiki.ros.org/tf#tf_echo, http://wiki.ros.org/tf2_tools.
"""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Callable, Sequence

from geometry_msgs.msg import TransformStamped

from minirospy import client as rospy
from minirospy.base.errors import ExtrapolationException, LookupException, TransformException
from minirospy.base.escape import escaped
from minirospy.core.tf2.rotation import Quaternion, Vector
from minirospy.core.urdf.values import NotANumberError, as_float
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
from minirospy.ros.tf2_ros.tools.angles import euler_of_matrix, rpy_of_matrix
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["main_tf", "main_tf2"]

_USAGE = """\
Usage: tf_echo source_frame target_frame [echo_rate]

This will echo the transform from the coordinate frame of the source_frame
to the coordinate frame of the target_frame. 
Note: This is the transform to get data from target_frame into the source_frame.
Default echo rate is 1 if echo_rate is not given."""  # noqa: W291 - as ROS prints it

_PRECISION = 3
_MAX_DIGITS = 17


def main_tf(words: Sequence[str] | None = None) -> int:
    """Run tf_echo with the arguments SOURCE TARGET [RATE] and the parameters ~rate and ~precision; return the exit status."""
    return run_program(_run_tf, words)


def main_tf2(words: Sequence[str] | None = None) -> int:
    """Run tf2_tools' echo.py with its options; return the exit status."""
    return run_program(_run_tf2, words)


def _run_tf(words: Sequence[str]) -> None:
    if len(words) not in (2, 3):
        raise ToolError("", text=_USAGE)
    rate = _positive(words[2]) if len(words) == 3 else None
    rospy.init_node("tf_echo", anonymous=True)
    if rate is None:
        rate = _positive(str(rospy.get_param("~rate", 1.0)))
    precision = _precision()
    if precision is None:
        precision = _PRECISION
    else:
        print(f"Precision default value was overriden, new value: {precision}", flush=True)
    source, target = (name.removeprefix("/") for name in words[:2])

    buffer = Buffer()
    TransformListener(buffer)
    with contextlib.suppress(rospy.ROSTimeMovedBackwardsException):
        buffer.can_transform(source, target, rospy.Time(), rospy.Duration(1))

    def echo() -> bool:
        try:
            found = buffer.lookup_transform(source, target, rospy.Time())
        except TransformException as error:
            now = rospy.Time.now()
            print(f"Failure at {now.secs}.{now.nsecs:09d}")
            print(escaped(f"Exception thrown:{error}", "\n"))
            print(
                escaped(f"The current list of frames is:\n{buffer.all_frames_as_string()}", "\n"), flush=True
            )
        else:
            stamp = _rounded(found.header.stamp.to_nsec(), precision)
            print(f"At time {stamp}\n{_pose(found, precision, rpy_of_matrix)}", flush=True)
        return True

    _repeat(rate, echo)


def _run_tf2(words: Sequence[str]) -> None:
    options = _parser().parse_args(words)
    rospy.init_node("echo")
    precision = _precision()
    if precision is not None:
        rospy.loginfo("Precision default value was overriden, new value: %d", precision)
    digits = options.precision or precision or _PRECISION

    buffer = Buffer(rospy.Duration.from_sec(options.cache_time) if options.cache_time else None)
    TransformListener(buffer)
    # The original program uses a timer, so it looks up the first transform after one period.
    rospy.sleep(1 / options.rate)
    looks = 0

    def echo() -> bool:
        nonlocal looks
        looks += 1
        if options.limit and looks > options.limit:
            return False
        now = rospy.Time.now()
        time = rospy.Time()
        if options.time:
            time = rospy.Time.from_sec(options.time)
        elif options.offset:
            time = rospy.Time.from_sec(max(now.to_sec() + options.offset, 0.0))

        try:
            found = buffer.lookup_transform(options.source_frame, options.target_frame, time)
        except LookupException as error:
            rospy.logerr("%s", f"At time {time.to_sec()}, (current time {now.to_sec()}) {error}")
        except ExtrapolationException as error:
            rospy.logerr("%s", f"(current time {now.to_sec()}) {error}")
        except TransformException as error:
            rospy.logerr("%s", error)
        else:
            stamp = found.header.stamp.to_sec()
            print(f"At time {stamp}, (current time {now.to_sec()})")
            print(_pose(found, digits, euler_of_matrix), flush=True)
        return True

    _repeat(options.rate, echo)


def _repeat(rate: float, echo: Callable[[], bool]) -> None:
    """Call ``echo`` at the given rate until it returns False or the node shuts down."""
    rhythm = rospy.Rate(rate)
    while not rospy.is_shutdown() and echo():
        try:
            rhythm.sleep()
        except rospy.ROSTimeMovedBackwardsException:
            pass


def _pose(found: TransformStamped, precision: int, angles: Callable[[Quaternion], Vector]) -> str:
    """Format a pose as lines, without a trailing line break."""
    place, turn = found.transform.translation, found.transform.rotation
    rpy = angles((turn.x, turn.y, turn.z, turn.w))
    rows = (
        ("- Translation: ", (place.x, place.y, place.z)),
        ("- Rotation: in Quaternion ", (turn.x, turn.y, turn.z, turn.w)),
        ("            in RPY (radian) ", rpy),
        ("            in RPY (degree) ", [math.degrees(angle) for angle in rpy]),
    )
    return "\n".join(
        f"{title}[{', '.join(f'{number:.{precision}f}' for number in numbers)}]" for title, numbers in rows
    )


def _rounded(nanoseconds: int, digits: int) -> str:
    """Format a time as seconds with ``digits`` decimals, without float rounding errors."""
    if digits > 6:
        return f"{nanoseconds / 1e9:.{digits}f}"
    scaled = round(nanoseconds / 10 ** (9 - digits))
    seconds, rest = divmod(scaled, 10**digits)
    return f"{seconds}.{rest:0{digits}d}" if digits else str(seconds)


def _positive(text: str) -> float:
    try:
        rate = as_float(text)
    except NotANumberError:
        rate = 0.0
    if rate <= 0:
        raise ToolError("Echo rate must be > 0.0", level="")
    return rate


def _precision() -> int | None:
    """Return the parameter ~precision. Raise ToolError if the parameter is invalid."""
    value = rospy.get_param("~precision", None)
    if value is None:
        return None
    if not isinstance(value, int) or isinstance(value, bool) or value > _MAX_DIGITS:
        raise ToolError(f"~precision is [{value}]: it is a number of digits, up to {_MAX_DIGITS}")
    if value < 1:
        raise ToolError("Precision must be > 0", level="")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="echo.py")
    parser.add_argument("source_frame")
    parser.add_argument("target_frame")
    parser.add_argument("-r", "--rate", help="update rate, must be > 0.0", default=1.0, type=_positive_float)
    parser.add_argument(
        "-c", "--cache_time", help="length of tf buffer cache in seconds", type=_positive_float
    )
    parser.add_argument(
        "-o", "--offset", help="offset the lookup from current time, ignored if using -t", type=float
    )
    parser.add_argument("-t", "--time", help="fixed time to do the lookup", type=float)
    parser.add_argument("-l", "--limit", help="lookup fixed number of times", type=_positive_int)
    parser.add_argument("-p", "--precision", help="output precision", type=_positive_int)
    return parser


def _positive_float(text: str) -> float:
    number = float(text)
    if number <= 0 or not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"{number} must be > 0.0")
    return number


def _positive_int(text: str) -> int:
    number = int(text)
    if number <= 0:
        raise argparse.ArgumentTypeError(f"{number} must be > 0")
    return number
