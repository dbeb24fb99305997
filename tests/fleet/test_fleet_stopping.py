"""The messages that follow if velocities over the fleet stop arriving, with a clock that the test controls."""

from __future__ import annotations

import struct
from collections.abc import Callable
from io import BytesIO
from typing import Any

import pytest
from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import Joy
from std_msgs.msg import String

from minirospy.base.errors import ROSException
from minirospy.fleet.stopping import CommandStream, at_rest
from tests.waiting import wait_until


def body(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def twist(speed: float) -> Twist:
    message = Twist()
    message.linear.x = speed
    return message


def stamped(speed: float) -> TwistStamped:
    message = TwistStamped(twist=twist(speed))
    message.header.frame_id = "base_link"
    message.header.seq = 7
    return message


def joy(axis: float, button: int) -> Joy:
    message = Joy(axes=[0.0, axis], buttons=[0, button, 0])
    message.header.frame_id = "pad"
    return message


@pytest.mark.parametrize(
    ("moving", "rest"),
    [
        (twist(-0.5), twist(0)),
        (stamped(0.5), stamped(0)),
        (joy(0.5, 0), joy(0, 0)),
        (joy(0, 1), joy(0, 0)),
    ],
)
def test_driving_types_have_a_stop_message(moving: Any, rest: Any) -> None:
    assert at_rest(moving._type, body(moving)) == body(rest)
    assert at_rest(rest._type, body(rest)) is None


def test_other_and_broken_messages_stop_nothing() -> None:
    assert at_rest(String._type, body(String("a"))) is None
    for message in (twist(1), stamped(1), joy(1, 1)):
        data = body(message)
        for length in range(len(data)):
            assert at_rest(message._type, data[:length]) is None
    huge = body(joy(1, 1))[:19] + struct.pack("<I", 0xFFFFFFFF) + bytes(100)
    assert at_rest(Joy._type, huge) is None
    assert at_rest(Twist._type, body(twist(float("nan")))) == body(twist(0))
    assert at_rest(Twist._type, body(twist(-0.0))) is None


class Robot:
    """A clock, the published messages, and the guard's steps, which the test runs."""

    def __init__(self) -> None:
        self.now = 100.0
        self.published: list[float] = []
        self.stream = CommandStream("/cmd_vel", Twist._type, self._publish, 0.5, lambda: self.now)

    def _publish(self, data: bytes) -> None:
        self.published.append(struct.unpack_from("<d", data)[0])

    def send(self, *speeds: float, pause: float = 0.1) -> None:
        for speed in speeds:
            self.now += pause
            self.stream.publish(body(twist(speed)))

    def wake(self) -> None:
        """Let the guard read the clock."""
        self.stream._guard.arm(_nothing, float("-inf"))
        wait_until(lambda: _nothing not in self.stream._guard._deadlines)


def _nothing() -> None:
    pass


def test_stream_that_ends_is_followed_by_a_zero_once(caplog: pytest.LogCaptureFixture) -> None:
    robot = Robot()
    robot.send(1, 2, 3)
    robot.wake()
    robot.now += 0.49
    robot.wake()
    assert robot.published == [1, 2, 3]
    robot.now += 0.01
    robot.wake()
    wait_until(lambda: robot.published == [1, 2, 3, 0])
    wait_until(lambda: "/cmd_vel is stopped: no command came for 0.5 s" in caplog.text)
    # The robot moves again as soon as commands arrive.
    robot.send(4, 5)
    robot.now += 1
    robot.wake()
    wait_until(lambda: robot.published == [1, 2, 3, 0, 4, 5, 0])


def test_single_velocities_and_streams_that_end_with_zero_are_left_alone() -> None:
    robot = Robot()
    robot.send(1)
    robot.send(2, 3, pause=0.6)
    robot.send(4, 0)
    robot.now += 10
    robot.wake()
    robot.stream.close()
    assert robot.published == [1, 2, 3, 4, 0]
    assert not robot.stream._guard._deadlines


def test_stream_is_stopped_when_its_topic_is_closed() -> None:
    robot = Robot()
    robot.send(1, 2)
    robot.stream.close()
    robot.stream.close()
    assert robot.published == [1, 2, 0]
    assert not robot.stream._guard._deadlines


def test_command_at_the_last_moment_goes_on() -> None:
    robot = Robot()
    robot.send(1, 2)
    robot.now += 0.2
    robot.stream._silent()
    assert robot.published == [1, 2]
    robot.stream.close()


def test_node_that_has_ended_is_no_fault(caplog: pytest.LogCaptureFixture) -> None:
    robot = Robot()
    robot.send(1, 2)
    failing: Callable[[bytes], None] = _fail
    robot.stream._publish = failing
    robot.now += 1
    robot.wake()
    wait_until(lambda: "is stopped" in caplog.text)
    assert "Traceback" not in caplog.text


def _fail(_: bytes) -> None:
    raise ROSException("publish() to a closed topic")
