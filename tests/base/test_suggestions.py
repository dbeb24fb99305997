"""Suggestions for names that do not exist: plausible names, and no far-fetched ones."""

from __future__ import annotations

import pytest

from minirospy.base.suggestions import did_you_mean, nearest

NODES = ("/talker", "/listener", "/rosout", "/turtle1/teleop", "/robot/arm_driver")
TOPICS = (
    "/chatter",
    "/rosout",
    "/rosout_agg",
    "/bool",
    "/turtle1/cmd_vel",
    "/turtle1/color_sensor",
    "/turtle1/pose",
    "/camera/image_raw",
)
TYPES = (
    "std_msgs/String",
    "std_msgs/Bool",
    "std_msgs/Int32",
    "geometry_msgs/Pose",
    "geometry_msgs/Twist",
    "actionlib/TestAction",
)
FILES = ("talker.py", "listener.py", "start.launch", "rpi_led.launch")
LONG = tuple(f"/factory/hall_2/robot_17/{name}" for name in ("odom", "scan", "battery", "battery_state"))


@pytest.mark.parametrize(
    ("name", "known", "expected"),
    [
        ("taker", ("talker", "listener"), ["talker"]),
        ("/taker", NODES, ["/talker"]),
        ("talker", NODES, ["/talker"]),
        ("/lisetner", NODES, ["/listener"]),
        ("teleop", NODES, ["/turtle1/teleop"]),
        ("/arm_drivr", NODES, ["/robot/arm_driver"]),
        ("/chater", TOPICS, ["/chatter"]),
        ("/Chatter", TOPICS, ["/chatter"]),
        ("/robot/chatter", TOPICS, ["/chatter"]),
        ("/turtle/cmd_vel", TOPICS, ["/turtle1/cmd_vel"]),
        ("/turtle1/cmdvel", TOPICS, ["/turtle1/cmd_vel"]),
        ("/turtle1/colour_sensor", TOPICS, ["/turtle1/color_sensor"]),
        ("/camera/image", TOPICS, ["/camera/image_raw"]),
        ("foo", TOPICS, []),
        ("/foo", TOPICS, []),
        ("/turtle1/foo", TOPICS, []),
        ("/turtle1/velocity", TOPICS, []),
        ("String", TYPES, ["std_msgs/String"]),
        ("std_msgs/string", TYPES, ["std_msgs/String"]),
        ("std_msg/Strin", TYPES, ["std_msgs/String"]),
        ("std_msgs/Bol", TYPES, ["std_msgs/Bool"]),
        ("std_msgs/Twist", TYPES, ["geometry_msgs/Twist"]),
        ("actionlib/TesAction", TYPES, ["actionlib/TestAction"]),
        ("std_msgs/Foo", TYPES, []),
        ("geometry_msgs/Transform", TYPES, []),
        ("taker.py", FILES, ["talker.py"]),
        ("rpi_let.launch", FILES, ["rpi_led.launch"]),
        ("x.launch", FILES, []),
        ("node.py", FILES, []),
        ("/factory/hall_2/robot_17/odm", LONG, [LONG[0]]),
        ("/factory/hall_2/robot_17/imu", LONG, []),
        ("", NODES, []),
        ("/", NODES, []),
    ],
)  # fmt: skip
def test_names_that_may_have_been_meant(name: str, known: tuple[str, ...], expected: list[str]) -> None:
    assert nearest(name, known) == expected


@pytest.mark.parametrize(
    ("word", "known", "expected"),
    [
        ("ecoh", ("echo", "hz", "list"), "; did you mean echo?"),
        ("ls", ("list", "info"), "; did you mean list?"),
        ("inf", ("info", "play"), "; did you mean info?"),
        ("instal", ("install", "init", "db"), "; did you mean install?"),
        ("foo", ("info", "hz", "echo"), ""),
        ("--quite", ("--quiet", "--rate"), "; did you mean --quiet?"),
        ("--foo", ("--bool", "--of"), ""),
    ],
)
def test_words_that_may_have_been_meant(word: str, known: tuple[str, ...], expected: str) -> None:
    assert did_you_mean(word, known) == expected


@pytest.mark.parametrize(
    ("name", "known", "expected"),
    [
        ("/buton_state", "/button_state", True),
        # Another robot's topic, and another topic with the same prefix: the user waits for this one.
        ("/robot2/scan", "/robot10/scan", False),
        ("/camera/image", "/camera/image_raw", False),
    ],
)
def test_only_slips_are_suggested_for_a_name_that_may_come(name: str, known: str, expected: bool) -> None:
    assert bool(did_you_mean(name, [known], only_slips=True)) is expected
