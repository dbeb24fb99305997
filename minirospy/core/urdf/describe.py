"""A robot as text: its tree in the format that `check_urdf` prints, and as a graph for graphviz."""

from __future__ import annotations

from collections.abc import Iterator

from minirospy.base.errors import UrdfError
from minirospy.core.urdf.model import Problem, Robot
from minirospy.core.urdf.poses import quaternion_from_rpy, rpy_from_quaternion

__all__ = ["dot_graph", "error_lines", "problem_lines", "tree_lines"]


def tree_lines(robot: Robot) -> Iterator[str]:
    """Yield the lines that `check_urdf` prints for a robot."""
    yield f"robot name is: {robot.name}"
    yield "---------- Successfully Parsed XML ---------------"
    yield f"root Link: {robot.root} has {len(robot.child_joints(robot.root))} child(ren)"
    # Iterate instead of recursing, because trees may be deep.
    # Visit each link's children only once, because links may have many parents.
    shown = {robot.root}
    waiting = [(1, *child) for child in _numbered(robot, robot.root)]
    while waiting:
        level, number, link = waiting.pop()
        yield f"{'    ' * level}child({number}):  {link}"
        if link not in shown:
            shown.add(link)
            waiting += [(level + 1, *child) for child in _numbered(robot, link)]


def _numbered(robot: Robot, link: str) -> list[tuple[int, str]]:
    """Return (number, name) for each child of a link, last child first. The first child's number is 1."""
    return [*enumerate((joint.child for joint in robot.child_joints(link)), 1)][::-1]


def dot_graph(robot: Robot) -> str:
    """Return the links and joints as text for graphviz, in the format that `urdf_to_graphviz` writes."""
    links, edges = [], []
    waiting = [robot.root]
    seen = set()
    while waiting:
        link = waiting.pop()
        if link in seen:
            continue
        seen.add(link)
        links.append(f"{_quoted(link)} [label={_quoted(link)}];")
        if link != robot.root:
            joint = robot.parent_joint(link)
            assert joint is not None
            x, y, z = joint.origin.xyz
            roll, pitch, yaw = rpy_from_quaternion(quaternion_from_rpy(*joint.origin.rpy))
            label = f"xyz: {x:g} {y:g} {z:g} \\nrpy: {roll:g} {pitch:g} {yaw:g}"
            edges.append(f'{_quoted(joint.parent)} -> {_quoted(joint.name)} [label="{label}"]')
            edges.append(f"{_quoted(joint.name)} -> {_quoted(link)}")
        waiting += [joint.child for joint in reversed(robot.child_joints(link))]

    head = ["digraph G {", "node [shape=box];"]
    return "\n".join([*head, *links, "node [shape=ellipse, color=blue, fontcolor=blue];", *edges, "}"]) + "\n"


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def error_lines(error: UrdfError) -> Iterator[str]:
    """Yield the messages that ROS's parser prints about an invalid description, each with its location."""
    for text in error.trail:
        yield f"Error:   {text}"
        yield f"         at line {error.line} in {error.file}" if error.line else f"         in {error.file}"


def problem_lines(problem: Problem, file: str) -> Iterator[str]:
    """Yield the messages about a fault that leaves the robot usable, in the format of ROS's parser."""
    level = "Warning:" if problem.is_warning else "Error:  "
    for text in problem.trail:
        yield f"{level} {text}"
        yield f"         at line {problem.line} in {file}"
