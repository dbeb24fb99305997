"""Robot descriptions for which sdformat.json has sdformat's models, and the summary of a model that is compared."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any, TypeVar

from minirospy.core.sdf.inertias import Inertia, turned_inertia
from minirospy.core.sdf.model import Model, Pose

_T = TypeVar("_T")

MESH = "/existing"
RANDOM = range(20)


def resolve(_: str) -> str:
    """Return one path for all files."""
    return MESH


INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0.01"/></inertial>'
BOX = '<collision><geometry><box size="1 2 3"/></geometry></collision>'
BALL = '<visual><geometry><sphere radius="0.5"/></geometry></visual>'


def joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'
    )


def robot(*parts: str) -> str:
    return '<?xml version="1.0"?>\n<robot name="r">\n' + "\n".join(parts) + "\n</robot>\n"


LIMIT = '<limit lower="-1" upper="2" effort="3" velocity="4"/>'
SENSOR = '<sensor name="s" type="ray"><pose>1 0 0 0 0 1</pose><update_rate>5</update_rate></sensor>'

CASES = {
    "one link": robot(f'<link name="a">{INERTIAL}{BOX}{BOX}{BALL}</link>'),
    "massless root": robot(
        f'<link name="a"/><link name="b">{INERTIAL}{BOX}</link>',
        joint("j", "fixed", "a", "b", '<origin xyz="0 0 1" rpy="0 0 1"/>'),
    ),
    "chain of fixed joints": robot(
        f'<link name="a">{INERTIAL}{BOX}</link><link name="b">{INERTIAL}{BOX}{BALL}</link>',
        f'<link name="c">{INERTIAL}{BOX}{BOX}</link><link name="d">{INERTIAL}</link>',
        joint("ab", "fixed", "a", "b", '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>'),
        joint("bc", "fixed", "b", "c", '<origin xyz="0 1 0" rpy="1 0 0"/>'),
        joint("cd", "revolute", "c", "d", f'<origin xyz="0 0 1"/><axis xyz="0 1 0"/>{LIMIT}'),
    ),
    "massless leaf and what is below": robot(
        f'<link name="a">{INERTIAL}</link><link name="b"/><link name="c">{INERTIAL}</link>',
        joint("ab", "continuous", "a", "b"),
        joint("bc", "continuous", "b", "c"),
    ),
    "world": robot(
        f'<link name="world"/><link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link>',
        joint("wa", "fixed", "world", "a", '<origin xyz="1 2 3"/>'),
        joint(
            "ab", "prismatic", "a", "b", f'<axis xyz="1 0 0"/>{LIMIT}<dynamics damping="0.5" friction="0.6"/>'
        ),
    ),
    "preserved and disabled": robot(
        *(f'<link name="{name}">{INERTIAL}</link>' for name in "abcd"),
        *(joint(f"a{name}", "fixed", "a", name, f'<origin xyz="{ord(name)} 0 0"/>') for name in "bcd"),
        '<gazebo reference="ab"><preserveFixedJoint>true</preserveFixedJoint></gazebo>',
        '<gazebo reference="ac"><disableFixedJointLumping>true</disableFixedJointLumping></gazebo>',
        '<gazebo reference="ad"><preserveFixedJoint>1</preserveFixedJoint>',
        "<disableFixedJointLumping>1</disableFixedJointLumping></gazebo>",
    ),
    "switched limits": robot(
        f'<link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link>',
        joint("j", "revolute", "a", "b", '<limit lower="2" upper="-1" effort="3" velocity="4"/>'),
    ),
    "tags of a lumped link": robot(
        f'<link name="a">{INERTIAL}{BOX}</link><link name="b">{INERTIAL}{BOX}{BALL}</link>',
        joint("ab", "fixed", "a", "b", '<origin xyz="0 0 1" rpy="0 0 1.5"/>'),
        '<gazebo reference="a"><mu1>0.1</mu1><mu2 value="0.2"/><selfCollide>true</selfCollide></gazebo>',
        '<gazebo reference="b"><mu1>0.3</mu1><kp>100</kp><kd>2</kd><minDepth>0.01</minDepth><maxVel>0.5</maxVel>',
        f"<fdir1>1 0 0</fdir1><material>Gazebo/Red</material>{SENSOR}<turnGravityOff>true</turnGravityOff>",
        "<dampingFactor>0.7</dampingFactor></gazebo>",
    ),
    "springs and feedback": robot(
        f'<link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link>',
        joint("j", "revolute", "a", "b", LIMIT),
        '<gazebo reference="j"><springStiffness>3</springStiffness><springReference>0.5</springReference>',
        "<provideFeedback>true</provideFeedback><implicitSpringDamper>1</implicitSpringDamper></gazebo>",
    ),
}


class _Choice(random.Random):
    """Random values that are the same in each version of Python, because only :meth:`random` is used."""

    def one(self, values: Sequence[_T]) -> _T:
        return values[int(self.random() * len(values))]

    def number(self) -> float:
        return round(4 * self.random() - 2, 3)

    def positive(self) -> float:
        return round(2 * self.random() + 0.1, 3)

    def likely(self, probability: float) -> bool:
        return self.random() < probability


def random_robot(seed: int) -> str:
    """Return a random tree of links. Only the last ones may have no mass, and no joint is floating or planar."""
    choice = _Choice(seed)
    count = 2 + int(8 * choice.random())
    names = [choice.one(("world", "l0", "l0", "l0")), *(f"l{index}" for index in range(1, count))]
    parts = []
    for index, name in enumerate(names):
        has_mass = name != "world" and (index < count - 2 or choice.likely(0.6))
        shapes = [_shape(choice, "collision") for _ in range(choice.one((0, 1, 1, 2)))]
        shapes += [_shape(choice, "visual") for _ in range(choice.one((0, 1, 1, 2)))]
        parts.append(f'<link name="{name}">{_inertial(choice) if has_mass else ""}{"".join(shapes)}</link>')
    for index in range(1, count):
        kind = choice.one(("fixed", "fixed", "fixed", "revolute", "continuous", "prismatic"))
        above = max(0, index - 3)
        parent = names[above + int(choice.random() * (index - above))]
        name = f"{choice.one('abcdefgh')}{index}"
        parts.append(joint(name, kind, parent, names[index], _joint_parts(choice, kind)))
        if choice.likely(0.25):
            parts.append(f'<gazebo reference="{name}">{choice.one(_JOINT_TAGS)}</gazebo>')
    parts += [
        f'<gazebo reference="{name}">{_tags(choice, name)}</gazebo>' for name in names if choice.likely(0.5)
    ]
    return robot(*parts)


_JOINT_TAGS = (
    "<preserveFixedJoint>true</preserveFixedJoint>",
    "<disableFixedJointLumping>true</disableFixedJointLumping>",
    "<springStiffness>3</springStiffness><springReference>.5</springReference>",
)


def _origin(choice: _Choice) -> str:
    if choice.likely(0.2):
        return ""
    xyz = " ".join(str(choice.number()) for _ in range(3))
    return f'<origin xyz="{xyz}" rpy="{choice.number()} {choice.number() / 2} {choice.number()}"/>'


def _shape(choice: _Choice, tag: str) -> str:
    shape = choice.one(
        (
            f'<box size="{choice.positive()} 1 2"/>',
            f'<cylinder radius="{choice.positive()}" length="1"/>',
            '<sphere radius=".5"/>',
            '<mesh filename="package://a/b.stl" scale="1 2 3"/>',
        )
    )
    return f"<{tag}>{_origin(choice)}<geometry>{shape}</geometry></{tag}>"


def _inertial(choice: _Choice) -> str:
    xx, yy, zz = (round(1 + choice.random(), 3) for _ in range(3))
    xy, xz, yz = (round(choice.number() / 10, 3) for _ in range(3))
    return (
        f'<inertial>{_origin(choice)}<mass value="{choice.one((0.1, 1, 2.5, 3))}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>'
    )


def _joint_parts(choice: _Choice, kind: str) -> str:
    origin = _origin(choice)
    if kind == "fixed":
        return origin
    axis = f'<axis xyz="{choice.number()} {choice.number()} {choice.number()}"/>'
    limit = f'<limit lower="{choice.number()}" upper="{choice.number()}" effort="{choice.positive()}" velocity="1"/>'
    dynamics = f'<dynamics damping="{choice.positive()}" friction="0.2"/>' if choice.likely(0.4) else ""
    return origin + axis + (limit if kind != "continuous" or choice.likely(0.5) else "") + dynamics


def _tags(choice: _Choice, name: str) -> str:
    values: list[tuple[str, Any]] = [
        ("mu1", choice.positive()), ("mu2", choice.positive()), ("kp", 1000.0), ("kd", choice.positive()),
        ("minDepth", 0.001), ("maxVel", 0.5), ("fdir1", "0 1 0"), ("selfCollide", "true"),
        ("turnGravityOff", choice.one(("true", "false"))), ("dampingFactor", choice.positive()),
        ("material", "Gazebo/Red"), ("gravity", choice.one(("true", "false"))), ("unknownTag", "x"),
    ]  # fmt: skip
    tags = [f"<{tag}>{value}</{tag}>" for tag, value in values if choice.likely(0.25)]
    if choice.likely(0.3):
        tags.append(SENSOR.replace('"s"', f'"s_{name}"'))
    return "".join(tags)


def summary(model: Model) -> dict[str, Any]:
    """Return what is compared: names, poses, masses, shapes, surfaces, joints."""
    return {
        "links": {link.name: _link_summary(link) for link in model.links.values()},
        "joints": {
            each.name: [
                # sdformat's joints that turn without limits are revolute.
                {"continuous": "revolute"}.get(each.kind, each.kind),
                each.parent,
                each.child,
                _pose(each.pose),
                [_rounded(value) for value in (*each.axis.xyz, *each.axis[1:])],
            ]
            for each in model.joints.values()
        },
    }


def _link_summary(link: Any) -> dict[str, Any]:
    inertia: Inertia = turned_inertia(link.inertial.inertia, link.inertial.pose.orientation)
    return {
        "pose": _pose(link.pose),
        "mass": _rounded(link.inertial.mass),
        "centre": [_rounded(value) for value in link.inertial.pose.position],
        "inertia": [_rounded(value) for value in inertia],
        "collisions": [
            [
                each.name,
                _pose(each.pose),
                type(each.geometry).__name__,
                [_plain(value) for value in each.surface],
            ]
            for each in link.collisions
        ],
        "visuals": [[each.name, _pose(each.pose), each.material.script] for each in link.visuals],
        "sensors": [[each.name, each.kind, _pose(each.pose), each.update_rate] for each in link.sensors],
        "flags": [link.has_gravity, link.self_collide, _rounded(link.linear_damping)],
    }


def _pose(pose: Pose) -> list[float]:
    x, y, z, w = pose.orientation
    sign = -1.0 if max((x, y, z, w), key=abs) < 0 else 1.0
    return [_rounded(value) for value in (*pose.position, *(sign * value for value in (x, y, z, w)))]


def _plain(value: Any) -> Any:
    return [_rounded(part) for part in value] if isinstance(value, tuple) else _rounded(value)


def _rounded(value: float) -> float:
    return float(f"{value:.5g}") if abs(value) > 1e-6 else 0.0
