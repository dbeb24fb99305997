"""Robot descriptions with ``<gazebo>`` tags, as sdformat converts them (sdformat.json), and what minirospy does differently."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Box, Inertial, MeshShape, Mimic, Model, Pose
from minirospy.core.sdf.read import parse_model, parse_urdf

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from sdf_robots import (  # noqa: E402 (the folder is not a package)
    BALL,
    BOX,
    CASES,
    INERTIAL,
    LIMIT,
    RANDOM,
    SENSOR,
    joint,
    random_robot,
    resolve,
    robot,
    summary,
)

OURS = {
    "random 3": "sdformat leaves out the links below a massless link, even if a fixed joint merges that link"
}

RECORDED: dict[str, Any] = json.loads((HERE / "sdformat.json").read_text(encoding="utf-8"))
TEXTS = {**CASES, **{f"random {seed}": random_robot(seed) for seed in RANDOM}}


def differences(own: Any, theirs: Any, path: str = "") -> list[str]:
    """Return the paths of values that differ by more than rounding."""
    if isinstance(own, float) and isinstance(theirs, float):
        return (
            [] if own == pytest.approx(theirs, rel=1e-4, abs=2e-5) else [f"{path}: {own} instead of {theirs}"]
        )
    if isinstance(own, dict) and isinstance(theirs, dict) and list(own) == list(theirs):
        return [each for key in own for each in differences(own[key], theirs[key], f"{path}/{key}")]
    if isinstance(own, list) and isinstance(theirs, list) and len(own) == len(theirs):
        pairs = enumerate(zip(own, theirs, strict=True))
        return [each for index, pair in pairs for each in differences(*pair, f"{path}/{index}")]
    return [] if own == theirs else [f"{path}: {own} instead of {theirs}"]


@pytest.mark.parametrize("name", TEXTS)
def test_robots_become_the_models_that_sdformat_makes(name: str) -> None:
    own = summary(parse_urdf(TEXTS[name], resolve))
    if name in OURS:
        assert own["links"].keys() > RECORDED[name]["links"].keys(), OURS[name]
        return
    assert differences(own, RECORDED[name]) == []


def model(*parts: str, **options: Any) -> Model:
    return parse_urdf(robot(*parts), resolve, **options)


class TestLumping:
    def test_masses_add_about_the_common_centre(self) -> None:
        other = INERTIAL.replace('value="2"', 'value="6"')
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="b">{other}</link>',
            joint("j", "fixed", "a", "b", '<origin xyz="4 0 0"/>'),
        )
        # 2 kg at 0 and 6 kg at 4 m: the centre is at 3 m, and 2 * 3^2 + 6 * 1^2 = 24 kg m^2 are added.
        expected = Inertial(8.0, Pose((3.0, 0.0, 0.0)), (0.2, 0.0, 0.0, 24.4, 0.02, 24.6))
        assert read.links["a"].inertial.mass == expected.mass
        assert read.links["a"].inertial.pose == expected.pose
        assert read.links["a"].inertial.inertia == pytest.approx(expected.inertia)

    def test_merged_links_are_listed_with_their_poses(self) -> None:
        read = parse_urdf(CASES["chain of fixed joints"], resolve)
        assert {name: target for name, (target, _) in read.lumped.items()} == {"b": "a", "c": "a"}
        assert read.lumped["b"][1].position == (1.0, 2.0, 3.0)

    def test_links_below_a_massless_merged_link_stay(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="mount"/><link name="b">{INERTIAL}</link>',
            joint("j", "fixed", "a", "mount", '<origin xyz="0 0 1"/>'),
            joint("k", "continuous", "mount", "b"),
        )
        assert list(read.links) == ["a", "b"]
        assert read.joints["k"].parent == "a"
        assert read.links["b"].pose.position == (0.0, 0.0, 1.0)

    def test_a_contact_sensor_of_a_merged_link_finds_its_collision(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}{BOX}</link><link name="b">{BOX}</link>',
            joint("j", "fixed", "a", "b"),
            '<gazebo reference="b"><sensor name="s" type="contact"><contact><collision>b_collision</collision>',
            "</contact></sensor></gazebo>",
        )
        contact = read.links["a"].sensors[0].element.first("contact")
        assert contact is not None
        assert [each.text for each in contact.children] == ["a_fixed_joint_lump__b_collision_1"]
        assert read.links["a"].collisions[1].name == "a_fixed_joint_lump__b_collision_1"

    def test_friction_applies_to_collisions_with_a_name(self) -> None:
        named = BOX.replace("<collision>", '<collision name="hull">')
        read = model(
            f'<link name="a">{INERTIAL}{named}</link>',
            '<gazebo reference="a"><mu1>0.5</mu1><mu2>0.25</mu2></gazebo>',
        )
        collision = read.links["a"].collisions[0]
        assert (collision.name, collision.surface.mu, collision.surface.mu2) == (
            "a_fixed_joint_lump__hull_collision",
            0.5,
            0.25,
        )


class TestWarnings:
    def test_a_massless_link_is_named_with_the_number_of_links_below_it(self) -> None:
        read = parse_urdf(CASES["massless leaf and what is below"], resolve)
        assert list(read.links) == ["a"]
        assert read.warnings == (
            "robot_description:3: link [b] has no <inertial>: it, and the link below it are left out",
        )

    def test_a_zero_mass_is_named(self) -> None:
        zero = INERTIAL.replace('value="2"', 'value="0"')
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="b">{zero}</link>',
            joint("j", "continuous", "a", "b"),
        )
        assert read.warnings == ("robot_description:3: link [b] has no mass: it is left out",)

    def test_a_robot_without_masses_is_refused(self) -> None:
        with pytest.raises(SdfError, match="robot_description:3: no link is left: the root link has no mass"):
            model('<link name="a"/>')

    @pytest.mark.parametrize("kind", ["floating", "planar"])
    def test_the_child_of_an_unknown_joint_is_free(self, kind: str) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link>',
            joint("j", kind, "a", "b", '<origin xyz="0 0 1"/>'),
        )
        assert not read.joints
        assert read.links["b"].pose.position == (0.0, 0.0, 1.0)
        assert read.warnings == (
            f"robot_description:4: joint [j] is {kind}, which Gazebo does not know: link [b] is free",
        )

    def test_a_reference_to_nothing_is_named(self) -> None:
        read = model(f'<link name="a">{INERTIAL}</link>', '<gazebo reference="typo"><mu1>1</mu1></gazebo>')
        assert read.warnings == (
            'robot_description:4: <gazebo reference="typo"> is left out: no link or joint has this name',
        )

    def test_a_missing_mesh_leaves_out_the_shape_only(self) -> None:
        mesh = '<visual><geometry><mesh filename="package://x/y.dae"/></geometry></visual>'
        read = parse_urdf(robot(f'<link name="a">{INERTIAL}{mesh}</link>'), lambda _: None)
        assert read.links["a"].visuals == ()
        assert read.warnings == (
            "robot_description:3: visual [a_visual] is left out: the mesh package://x/y.dae does not exist",
        )

    def test_a_plugin_of_a_link_is_named(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link>',
            '<gazebo reference="a"><plugin name="p" filename="libp.so"/></gazebo>',
        )
        assert read.plugins == ()
        assert "plugin [p] of link [a] is left out" in read.warnings[0]


class TestParts:
    def test_colours_of_the_description_are_kept(self) -> None:
        ball = BALL.replace(
            "</visual>", '<material name="m"><color rgba="0.1 0.2 0.3 0.5"/></material></visual>'
        )
        read = model(f'<link name="a">{INERTIAL}{ball}</link>')
        assert read.links["a"].visuals[0].material.color == (0.1, 0.2, 0.3, 0.5)

    def test_gazebos_material_wins_over_the_colour(self) -> None:
        ball = BALL.replace(
            "</visual>", '<material name="m"><color rgba="0.1 0.2 0.3 1"/></material></visual>'
        )
        read = model(
            f'<link name="a">{INERTIAL}{ball}</link>',
            '<gazebo reference="a"><material>Gazebo/Orange</material></gazebo>',
        )
        material = read.links["a"].visuals[0].material
        assert (material.script, material.color) == ("Gazebo/Orange", (1.0, 0.5088, 0.0468, 1.0))

    def test_an_unknown_material_leaves_the_colour(self) -> None:
        ball = BALL.replace(
            "</visual>", '<material name="m"><color rgba="0.1 0.2 0.3 1"/></material></visual>'
        )
        read = model(
            f'<link name="a">{INERTIAL}{ball}</link>',
            '<gazebo reference="a"><material>Gazebo/Typo</material></gazebo>',
        )
        assert read.links["a"].visuals[0].material.color == (0.1, 0.2, 0.3, 1.0)
        assert "the material 'Gazebo/Typo' does not exist" in read.warnings[0]

    def test_materials_are_referred_to_by_name(self) -> None:
        ball = BALL.replace("</visual>", '<material name="m"/></visual>')
        read = model(
            '<material name="m"><color rgba="1 0 1 1"/><texture filename="file:///t.png"/></material>',
            f'<link name="a">{INERTIAL}{ball}</link>',
        )
        material = read.links["a"].visuals[0].material
        assert (material.color, material.texture) == ((1.0, 0.0, 1.0, 1.0), "/existing")

    def test_mimic_and_initial_position_are_read(self) -> None:
        read = model(
            *(f'<link name="{name}">{INERTIAL}</link>' for name in "abc"),
            joint("j", "revolute", "a", "b", LIMIT),
            joint("k", "revolute", "a", "c", f'{LIMIT}<mimic joint="j" multiplier="-1" offset="0.5"/>'),
            '<gazebo reference="j"><initial_joint_position>0.25</initial_joint_position></gazebo>',
        )
        assert read.joints["k"].mimic == Mimic("j", -1.0, 0.5)
        assert read.joints["j"].axis.initial_position == 0.25

    def test_plugins_and_static_are_those_of_the_robot(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link>',
            '<gazebo><plugin name="p" filename="libgazebo_ros_diff_drive.so"><a>1</a></plugin></gazebo>',
            "<gazebo><static>true</static></gazebo>",
        )
        assert [(each.name, each.library) for each in read.plugins] == [("p", "gazebo_ros_diff_drive")]
        assert read.is_static

    def test_a_joint_in_gazebo_closes_a_loop(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link><link name="tip">{INERTIAL}</link>',
            joint("j", "continuous", "a", "b", '<origin xyz="1 0 0"/>'),
            joint("k", "fixed", "b", "tip", '<origin xyz="0 0 2"/>'),
            '<gazebo><joint name="loop" type="revolute"><parent>a</parent><child>tip</child>',
            "<axis><xyz>0 1 0</xyz></axis></joint></gazebo>",
        )
        loop = read.joints["loop"]
        assert (loop.parent, loop.child, loop.pose.position) == ("a", "b", (0.0, 0.0, 2.0))

    def test_sensors_of_merged_links_move_along(self) -> None:
        read = model(
            f'<link name="a">{INERTIAL}</link><link name="b"/>',
            joint("j", "fixed", "a", "b", '<origin xyz="0 0 1"/>'),
            f'<gazebo reference="b">{SENSOR}</gazebo>',
        )
        sensor = read.links["a"].sensors[0]
        assert (sensor.name, sensor.kind, sensor.update_rate) == ("s", "ray", 5.0)
        assert sensor.pose.position == (1.0, 0.0, 1.0)

    def test_a_mesh_is_a_path(self) -> None:
        mesh = (
            '<collision><geometry><mesh filename="package://x/y.stl" scale="1 2 3"/></geometry></collision>'
        )
        read = model(f'<link name="a">{INERTIAL}{mesh}</link>')
        assert read.links["a"].collisions[0].geometry == MeshShape("/existing", (1.0, 2.0, 3.0))

    def test_the_name_can_be_replaced(self) -> None:
        assert model(f'<link name="a">{INERTIAL}</link>', name="other").name == "other"

    def test_a_link_and_a_joint_may_have_the_same_name(self) -> None:
        read = model(
            *(f'<link name="{name}">{INERTIAL}{BOX}</link>' for name in "abc"),
            joint("b", "continuous", "a", "c", '<origin xyz="5 0 0"/>'),
            joint("c", "continuous", "c", "b", '<origin xyz="0 1 0"/>'),
        )
        assert read.links["b"].pose.position == (5.0, 1.0, 0.0)
        assert read.joints["b"].pose.position == (0.0, 0.0, 0.0)
        assert read.links["a"].collisions[0].geometry == Box((1.0, 2.0, 3.0))


class TestText:
    def test_a_declaration_with_version_1_is_accepted(self) -> None:
        text = robot(f'<link name="a">{INERTIAL}</link>').replace('version="1.0"', 'version="1"')
        assert list(parse_urdf("\n  " + text, resolve).links) == ["a"]

    def test_comments_with_dashes_and_lone_ampersands_are_accepted(self) -> None:
        read = model(f'<!-- a -- b --><link name="a">{INERTIAL}</link>', "<gazebo><x>a & b</x></gazebo>")
        assert list(read.links) == ["a"]

    def test_bytes_and_both_formats_are_told_apart(self) -> None:
        text = robot(f'<link name="a">{INERTIAL}</link>').encode()
        assert list(parse_model(text, resolve).links) == ["a"]

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("", "robot_description: the file is empty"),
            ("<robot>", "robot_description:1: not XML: no element found"),
            ("<robot/>", "robot_description:1: No name given for the robot."),
            ('<robot name="r"><link name="a"/><link name="a"/></robot>', "link 'a' is not unique"),
            ("<a>" * 200, "tags are nested deeper than 100 levels"),
        ],
    )
    def test_what_cannot_be_used_is_one_line(self, text: str, why: str) -> None:
        with pytest.raises(SdfError) as caught:
            parse_urdf(text, resolve)
        assert why in str(caught.value)
        assert "\n" not in str(caught.value)
