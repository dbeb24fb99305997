"""NaN, infinite and absurd numbers at each place of a model file: one line says what is wrong, or the model can be simulated."""

from __future__ import annotations

import re

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Model, World
from minirospy.core.sdf.read import parse_model, parse_world
from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError

BAD = ("nan", "inf", "-inf", "1e400", "-1e300", "1e16", "-1", "0", "x", "")
NOT_NUMBERS = ("nan", "x")
PLACE = re.compile(r"@([-\d.e]+)")

# A number after @ is a place; all others keep theirs.
SDF = """<sdf version="1.6"><model name="m"><pose>@0 0 1 0 0 @0</pose>
<link name="a"><pose>0 0 @0 0 0 0</pose>
<velocity_decay><linear>@0</linear><angular>@0</angular></velocity_decay>
<inertial><mass>@1</mass><pose>@0 0 0 0 0 0</pose>
<inertia><ixx>@0.1</ixx><ixy>@0</ixy><iyy>0.1</iyy><izz>@0.1</izz></inertia></inertial>
<collision name="c"><pose>0 0 0 @0 0 0</pose><geometry><box><size>@0.1 0.1 0.1</size></box></geometry>
<surface><friction><ode><mu>@1</mu><mu2>@1</mu2><fdir1>@1 0 0</fdir1></ode></friction>
<contact><ode><kp>@1e6</kp><kd>@1</kd><max_vel>@1</max_vel><min_depth>@0</min_depth></ode></contact>
<bounce><restitution_coefficient>@0</restitution_coefficient></bounce></surface></collision>
<visual name="v"><transparency>@0</transparency><geometry><sphere><radius>@0.1</radius></sphere></geometry>
<material><diffuse>@1 0 0 1</diffuse></material></visual>
<sensor name="s" type="ray"><update_rate>@10</update_rate><pose>0 @0 0 0 0 0</pose></sensor></link>
<link name="b"><pose>0 0 0.3 0 0 0</pose><inertial><mass>1</mass></inertial>
<collision name="d"><geometry><cylinder><radius>@0.05</radius><length>@0.1</length></cylinder></geometry></collision></link>
<link name="e"><pose>0 1 0.3 0 0 0</pose><inertial><mass>1</mass></inertial>
<collision name="d"><geometry><sphere><radius>@0.05</radius></sphere></geometry></collision>
<collision name="p"><geometry><polyline><point>0 0</point><point>@1 0</point><point>0 1</point><height>@1</height></polyline>
</geometry></collision></link>
<joint name="j" type="revolute"><pose>@0 0 0 0 0 0</pose><parent>a</parent><child>b</child>
<axis><xyz>0 @1 0</xyz><initial_position>@0</initial_position>
<limit><lower>@-1</lower><upper>@1</upper><effort>@5</effort><velocity>@2</velocity></limit>
<dynamics><damping>@0.1</damping><friction>@0.1</friction>
<spring_stiffness>@0</spring_stiffness><spring_reference>@0</spring_reference></dynamics></axis></joint>
<joint name="k" type="prismatic"><parent>a</parent><child>e</child><axis><xyz>1 0 0</xyz>
<mimic joint="j"><multiplier>@1</multiplier><offset>@0</offset></mimic></axis></joint>
</model></sdf>"""

URDF = """<robot name="m"><link name="a"><inertial><origin xyz="@0 0 0" rpy="@0 0 0"/><mass value="@1"/>
<inertia ixx="@0.1" ixy="@0" ixz="0" iyy="0.1" iyz="0" izz="@0.1"/></inertial>
<collision><origin xyz="0 0 @0"/><geometry><box size="@0.1 0.1 0.1"/></geometry></collision>
<visual><geometry><sphere radius="@0.1"/></geometry><material name="x"><color rgba="@1 0 0 1"/></material></visual></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><cylinder radius="@0.05" length="@0.1"/></geometry></collision></link>
<joint name="j" type="revolute"><origin xyz="0 0 @0.3" rpy="0 0 0"/><parent link="a"/><child link="b"/>
<axis xyz="0 @1 0"/><limit lower="@-1" upper="@1" effort="@5" velocity="@2"/>
<dynamics damping="@0.1" friction="@0.1"/></joint>
<gazebo reference="a"><mu1>@1</mu1><mu2>@1</mu2><kp>@1e6</kp><kd>@1</kd><minDepth>@0</minDepth><maxVel>@0.1</maxVel>
<fdir1>@1 0 0</fdir1><dampingFactor>@0.01</dampingFactor>
<sensor name="s" type="imu"><update_rate>@10</update_rate><pose>@0 0 0 0 0 0</pose></sensor></gazebo>
<gazebo reference="j"><springReference>@0</springReference><springStiffness>@0</springStiffness>
<initial_joint_position>@0</initial_joint_position></gazebo></robot>"""

STATIC = """<sdf version="1.6"><model name="m"><static>true</static><link name="a"><pose>@0 0 0 0 0 0</pose>
<collision name="p"><geometry><plane><normal>0 @0 1</normal><size>@1 1</size></plane></geometry></collision>
<collision name="b"><pose>0 0 0 0 @0 0</pose><geometry><box><size>1 @1 1</size></box></geometry></collision></link>
</model></sdf>"""

WORLD = """<sdf version="1.6"><world name="w"><gravity>0 0 @-9.8</gravity>
<physics type="ode"><max_step_size>@0.001</max_step_size><real_time_factor>@1</real_time_factor>
<real_time_update_rate>@1000</real_time_update_rate><max_contacts>@20</max_contacts>
<ode><solver><iters>@50</iters><sor>@1.3</sor></solver></ode></physics>
<scene><ambient>@0.4 0.4 0.4 1</ambient><background>@0.7 0.7 0.7 1</background></scene>
<gui><camera><pose>@5 0 0 0 0 0</pose></camera></gui>
<light name="sun" type="directional"><pose>@0 0 10 0 0 0</pose><diffuse>@1 1 1 1</diffuse><direction>@1 0 -1</direction>
<attenuation><range>@10</range></attenuation></light>
<model name="m"><pose>@0 0 1 0 0 0</pose><link name="a"><collision name="c"><geometry><box><size>1 1 1</size></box></geometry>
</collision></link></model><state world_name="w"><model name="m"><pose>@0 0 2 0 0 0</pose></model></state></world></sdf>"""


def places(text: str) -> range:
    return range(len(PLACE.findall(text)))


def filled(text: str, place: int, value: str) -> str:
    """Return the text with a value at one place."""
    numbers = PLACE.findall(text)
    numbers[place] = value
    return PLACE.sub(lambda _: numbers.pop(0), text)


def name(text: str, place: int) -> str:
    """Return the tag or attribute of a place."""
    start = [match.start() for match in PLACE.finditer(text)][place]
    return re.findall(r'[<"]?([a-z_A-Z\d]+)(?:=|>)', text[:start])[-1]


MODELS = [
    pytest.param(text, place, id=f"{kind}-{place}-{name(text, place)}")
    for kind, text in (("sdf", SDF), ("urdf", URDF), ("static", STATIC))
    for place in places(text)
]


def is_simulated(model: Model) -> bool:
    """Return whether the model moves by motors and a force with finite states; else it is refused, or removed, and named."""
    simulation = Simulation(World())
    try:
        added = simulation.add_model(model)
    except SimulationError as error:
        line = str(error)
    else:
        line = ""
    if line:
        assert re.fullmatch("model 'm': .{,150}", line)
        return False
    joints = list(added.joints.values())
    for phase in range(3):
        for joint in joints:
            if phase == 0:
                joint.set_velocity(0.5, 3.0)
            elif phase == 1:
                joint.set_position(0.1)
            else:
                joint.stop_motor()
                joint.set_force(1.0)
        if lost := simulation.step(30):
            assert [each.name for each in lost] == ["m"]
            return False
        data = simulation.engine.data
        assert np.isfinite(data.qpos).all()
        assert np.isfinite(data.qvel).all()
        assert np.isfinite([joint.effort for joint in joints]).all()
    return True


@pytest.mark.parametrize(("text", "place"), MODELS)
def test_a_bad_number_is_named_or_can_be_simulated(text: str, place: int) -> None:
    for value in BAD:
        try:
            model = parse_model(filled(text, place, value), file="my.sdf")
        except SdfError as error:
            line = str(error)
            assert line.startswith("my.sdf:")
            assert "\n" not in line
            assert len(line) < 250
            continue
        if value in NOT_NUMBERS and "dampingFactor" not in text:
            assert model.warnings, f"'{value}' is accepted without a line"
        is_simulated(model)


@pytest.mark.parametrize("place", places(WORLD))
def test_a_bad_number_in_a_world_is_named_or_can_be_simulated(place: int) -> None:
    for value in BAD:
        world = parse_world(filled(WORLD, place, value), file="my.world")
        assert all("\n" not in line and len(line) < 250 for line in world.warnings)
        if value in NOT_NUMBERS:
            assert world.warnings, f"'{value}' is accepted without a line"
        simulation = Simulation(world)
        simulation.step(20)
        assert np.isfinite(simulation.engine.data.qpos).all()


@pytest.mark.parametrize(
    ("lower", "upper", "shown"),
    [("inf", "1", "inf and 1"), ("-1", "-inf", "-1 and -inf"), ("1e16", "-1e16", "inf and -inf")],
)
def test_infinite_limits_on_the_wrong_side_are_left_out(lower: str, upper: str, shown: str) -> None:
    limits = SDF.replace("<lower>@-1", f"<lower>{lower}").replace("<upper>@1", f"<upper>{upper}")
    model = parse_model(PLACE.sub(r"\1", limits), file="my.sdf")
    (line,) = model.warnings
    assert line.endswith(f": the limits {shown} allow no position: the infinite one is left out")
    assert model.joints["j"].axis.lower < 0 < model.joints["j"].axis.upper
    assert is_simulated(model)
