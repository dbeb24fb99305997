"""SDF models of versions 1.4 to 1.7: poses, joints, shapes, materials, sensors, nested models."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import (
    Box,
    Cylinder,
    Geometry,
    Heightmap,
    Inertial,
    MeshShape,
    Model,
    Plane,
    Polyline,
    Pose,
    Sphere,
    Surface,
)
from minirospy.core.sdf.read import Resolve, new_source, no_files, parse_model
from minirospy.core.sdf.read_model import read_model
from minirospy.core.sdf.text import parse_document

SHAPE = "<geometry><sphere><radius>0.5</radius></sphere></geometry>"


def read(body: str, version: str = "1.7", resolve: Resolve = no_files) -> Model:
    return parse_model(f'<sdf version="{version}"><model name="m">{body}</model></sdf>', resolve)


def values(pose: Pose) -> tuple[float, ...]:
    return (*pose.position, *pose.orientation)


class TestFrames:
    """The expected numbers are those of libsdformat 12.3 for the same model."""

    MODEL = f"""
      <pose>1 2 3 0.1 0.2 0.3</pose>
      <frame name="f1"><pose>1 0 0 0 0 0.5</pose></frame>
      <frame name="f2" attached_to="b"><pose relative_to="f1">0 1 0 0.2 0 0</pose></frame>
      <link name="a"><pose relative_to="f1">0 0 1 0 0.3 0</pose>
        <collision name="c"><pose relative_to="f2">1 1 1 0 0 0</pose>{SHAPE}</collision>
        <sensor name="s" type="imu"><pose relative_to="j">0 0 1 0 0 0</pose></sensor>
      </link>
      <link name="b"><pose relative_to="a">0 2 0 0 0 1</pose></link>
      <link name="c"><pose relative_to="j">0 0 1 0 0 1</pose></link>
      <joint name="j" type="revolute"><parent>a</parent><child>b</child><pose relative_to="f1">0 0 2 0 0.1 0</pose>
        <axis><xyz expressed_in="f2">0 1 1</xyz></axis></joint>
      <joint name="k" type="universal"><parent>b</parent><child>c</child>
        <axis><xyz>0 1 0</xyz></axis><axis2><xyz expressed_in="__model__">1 0 0</xyz></axis2></joint>
      <joint name="l" type="fixed"><parent>world</parent><child>f2</child></joint>
      <model name="n"><pose relative_to="b">0 0 1 1 0 0</pose><link name="x"><pose>1 0 0 0 0 0</pose></link></model>
    """

    @pytest.fixture
    def model(self) -> Model:
        return read(self.MODEL)

    @pytest.mark.parametrize(
        ("name", "expected"),
        [
            ("a", (1, 0, 1, -0.0369716, 0.1447925, 0.2446259, 0.9580326)),
            ("b", (0.041149, 1.755165, 1, 0.0369716, 0.1447925, 0.6739847, 0.7234728)),
            ("c", (1.087612, 0.047863, 2.995004, 0.0123650, 0.0484254, 0.6807869, 0.7307745)),
            ("n::x", (0.3500519, 2.8827706, 1.7956662, 0.3792970, 0.4501928, 0.5220600, 0.6171820)),
        ],
    )
    def test_links(self, model: Model, name: str, expected: tuple[float, ...]) -> None:
        assert values(model.links[name].pose) == pytest.approx(expected, abs=1e-6)

    def test_parts_of_links(self, model: Model) -> None:
        link = model.links["a"]
        collision = (0.902516, 1.781397, 0.466273, 0.0987124, -0.1486916, 0.0149189, 0.9838313)
        sensor = (-0.494190, 0, 1.935403, 0, -0.0998334, 0, 0.9950042)
        assert values(link.collisions[0].pose) == pytest.approx(collision, abs=1e-6)
        assert values(link.sensors[0].pose) == pytest.approx(sensor, abs=1e-6)

    def test_joints(self, model: Model) -> None:
        hinge, cardan, weld = (model.joints[name] for name in "jkl")
        pose = (-1.842612, -0.831933, 0.955336, -0.0478627, -0.0876121, -0.4770304, 0.8731983)
        assert values(hinge.pose) == pytest.approx(pose, abs=1e-6)
        assert hinge.axis.xyz == pytest.approx((-0.08321, 0.552531, 0.829328), abs=1e-6)
        assert cardan.axis.xyz == (0.0, 1.0, 0.0)
        assert cardan.axis2.xyz == pytest.approx((0.068368, -0.993806, 0.087612), abs=1e-6)
        assert (weld.parent, weld.child) == ("world", "b")
        assert weld.pose.position == pytest.approx((-0.681801, -0.788974, -0.955336), abs=1e-6)

    def test_the_pose_of_the_model(self, model: Model) -> None:
        assert model.pose.position == (1.0, 2.0, 3.0)

    @pytest.mark.parametrize(
        ("body", "why"),
        [
            ('<link name="a"><pose relative_to="typo"/></link>', "the frame [typo] does not exist"),
            (
                '<link name="a"><pose relative_to="b"/></link><link name="b"><pose relative_to="a"/></link>',
                "the pose of [a] is relative to itself",
            ),
            ('<link name="a"><pose relative_to="a"/></link>', "the pose of [a] is relative to itself"),
        ],
    )
    def test_frames_that_cannot_be_resolved(self, body: str, why: str) -> None:
        with pytest.raises(SdfError) as caught:
            read(body)
        assert str(caught.value) == f"model:1: model [m]: {why}"

    def test_a_chain_of_a_thousand_links(self) -> None:
        links = "".join(
            f'<link name="l{index}"><pose relative_to="l{index - 1}">1 0 0 0 0 0</pose></link>'
            for index in range(1000, 0, -1)
        )
        model = read(f'{links}<link name="l0"/>')
        assert model.links["l1000"].pose.position == (1000.0, 0.0, 0.0)

    def test_the_attribute_frame_of_older_versions(self) -> None:
        body = """<link name="a"><pose frame="">1 0 0 0 0 0</pose></link>
            <link name="b"><pose frame="unknown">0 1 0 0 0 0</pose></link>"""
        model = read(body, "1.6")
        assert model.links["a"].pose.position == (1.0, 0.0, 0.0)
        assert model.links["b"].pose.position == (0.0, 1.0, 0.0)

    def test_degrees(self) -> None:
        model = read('<link name="a"><pose degrees="true">0 0 0 0 0 90</pose></link>')
        assert model.links["a"].pose.orientation == pytest.approx((0, 0, math.sqrt(0.5), math.sqrt(0.5)))


class TestJoints:
    LINKS = '<link name="a"/><link name="b"><pose>0 0 0 0 0 1.5707963267948966</pose></link>'

    @staticmethod
    def hinge(more: str, kind: str = "revolute", child: str = "b") -> str:
        return f'<joint name="j" type="{kind}"><parent>a</parent><child>{child}</child>{more}</joint>'

    @pytest.mark.parametrize(
        ("version", "more", "expected"),
        [
            ("1.4", "", (0.0, -1.0, 0.0)),
            ("1.5", "", (1.0, 0.0, 0.0)),
            ("1.5", "<use_parent_model_frame>1</use_parent_model_frame>", (0.0, -1.0, 0.0)),
            ("1.4", "<use_parent_model_frame>0</use_parent_model_frame>", (1.0, 0.0, 0.0)),
        ],
    )
    def test_the_axis_is_in_the_models_frame_before_1_5(
        self, version: str, more: str, expected: tuple[float, ...]
    ) -> None:
        model = read(self.LINKS + self.hinge(f"<axis><xyz>1 0 0</xyz>{more}</axis>"), version)
        assert model.joints["j"].axis.xyz == pytest.approx(expected, abs=1e-9)

    def test_limits_and_dynamics(self) -> None:
        axis = """<axis><xyz>0 0 2</xyz><initial_position>0.3</initial_position>
            <limit><lower>-1e16</lower><upper>1.5</upper><effort>-1</effort><velocity>3</velocity></limit>
            <dynamics><damping>0.1</damping><friction>0.2</friction>
            <spring_reference>0.4</spring_reference><spring_stiffness>5</spring_stiffness></dynamics></axis>"""
        read_axis = read(self.LINKS + self.hinge(axis)).joints["j"].axis
        assert tuple(read_axis) == ((0, 0, 1), -math.inf, 1.5, math.inf, 3.0, 0.1, 0.2, 5.0, 0.4, 0.3)

    @pytest.mark.parametrize(
        ("kind", "expected"),
        [
            ("revolute", "revolute"),
            ("continuous", "continuous"),
            ("prismatic", "prismatic"),
            ("fixed", "fixed"),
            ("ball", "ball"),
            ("universal", "universal"),
            ("revolute2", "universal"),
        ],
    )
    def test_kinds(self, kind: str, expected: str) -> None:
        assert read(self.LINKS + self.hinge("", kind)).joints["j"].kind == expected

    @pytest.mark.parametrize(
        ("body", "why"),
        [
            (hinge("", "gearbox"), "joint [j] is left out: its type 'gearbox' is not supported"),
            (hinge("", child="typo"), "joint [j] is left out: its child link [typo] does not exist"),
            (hinge("", child="a"), "joint [j] is left out: parent and child are both [a]"),
        ],
    )
    def test_joints_that_are_left_out(self, body: str, why: str) -> None:
        model = read(self.LINKS + body)
        assert not model.joints
        assert model.warnings == (f"model:1: {why}",)

    def test_a_joint_to_the_world_as_the_child_is_turned_around(self) -> None:
        joint = read(self.LINKS + self.hinge("<axis><xyz>0 0 1</xyz></axis>", child="world")).joints["j"]
        assert (joint.parent, joint.child, joint.axis.xyz) == ("world", "a", (0.0, 0.0, -1.0))

    def test_sensors_of_joints(self) -> None:
        sensor = '<sensor name="ft" type="force_torque"><update_rate>10</update_rate></sensor>'
        joint = read(self.LINKS + self.hinge(sensor)).joints["j"]
        assert [(each.name, each.kind, each.update_rate) for each in joint.sensors] == [
            ("ft", "force_torque", 10.0)
        ]


class TestShapes:
    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("<box><size>1 2 3</size></box>", Box((1, 2, 3))),
            ("<box><size>1 2 0</size></box>", Box((1, 2, 1e-4))),
            ("<cylinder><radius>1</radius><length>2</length></cylinder>", Cylinder(1, 2)),
            ("<sphere><radius>0.5</radius></sphere>", Sphere(0.5)),
            ("<plane><normal>0 0 2</normal><size>3 4</size></plane>", Plane((0, 0, 1), (3, 4))),
            ("<plane/>", Plane()),
            (
                "<mesh><uri>model://a/b.dae</uri><scale>1 2 3</scale>"
                "<submesh><name>s</name><center>1</center></submesh></mesh>",
                MeshShape("/found", (1, 2, 3), "s", True),
            ),
            (
                "<heightmap><uri>file://a.png</uri><size>10 20 3</size><pos>0 0 1</pos></heightmap>",
                Heightmap("/found", (10, 20, 3), (0, 0, 1)),
            ),
            (
                "<polyline><point>0 0</point><point>1 0</point><point>1 1</point><point>0 0</point>"
                "<height>2</height></polyline>",
                Polyline(((0, 0), (1, 0), (1, 1)), 2),
            ),
        ],
    )
    def test_geometries(self, text: str, expected: Geometry) -> None:
        body = f'<link name="a"><visual name="v"><geometry>{text}</geometry></visual></link>'
        model = read(body, resolve=lambda _: "/found")
        assert model.links["a"].visuals[0].geometry == expected
        assert model.warnings == ()

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            (
                "<box><size>0 0 0</size></box>",
                "visual [v] is left out: the box has a size of 0 or less: 0 0 0",
            ),
            (
                "<sphere><radius>-1</radius></sphere>",
                "visual [v] is left out: the sphere's radius is 0 or less: -1",
            ),
            (
                "<mesh><uri>model://a.dae</uri></mesh>",
                "visual [v] is left out: the mesh model://a.dae does not exist "
                "(add its folder to GAZEBO_MODEL_PATH)",
            ),
            (
                "<mesh><uri>model://a.dae</uri><scale>1 0 0</scale></mesh>",
                "visual [v] is left out: the mesh has a scale of 0",
            ),
            ("<torus/>", "visual [v]: the geometry <torus> is not supported, so it is left out"),
            ("", "visual [v] has no geometry and is left out"),
        ],
    )
    def test_shapes_that_are_left_out(self, text: str, why: str) -> None:
        model = read(f'<link name="a"><visual name="v"><geometry>{text}</geometry></visual></link>')
        assert model.links["a"].visuals == ()
        assert model.warnings == (f"model:1: {why}",)

    def test_surfaces(self) -> None:
        surface = """<surface><friction><ode><mu>0.1</mu><mu2>0.2</mu2><fdir1>1 0 0</fdir1></ode></friction>
            <contact><ode><kp>1e5</kp><kd>10</kd><min_depth>0.001</min_depth><max_vel>0.1</max_vel></ode></contact>
            <bounce><restitution_coefficient>0.5</restitution_coefficient></bounce></surface>"""
        model = read(f'<link name="a"><collision name="c">{SHAPE}{surface}</collision></link>')
        expected = Surface(0.1, 0.2, 1e5, 10, 0.001, 0.1, 0.5, (1, 0, 0))
        assert model.links["a"].collisions[0].surface == expected


class TestMaterials:
    @staticmethod
    def material(text: str, resolve: Resolve = no_files) -> tuple[object, ...]:
        body = f'<link name="a"><visual name="v">{SHAPE}<material>{text}</material></visual></link>'
        model = read(body, resolve=resolve)
        material = model.links["a"].visuals[0].material
        return material.color, material.texture, model.warnings

    def test_colours(self) -> None:
        assert self.material("<diffuse>1 0 0 0.5</diffuse><ambient>0 1 0 1</ambient>")[0] == (1, 0, 0, 0.5)
        assert self.material("<ambient>0 1 0</ambient>")[0] == (0, 1, 0, 1)

    def test_gazebos_names(self) -> None:
        assert self.material("<script><name>Gazebo/Grey</name></script>")[0] == (0.7, 0.7, 0.7, 1)
        assert self.material("<script>Gazebo/Grey</script>")[0] == (0.7, 0.7, 0.7, 1)
        color = self.material("<script><name>Gazebo/Grey</name></script><diffuse>1 0 0 1</diffuse>")[0]
        assert color == (1, 0, 0, 1)

    def test_scripts_of_a_model(self, tmp_path: Path) -> None:
        scripts, textures = tmp_path / "scripts", tmp_path / "textures"
        scripts.mkdir()
        textures.mkdir()
        (textures / "wood.png").write_bytes(b"")
        (scripts / "a.material").write_text(
            "material Own/Green\n{\n technique\n {\n  pass\n  {\n   diffuse 0 0.5 0 1\n  }\n }\n}\n"
            "material Own/Wood : Own/Green\n{\n technique\n {\n  pass\n  {\n"
            "   texture_unit\n   {\n    texture wood.png\n   }\n  }\n }\n}\n",
            encoding="utf-8",
        )

        def resolve(uri: str) -> str | None:
            return str(tmp_path / uri.removeprefix("model://own/"))

        uris = "<uri>model://own/scripts</uri><uri>model://own/textures</uri>"
        green = self.material(f"<script>{uris}<name>Own/Green</name></script>", resolve)
        wood = self.material(f"<script>{uris}<name>Own/Wood</name></script>", resolve)
        assert green == ((0, 0.5, 0, 1), "", ())
        assert wood == ((1, 1, 1, 1), str(textures / "wood.png"), ())

    def test_an_unknown_name_is_told(self) -> None:
        color, _, warnings = self.material("<script><name>My/Typo</name></script>")
        assert color is None
        assert warnings == ("model:1: the material 'My/Typo' does not exist: the part is grey",)


class TestLinks:
    def test_defaults(self) -> None:
        link = read('<link name="a"/>').links["a"]
        assert link.inertial == Inertial(1.0, Pose(), (1, 0, 0, 1, 0, 1))
        assert link.has_gravity
        assert not link.self_collide

    def test_values(self) -> None:
        body = """<self_collide>1</self_collide><link name="a"><gravity>0</gravity>
            <velocity_decay><linear>0.1</linear><angular>0.2</angular></velocity_decay>
            <inertial><pose>0 0 1 0 0 0</pose><mass>3</mass>
            <inertia><ixx>1</ixx><ixy>2</ixy><ixz>3</ixz><iyy>4</iyy><iyz>5</iyz><izz>6</izz></inertia></inertial>
            <light name="l" type="spot"><diffuse>1 0 0 1</diffuse><attenuation><range>5</range></attenuation></light>
            </link>"""
        link = read(body).links["a"]
        assert link.inertial == Inertial(3.0, Pose((0, 0, 1)), (1, 2, 3, 4, 5, 6))
        assert (link.has_gravity, link.self_collide) == (False, True)
        assert (link.linear_damping, link.angular_damping) == (0.1, 0.2)
        assert [(light.name, light.kind, light.range) for light in link.lights] == [("l", "spot", 5.0)]

    @pytest.mark.parametrize("mass", ["0", "-1", "inf"])
    def test_a_mass_that_is_not_possible_is_named(self, mass: str) -> None:
        model = read(f'<link name="a"><inertial><mass>{mass}</mass></inertial></link>')
        assert model.links["a"].inertial.mass == 1.0
        assert f"link [a] has the mass {mass} kg, which is not possible" in model.warnings[0]

    def test_the_mass_of_a_static_model_does_not_matter(self) -> None:
        body = '<static>1</static><link name="a"><inertial><mass>0</mass></inertial></link>'
        assert read(body).warnings == ()

    def test_an_inertia_that_is_nan_is_named(self) -> None:
        model = read('<link name="a"><inertial><inertia><ixx>nan</ixx></inertia></inertial></link>')
        assert model.links["a"].inertial.inertia == (1, 0, 0, 1, 0, 1)
        assert "link [a] gets the inertia of SDF's default" in model.warnings[0]

    def test_sensors_and_plugins(self) -> None:
        body = """<link name="a"><sensor name="s" type="ray"><update_rate>20</update_rate>
            <topic>t</topic><pose>0 0 1 0 0 0</pose><plugin name="p" filename="libgazebo_ros_laser.so"/></sensor>
            <sensor name="broken"/></link><plugin name="q" filename="lib/own/libdrive.dylib"/><plugin name="r"/>"""
        model = read(body)
        sensor = model.links["a"].sensors[0]
        assert (sensor.name, sensor.kind, sensor.update_rate, sensor.topic) == ("s", "ray", 20.0, "t")
        assert [plugin.library for plugin in (*sensor.plugins, *model.plugins)] == [
            "gazebo_ros_laser",
            "drive",
        ]
        assert sorted(line.partition(": ")[2] for line in model.warnings) == [
            "plugin [r] has no filename and is left out",
            "sensor [broken] has no type and is left out",
        ]


class TestBadInput:
    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("<sdf", "model:1: not XML: unclosed token (column 0)"),
            ("<html/>", "model:1: the root is <html>: <sdf> or <robot> is expected"),
            ('<sdf version="1.6"/>', "model:1: there is no <model>"),
            ('<sdf version="1.6">\n<model name="m"/></sdf>', "model:2: model [m] has no links"),
            ('<sdf version="1.6"><model><link name="a"/></model></sdf>', "model:1: <model> has no name"),
            (
                '<sdf version="1.6"><model name="m"><link name="a"><pose>1 2 3</pose></link></model></sdf>',
                "model:1: <pose> has 3 numbers instead of 6: '1 2 3'",
            ),
            (
                '<sdf version="1.6"><model name="m"><link name="a"><pose>1 2 3 0 0 nan</pose></link></model></sdf>',
                "model:1: <pose> is '1 2 3 0 0 nan': NaN is not allowed",
            ),
            (
                '<sdf version="1.6"><model name="m"><link name="a"><pose>1 2 inf 0 0 0</pose></link></model></sdf>',
                "model:1: <pose> has an infinite number: '1 2 inf 0 0 0'",
            ),
            (
                '<sdf version="1.6"><model name="m"><static>maybe</static><link name="a"/></model></sdf>',
                "model:1: <static> is 'maybe': write true or false",
            ),
        ],
    )
    def test_what_cannot_be_used_is_one_line(self, text: str, why: str) -> None:
        with pytest.raises(SdfError) as caught:
            parse_model(text)
        assert str(caught.value) == why

    def test_models_inside_each_other_have_a_limit(self) -> None:
        text = (
            "".join(f'<model name="m{index}">' for index in range(40)) + '<link name="a"/>' + "</model>" * 40
        )
        with pytest.raises(SdfError, match="models are nested more than 16 levels deep"):
            parse_model(f'<sdf version="1.7">{text}</sdf>')

    def test_links_have_a_limit(self) -> None:
        links = "".join(f'<link name="l{index}"/>' for index in range(20))
        root = parse_document(f'<model name="m">{links}</model>', "model")
        with pytest.raises(SdfError, match="there are more than 10 links, joints and models"):
            read_model(root, new_source("model", no_files, max_parts=10))


class TestNested:
    def test_names_have_the_models_as_prefixes(self) -> None:
        body = """<link name="a"/><model name="arm"><pose>1 0 0 0 0 0</pose><link name="x"/><link name="y"/>
            <joint name="xy" type="revolute"><parent>x</parent><child>y</child>
            <axis><mimic joint="other"/></axis></joint>
            <joint name="fix" type="fixed"><parent>world</parent><child>x</child></joint>
            <plugin name="p" filename="libp.so"/></model>
            <joint name="mount" type="fixed"><parent>a</parent><child>arm::x</child></joint>"""
        model = read(body)
        assert list(model.links) == ["a", "arm::x", "arm::y"]
        assert model.links["arm::y"].pose.position == (1.0, 0.0, 0.0)
        assert [(each.name, each.parent, each.child) for each in model.joints.values()] == [
            ("arm::xy", "arm::x", "arm::y"),
            ("arm::fix", "world", "arm::x"),
            ("mount", "a", "arm::x"),
        ]
        mimic = model.joints["arm::xy"].mimic
        assert mimic is not None
        assert mimic.joint == "arm::other"
        assert [plugin.name for plugin in model.plugins] == ["p"]


class TestNumbers:
    JOINT = """<link name="a"/><link name="b"/><joint name="j" type="revolute"><parent>a</parent><child>b</child>
      <axis><xyz>0 0 1</xyz><dynamics>{}</dynamics></axis></joint>"""

    @pytest.mark.parametrize(
        ("body", "line"),
        [
            (JOINT.format("<damping>-1</damping>"), "<damping> is -1: it is 0 instead"),
            (JOINT.format("<friction>-0.5</friction>"), "<friction> is -0.5: it is 0 instead"),
            (
                '<link name="a"><velocity_decay><linear>-2</linear></velocity_decay></link>',
                "<linear> is -2: it is 0 instead",
            ),
            (
                '<link name="a"><sensor name="s" type="imu"><update_rate>-5</update_rate></sensor></link>',
                "<update_rate> is -5: it is 0 instead",
            ),
            (
                '<link name="a"><inertial><mass>-2</mass></inertial></link>',
                "link [a] has the mass -2 kg, which is not possible: it gets 1 kg",
            ),
            (
                '<link name="a"><inertial><mass>1e308</mass></inertial></link>',
                "link [a] has the mass inf kg, which is not possible: it gets 1 kg",
            ),
        ],
    )
    def test_numbers_below_zero_are_named(self, body: str, line: str) -> None:
        (warning,) = read(body).warnings
        assert warning.partition(": ")[2] == line

    @pytest.mark.parametrize("value", ["inf", "-inf", "1e308", "-1e17", "1e400"])
    @pytest.mark.parametrize("tag", ["damping", "friction", "spring_stiffness", "spring_reference"])
    def test_numbers_that_overflow_are_refused(self, tag: str, value: str) -> None:
        with pytest.raises(SdfError, match=f"<{tag}> has an infinite number: '{value}'"):
            read(self.JOINT.format(f"<{tag}>{value}</{tag}>"))
