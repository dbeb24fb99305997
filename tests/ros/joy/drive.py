"""Drive joy_node with a simulated device, and teleop_node with states; print the messages that they publish.

Usage: `drive.py JOY_NODE TELEOP_NODE [PYTHON [NAME...]]`, with either stack's programs; NAME selects cases. drive.txt is
the output with the real programs (joy 1.15.1 and teleop_twist_joy 0.1.3, which Debian does not have, built from source).
"""

from __future__ import annotations

import contextlib
import os
import pty
import queue
import struct
import subprocess
import sys
import time
import tty

import rospy
from cases import OPTIONS, STATES, STEPS, TELEOPS
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy

SECONDS = 100


def started(program: list[str], name: str, parameters: dict[str, object]) -> subprocess.Popen[bytes]:
    if rospy.has_param(f"/{name}"):
        rospy.delete_param(f"/{name}")
    rospy.set_param(f"/{name}", parameters)
    return subprocess.Popen(
        [*program, f"__name:={name}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def ended(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def numbers(values: object) -> str:
    return "[" + ", ".join(f"{value:.5g}" for value in values) + "]"


def joysticks(program: list[str], names: list[str]) -> None:
    for name in names:
        options = OPTIONS[name]
        print("joy_node", name)
        master, slave = pty.openpty()
        tty.setraw(slave)
        states: queue.Queue[Joy] = queue.Queue()
        subscriber = rospy.Subscriber("joy", Joy, states.put)
        parameters = {"dev": os.ttyname(slave), "dev_ff": "/dev/null", "coalesce_interval": 1.0, **options}
        process = started(program, "joystick", parameters)
        try:
            while not has_opened(process, os.ttyname(slave)):
                time.sleep(0.02)
            follow_joystick(master, os.ttyname(slave), subscriber, states)
        finally:
            ended(process)
            subscriber.unregister()
            os.close(master)
            os.close(slave)


def has_opened(process: subprocess.Popen[bytes], path: str) -> bool:
    """Return whether a process has a file open, as far as the system reports it."""
    try:
        files = os.listdir(f"/proc/{process.pid}/fd")
    except FileNotFoundError:
        return True
    for each in files:
        # The file may have been closed in the meantime.
        with contextlib.suppress(FileNotFoundError):
            if os.readlink(f"/proc/{process.pid}/fd/{each}") == path:
                return True
    return False


def follow_joystick(master: int, path: str, subscriber: rospy.Subscriber, states: queue.Queue[Joy]) -> None:
    while not subscriber.get_num_connections():
        time.sleep(0.02)
    # joy_node opens the device twice, so earlier events are lost.
    time.sleep(1)
    for events, count in STEPS:
        os.write(master, b"".join(struct.pack("<IhBB", 0, value, kind, at) for kind, at, value in events))
        for _ in range(count):
            state = states.get(timeout=SECONDS)
            print(" ", numbers(state.axes), list(state.buttons), state.header.frame_id == path)


def teleops(program: list[str], names: list[str]) -> None:
    publisher = rospy.Publisher("joy", Joy, queue_size=10)
    for name in names:
        options = TELEOPS[name]
        print("teleop_node", name)
        twists: queue.Queue[Twist] = queue.Queue()
        subscriber = rospy.Subscriber("cmd_vel", Twist, twists.put)
        process = started(program, "teleop", options)
        try:
            follow_teleop(publisher, subscriber, twists)
        finally:
            ended(process)
            subscriber.unregister()


def follow_teleop(
    publisher: rospy.Publisher, subscriber: rospy.Subscriber, twists: queue.Queue[Twist]
) -> None:
    while not (subscriber.get_num_connections() and publisher.get_num_connections()):
        time.sleep(0.02)
    answers: list[str] = []
    for axes, buttons in STATES:
        publisher.publish(Joy(axes=axes, buttons=buttons))
        # After the last state, send one with the same effect as the second, to avoid a long wait for nothing.
        is_last = len(answers) == len(STATES) - 1 and answers[1] != "nothing"
        if is_last:
            publisher.publish(Joy(axes=STATES[1][0], buttons=STATES[1][1]))
        answer = answer_of(twists)
        answers.append("nothing" if is_last and answer == answers[1] else answer)
        print(" ", answers[-1])


def answer_of(twists: queue.Queue[Twist]) -> str:
    try:
        # Only a silent node takes this long: on a busy machine, a message may take a while.
        twist = twists.get(timeout=60)
    except queue.Empty:
        return "nothing"
    linear, angular = twist.linear, twist.angular
    return f"{numbers((linear.x, linear.y, linear.z))} {numbers((angular.x, angular.y, angular.z))}"


if __name__ == "__main__":
    rospy.init_node("driver", disable_signals=True)
    interpreter = sys.argv[3:4]
    only = sys.argv[4:] or [*OPTIONS, *TELEOPS]
    joysticks([*interpreter, sys.argv[1]], [name for name in OPTIONS if name in only])
    teleops([*interpreter, sys.argv[2]], [name for name in TELEOPS if name in only])
