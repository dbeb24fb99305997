"""Compare RViz's and minirospy's pictures of robots. Run by hand: the robots' packages are not in this repository.

`PYTHONPATH=. python tests/interop/rviz_robots.py FOLDER DESCRIPTION... [--packages FOLDER...]`. A description is a .urdf or
.xacro file, with arguments for xacro after a "?": `ur5.xacro?limited:=true`. The packages of its meshes are below the folders of
--packages. Each robot stands with all joints at zero. Prints the share of positions in drawn bodies whose color differs, and
saves a picture of both, with RViz on the left. tests/interop/rviz_pictures.py lists the programs that it needs.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import tempfile
import time
from pathlib import Path

import numpy as np
import xacro  # type: ignore[import-untyped]
from geometry_msgs.msg import Quaternion
from numpy.typing import NDArray
from PIL import Image
from tf2_msgs.msg import TFMessage

from minirospy.base.errors import MinirospyError
from minirospy.core.meshes.files import read_mesh
from minirospy.core.urdf.model import Box, Cylinder, Geometry, Mesh, Origin, Robot, Sphere
from minirospy.core.urdf.poses import matrix_from_quaternion, quaternion_from_rpy
from minirospy.core.urdf.read import parse_robot
from minirospy.web.access import Access
from minirospy.web.bridge import BridgeOptions
from minirospy.workspace.packages import Packages
from tests.interop import robot_scene, rviz_pictures
from tests.interop.browser import Page
from tests.interop.conftest import running_master
from tests.interop.rviz_pictures import HEIGHT, WIDTH, Rviz
from tests.interop.test_interop_rviz import ALIKE, bodies
from tests.web.dashboard.conftest import TOKEN, Served

__all__: list[str] = []

_SECONDS = 20.0  # for pictures that become more alike, because meshes load one by one
_ALIKE = 0.005  # share of differing positions below which the pictures are final
_MIN_PLACES = 100  # in drawn bodies; fewer are a robot that has not been loaded
Points = NDArray[np.float64]


def read_description(word: str) -> tuple[str, str]:
    """Return a robot's name and its description, expanded."""
    path, _, arguments = word.partition("?")
    mappings = dict(each.split(":=", 1) for each in arguments.split("&") if each)
    name = Path(path).name.partition(".")[0]
    if path.endswith(".xacro"):
        return name, xacro.process_file(path, mappings=mappings).toxml()
    return name, Path(path).read_text(encoding="utf-8")


def _matrix(origin: Origin) -> Points:
    found = np.eye(4)
    found[:3, :3] = np.reshape(matrix_from_quaternion(quaternion_from_rpy(*origin.rpy)), (3, 3))
    found[:3, 3] = origin.xyz
    return found


def _corners(low: Points, high: Points) -> Points:
    """Return the corners of a box."""
    return np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )


def _extent(geometry: Geometry, packages: Packages) -> Points:
    """Return the corners of a box around a shape."""
    match geometry:
        case Box(size):
            half = np.array(size) / 2
        case Cylinder(radius, length):
            half = np.array([radius, radius, length / 2])
        case Sphere(radius):
            half = np.array([radius] * 3)
        case Mesh(filename, scale):
            path = filename.removeprefix("file://")
            if filename.startswith("package://"):
                package, _, rest = filename.removeprefix("package://").partition("/")
                path = os.path.join(packages.find(package), rest)
            points = np.concatenate([each.vertices for each in read_mesh(path, scale=scale)])
            return _corners(points.min(axis=0), points.max(axis=0))
    return _corners(-half, half)


def extent(robot: Robot, packages: Packages) -> tuple[Points, list[str]]:
    """Return the corners of boxes around all shapes, in the root's frame, and the shapes that cannot be read."""
    poses = {robot.root: np.eye(4)}
    children: dict[str, list[str]] = {}
    for name, joint in robot.joints.items():
        children.setdefault(joint.parent, []).append(name)
    waiting = [robot.root]
    while waiting:
        link = waiting.pop()
        for name in children.get(link, ()):
            joint = robot.joints[name]
            poses[joint.child] = poses[link] @ _matrix(joint.origin)
            waiting.append(joint.child)
    found, missing = [], []
    for name, pose in poses.items():
        for visual in robot.links[name].visuals:
            try:
                corners = _extent(visual.geometry, packages)
            except (MinirospyError, OSError) as error:
                missing.append(str(error))
                continue
            placed = pose @ _matrix(visual.origin) @ np.column_stack([corners, np.ones(8)]).T
            found.append(placed[:3].T)
    if not found:
        raise SystemExit(f"robot {robot.name}: no shape can be read: {missing[:1]}")
    return np.concatenate(found), missing


def frames(robot: Robot) -> TFMessage:
    """Return the robot's frames with all joints at zero; its root is at the map's."""
    found = [robot_scene.transform("map", robot.root, 0, 0)]
    for joint in robot.joints.values():
        found.append(robot_scene.transform(joint.parent, joint.child, *joint.origin.xyz))
        found[-1].transform.rotation = Quaternion(*quaternion_from_rpy(*joint.origin.rpy))
    return TFMessage(found)


def differing(one: Image.Image, other: Image.Image) -> float:
    """Return the share (0 to 1) of positions in the drawn bodies of one picture whose color differs in the other."""
    places = bodies(one)
    pairs = [(one.getpixel(place), other.getpixel(place)) for place in places]
    others = sum(any(abs(a - b) > ALIKE for a, b in zip(*pair, strict=True)) for pair in pairs)  # type: ignore[arg-type]
    return others / len(pairs) if len(pairs) > _MIN_PLACES else 1.0


def compare(name: str, text: str, folder: Path, packages: Packages) -> tuple[float, list[str]]:
    """Save the picture of both; return the share of positions that differ, and the shapes that cannot be read."""
    robot = parse_robot(text, name)
    corners, missing = extent(robot, packages)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = [float(each) for each in (low + high) / 2]
    size = float(np.linalg.norm(high - low))
    rviz_pictures.SCENES[name] = (
        [rviz_pictures.display("RobotModel", Robot_Description="robot_description")],
        rviz_pictures.orbit(size, *middle, yaw=-0.8, pitch=0.4),
    )
    with contextlib.ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        os.environ["ROS_MASTER_URI"] = stack.enter_context(running_master("ours"))
        served = Served(BridgeOptions(foxglove_port=0, diagnostics=False, access=Access(write_token=TOKEN)))
        served.start()
        stack.callback(served.close)
        assert served.dashboard
        node = served.node("robot")

        async def publish() -> None:
            await node.set_param("/robot_description", text)
            publisher = await node.advertise("/tf_static", TFMessage, latch=True)
            await publisher.publish(frames(robot))

        served.run(publish())
        file = place / "scene.rviz"
        rviz_pictures.write_file(file, name)
        rviz = Rviz(file, place)
        stack.callback(rviz.close)
        served.dashboard.rviz.file = file
        page = Page(f"http://127.0.0.1:{served.port}/#/3d?file=1&token={TOKEN}", width=1100, height=700)
        stack.callback(page.close)
        rviz_pictures.enlarge(page, are_all_well=False)
        # A software renderer needs seconds for each picture while RViz draws, too.
        page.wait(
            "return document.querySelector('canvas.stage').dataset.settled === 'true' "
            "&& [...document.querySelectorAll('.displays .display')].some(e => e.dataset.level !== 'warn')"
        )
        end = time.monotonic() + _SECONDS
        while True:
            theirs, ours = rviz.settled(2.0), rviz_pictures.our_picture(page)
            share = max(differing(theirs, ours), differing(ours, theirs))
            if share < _ALIKE or time.monotonic() > end:
                break
        both = Image.new("RGB", (2 * WIDTH + 4, HEIGHT), "white")
        both.paste(theirs, (0, 0))
        both.paste(ours, (WIDTH + 4, 0))
        both.save(folder / f"{name}.png")
    return share, missing


def main() -> None:
    """Compare the robots that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("descriptions", nargs="+", metavar="DESCRIPTION")
    parser.add_argument("--packages", nargs="*", default=[], metavar="FOLDER")
    words = parser.parse_args()
    if not rviz_pictures.has_rviz():
        raise SystemExit("RViz and Xvfb are needed: apt-get install rviz xvfb libgl1-mesa-dri")
    words.folder.mkdir(parents=True, exist_ok=True)
    os.environ.update(
        ROS_HOSTNAME="localhost",
        ROS_HOME=str(words.folder / "home"),
        ROS_PACKAGE_PATH=os.pathsep.join(map(os.path.abspath, words.packages)),
    )
    packages = Packages()
    for word in words.descriptions:
        try:
            name, text = read_description(word)
            share, missing = compare(name, text, words.folder, packages)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - of one robot: the others are compared
            print(f"{word}: {str(error)[:300]}", flush=True)
            continue
        print(f"{name}: {share:.1%}{'; ' if missing else ''}{'; '.join(missing)[:300]}", flush=True)


if __name__ == "__main__":
    main()
