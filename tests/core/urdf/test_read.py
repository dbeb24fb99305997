"""Robot descriptions, read as by Debian's urdfdom: its messages, and the robots that it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import UrdfError
from minirospy.core.urdf.describe import error_lines, problem_lines, tree_lines
from minirospy.core.urdf.model import Box, Cylinder, JointType, Limit, Mimic
from minirospy.core.urdf.read import parse_robot, read_robot
from minirospy.core.urdf.values import NotANumberError, as_float

HERE = Path(__file__).parent
GOLDEN: dict[str, dict[str, Any]] = json.loads((HERE / "check_urdf.json").read_text(encoding="utf-8"))
"""Output of Debian's `check_urdf`, recorded by tests/interop/test_interop_robots.py."""

OURS = {
    "badcolor": "a colour of three numbers is passed over in silence there",
    "matcol": "a colour of three numbers is passed over in silence there",
    "linknoname": "a link without a name is accepted there",
    "loop2": "links in a loop are accepted there",
    "mimicunk": "a mimicked joint that does not exist is accepted there",
    "twoparents": "a link with two parents is accepted there",
}
"""Cases in which minirospy prints more than urdfdom."""
ODD_XML = {
    name for name in GOLDEN if name.startswith("xml_")
}  # not well-formed, and read by urdfdom silently


def lines_of(text: str) -> tuple[list[str], list[str], int]:
    """Return stdout, stderr (without positions) and status of minirospy's `check_urdf`."""
    try:
        robot = parse_robot(text, "x.urdf")
    except UrdfError as error:
        return [], [*without_places(error_lines(error)), "ERROR: Model Parsing the xml failed"], 255
    errors = [line for problem in robot.problems for line in problem_lines(problem, "x.urdf")]
    return [*tree_lines(robot)], without_places(errors), 0


def without_places(lines: Any) -> list[str]:
    return [line for line in lines if not line.startswith("         ")]


@pytest.mark.parametrize("name", sorted(GOLDEN.keys() - OURS.keys() - ODD_XML))
def test_reader_agrees_with_urdfdom(name: str) -> None:
    golden = GOLDEN[name]
    stdout, stderr, status = lines_of(golden["urdf"])
    # Debian's urdfdom reports an undefined material twice.
    assert (stdout, stderr, status) == (
        golden["stdout"],
        [*dict.fromkeys(golden["stderr"])],
        golden["status"],
    )


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("badcolor", "3 numbers instead of 4"),
        ("linknoname", "No name given for the link."),
        ("loop2", "link [a] is part of a loop"),
        ("mimicunk", "which is not in this robot"),
        ("twoparents", "link [c] has two parents: joint [j] and joint [k]"),
    ],
)
def test_reader_reports_faults_that_urdfdom_accepts_silently(name: str, words: str) -> None:
    assert words in "\n".join(lines_of(GOLDEN[name]["urdf"])[1])


@pytest.mark.parametrize("name", sorted(ODD_XML))
def test_odd_xml_is_read_as_urdfdom_reads_it_with_one_warning(name: str) -> None:
    stdout, stderr, status = lines_of(GOLDEN[name]["urdf"])
    assert (stdout, status) == (GOLDEN[name]["stdout"], GOLDEN[name]["status"])
    assert [line.partition(" ")[0] for line in stderr] == ["Warning:"]


def test_latin_1_in_a_comment_is_one_warning() -> None:
    """urdfdom reads bytes, and accepts these, too."""
    robot = parse_robot('<robot name="r"><!-- \xe9 --><link name="a"/></robot>'.encode("latin-1"), "x.urdf")
    assert [(str(problem), problem.is_warning) for problem in robot.problems] == [
        ("the text is not UTF-8, and was read as Latin-1", True)
    ]


def test_arm_is_read_whole() -> None:
    robot = read_robot(HERE / "arm.urdf")
    assert (robot.name, robot.root, robot.problems) == ("two_link_arm", "base_link", ())
    assert [*robot.joints] == ["shoulder", "elbow", "wrist", "left", "right"]
    shoulder, right = robot.joints["shoulder"], robot.joints["right"]
    assert shoulder.type is JointType.REVOLUTE
    assert shoulder.limit == Limit(-1.57, 1.57, 10, 1)
    assert (shoulder.origin.rpy, shoulder.axis) == ((0.1, 0.2, 0.3), (0, 1, 0))
    assert right.mimic == Mimic("left", 2, 0.1)
    base, upper = robot.links["base_link"], robot.links["upper_arm"]
    assert base.visuals[0].geometry == Cylinder(0.1, 0.1)
    assert base.visuals[0].material
    assert robot.materials[base.visuals[0].material.name].color == (0, 0, 0.8, 1)
    assert upper.inertial
    assert (upper.inertial.mass, upper.inertial.inertia[0], upper.inertial.origin.xyz[2]) == (1, 0.02, 0.25)


def test_errors_name_file_and_line() -> None:
    text = (
        '<robot name="r">\n  <link name="a"/>\n  <link name="b"/>\n  <joint name="j" type="ball"/>\n</robot>'
    )
    with pytest.raises(UrdfError, match=r"^x\.urdf:4: Joint \[j\] has no known type \[ball\]"):
        parse_robot(text, "x.urdf")
    with pytest.raises(UrdfError, match=r"^x\.urdf:2: not XML: "):
        parse_robot("<robot name='r'>\n<link</robot>", "x.urdf")


@pytest.mark.parametrize(
    "text",
    [
        "",
        " \n",
        "<a>" * 50_000,
        "\ud800",
        f'<robot name="r" version="{"9" * 5000}.0"/>',
        b"\xff\xfe<",
        b'<?xml version="1.0" encoding="klingon"?><robot name="r"/>',
        '<!DOCTYPE r [<!ENTITY a0 "aaaaaaaaaa">'
        + "".join(f'<!ENTITY a{n} "' + f"&a{n - 1};" * 10 + '">' for n in range(1, 9))
        + ']><robot name="r"><link name="&a8;"/></robot>',
    ],
    ids=["nothing", "blanks", "deep", "surrogate", "version", "bytes", "encoding", "entities"],
)
def test_invalid_description_is_refused(text: str | bytes) -> None:
    with pytest.raises(UrdfError):
        parse_robot(text)


@given(st.text(alphabet="<>/=\"' robtlinkjaxyz0123456789.", max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse_robot(f'<robot name="r"><link name="a">{text}</link></robot>')
    except UrdfError:
        pass


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "0x10", "1_0", "1,5", "", "1e999", "٣"])
def test_numbers_that_ros_refuses(text: str) -> None:
    with pytest.raises(NotANumberError):
        as_float(text)


@pytest.mark.parametrize(("text", "value"), [(" 1 ", 1), ("+.5", 0.5), ("1.", 1), ("-2e-3", -0.002)])
def test_numbers_that_ros_reads(text: str, value: float) -> None:
    assert as_float(text) == value


def test_long_chains_are_read_and_shown() -> None:
    count = 5000
    links = "".join(f'<link name="l{n}"/>' for n in range(count))
    joints = "".join(
        f'<joint name="j{n}" type="fixed"><parent link="l{n}"/><child link="l{n + 1}"/></joint>'
        for n in range(count - 1)
    )
    robot = parse_robot(f'<robot name="r">{links}{joints}</robot>')
    assert len([*tree_lines(robot)]) == 3 + count - 1


def test_shapes_may_share_a_link() -> None:
    robot = parse_robot(
        '<robot name="r"><link name="a"><visual><geometry><box size="1 2 3"/></geometry></visual>'
        '<visual><geometry><cone/></geometry></visual><collision><geometry><sphere radius="1"/></geometry></collision>'
        "</link></robot>"
    )
    assert [visual.geometry for visual in robot.links["a"].visuals] == [Box((1, 2, 3))]
    assert (
        str(robot.problems[0]) == "Unknown geometry type 'cone': Could not parse visual element for Link [a]"
    )


def test_long_numbers_take_no_time() -> None:
    # Each digit used to be tried as the end of the integer part, and each rest as the decimals, which took 30 s.
    with pytest.raises(NotANumberError):
        as_float("1" * 100_000 + "x")
