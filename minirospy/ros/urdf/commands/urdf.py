"""`check_urdf` and `urdf_to_graphviz` (old name: `urdf_to_graphiz`): print or draw a robot description's tree.

The output is the same as that of liburdfdom-tools, except that line numbers refer to the description instead of the tools'
source code. The exit status is 255 if the description cannot be read, as in liburdfdom-tools. Source:
http://wiki.ros.org/urdf#Verification.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.errors import MinirospyError, UrdfError, UsageError
from minirospy.base.escape import escaped
from minirospy.command.command import RosText, WordedError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.core.urdf.describe import dot_graph, error_lines, problem_lines, tree_lines
from minirospy.core.urdf.model import Robot
from minirospy.core.urdf.poses import quaternion_from_rpy, rpy_from_quaternion

__all__ = ["CHECK", "GRAPHIZ", "GRAPHVIZ", "check_urdf", "urdf_to_graphiz", "urdf_to_graphviz"]

_FAILED = 255
_NO_FILE = "Expect URDF xml file to parse"
_NOT_PARSED = "ERROR: Model Parsing the xml failed"
_USAGE = """\
Usage: urdf_to_graphviz input.xml [OUTPUT]  Will create either $ROBOT_NAME.gv & $ROBOT_NAME.pdf in CWD  \
or OUTPUT.gv & OUTPUT.pdf."""
_OLD_NAME = "WARNING: The executable named 'urdf_to_graphiz' is deprecated. Use 'urdf_to_graphviz' instead."
_NO_OUTPUT = "WARNING: OUTPUT not given. This type of usage is deprecated!"


def check_urdf(argv: Sequence[str] | None = None) -> int:
    """Run check_urdf; return 0, or 255 if the description cannot be read."""
    return CHECK.main(argv)


def urdf_to_graphviz(argv: Sequence[str] | None = None) -> int:
    """Run urdf_to_graphviz; return 0, or 255 if the description cannot be read."""
    return GRAPHVIZ.main(argv)


def urdf_to_graphiz(argv: Sequence[str] | None = None) -> int:
    """Run urdf_to_graphviz under its old name, with a warning."""
    return GRAPHIZ.main(argv)


def _check_parser() -> Parser:
    parser = Parser("check_urdf", "Read a robot description, and print the tree of its links.")
    parser.add_argument("file", nargs="?", help="the description, as robot.urdf", completer="files")
    return parser


def _check(file: str | None) -> None:
    if file is None:
        raise WordedError(UsageError("type check_urdf FILE"), RosText(_NO_FILE, _FAILED))
    robot = _read(file)
    for line in tree_lines(robot):
        print(escaped(line))


def _graph_parser(prog: str) -> Parser:
    parser = Parser(
        prog, "Draw the links and joints of a robot description with graphviz; without it as SVG."
    )
    parser.add_argument("file", nargs="?", help="the description, as robot.urdf", completer="files")
    parser.add_argument(
        "output",
        nargs="?",
        help="the drawing's name without its ending (the robot's name)",
        completer="nothing",
    )
    return parser


def _graphiz(file: str | None, output: str | None) -> None:
    print(_OLD_NAME, file=sys.stderr)
    _graph(file, output)


def _graph(file: str | None, output: str | None) -> None:
    if file is None:
        raise WordedError(UsageError("type urdf_to_graphviz FILE OUTPUT"), RosText(_USAGE, _FAILED))
    if output is None:
        print(_NO_OUTPUT + _USAGE, file=sys.stderr)
    robot = _read(file)
    name = robot.name if output is None else output
    # The file may be untrusted, so the robot's name must not determine where files are written.
    if output is None and (not name or name != Path(name).name or name.startswith(".") or "\\" in name):
        raise UsageError(f"the robot's name [{name}] is not a file's name: name the OUTPUT")

    Path(f"{name}.gv").write_text(dot_graph(robot), encoding="utf-8")
    print(f"Created file {name}.gv")
    if dot := shutil.which("dot"):
        done = subprocess.run([dot, "-Tpdf", f"{name}.gv", "-o", f"{name}.pdf"], check=False)
        if done.returncode:
            raise MinirospyError(f"`dot` could not draw {name}.gv: exit status {done.returncode}")
        print(f"Created file {name}.pdf")
    else:
        Path(f"{name}.svg").write_text(_picture(robot), encoding="utf-8")
        print(f"Created file {name}.svg (graphviz, which makes a PDF, is not installed)")


def _picture(robot: Robot) -> str:
    from minirospy.base.tree_svg import Edge, tree_svg

    edges = []
    for name, joint in robot.joints.items():
        x, y, z = joint.origin.xyz
        roll, pitch, yaw = rpy_from_quaternion(quaternion_from_rpy(*joint.origin.rpy))
        pose = (f"xyz: {x:g} {y:g} {z:g}", f"rpy: {roll:g} {pitch:g} {yaw:g}")
        # Put spaces around the joint's name, because a joint and a link may have the same name.
        edges += [Edge(joint.parent, f" {name} ", pose), Edge(f" {name} ", joint.child)]
    return tree_svg(edges, robot.name, alone=[robot.root], round_=[f" {name} " for name in robot.joints])


def _read(file: str) -> Robot:
    """Read a robot description from a file and print its problems. Raise WordedError if it cannot be read or parsed."""
    from minirospy.core.urdf.read import read_robot

    try:
        robot = read_robot(file)
    except UrdfError as error:
        ros = "\n".join([*map(escaped, error_lines(error)), _NOT_PARSED])
        raise WordedError(error, RosText(ros, _FAILED)) from error
    except OSError as error:
        ros = f"Error:   Error document empty.\n{_NOT_PARSED}"
        raise WordedError(MinirospyError(f"{file}: {error.strerror}"), RosText(ros, _FAILED)) from error
    for problem in robot.problems:
        for line in problem_lines(problem, file):
            print(escaped(line), file=sys.stderr)
    return robot


CHECK = Command("check_urdf", _check_parser, _check)
GRAPHVIZ = Command("urdf_to_graphviz", lambda: _graph_parser("urdf_to_graphviz"), _graph)
GRAPHIZ = Command("urdf_to_graphiz", lambda: _graph_parser("urdf_to_graphiz"), _graphiz)
