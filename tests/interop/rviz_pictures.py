"""`PYTHONPATH=. python tests/interop/rviz_pictures.py FOLDER [SCENE...]`: pictures of Debian's RViz and minirospy's 3D view.

Both open the same .rviz file on the same topics and draw from the same camera position. Each scene becomes one picture, with
RViz on the left. RViz runs under Xvfb with Mesa's software renderer: apt-get install rviz xvfb libgl1-mesa-dri.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import io
import json
import math
import os
import re
import shutil
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Point, Point32, PoseStamped, Quaternion
from nav_msgs.msg import GridCells
from nav_msgs.msg import Path as PathMessage
from PIL import Image
from sensor_msgs.msg import CameraInfo, ChannelFloat32, PointCloud
from sensor_msgs.msg import Image as ImageMessage
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from minirospy.core.urdf.poses import quaternion_from_rpy
from minirospy.core.urdf.read import parse_robot
from minirospy.web.access import Access
from minirospy.web.bridge import BridgeOptions
from tests.interop import robot_scene
from tests.interop.browser import PATIENCE, Page
from tests.interop.conftest import running_master
from tests.web.dashboard.conftest import TOKEN, Served

__all__ = [
    "HEIGHT",
    "SCENES",
    "WIDTH",
    "Rviz",
    "has_rviz",
    "our_picture",
    "prepare",
    "publish",
    "publish_robots",
    "write_file",
]

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 640, 480
_DEPTH = 24

Settings = dict[str, object]

STL = b"\0" * 80 + struct.pack("<I", 4)
_CORNERS = ((0.0, 0.0, 0.4), (0.3, 0.2, 0.0), (-0.3, 0.2, 0.0), (0.0, -0.35, 0.0))
for _a, _b, _c in ((0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)):
    STL += struct.pack("<12f", 0, 0, 0, *_CORNERS[_a], *_CORNERS[_b], *_CORNERS[_c]) + b"\0\0"
"""A pyramid, 0.4 m high."""

_SIDES = (
    ((1, 0, 0), ((1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1))),
    ((-1, 0, 0), ((-1, 1, -1), (-1, -1, -1), (-1, -1, 1), (-1, 1, 1))),
    ((0, 1, 0), ((1, 1, -1), (-1, 1, -1), (-1, 1, 1), (1, 1, 1))),
    ((0, -1, 0), ((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1))),
    ((0, 0, 1), ((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))),
    ((0, 0, -1), ((-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1))),
)
"""Normals and corners of the sides of a box, against the clock."""


def _box(x: float, half: float) -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Yield the corners and normals of the triangles of a box on the ground."""
    for normal, corners in _SIDES:
        for at in (0, 1, 2, 0, 2, 3):
            corner = corners[at]
            yield (x + corner[0] * half, corner[1] * half, (corner[2] + 1) * half), normal


def collada(materials: tuple[str, str] = ("red", "")) -> str:
    """Return a Collada file: two boxes, by default a red one and one without a material, a lamp and a camera.

    RViz shows the material as opaque, although it has the transparency 0, which means that it cannot be seen.
    """
    geometries, nodes = [], []
    for name, x, material in (("a", -0.2, materials[0]), ("b", 0.2, materials[1])):
        triangles = [*_box(x, 0.15)]
        sources = "".join(
            f'<source id="{name}{kind}"><float_array id="{name}{kind}a" count="{len(values) * 3}">'
            f"{' '.join(f'{part:g}' for value in values for part in value)}</float_array><technique_common>"
            f'<accessor source="#{name}{kind}a" count="{len(values)}" stride="3"><param name="X" type="float"/>'
            '<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>'
            for kind, values in (("p", [c for c, _ in triangles]), ("n", [n for _, n in triangles]))
        )
        symbol = f' material="{material}"' if material else ""
        numbers = " ".join(f"{at} {at}" for at in range(len(triangles)))
        geometries.append(
            f'<geometry id="{name}"><mesh>{sources}<vertices id="{name}v"><input semantic="POSITION" source="#{name}p"/>'
            f'</vertices><triangles count="{len(triangles) // 3}"{symbol}><input semantic="VERTEX" source="#{name}v" offset="0"/>'
            f'<input semantic="NORMAL" source="#{name}n" offset="1"/><p>{numbers}</p></triangles></mesh></geometry>'
        )
        bound = (
            f'<bind_material><technique_common><instance_material symbol="{material}" target="#{material}"/>'
            "</technique_common></bind_material>"
            if material
            else ""
        )
        nodes.append(
            f'<node id="n{name}"><instance_geometry url="#{name}">{bound}</instance_geometry></node>'
        )
    return (
        '<?xml version="1.0" encoding="utf-8"?>'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        '<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>'
        '<library_lights><light id="lamp"><technique_common><point><color>9 9 9</color></point></technique_common></light>'
        '</library_lights><library_cameras><camera id="eye"><optics><technique_common><perspective><xfov>50</xfov>'
        "<znear>0.1</znear><zfar>10</zfar></perspective></technique_common></optics></camera></library_cameras>"
        + (
            '<library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong>'
            "<emission><color>0.05 0.3 0.1 1</color></emission><ambient><color>0.4 0.4 0.4 1</color></ambient>"
            "<diffuse><color>0.7 0.1 0.1 1</color></diffuse><specular><color>0.6 0.6 0.6 1</color></specular>"
            "<shininess><float>50</float></shininess><transparent><color>1 1 1 1</color></transparent>"
            "<transparency><float>0</float></transparency></phong></technique></profile_COMMON></effect></library_effects>"
            if any(materials)
            else ""
        )
        + (
            '<library_materials><material id="red"><instance_effect url="#e"/></material></library_materials>'
            if any(materials)
            else ""
        )
        + f"<library_geometries>{''.join(geometries)}</library_geometries>"
        f'<library_visual_scenes><visual_scene id="vs">{"".join(nodes)}<node id="l"><translate>0 0 1</translate>'
        '<instance_light url="#lamp"/></node><node id="c"><instance_camera url="#eye"/></node></visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#vs"/></scene></COLLADA>'
    )


_PARAMETER = '<param name="{}" type="float"/>'


def textured(picture: str, *, has_bumps: bool = False) -> str:
    """Return a Collada file: a box with a picture on each side, which is also that of its bumps with ``has_bumps``.

    After its end is other text, as in some public files.
    """
    bumps = '<extra><technique profile="FCOLLADA"><bump><texture texture="u" texcoord="UV"/></bump></technique></extra>'
    corners = [*_box(0, 0.15)]
    places = ((0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)) * len(_SIDES)
    sources = "".join(
        f'<source id="{name}"><float_array id="{name}a" count="{len(values) * len(parts)}">'
        f"{' '.join(f'{part:g}' for value in values for part in value)}</float_array><technique_common>"
        f'<accessor source="#{name}a" count="{len(values)}" stride="{len(parts)}">'
        f"{''.join(map(_PARAMETER.format, parts))}</accessor></technique_common></source>"
        for name, values, parts in (
            ("p", [corner for corner, _ in corners], "XYZ"),
            ("n", [normal for _, normal in corners], "XYZ"),
            ("t", places, "ST"),
        )
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        '<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>'
        f'<library_images><image id="i"><init_from>{picture}</init_from></image></library_images>'
        '<library_effects><effect id="e"><profile_COMMON><newparam sid="s"><surface type="2D"><init_from>i</init_from></surface>'
        '</newparam><newparam sid="u"><sampler2D><source>s</source></sampler2D></newparam><technique sid="c"><lambert>'
        '<diffuse><texture texture="u" texcoord="UV"/></diffuse></lambert>'
        f"{bumps if has_bumps else ''}</technique></profile_COMMON></effect>"
        '</library_effects><library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>'
        f'<library_geometries><geometry id="g"><mesh>{sources}<vertices id="v">'
        f'<input semantic="POSITION" source="#p"/></vertices><triangles count="{len(corners) // 3}" material="m">'
        '<input semantic="VERTEX" source="#v" offset="0"/>'
        '<input semantic="NORMAL" source="#n" offset="0"/><input semantic="TEXCOORD" source="#t" offset="0" set="0"/>'
        f"<p>{' '.join(map(str, range(len(corners))))}</p></triangles></mesh></geometry></library_geometries>"
        '<library_visual_scenes><visual_scene id="vs"><node><instance_geometry url="#g"><bind_material><technique_common>'
        '<instance_material symbol="m" target="#m"><bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="0"/>'
        "</instance_material></technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>"
        '<scene><instance_visual_scene url="#vs"/></scene></COLLADA>\0\0</mesh>\n'
    )


OBJ = "mtllib part.mtl\nusemtl leaf\n" + "".join(
    f"v {' '.join(map(str, corner))}\nvn {' '.join(map(str, normal))}\n" for corner, normal in _box(0, 0.15)
)
OBJ += "".join(f"f {at}//{at} {at + 1}//{at + 1} {at + 2}//{at + 2}\n" for at in range(1, 37, 3))
SMOOTH_OBJ = re.sub(
    r"v (\S+) (\S+) (\S+)\nvn .*",
    lambda at: f"{at[0].partition(chr(10))[0]}\nvn {at[1]} {at[2]} {float(at[3]) - 0.15}",
    OBJ,
)
"""The same box with the normals of a ball, so that each side is lit as its corners are."""
MTL = "newmtl leaf\nKa 0.1 0.1 0.1\nKd 0.1 0.5 0.2\nKe 0.2 0 0.3\nKs 0.4 0.4 0.4\nd 0\n"  # d: RViz ignores it


def display(cls: str, topic: str = "", **settings: object) -> Settings:
    """Return a display. Settings that are not given keep each program's default."""
    key = {"Marker": "Marker Topic", "MarkerArray": "Marker Topic"}.get(cls, "Topic")
    found: Settings = {
        "Class": f"rviz/{cls}",
        "Name": f"{cls} {topic}".strip(),
        "Enabled": True,
        "Value": True,
    }
    if topic:
        found[key] = topic
    return {**found, **{name.replace("_", " "): value for name, value in settings.items()}}


def orbit(
    distance: float, x: float = 0, y: float = 0, z: float = 0, yaw: float = 0.785, pitch: float = 0.785
) -> Settings:
    focus = {"X": x, "Y": y, "Z": z}
    return {
        "Class": "rviz/Orbit",
        "Distance": distance,
        "Focal Point": focus,
        "Yaw": yaw,
        "Pitch": pitch,
        "Target Frame": "<Fixed Frame>",
    }


def mesh(x: float, y: float, file: str, **fields: Any) -> Marker:
    found = robot_scene.marker(
        Marker.MESH_RESOURCE, x, y, mesh_resource=f"package://rviz_meshes/{file}", **fields
    )
    found.scale.x = found.scale.y = found.scale.z = 1.0
    return found


def _old_cloud() -> PointCloud:
    points = [Point32(-3 + 0.1 * n, 3.2, 0.3) for n in range(30)]
    channels = [ChannelFloat32("intensity", [float(n) for n in range(30)])]
    return robot_scene.stamped(PointCloud, "map", points=points, channels=channels)


def _posed_path() -> PathMessage:
    poses = [
        robot_scene.stamped(PoseStamped, "map", pose=robot_scene.pose(-3.5 + n * 0.5, -3.0, n * 0.4))
        for n in range(8)
    ]
    return robot_scene.stamped(PathMessage, "map", poses=poses)


def _two_point_arrow() -> Marker:
    found = robot_scene.marker(Marker.ARROW, -3.2, -1.4, points=[Point(0, 0, 0), Point(0.8, 0.3, 0.3)])
    found.id = 100
    found.scale.x, found.scale.y, found.scale.z = 0.08, 0.16, 0.2
    return found


def _glass() -> list[Marker]:
    found = [robot_scene.marker(Marker.CUBE, 1.6, -1.2), robot_scene.marker(Marker.SPHERE, 1.9, -1.2)]
    for index, each in enumerate(found):
        each.id = 101 + index
        each.color.a = 0.5
    return found


def _cells() -> GridCells:
    cells = [Point(-2.0 + 0.25 * (n % 4), 1.0 + 0.25 * (n // 4), 0) for n in range(12)]
    return robot_scene.stamped(GridCells, "map", cell_width=0.25, cell_height=0.25, cells=cells)


def depth_camera() -> dict[str, Any]:
    """Return a depth camera's messages in the frame lens.

    They show a wavy wall, a ball in front of it, and an area without depths.
    """
    width, height, focal = 80, 60, 70.0
    depths, colors = [], bytearray()
    for y in range(height):
        for x in range(width):
            ball = 100 - (x - 50) ** 2 - (y - 30) ** 2
            depth = 1.4 - 0.04 * math.sqrt(ball) if ball > 0 else 2 + 0.15 * math.sin(x / 6)
            is_seen = x > 12 or y > 12
            depths.append(round(1000 * depth) if is_seen else 0)
            colors += bytes((230, 60, 40) if ball > 0 else (40 + 2 * x, 90, 255 - 3 * y))
    info = robot_scene.stamped(CameraInfo, "lens", width=width, height=height)
    info.K = [focal, 0, 39.5, 0, focal, 29.5, 0, 0, 1]
    info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [focal, 0, 39.5, 0, 0, focal, 29.5, 0, 0, 0, 1, 0]
    size = {"width": width, "height": height}
    data = struct.pack(f"<{width * height}H", *depths)
    depth_image = robot_scene.stamped(
        ImageMessage, "lens", **size, encoding="16UC1", step=2 * width, data=data
    )
    color_image = robot_scene.stamped(
        ImageMessage, "lens", **size, encoding="rgb8", step=3 * width, data=bytes(colors)
    )
    return {"/depth/image": depth_image, "/depth/camera_info": info, "/color/image": color_image}


def shapes() -> MarkerArray:
    """Return one marker of each type, and a transparent marker."""
    return MarkerArray(
        [*robot_scene.markers().markers, _two_point_arrow(), *_glass(), mesh(2.6, -3.2, "part.stl")]
    )


def messages() -> dict[str, Any]:
    """Return all messages by topic."""
    found = robot_scene.everything()
    # The torque must be larger than the values that RViz hides.
    found["/wrench"].wrench.torque.y = 0.5
    lens = robot_scene.transform("map", "lens", 0, 0, 1)
    lens.transform.rotation = Quaternion(-0.5, 0.5, -0.5, 0.5)
    found["/tf_static"].transforms.append(lens)
    return {
        **found,
        **depth_camera(),
        "/shapes": shapes(),
        "/mesh_markers": mesh_markers(),
        "/old_cloud": _old_cloud(),
        "/posed": _posed_path(),
        "/cells": _cells(),
    }


def mesh_markers() -> MarkerArray:
    """Return markers of one mesh: in their own color, in the mesh's colors, and in both.

    None is transparent: RViz shares materials between displays, so such a mesh depends on the order in which they load.
    """
    found = []
    for index, (own, color) in enumerate(
        (
            (False, (0.2, 0.4, 0.9, 1.0)),
            (True, (0.0, 0.0, 0.0, 0.0)),
            (True, (0.2, 0.4, 0.9, 1.0)),
        )
    ):
        each = mesh(-2.4 + 0.9 * index, 1.2, "two.dae", mesh_use_embedded_materials=own)
        each.id, each.ns = 200 + index, "meshes"
        each.color.r, each.color.g, each.color.b, each.color.a = color
        found.append(each)
    return MarkerArray(found)


def mesh_robot() -> str:
    """Return a robot of meshes, with and without materials, and a textured box."""
    blue = '<material name="blue"><color rgba="0.2 0.4 0.9 1"/></material>'
    files = "".join(
        f'<visual><origin xyz="{x} {y} 0"/><geometry><mesh filename="package://rviz_meshes/{uri}"/></geometry>{material}</visual>'
        for x, y, uri, material in (
            (-2, -0.6, "two.dae", ""),
            (-1, -0.6, "two.dae", blue),
            (0, -0.6, "leaf.obj", blue),
            (1, -0.6, "part.stl", blue),
            (-2, -1.6, "none.dae", ""),
            (-1, -1.6, "none.dae", blue),
            (0, -1.6, "bare.obj", blue),
            (0.6, -1.6, "bare.obj", ""),
            (0.6, 1.2, "picture.dae", ""),
            (1.2, 1.2, "bumps.dae", ""),
            (1.8, 1.2, "smooth.obj", ""),
        )
    )
    texture = '<material name="squares"><texture filename="package://rviz_meshes/squares.png"/></material>'
    box = '<box size="0.3 0.3 0.3"/>'
    stl = '<mesh filename="package://rviz_meshes/part.stl"/>'
    links, joints = [f'<link name="map">{files}</link>'], []
    for frame, shape, material in (
        ("odom", box, ""),
        ("base_link", stl, ""),
        ("mast", box, texture),
        ("laser", box, blue),
    ):
        links.append(f'<link name="{frame}"><visual><geometry>{shape}</geometry>{material}</visual></link>')
        joints.append(
            f'<joint name="to_{frame}" type="fixed"><parent link="map"/><child link="{frame}"/></joint>'
        )
    return f'<robot name="meshes">{"".join(links + joints)}</robot>'


ROBOTS = {
    "wheels": (ROOT / "minirospy/ros/diff_drive_robot/urdf/robot.xacro", 0.0, -0.7),
    "arm": (ROOT / "minirospy/ros/six_joint_arm/urdf/arm.xacro", -0.3, 0.1),
    "links": (ROOT / "minirospy/ros/two_link_arm/urdf/arm.xacro", -0.6, -0.9),
    "rover": (ROOT / "tests/ros/simulation/rover.urdf", 0.5, -0.1),
}
"""Description, and position (x, y in metres) of each robot of the scene "robots", by the prefix of its frames."""


def robots() -> dict[str, str]:
    """Return the descriptions of ROBOTS, expanded."""
    import xacro  # type: ignore[import-untyped]

    return {name: xacro.process_file(str(path)).toxml() for name, (path, _, _) in ROBOTS.items()}


def robot_frames(descriptions: Mapping[str, str]) -> TFMessage:
    """Return the frames of the robots with all joints at zero, as robot_state_publisher has them."""
    found = []
    for name, text in descriptions.items():
        robot = parse_robot(text, name)
        _, x, y = ROBOTS[name]
        found.append(robot_scene.transform("map", f"{name}/{robot.root}", x, y))
        for joint in robot.joints.values():
            found.append(
                robot_scene.transform(f"{name}/{joint.parent}", f"{name}/{joint.child}", *joint.origin.xyz)
            )
            found[-1].transform.rotation = Quaternion(*quaternion_from_rpy(*joint.origin.rpy))
    return TFMessage(found)


def description() -> str:
    """Return the robot's description, with a mesh."""
    part = '<visual><origin xyz="0 0 0.08"/><geometry><mesh filename="package://rviz_meshes/part.stl"/></geometry>'
    return robot_scene.description(
        part + '<material name="of_part"><color rgba="0.9 0.6 0.1 1"/></material></visual>'
    )


SCENES: dict[str, tuple[list[Settings], Settings]] = {
    "robot": (
        [
            display("Grid"),
            display("TF"),
            display("RobotModel", Robot_Description="robot_description"),
            display("LaserScan", "/scan"),
            display("PointCloud2", "/cloud", Color_Transformer="RGB8"),
            display("Map", "/map"),
            display("Path", "/plan"),
            display("Polygon", "/footprint"),
        ],
        orbit(5.5, x=0.9, y=0.2, yaw=-0.9, pitch=0.6),
    ),
    "markers": (
        [display("Grid"), display("MarkerArray", "/shapes")],
        orbit(6.2, x=0.1, y=-2.5, yaw=-1.3, pitch=0.75),
    ),
    "poses": (
        [
            display("Grid"),
            display("Axes"),
            display("Pose", "/goal"),
            display("PoseArray", "/particles"),
            display("PoseWithCovariance", "/estimate"),
            display("Odometry", "/odometry"),
            display("Range", "/sonar"),
            display("WrenchStamped", "/wrench"),
            display("PointStamped", "/point"),
            display("GridCells", "/cells"),
            {**display("Path", "/posed", Pose_Style="Arrows"), "Name": "arrows"},
        ],
        orbit(7, x=0.4, y=0.1, yaw=-1.2, pitch=0.8),
    ),
    "clouds": (
        [
            {
                **display("PointCloud2", "/cloud", Color_Transformer="AxisColor", Style="Spheres"),
                "Size (m)": 0.03,
            },
            {**display("LaserScan", "/scan", Style="Boxes"), "Size (m)": 0.06},
            display("PointCloud", "/old_cloud", Style="Points"),
            display("Map", "/map", Color_Scheme="costmap"),
            {**display("Path", "/plan", Line_Style="Billboards", Alpha=0.5), "Line Width": 0.1},
            {**display("PoseArray", "/particles", Shape="Arrow (3D)"), "Name": "particles"},
            {**display("Path", "/posed", Pose_Style="Axes"), "Name": "axes"},
        ],
        orbit(8, x=-0.5, y=0.5, yaw=-1.2, pitch=0.8),
    ),
    "meshes": (
        [display("RobotModel", Robot_Description="mesh_robot"), display("MarkerArray", "/mesh_markers")],
        orbit(4.4, x=0, y=0.1, yaw=-1.2, pitch=0.7),
    ),
    "depth": (
        [
            display("Grid"),
            {
                **display("DepthCloud", Depth_Map_Topic="/depth/image", Color_Image_Topic="/color/image"),
                "Auto Size": {"Auto Size Factor": 0.7, "Value": True},
            },
        ],
        orbit(2.6, x=1.5, z=1, yaw=-2.6, pitch=0.3),
    ),
    "robots": (
        [
            {**display("RobotModel", Robot_Description=f"{name}_robot", TF_Prefix=name), "Name": name}
            for name in ROBOTS
        ],
        orbit(3.0, z=0.5, yaw=-1.0, pitch=0.5),
    ),
}
"""Displays and view of each scene, by name."""


def write_file(path: Path, scene: str) -> None:
    """Write the .rviz file of a scene as JSON, which is valid YAML."""
    displays, view = SCENES[scene]
    manager = {
        "Class": "",
        "Name": "root",
        "Enabled": True,
        "Displays": displays,
        "Global Options": {
            "Background Color": "48; 48; 48",
            "Fixed Frame": "map",
            "Default Light": True,
            "Frame Rate": 30,
        },
        "Tools": [{"Class": "rviz/MoveCamera"}],
        "Views": {"Current": view},
    }
    window = {"Width": WIDTH, "Height": HEIGHT, "X": 0, "Y": 0}
    path.write_text(
        json.dumps({"Panels": [], "Visualization Manager": manager, "Window Geometry": window}),
        encoding="utf-8",
    )


def has_rviz() -> bool:
    """Return whether RViz and Xvfb are installed."""
    return Path("/usr/bin/rviz").exists() and bool(shutil.which("Xvfb"))


class Rviz:
    """RViz under Xvfb, without menus, so that the 3D view fills the window."""

    def __init__(self, file: Path, folder: Path) -> None:
        self._frame = folder / "Xvfb_screen0"
        self._stack = contextlib.ExitStack()
        try:
            number = self._start_display(folder)
            environment = {**os.environ, "DISPLAY": f":{number}", "LIBGL_ALWAYS_SOFTWARE": "1"}
            words = ["/usr/bin/rviz", "-d", str(file), "--fullscreen", "--splash-screen", ""]
            self._start(words, env=environment)
        except BaseException:
            self.close()
            raise

    def _start(self, words: list[str], **options: Any) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options)

        def end() -> None:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

        self._stack.callback(end)
        return process

    def _start_display(self, folder: Path) -> int:
        """Start Xvfb; return the display number, which Xvfb chooses."""
        reading, writing = os.pipe()
        screen = f"{WIDTH}x{HEIGHT}x{_DEPTH}"
        words = [
            "Xvfb",
            "-displayfd",
            str(writing),
            "-screen",
            "0",
            screen,
            "-nocursor",
            "-nolisten",
            "tcp",
            "-fbdir",
            str(folder),
        ]
        self._start(words, pass_fds=[writing])
        os.close(writing)
        with os.fdopen(reading) as numbers:
            return int(numbers.readline())

    def picture(self) -> Image.Image:
        """Return a screenshot, read from Xvfb's framebuffer file in xwd format."""
        data = self._frame.read_bytes()
        size, width, height, line, colors = (
            struct.unpack_from(">I", data, at)[0] for at in (0, 16, 20, 48, 76)
        )
        start = size + colors * 12
        return Image.frombuffer(
            "RGB", (width, height), data[start : start + line * height], "raw", "BGRX", line, 1
        )

    def settled(self, seconds: float = 4.0) -> Image.Image:
        """Return the picture once it has not changed for ``seconds`` and shows more than a background."""
        end = time.monotonic() + PATIENCE
        picture, since = self.picture(), time.monotonic()
        while time.monotonic() - since < seconds or len(picture.getcolors(WIDTH * HEIGHT) or ()) < 20:
            assert time.monotonic() < end, "RViz shows nothing"
            time.sleep(0.3)
            now = self.picture()
            if now.tobytes() != picture.tobytes():
                picture, since = now, time.monotonic()
        return picture

    def close(self) -> None:
        """Stop RViz and Xvfb."""
        self._stack.close()


def our_picture(page: Page) -> Image.Image:
    """Return the picture of the page's 3D view, in RViz's size."""
    clip = {"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT, "scale": 1}
    data = base64.b64decode(page.call("Page.captureScreenshot", format="png", clip=clip)["data"])
    return Image.open(io.BytesIO(data)).convert("RGB")


def enlarge(page: Page, *, are_all_well: bool = True) -> None:
    """Enlarge the 3D view to the page's upper left corner, in RViz's size.

    Wait until there are displays and, with ``are_all_well``, until none reports a fault.
    """
    page.wait(
        "const all = [...document.querySelectorAll('.displays .display')];"
        f"return all.length && ({str(not are_all_well).lower()} || all.every(e => e.dataset.level === 'ok'))"
    )
    style = f"position:fixed;inset:0 auto auto 0;width:{WIDTH}px;height:{HEIGHT}px;z-index:99;border:0;border-radius:0;margin:0"
    # Count before the change: the picture in the new size may be the last one for a long time.
    drawn = int(page.evaluate("Number(document.querySelector('canvas.stage').dataset.drawn || 0)"))
    page.evaluate(f"document.querySelector('.scene').style.cssText = {json.dumps(style)}")
    page.wait(
        "const c = document.querySelector('canvas.stage'); "
        f"return c.clientWidth === {WIDTH} && c.clientHeight === {HEIGHT}"
    )
    page.wait(f"return Number(document.querySelector('canvas.stage').dataset.drawn) > {drawn}")


def prepare(folder: Path) -> None:
    """Create the package that contains the scenes' meshes."""
    package = folder / "rviz_meshes"
    package.mkdir()
    (package / "package.xml").write_text(
        '<package format="2"><name>rviz_meshes</name><version>0.0.1</version><description>Meshes</description>'
        '<maintainer email="a@b.cd">A</maintainer><license>BSD</license></package>',
        encoding="utf-8",
    )
    (package / "part.stl").write_bytes(STL)
    (package / "two.dae").write_text(collada(), encoding="utf-8")
    squares = Image.new("RGB", (4, 4), (240, 220, 40))
    squares.paste((30, 160, 60), (0, 0, 2, 2))
    squares.paste((160, 40, 160), (2, 2, 4, 4))
    squares.resize((64, 64), Image.Resampling.NEAREST).save(package / "squares.png")
    (package / "picture.dae").write_text(textured("squares.png"), encoding="utf-8")
    (package / "bumps.dae").write_text(textured("squares.png", has_bumps=True), encoding="utf-8")
    (package / "none.dae").write_text(collada(("", "")), encoding="utf-8")
    (package / "bare.obj").write_text(OBJ.partition("v ")[1] + OBJ.partition("v ")[2], encoding="utf-8")
    (package / "leaf.obj").write_text(OBJ, encoding="utf-8")
    (package / "smooth.obj").write_text(SMOOTH_OBJ, encoding="utf-8")
    (package / "part.mtl").write_text(MTL, encoding="utf-8")


def publish(served: Served, all_messages: Mapping[str, Any]) -> None:
    """Publish latched messages, and set the robot's description."""
    node = served.node("robot")

    async def run() -> None:
        await node.set_param("/robot_description", description())
        await node.set_param("/mesh_robot", mesh_robot())
        for topic, message in all_messages.items():
            publisher = await node.advertise(topic, type(message), latch=True)
            await publisher.publish(message)

    served.run(run())


def publish_robots(served: Served) -> None:
    """Set the descriptions of the scene "robots", and publish their frames, which other scenes do not show."""
    node, descriptions = served.node("robots"), robots()

    async def run() -> None:
        for name, text in descriptions.items():
            await node.set_param(f"/{name}_robot", text)
        publisher = await node.advertise("/tf_static", TFMessage, latch=True)
        await publisher.publish(robot_frames(descriptions))

    served.run(run())


@contextlib.contextmanager
def robot() -> Iterator[Served]:
    """Run a master, a dashboard and a node that publishes the messages."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        prepare(folder)
        os.environ.update(
            ROS_HOSTNAME="localhost", ROS_HOME=str(folder / "home"), ROS_PACKAGE_PATH=str(folder)
        )
        os.environ["ROS_MASTER_URI"] = stack.enter_context(running_master("ours"))
        served = Served(BridgeOptions(foxglove_port=0, diagnostics=False, access=Access(write_token=TOKEN)))
        served.start()
        stack.callback(served.close)
        publish(served, messages())
        yield served


def compare(served: Served, scene: str) -> tuple[Image.Image, Image.Image]:
    """Return the pictures of a scene: RViz's and minirospy's."""
    assert served.dashboard
    if scene == "robots":
        publish_robots(served)
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        file = Path(name, "scene.rviz")
        write_file(file, scene)
        rviz = Rviz(file, Path(name))
        stack.callback(rviz.close)
        served.dashboard.rviz.file = file
        page = Page(f"http://127.0.0.1:{served.port}/#/3d?file=1&token={TOKEN}", width=1100, height=700)
        stack.callback(page.close)
        enlarge(page)
        return rviz.settled(), our_picture(page)


def main() -> None:
    """Save the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(SCENES)}; all, if none is named"
    )
    words = parser.parse_args()
    if unknown := set(words.scenes) - set(SCENES):
        parser.error(f"there is no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    if not has_rviz():
        raise SystemExit("RViz and Xvfb are needed: apt-get install rviz xvfb libgl1-mesa-dri")
    words.folder.mkdir(parents=True, exist_ok=True)
    with robot() as served:
        for scene in words.scenes or SCENES:
            both = Image.new("RGB", (2 * WIDTH + 4, HEIGHT), "white")
            for index, picture in enumerate(compare(served, scene)):
                both.paste(picture, (index * (WIDTH + 4), 0))
            both.save(words.folder / f"rviz_{scene}.webp", quality=88, method=6)
            print(words.folder / f"rviz_{scene}.webp")


if __name__ == "__main__":
    main()
