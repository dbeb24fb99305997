"""Values of plugins and sensors that cannot be used: one line names model, tag and value, and the rest goes on."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from gazebo_msgs.srv import DeleteModel, GetWorldProperties, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

from minirospy import Node
from minirospy.base.xml_text import parse_xml
from minirospy.ros.gazebo_ros.parameters import PluginError, number_of, numbers_of
from tests.ros.simulation.processes import Start, call, end, run, start_world, until

HERE = Pose(Point(0.0, 0.0, 1.0), Quaternion(0.0, 0.0, 0.0, 1.0))
MODEL = '<sdf version="1.6"><model name="m"><static>true</static><link name="body">{}</link>{}</model></sdf>'
WHEELS = """<link name="left"/><link name="right"/>
  <joint name="left_joint" type="revolute"><parent>body</parent><child>left</child><axis><xyz>0 1 0</xyz></axis></joint>
  <joint name="right_joint" type="revolute"><parent>body</parent><child>right</child><axis><xyz>0 1 0</xyz></axis></joint>
  <plugin name="drive" filename="libgazebo_ros_diff_drive.so">{}</plugin>"""
SCANNER = """<sensor name="eye" type="ray"><ray><scan><horizontal><samples>{}</samples><min_angle>-1</min_angle>
  <max_angle>1</max_angle></horizontal></scan><range><max>{}</max></range></ray>
  <plugin name="scan" filename="libgazebo_ros_laser.so"/></sensor>"""
CAMERA = """<sensor name="eye" type="camera"><camera><image><width>{}</width></image></camera>
  <plugin name="look" filename="libgazebo_ros_camera.so"><cameraName>eye</cameraName></plugin></sensor>"""
IMU = '<plugin name="imu" filename="libgazebo_ros_imu.so"><bodyName>body</bodyName>{}</plugin>'

BAD = {
    "wheels0": (
        MODEL.format("", WHEELS.format("<wheelDiameter>0</wheelDiameter>")),
        "plugin 'drive' (gazebo_ros_diff_drive) of model 'wheels0' is ignored: <wheelDiameter> is '0': it must be positive",
    ),
    "wheels1": (
        MODEL.format("", WHEELS.format("<wheelSeparation>nan</wheelSeparation>")),
        "of model 'wheels1' is ignored: <wheelSeparation> is 'nan', not a finite number",
    ),
    "wheels2": (
        MODEL.format("", WHEELS.format("<wheelTorque>-5</wheelTorque>")),
        "of model 'wheels2' is ignored: <wheelTorque> is '-5': it must not be negative",
    ),
    "scan0": (
        MODEL.format(SCANNER.format("-3", "5"), ""),
        "plugin 'scan' (gazebo_ros_laser) of model 'scan0' is ignored: <samples> is '-3': it must be positive",
    ),
    "scan1": (
        MODEL.format(SCANNER.format("1e9", "5"), ""),
        "of model 'scan1' is ignored: the sensor has 1000000000 x 1 rays: at most 1000000 are possible",
    ),
    "scan2": (
        MODEL.format(SCANNER.format("3", "far"), ""),
        "of model 'scan2' is ignored: <max> is 'far', not a number",
    ),
    "camera": (
        MODEL.format(CAMERA.format("inf"), ""),
        "of model 'camera' is ignored: <width> is 'inf', not a finite number",
    ),
    "imu": (
        MODEL.format("", IMU.format("<rpyOffset>0 0</rpyOffset>")),
        "of model 'imu' is ignored: <rpyOffset> is '0 0': 3 numbers are needed",
    ),
    "laser": (
        MODEL.format("", '<plugin name="scan" filename="libgazebo_ros_laser.so"/>'),
        "plugin 'scan' (gazebo_ros_laser) of model 'laser' is ignored: it must be in a <sensor>",
    ),
    "eye": (
        MODEL.format("", '<plugin name="look" filename="libgazebo_ros_camera.so"/>'),
        "of model 'eye' is ignored: it must be in a <sensor>",
    ),
    "tilt": (
        MODEL.format("", '<plugin name="tilt" filename="libgazebo_ros_imu_sensor.so"/>'),
        "of model 'tilt' is ignored: it must be in a <sensor>",
    ),
}
SLOW = MODEL.format("", WHEELS.format("<updateRate>-1</updateRate>"))


def test_each_value_that_cannot_be_used_is_named_in_one_line(master: str, start: Start) -> None:
    process = start_world(start)

    async def body(node: Node) -> None:
        for name, (text, _) in BAD.items():
            assert (await call(node, "spawn_sdf_model", SpawnModel, name, text, f"/{name}", HERE, "")).success
        assert (await call(node, "spawn_sdf_model", SpawnModel, "slow", SLOW, "/slow", HERE, "")).success
        await until(node, "/slow/odom", Odometry, lambda _: True)
        names = (await call(node, "get_world_properties", GetWorldProperties)).model_names
        assert {*BAD, "slow"} <= set(names)

    run(body)
    output, errors = end(process)
    lines = (output + errors).splitlines()
    for name, (_, expected) in BAD.items():
        found = [line.partition(": ")[2] for line in lines if f"model '{name}'" in line]
        assert len(found) == 1, found
        assert found[0].endswith(expected)
    slow = [line.partition(": ")[2] for line in lines if "model 'slow'" in line]
    assert slow == [
        "plugin 'drive' (gazebo_ros_diff_drive) of model 'slow': <updateRate> is '-1': each step is used"
    ]


def test_numbers_are_read_within_the_range_of_their_tag() -> None:
    element = parse_xml(
        "<p><width> 4 </width><max>inf</max><empty/><rpyOffset>1 2 3</rpyOffset><height>-0</height></p>"
    )
    assert number_of(element, "width", 1.0) == 4.0
    assert number_of(element, "max", 1.0) == math.inf
    assert (
        number_of(element, "empty", 2.0)
        == number_of(None, "width", 2.0)
        == number_of(element, "x", 2.0)
        == 2.0
    )
    assert numbers_of(element, "rpyOffset", (3,)) == (1.0, 2.0, 3.0)
    assert numbers_of(element, "empty", (3,)) == ()
    with pytest.raises(PluginError, match="<height> is '-0': it must be positive"):
        number_of(element, "height", 1.0)


def test_a_second_robot_leaves_the_services_of_the_first(master: str, start: Start) -> None:
    process = start_world(start)
    robot = MODEL.format("", IMU.format(""))

    async def body(node: Node) -> None:
        for name in ("first", "second"):
            assert (await call(node, "spawn_sdf_model", SpawnModel, name, robot, "/", HERE, "")).success
        assert (await call(node, "delete_model", DeleteModel, "second")).success
        await node.call("/default_imu", Empty)

    run(body)
    output, errors = end(process)
    line = "Tried to advertise a service that is already advertised in this node [/default_imu]"
    assert (output + errors).count(line) == 1
