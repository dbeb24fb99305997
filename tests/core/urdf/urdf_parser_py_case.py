"""A program that uses urdf_parser_py; urdf_parser_py.txt is its output with PyPI's urdf_parser_py 0.0.4.

Record it: `pip install urdf-parser-py` in an environment without minirospy, then
`python urdf_parser_py_case.py arm.urdf > urdf_parser_py.txt`.
"""

import collections
import collections.abc
import sys

# The real urdf_parser_py needs this since Python 3.10.
collections.Iterable = collections.abc.Iterable

from urdf_parser_py.urdf import (  # noqa: E402
    URDF,
    Box,
    Color,
    Joint,
    JointLimit,
    JointMimic,
    Link,
    Material,
    Pose,
    Robot,
    Visual,
)

INSIDE = [
    "<link/>",
    '<foo/><link name="a" x="1"/>',
    '<link name="a"/><joint name="j" type="ball"><parent link="a"/><child link="a"/></joint>',
    '<joint name="j" type="fixed"><child link="a"/></joint>',
    '<link name="a"><visual><origin xyz="1 2"/><geometry><box size="1 1 1"/></geometry></visual></link>',
    '<link name="a"><visual><geometry><cone/></geometry></visual></link>',
    '<material name="m"/><link name="a"><inertial><mass value="x"/></inertial></link>',
    '<transmission name="t"><type>x</type><joint name="j"><hardwareInterface>E</hardwareInterface></joint>'
    '<actuator name="a"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>'
    '<gazebo reference="a"><material>Gazebo/Blue</material></gazebo>',
    '<transmission name="t"/>',
    '<link name="a"><inertial/><inertial><mass value="1"/></inertial></link>',
]
TEXTS = [
    "<robot/>",
    "<robot",
    '<robot name="r" version="2.0"/>',
    '<robot name="r" version="1"/>',
    *(f'<robot name="r">{inside}</robot>' for inside in INSIDE),
]

sys.stderr = sys.stdout
robot = URDF.from_xml_file(sys.argv[1])
print(robot.to_xml_string())
print(robot)
print(
    robot.get_root(), robot.get_chain("base_link", "tool"), robot.get_chain("base_link", "tool", links=False)
)
print(robot.get_chain("base_link", "tool", joints=False), robot.get_chain("base_link", "tool", fixed=False))
print(robot.parent_map, robot.child_map)
shoulder, elbow = robot.joint_map["shoulder"], robot.joint_map["elbow"]
print(
    shoulder.limit.lower,
    shoulder.origin.rotation,
    shoulder.origin.position,
    shoulder.axis,
    shoulder.joint_type,
)
print(shoulder.mimic, shoulder.dynamics, elbow.limit, elbow.origin.rpy)
base = robot.links[0]
print(base.visual.geometry.radius, base.visual.origin, base.collision, base.visual.material.name)
print(robot.link_map["upper_arm"].inertial.inertia.to_matrix(), robot.materials[0].color.rgba)

for text in TEXTS:
    print("--", text)
    try:
        robot = URDF.from_xml_string(text)
        print(robot.to_xml_string(addHeader=False))
        for transmission in robot.transmissions:
            print(transmission.joints[0].hardwareInterfaces, transmission.actuators[0].mechanicalReduction)
    except Exception as error:  # noqa: BLE001 - the real one raises all kinds
        print(type(error).__name__, error)

robot = Robot(name="new")
looks = Material(name="m", color=Color(1, 0, 0, 1))
robot.add_link(Link(name="l", visual=Visual(Box([1, 2, 3]), looks, Pose([1, 2, 3], [0, 0, 0]))))
limit, mimic = JointLimit(effort=1, velocity=2), JointMimic("k", 2.0)
robot.add_joint(Joint("j", "l", "m", "revolute", axis=[0, 0, 1], limit=limit, mimic=mimic))
robot.add_aggregate("link", Link(name="m"))
print(robot.to_xml_string())
print(robot.links[0].to_xml_string())
print(Pose.from_xml_string('<origin xyz="1 2 3"/>'))
print(len(URDF(name="p").parse(robot.to_xml_string()).links))
for wrong in (
    lambda: Joint(name="x", joint_type="ball").check_valid(),
    lambda: Robot("q", version="3"),
    lambda: Color(1),
):
    try:
        wrong()
    except Exception as error:  # noqa: BLE001 - the real one raises all kinds
        print(type(error).__name__, error)
