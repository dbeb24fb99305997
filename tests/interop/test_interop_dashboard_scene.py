"""The pure parts of the 3D view under node: frames (compared with tf2), robots (compared with core/urdf), clouds, .rviz files."""

from __future__ import annotations

import json
import math
import random
import struct
import subprocess
from typing import Any

import pytest

from minirospy.base.errors import ConnectivityException, ExtrapolationException, TransformException
from minirospy.core.tf2.buffer import TransformBuffer
from minirospy.web.dashboard.files import FOLDER
from tests.interop.conftest import PATIENCE
from tests.interop.page_modules import run_script
from tests.interop.test_interop_dashboard import needs_node
from tests.interop.test_interop_foreign import FOREIGN
from tests.ros.robot_state_publisher.conftest import ARM

pytestmark = needs_node
SECOND = 1_000_000_000
STILL = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def run(*calls: dict[str, Any]) -> list[Any]:
    """Return the results of calls to the page's modules: values, or error texts."""
    done = subprocess.run(
        ["node", str(FOREIGN / "scene.mjs")],
        input="".join(json.dumps(call) + "\n" for call in calls),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(answers) == len(calls)
    return [answer.get("value", answer.get("error")) for answer in answers]


def insert(
    parent: str, child: str, seconds: float, values: list[float], fixed: bool = False
) -> dict[str, Any]:
    return {
        "call": "insert",
        "parent": parent,
        "child": child,
        "seconds": seconds,
        "values": values,
        "isStatic": fixed,
    }


def lookup(target: str, source: str, seconds: float | None = None) -> dict[str, Any]:
    return {"call": "lookup", "target": target, "source": source, "seconds": seconds}


# --- frames


def random_values(chance: random.Random) -> list[float]:
    rotation = [chance.gauss(0, 1) for _ in range(4)]
    length = math.hypot(*rotation)
    return [chance.uniform(-5, 5) for _ in range(3)] + [part / length for part in rotation]


def same(found: list[float], wanted: list[float]) -> bool:
    """Return whether two poses are equal; a quaternion and its negative are the same rotation."""
    sign = 1 if sum(a * b for a, b in zip(found[3:], wanted[3:], strict=True)) >= 0 else -1
    turned = [sign * part for part in found[3:]]
    return all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(found[:3] + turned, wanted, strict=True))


def test_lookups_agree_with_tf2() -> None:
    chance = random.Random(3)
    buffer = TransformBuffer()
    calls: list[dict[str, Any]] = []
    names = [f"f{index}" for index in range(12)]
    for index, child in enumerate(names[1:], 1):
        parent = "alone" if index == 11 else names[chance.randrange(index)]
        fixed = chance.random() < 0.3
        stamps = [1.0] if fixed else sorted(chance.sample(range(100, 600), 12))
        for stamp in stamps if fixed else [each / 100 for each in stamps]:
            values = random_values(chance)
            calls.append(insert(parent, child, stamp, values, fixed))
            x, y, z, a, b, c, d = values
            buffer.insert(
                parent, child, round(stamp * SECOND), (x, y, z), (a, b, c, d), "test", is_static=fixed
            )
    assert run(*calls) == [""] * len(calls)

    asked = [(*chance.sample([*names, "missing"], 2), chance.randrange(0, 700) / 100) for _ in range(400)]
    answers = run(*calls, *(lookup(target, source, time or None) for target, source, time in asked))
    seen = set()
    for (target, source, time), found in zip(asked, answers[len(calls) :], strict=True):
        try:
            wanted = buffer.lookup(target, source, round(time * SECOND))
        except ExtrapolationException:
            # If there are several faults, tf2 reports the first one on the path towards the root.
            assert found["kind"] in ("future", "past", "unconnected")
            seen.add(found["kind"])
        except ConnectivityException:
            assert found["kind"] == "unconnected"
            seen.add("unconnected")
        except TransformException:
            assert found["kind"] == "unknown"
            assert "Frame [missing] does not exist" in found["status"]
            seen.add("unknown")
        else:
            assert same(found, [*wanted.translation, *wanted.rotation]), (target, source, time)
            seen.add("found")
    assert seen == {"future", "past", "unconnected", "unknown", "found"}


def test_missing_transforms_are_named_as_rviz_does() -> None:
    *_, missing, apart, loop = run(
        insert("map", "odom", 1, STILL),
        insert("base", "laser", 1, STILL),
        insert("a", "b", 1, STILL),
        insert("b", "a", 1, STILL),
        lookup("map", "camera"),
        lookup("map", "/laser"),
        lookup("map", "a"),
    )
    assert (
        missing["status"] == "No transform from [camera] to fixed frame [map]: Frame [camera] does not exist"
    )
    assert apart["status"].startswith(
        "No transform from [laser] to fixed frame [map]: Could not find a connection"
    )
    assert loop["kind"] == "loop"


def test_transforms_that_tf2_refuses_are_refused() -> None:
    same_frame, no_name, length = run(
        insert("a", "/a", 1, STILL), insert("a", "", 1, STILL), insert("a", "b", 1, [*STILL[:6], 1.1])
    )
    assert same_frame.startswith("TF_SELF_TRANSFORM")
    assert no_name.startswith("TF_NO_FRAME_ID")
    assert length.startswith("TF_DENORMALIZED_QUATERNION")


def test_frames_without_end_are_refused() -> None:
    calls = [insert("map", f"f{index}", 1, STILL) for index in range(10_000)]
    *_, last, refused, again = run(*calls, insert("map", "f0", 2, STILL))
    assert last == ""
    assert refused == 'more than 10000 frames: "f9999" is left out'
    assert again == ""


def test_parents_of_a_frame_are_the_latest() -> None:
    body = """
        const frames = new Frames();
        const transform = {translation: {x: 0, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0, w: 1}};
        for (let at = 0; at < 1000; at++) {
          const header = {frame_id: `p${at}`, stamp: {secs: at, nsecs: 0}};
          frames.add({transforms: [{header, child_frame_id: "a", transform}]}, at, true);
        }
        return [...frames.frames.get("a").parents.keys()];"""
    assert run_script("Frames", "js/frames.js", body) == [f"p{index}" for index in range(980, 1000)]


def test_frames_of_a_bag_that_starts_again_replace_the_old_ones() -> None:
    moved = [1.0, *STILL[1:]]
    *_, root, before, after = run(
        insert("map", "odom", 500, STILL),
        insert("map", "odom", 100, moved),
        {"call": "root"},
        lookup("map", "odom"),
        lookup("map", "odom", 500),
    )
    assert root == "map"
    assert before == moved
    assert after["kind"] == "future"


# --- robots


def test_poses_of_links_agree_with_our_urdf() -> None:
    from minirospy.core.urdf.poses import Segment
    from minirospy.core.urdf.read import parse_robot

    text = ARM.read_text(encoding="utf-8")
    robot = parse_robot(text)
    chance = random.Random(5)
    positions = {name: chance.uniform(-1, 1) for name in robot.joints}
    (found,) = run({"call": "urdf", "text": text, "positions": positions})
    assert (found["name"], found["root"]) == (robot.name, robot.root)
    assert set(found["links"]) == set(robot.links) == set(found["poses"])

    frames = TransformBuffer()
    for joint in robot.joints.values():
        # Mimic joints have the position of the joint that they follow.
        pose = Segment(joint).pose(positions[joint.name])
        frames.insert(joint.parent, joint.child, 0, pose.translation, pose.rotation, "test", is_static=True)
    for link in robot.links:
        wanted = frames.lookup(robot.root, link, 0)
        assert same(found["poses"][link], [*wanted.translation, *wanted.rotation]), link


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("<robot><link name='a'>", "XmlError: line 1: </link> is missing"),
        ("<robot>\n<link></robot>", "XmlError: line 2: </robot>, where </link> is expected"),
        ("<robot>\n& < </robot>", 'XmlError: line 2: "< </robot>" is not XML'),
        ("text", "XmlError: line 1: there is not one element around all others"),
        ("<other/>", "UrdfError: <other>, where <robot> is expected"),
        ("<robot name='x'/>", "UrdfError: there is no root link"),
        ("<robot><link name='a'/><link name='b'/></robot>", "UrdfError: two root links: a, b"),
        (
            "<robot><link name='a'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint></robot>",
            'UrdfError: joint "j": there is no link "b"',
        ),
        (
            "<robot><link name='a'/><link name='b'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/>"
            "<origin xyz='1 2'/></joint></robot>",
            'UrdfError: "1 2", where 3 numbers are expected',
        ),
    ],
)
def test_description_that_cannot_be_read_is_named(text: str, error: str) -> None:
    assert run({"call": "urdf", "text": text}) == [error]


def test_xml_has_attributes_entities_comments_and_sections() -> None:
    text = "<?xml version='1.0'?><!-- <x> --><a b='1 &lt; 2' c=\"&#228;\"><d/>x<![CDATA[<&]]></a>\n"
    (found,) = run({"call": "xml", "text": text})
    assert found["attributes"] == {"b": "1 < 2", "c": "ä"}
    assert [child["name"] for child in found["children"]] == ["d"]
    assert found["text"] == "x<&"


# --- sensors


def cloud(
    points: list[tuple[float, ...]], layout: str, fields: dict[str, tuple[int, int]], big: bool = False
) -> dict[str, Any]:
    code = (">" if big else "<") + layout
    size = struct.calcsize(code)
    return {
        "width": len(points),
        "height": 1,
        "point_step": size,
        "row_step": size * len(points),
        "is_bigendian": big,
        "fields": [
            {"name": name, "offset": offset, "datatype": kind, "count": 1}
            for name, (offset, kind) in fields.items()
        ],
        "data": b"".join(struct.pack(code, *point) for point in points).hex(),
    }


XYZ = {"x": (0, 7), "y": (4, 7), "z": (8, 7)}
NAN = math.nan


@pytest.mark.parametrize(
    "message",
    [
        cloud([(1, 2, 3), (NAN, 0, 0), (-1, 0.5, 0)], "fff", XYZ),
        cloud([(1, 2, 3), (NAN, 0, 0), (-1, 0.5, 0)], "fff", XYZ, big=True),
        cloud(
            [(7, 1, 2, 3), (7, NAN, 0, 0), (7, -1, 0.5, 0)], "Bfff", {"x": (1, 7), "y": (5, 7), "z": (9, 7)}
        ),
        cloud([(1, 2, 3), (NAN, 0, 0), (-1, 0.5, 0)], "ddd", {"x": (0, 8), "y": (8, 8), "z": (16, 8)}),
    ],
    ids=["aligned", "big-endian", "odd offsets", "doubles"],
)
def test_points_of_a_cloud_are_read_in_every_layout(message: dict[str, Any]) -> None:
    (found,) = run({"call": "cloud", "message": message})
    assert found["count"] == 2
    assert found["positions"] == [1, 2, 3, -1, 0.5, 0]


def test_colors_of_points_are_those_of_rviz() -> None:
    fields = {**XYZ, "intensity": (12, 7), "rgb": (16, 7)}
    message = cloud([(0, 0, 0, 10, 0x102030), (0, 0, 1, 20, 0xFF0000)], "ffffI", fields)
    scaled = {"Color Transformer": "Intensity", "Channel Name": "intensity"}
    ends_of = {"Use rainbow": False, "Min Color": "0; 0; 0", "Max Color": "200; 100; 0"}
    bounds = {"Autocompute Intensity Bounds": False, "Min Intensity": 0, "Max Intensity": 20}
    settings: list[dict[str, Any]] = [
        {"Color Transformer": "RGB8"},
        scaled,
        {"Color Transformer": "AxisColor", "Axis": "Z", "Invert Rainbow": True},
        {**scaled, **ends_of, **bounds},
    ]
    rgb, intensity, axis, ends, missing = run(
        *({"call": "cloud", "message": message, "settings": each} for each in settings),
        {"call": "cloud", "message": {**message, "fields": message["fields"][1:]}},
    )
    assert rgb["colors"] == [0x10, 0x20, 0x30, 0xFF, 0, 0]
    # The lowest intensity is red and the highest is purple.
    assert intensity["colors"] == [255, 0, 0, 255, 0, 255]
    assert axis["colors"] == [255, 0, 255, 255, 0, 0]
    assert ends["colors"] == [100, 50, 0, 200, 100, 0]
    assert missing == "Error: the cloud has no field x; it has y, z, intensity, rgb"


def test_large_clouds_are_thinned_and_short_ones_refused() -> None:
    message = cloud([(float(index), 0, 0) for index in range(10)], "fff", XYZ)
    thin, short = run(
        {"call": "cloud", "message": message, "stride": 4},
        {"call": "cloud", "message": {**message, "data": message["data"][:-2]}},
    )
    assert thin["positions"][::3] == [0, 4, 8]
    assert short == "Error: the cloud has 119 bytes, 10 x 1 points of 12 bytes need 120"


def test_readings_outside_of_the_range_of_a_scan_are_left_out() -> None:
    message = {
        "angle_min": 0,
        "angle_increment": math.pi / 2,
        "range_min": 0.5,
        "range_max": 9,
        "ranges": [1, 0.1, 2, 10],
        "intensities": [],
    }
    (found,) = run({"call": "scan", "message": message})
    assert [round(value, 5) for value in found] == [1, 0, 0, -2, 0, 0]


def test_palettes_of_maps_are_those_of_rviz() -> None:
    asked = [("map", 0), ("map", 100), ("map", 255), ("map", 101), ("costmap", 0), ("costmap", 100)]
    free, wall, unknown, illegal, clear, lethal = run(
        *({"call": "palette", "scheme": scheme, "value": value} for scheme, value in asked)
    )
    assert (free, wall, unknown) == ([255, 255, 255, 255], [0, 0, 0, 255], [0x70, 0x89, 0x86, 255])
    assert (illegal, clear, lethal) == ([0, 255, 0, 255], [0, 0, 0, 0], [255, 0, 255, 255])


# --- .rviz files


def test_config_shows_displays_groups_and_the_view_and_keeps_the_rest() -> None:
    frames = {"Class": "rviz/TF", "Name": "TF", "Enabled": True}
    plan = {"Class": "moveit_rviz_plugin/MotionPlanning", "Name": "Plan", "Enabled": True, "Odd": {"x": 1}}
    view = {"Class": "rviz/TopDownOrtho", "X": 1, "Y": 2, "Scale": 100, "Angle": 0.5, "Odd": 7}
    raw = {
        "Panels": [{"Class": "rviz/Time"}],
        "Visualization Manager": {
            "Displays": [
                {"Class": "rviz/Grid", "Name": "Grid", "Enabled": True},
                {"Class": "rviz/Group", "Name": "Robot", "Enabled": False, "Displays": [frames]},
                plan,
            ],
            "Global Options": {"Fixed Frame": "odom"},
            "Tools": [{"Class": "rviz/SetGoal", "Topic": "/robot/goal"}],
            "Views": {"Current": view},
        },
    }
    (found,) = run({"call": "config", "raw": raw})
    assert found["fixed"] == "odom"
    assert found["unknown"] == ["Plan (moveit_rviz_plugin/MotionPlanning)"]
    assert found["shown"] == [["Grid", 0, True], ["Robot", 0, False], ["TF", 1, False], ["Plan", 0, True]]
    assert (found["view"]["kind"], found["view"]["focus"], found["view"]["scale"]) == ("top", [1, 2, 0], 100)
    assert found["goal"] == "/robot/goal"
    manager = found["raw"]["Visualization Manager"]
    assert manager["Displays"][2] == plan
    assert manager["Views"]["Current"]["Odd"] == 7
    assert found["raw"]["Panels"] == raw["Panels"]


@pytest.mark.parametrize("name", ["constructor", "__proto__", "toString"])
def test_class_named_like_a_property_of_objects_is_unknown(name: str) -> None:
    display = {"Class": f"rviz/{name}", "Name": "Odd", "Enabled": True}
    (found,) = run({"call": "config", "raw": {"Visualization Manager": {"Displays": [display]}}})
    assert found["unknown"] == [f"Odd (rviz/{name})"]


def test_config_that_is_not_one_is_refused() -> None:
    assert run({"call": "config", "raw": {"a": 1}}) == [
        'Error: not a file of RViz: it has no "Visualization Manager"'
    ]


# --- languages


def test_reasons_are_in_the_language_of_the_person() -> None:
    texts = json.dumps((FOLDER / "js" / "texts.js").as_uri())
    body = f"""
      const {{ chooseLanguage }} = await import({texts});
      const reason = (text) => {{ try {{ parseUrdf(text); }} catch (error) {{ return error.message; }} }};
      const found = [];
      for (const language of ["de", "en"]) {{
        chooseLanguage(language);
        found.push(reason("<robot>"), reason('<robot><link name="a"/><link name="b"/></robot>'));
      }}
      return found;
    """
    assert run_script("parseUrdf", "js/scene/urdf.js", body) == [
        "Zeile 1: </robot> fehlt",
        "zwei Wurzeln: a, b",
        "line 1: </robot> is missing",
        "two root links: a, b",
    ]
