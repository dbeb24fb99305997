"""Parse a robot description into a Robot. Like ROS's parser, reject faults that would make a robot move wrongly.

If ROS's parser reports a fault and continues (an invalid shape or mass), the part is ignored and recorded in
:attr:`Robot.problems`. Messages are the same as in ROS's parser; line numbers refer to the description.

Source: http://wiki.ros.org/urdf/XML/model, and the output of Debian's `check_urdf`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from minirospy.base.errors import UrdfError
from minirospy.core.urdf.elements import Element, parse_noted
from minirospy.core.urdf.joints import read_joint
from minirospy.core.urdf.links import ElementError, read_link, read_material
from minirospy.core.urdf.model import Joint, Link, Material, Problem, Robot

__all__ = ["parse_robot", "read_robot", "robot_from_element"]

_TREE = "Failed to build tree"
_ROOT = "Failed to find root link"


def read_robot(path: str | Path) -> Robot:
    """Return the robot described in a file. Raise UrdfError if the description is invalid, OSError if it cannot be read."""
    return parse_robot(Path(path).read_bytes(), str(path))


def parse_robot(text: str | bytes, file: str = "robot_description") -> Robot:
    """Parse a robot description. ``file`` is its name in errors. Raise UrdfError if the description is invalid."""
    parsed = parse_noted(text, file)
    robot = robot_from_element(parsed.root, file)
    notes = [Problem(note.line, (note.text,), is_warning=True) for note in parsed.notes]
    return replace(robot, problems=(*notes, *robot.problems))


def robot_from_element(root: Element, file: str = "robot_description") -> Robot:
    """Build the robot from a parsed description. Raise UrdfError as :func:`parse_robot` does."""
    if root.tag != "robot":
        raise UrdfError(file, root.line, "Could not find the 'robot' element in the xml file")
    if "name" not in root.attributes:
        raise UrdfError(file, root.line, "No name given for the robot.")
    _check_version(root, file)

    problems: list[Problem] = []
    materials = _read_materials(root, file, problems)
    links = _read_links(root, file, materials, problems)
    joints = _read_joints(root, file)
    _check_joints(file, links, joints)
    top = _find_root(file, root.line, links, joints)
    robot = Robot(root.attributes["name"], links, joints, materials, top, tuple(problems))
    suspicions = tuple(_suspicions(robot))
    return Robot(robot.name, links, joints, materials, top, (*problems, *suspicions))


def _check_version(root: Element, file: str) -> None:
    version = root.attributes.get("version", "1.0")
    numbers = version.split(".")
    if len(numbers) != 2 or not all(number.isdecimal() for number in numbers):
        raise UrdfError(file, root.line, "The version attribute should be in the form 'x.y'")
    if [number.lstrip("0") for number in numbers] != ["1", ""]:
        raise UrdfError(
            file, root.line, "Invalid 'version' specified; only version 1.0 is currently supported"
        )


def _read_materials(root: Element, file: str, problems: list[Problem]) -> dict[str, Material]:
    materials: dict[str, Material] = {}
    for element in root.all("material"):
        try:
            material = read_material(element, problems)
        except ElementError as error:
            problems.append(Problem(error.line, error.trail))
            continue
        if material.name in materials:
            raise UrdfError(file, element.line, f"material '{material.name}' is not unique.")
        if material.color is None and not material.texture:
            name = material.name
            trail = (f"Material [{name}] color has no rgba", f"Material [{name}] not defined in file")
            problems.append(Problem(element.line, trail))
        else:
            materials[material.name] = material
    return materials


def _read_links(
    root: Element, file: str, materials: dict[str, Material], problems: list[Problem]
) -> dict[str, Link]:
    links: dict[str, Link] = {}
    for element in root.all("link"):
        try:
            link = read_link(element, problems)
        except ElementError as error:
            raise UrdfError(file, error.line, error.trail[0], error.trail[1:]) from None
        if link.name in links:
            raise UrdfError(file, element.line, f"link '{link.name}' is not unique.")
        links[link.name] = link
    if not links:
        raise UrdfError(file, root.line, "No link elements found in urdf file")

    # Check this after all links have been read, because a material may be defined where it is first used.
    for link in links.values():
        for visual in link.visuals:
            if visual.material and (visual.material.color or visual.material.texture):
                materials.setdefault(visual.material.name, visual.material)
    for link in links.values():
        for visual in link.visuals:
            if visual.material and visual.material.name not in materials:
                why = f"link '{link.name}' material '{visual.material.name}' undefined."
                problems.append(Problem(link.line, (why,), is_warning=True))
    return links


def _read_joints(root: Element, file: str) -> dict[str, Joint]:
    joints: dict[str, Joint] = {}
    for element in root.all("joint"):
        try:
            joint = read_joint(element)
        except ElementError as error:
            trail = (*error.trail[1:], "joint xml is not initialized correctly")
            raise UrdfError(file, error.line, error.trail[0], trail) from None
        if joint.name in joints:
            raise UrdfError(file, element.line, f"joint '{joint.name}' is not unique.")
        joints[joint.name] = joint
    return joints


def _check_joints(file: str, links: dict[str, Link], joints: dict[str, Joint]) -> None:
    """Raise UrdfError if a joint refers to a link that does not exist."""
    for name in sorted(joints):
        joint = joints[name]
        if not joint.parent or not joint.child:
            why = f"{_TREE}: Joint [{name}] is missing a parent and/or child link specification."
            raise UrdfError(file, joint.line, why)
        if joint.child not in links:
            raise UrdfError(
                file, joint.line, f"{_TREE}: child link [{joint.child}] of joint [{name}] not found"
            )

        if joint.parent not in links:
            raise UrdfError(
                file,
                joint.line,
                f"{_TREE}: parent link [{joint.parent}] of joint [{name}] not found.  This is not valid according to the "
                "URDF spec. Every link you refer to from a joint needs to be explicitly defined in the robot description. "
                f"To fix this problem you can either remove this joint [{name}] from your urdf file, or add "
                f'"<link name="{joint.parent}" />" to your urdf file.',
            )


def _find_root(file: str, line: int, links: dict[str, Link], joints: dict[str, Joint]) -> str:
    """Return the link without a parent. Raise UrdfError if there is not exactly one."""
    children = {joint.child for joint in joints.values()}
    roots = [name for name in sorted(links) if name not in children]
    if not roots:
        raise UrdfError(file, line, f"{_ROOT}: No root link found. The robot xml is not a valid tree.")
    if len(roots) > 1:
        why = f"{_ROOT}: Two root links found: [{roots[0]}] and [{roots[1]}]"
        raise UrdfError(file, links[roots[1]].line, why)
    return roots[0]


def _suspicions(robot: Robot) -> list[Problem]:
    """Return the faults that ROS's parser silently accepts but that a frame tree cannot represent."""
    found = []
    for joint in robot.joints.values():
        above = robot.parent_joint(joint.child)
        if above and above is not joint:
            why = f"link [{joint.child}] has two parents: joint [{joint.name}] and joint [{above.name}]"
            found.append(Problem(joint.line, (why,), is_warning=True))
        if joint.mimic and joint.mimic.joint not in robot.joints:
            why = f"joint [{joint.name}] mimics joint [{joint.mimic.joint}], which is not in this robot"
            found.append(Problem(joint.line, (why,), is_warning=True))

    reached, waiting = {robot.root}, [robot.root]
    while waiting:
        below = [joint.child for joint in robot.child_joints(waiting.pop()) if joint.child not in reached]
        reached.update(below)
        waiting += below
    for name in robot.links.keys() - reached:
        why = f"link [{name}] is part of a loop, and not connected to the root link [{robot.root}]"
        found.append(Problem(robot.links[name].line, (why,), is_warning=True))
    return sorted(found)
