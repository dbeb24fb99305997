"""The programs of tf, tf2_ros and tf2_tools. tests/interop/test_interop_robots.py compares their output with ROS's."""

from __future__ import annotations

import asyncio
import math
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tf2_msgs.msg import TFMessage
from tf2_msgs.srv import FrameGraph

from minirospy import Node
from minirospy.core.tf2.buffer import TransformBuffer
from minirospy.core.tf2.listing import frames_as_dot
from minirospy.core.urdf.poses import quaternion_from_rpy
from minirospy.ros.tf2_ros.tools import echo, monitor, static_publisher, view
from minirospy.ros.tf2_ros.tools.angles import euler_of_matrix, rpy_of_matrix
from minirospy.ros.tf2_ros.tools.monitor import Delays
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, python
from tests.waiting import until

STATIC = ("tf2_ros", "static_transform_publisher")
OLD_STATIC = ("tf", "static_transform_publisher")
POSE = """\
- Translation: [1.425, 2.232, 2.876]
- Rotation: in Quaternion [0.017, 0.133, 0.239, 0.962]
            in RPY (radian) [0.100, 0.250, 0.500]
            in RPY (degree) [5.730, 14.324, 28.648]
"""
"""Output of Debian's tf_echo for the frames in the fixture."""


@pytest.fixture
def frames(start: Start) -> None:
    """Publish the frame a -> b on /tf at 10 Hz, and b -> c on /tf_static."""
    start(*OLD_STATIC, *words("1 2 3 0.5 0.25 0.1 /a /b 100"), "__name:=moving")
    start(*STATIC, *words("0.5 0 0 0 0 0 1 b c"), "__name:=fixed")
    # Wait first, because some programs listen for only a few seconds.
    wait_for("b", "c")


def wait_for(*frames: str) -> None:
    """Return when all these frames have been published."""

    async def read(node: Node, topic: str, missing: set[str]) -> None:
        async for message in node.subscribe(topic, TFMessage):
            missing -= {each.child_frame_id.removeprefix("/") for each in message.transforms}
            if not missing:
                break

    async def main() -> None:
        async with Node("waits", rosout=False) as node:
            missing = set(frames)
            reads = [asyncio.ensure_future(read(node, topic, missing)) for topic in ("/tf", "/tf_static")]
            await asyncio.wait(reads, return_when=asyncio.FIRST_COMPLETED)
            for each in reads:
                each.cancel()
            await asyncio.gather(*reads, return_exceptions=True)
            assert not missing

    asyncio.run(asyncio.wait_for(main(), SECONDS))


def words(text: str) -> list[str]:
    return text.split()


def lines_until(process: subprocess.Popen[str], pattern: str) -> str:
    """Return a program's output up to a line that matches."""
    assert process.stdout
    read = ""
    for line in process.stdout:
        read += line
        if re.match(pattern, line):
            return read
    raise AssertionError(f"the program ended: {read} {process.communicate()}")


@pytest.mark.usefixtures("frames")
class TestEcho:
    def test_transform_is_printed_as_by_ros(self, start: Start) -> None:
        program = start("tf", "tf_echo", "a", "/c", "20")
        lines_until(program, "At time")
        read = lines_until(program, ".*degree")
        assert read == POSE

    def test_failure_names_the_frames(self, start: Start) -> None:
        program = start("tf", "tf_echo", "a", "nothing", "20")
        read = ""
        # "a" does not exist either until frames have arrived.
        while '"nothing"' not in read:
            lines_until(program, r"Failure at \d+\.\d{9}\n")
            read = lines_until(program, "The current list")
        read += lines_until(program, "Frame b")
        assert read.startswith(
            'Exception thrown:"nothing" passed to lookupTransform argument source_frame does not exist. \n'
            "The current list of frames is:\nFrame "
        )

    def test_precision_and_rate_are_parameters(self, start: Start) -> None:
        program = start("tf", "tf_echo", "b", "c", "_precision:=1", "_rate:=20.0")
        read = lines_until(program, ".*degree")
        assert read.startswith("Precision default value was overriden, new value: 1\n")
        read = lines_until(program, ".*degree")
        assert "- Translation: [0.5, 0.0, 0.0]\n- Rotation: in Quaternion [0.0, 0.0, 0.0, 1.0]\n" in read

    def test_echo_of_tf2_tools_ends_after_its_limit(self, start: Start) -> None:
        """Frames without a connection do not end it. Both programs run meanwhile, for ten seconds."""
        start(*STATIC, *words("0 0 0 0 0 0 p q"), "__name:=other")
        wait_for("q")
        program = start("tf2_tools", "echo.py", *words("a c -r 1 -l 10 -p 3"))
        apart = start("tf2_tools", "echo.py", *words("a q -r 1 -l 10"), "__name:=apart")
        output, errors = program.communicate(timeout=SECONDS)
        assert program.returncode == 0
        assert POSE in output
        assert "Traceback" not in errors
        _, errors = apart.communicate(timeout=SECONDS)
        assert apart.returncode == 0
        assert "not part of the same tree" in errors
        assert "Traceback" not in errors


@pytest.mark.usefixtures("frames")
class TestMonitor:
    def test_frames_and_nodes_are_listed(self, start: Start) -> None:
        program = start("tf", "tf_monitor")
        read = lines_until(program, r"Node: /moving [\d.]+ Hz")
        assert "\n\n\nRESULTS: for all Frames\n\nFrames:\n" in read
        found = re.search(
            r"^Frame: b published by /moving Average Delay: (\S+) Max Delay: (\S+)$", read, re.M
        )
        # The program's stamps are 0.1 s in the future, but a machine that stalls delays the publication.
        assert found
        assert -0.1 <= float(found[1]) <= float(found[2])
        assert "Frame: c published by /fixed(static) Average Delay: 0 Max Delay: 0" in lines_until(
            program, "Frame: c"
        )

    def test_chain_between_two_frames_is_followed(self, start: Start) -> None:
        program = start("tf", "tf_monitor", "/a", "c")
        read = lines_until(program, r"Net delay     avg = \S+: max = \S+\n")
        assert read.startswith("Waiting for transform chain to become available between a and c ")
        assert "\n\n\nRESULTS: for a to c\nChain is: a -> b -> c\n" in read


def test_delays_are_of_each_frame_and_node() -> None:
    delays = Delays()
    delays.add("/n", [("b", 1.0), ("c", 2.0)], 3.0, is_static=False)
    delays.add("/n", [("b", 4.5)], 5.0, is_static=False)
    delays.add("/s", [("d", 0.0)], 5.0, is_static=True)
    assert [*delays.frame_lines()] == [
        "Frame: b published by /n Average Delay: 1.25 Max Delay: 2",
        "Frame: c published by /n Average Delay: 1 Max Delay: 1",
        "Frame: d published by /s(static) Average Delay: 0 Max Delay: 0",
    ]
    assert [*delays.frame_lines(["d"])] == ["Frame: d published by /s(static) Average Delay: 0 Max Delay: 0"]
    assert [*delays.node_lines()] == [
        "Node: /n 1 Hz, Average Delay: 1 Max Delay: 1.5",
        "Node: /s(static) 1e+08 Hz, Average Delay: 0 Max Delay: 0",
    ]


@pytest.mark.usefixtures("frames")
@pytest.mark.parametrize(
    ("tool", "has_dot"),
    [(("tf", "view_frames"), True), (("tf", "view_frames"), False), (("tf2_tools", "view_frames.py"), False)],
)
def test_frames_are_drawn(
    tool: tuple[str, str], has_dot: bool, start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if has_dot and not shutil.which("dot"):
        pytest.skip("graphviz is not installed")
    monkeypatch.chdir(tmp_path)
    if not has_dot:
        monkeypatch.setenv("PATH", str(tmp_path))
    graph = output = ""
    for _ in range(5):
        program = start(*tool)
        output, errors = program.communicate(timeout=SECONDS)
        assert program.returncode == 0, errors
        graph = Path("frames.gv").read_text(encoding="utf-8")
        # If the machine stalls, frames may arrive after the five seconds for which the program listens.
        if '"a" -> "b"' in graph and '"b" -> "c"' in graph:
            break
    assert re.search(r'"b" -> "c"\[label=" ?Broadcaster: /fixed\\nAverage rate: 10000.0', graph)

    if has_dot:
        assert Path("frames.pdf").read_bytes().startswith(b"%PDF")
    else:
        texts = {
            each.text for each in ElementTree.parse("frames.svg").iter("{http://www.w3.org/2000/svg}text")
        }
        assert {"a", "b", "c", "Broadcaster: /moving"} <= texts

    if tool[0] == "tf":
        assert output.startswith("Listening to /tf for 5.0 seconds\nDone Listening\n")


@pytest.mark.usefixtures("frames")
def test_frames_of_a_node_are_drawn(start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    start("tf2_ros", "buffer_server", "_publish_frame_service:=true")

    async def listed() -> None:
        async with Node("waits", rosout=False) as node:
            await node.wait_for_service("/tf_buffer/tf2_frames")

            async def has_frame() -> bool:
                return "c:" in (await node.call("/tf_buffer/tf2_frames", FrameGraph)).frame_yaml

            await until(has_frame)

    asyncio.run(asyncio.wait_for(listed(), SECONDS))
    program = start("tf", "view_frames", "--node=/tf_buffer")
    output, errors = program.communicate(timeout=SECONDS)
    assert program.returncode == 0, errors
    assert output.startswith(
        "Generating graph for node:  /tf_buffer\nWaiting for service /tf_buffer/tf_frames\n"
    )
    assert '"b" -> "c"' in Path("frames.gv").read_text(encoding="utf-8")


def test_graph_without_frames_says_so() -> None:
    assert view.tf2_graph([], 1.0) == 'digraph G { "No tf data received" }'


@pytest.mark.parametrize("now", [0, 10**9])
def test_names_with_quotation_marks_are_escaped_in_tfs_graph(now: int) -> None:
    buffer = TransformBuffer()
    buffer.insert('a"b', "c\\", 10**9, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), "/n")
    graph = frames_as_dot(buffer, now)
    (edge,) = view.read_edges(graph)
    assert (edge.parent, edge.child) == ('a"b', "c\\")
    assert now == 0 or '->"a\\"b";' in graph


def test_names_of_frames_stay_names() -> None:
    listing = (
        "true: \n  parent: 'a\"b\\c'\n  broadcaster: '/n'\n  rate: 1.000\n  most_recent_transform: 2.000\n"
        "  oldest_transform: 1.500\n  buffer_length: 0.500\n"
    )
    graph = view.tf2_graph(view.read_records(listing), 1.0)
    (edge,) = view.read_edges(graph)
    assert (edge.parent, edge.child) == ('a"b\\c', "true")
    assert edge.label[:2] == ("Broadcaster: /n", "Average rate: 1.0")


@pytest.mark.parametrize(
    ("main", "typed", "status", "text"),
    [
        (static_publisher.main_tf, "", 255, "not having the right number of arguments"),
        (static_publisher.main_tf, "1 2 3", 255, "not having the right number of arguments"),
        (static_publisher.main_tf2, "1 2 3 0 0 0 1 a b 100", 255, "not having the right number of arguments"),
        (static_publisher.main_tf, "1 2 x 0 0 0 a b 100", 255, "z is [x], which is not a number"),
        (static_publisher.main_tf2, "1 2 3 0 0 nan a b", 255, "roll is [nan], which is not a number"),
        (
            static_publisher.main_tf,
            "1 2 3 0 0 0 /a a 100",
            1,
            "source frame are the same (/a, a) this cannot work",
        ),
        (
            static_publisher.main_tf2,
            "1 2 3 0 0 0 a a",
            1,
            "source frame are the same (a, a) this cannot work",
        ),
        (static_publisher.main_tf2, "1 2 3 0 0 0 2 a b", 1, "the quaternion (0 0 0 2) is not of length 1"),
        (echo.main_tf, "a", 255, "Usage: tf_echo source_frame target_frame [echo_rate]"),
        (echo.main_tf, "a b x", 255, "Echo rate must be > 0.0"),
        (monitor.main, "a", 255, "TF_Monitor: usage: tf_monitor framea frameb"),
    ],
)
def test_usage_errors_are_those_of_ros(
    main: Callable[[list[str]], int],
    typed: str,
    status: int,
    text: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(words(typed)) == status
    output, errors = capsys.readouterr()
    assert text in output + errors


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    ("tool", "typed", "status", "text"),
    [
        (STATIC, "nothing", 255, "Could not read TF from parameter server: nothing"),
        (("tf", "tf_echo"), "a b _precision:=0", 255, "Precision must be > 0"),
        (("tf", "tf_echo"), "a b _precision:=many", 255, "~precision is [many]"),
        (("tf2_tools", "echo.py"), "a b -r 0", 2, "argument -r/--rate: 0.0 must be > 0.0"),
        (("tf2_ros", "buffer_server"), "_buffer_size:=long", 1, "~buffer_size is [long]"),
        (("tf", "tf_remap"), "_mappings:=5", 1, "~mappings is [5]"),
    ],
)
def test_wrong_parameters_are_one_line(
    tool: tuple[str, str], typed: str, status: int, text: str, start: Start
) -> None:
    program = start(*tool, *typed.split())
    output, errors = program.communicate(timeout=SECONDS)
    assert program.returncode == status, errors
    assert text in output + errors
    assert "Traceback" not in errors


@pytest.mark.usefixtures("master")
def test_parameter_is_broadcast(start: Start) -> None:
    pose = "{translation: {x: 1, y: 2.5, z: 0}, rotation: {x: 0, y: 0, z: 0, w: 1}}"
    value = f"{{header: {{frame_id: p}}, child_frame_id: q, transform: {pose}}}"
    # The program's own arguments set a private parameter, which is given by its full name.
    start(*STATIC, "/fixed/here", f"_here:={value}", "__name:=fixed")
    program = start("tf", "tf_echo", "p", "q", "20")
    read = lines_until(program, "- Translation: ")
    assert read.endswith("- Translation: [1.000, 2.500, 0.000]\n")


@pytest.mark.usefixtures("frames")
def test_names_are_published_as_they_are_typed() -> None:
    read = python(
        "import rospy; from tf2_msgs.msg import TFMessage; rospy.init_node('names', anonymous=True); "
        f"seen = rospy.wait_for_message('/tf', TFMessage, {SECONDS}).transforms[0]; "
        "print(seen.header.frame_id, seen.child_frame_id)"
    )
    assert read == "/a /b\n"


@pytest.mark.usefixtures("frames")
def test_frames_are_renamed(start: Start) -> None:
    start(*OLD_STATIC, *words("7 0 0 0 0 0 x y 50"), "/tf:=/tf_old")
    start("tf", "tf_remap", "_mappings:=[{old: y, new: new_y}]")
    program = start("tf", "tf_echo", "x", "new_y", "20")
    assert "[7.000, 0.000, 0.000]" in lines_until(program, "- Translation: ")


@pytest.mark.parametrize("angles", [(0.1, 0.2, 0.3), (3, -1.5, -3), (0, 0, 0), (0, math.pi / 2, 0.5)])
@pytest.mark.parametrize("read", [rpy_of_matrix, euler_of_matrix])
def test_angles_make_the_same_rotation(angles: tuple[float, float, float], read: type) -> None:
    rotation = quaternion_from_rpy(*angles)
    again = quaternion_from_rpy(*read(rotation))
    assert abs(sum(a * b for a, b in zip(rotation, again, strict=True))) == pytest.approx(1)


@pytest.mark.usefixtures("frames")
@pytest.mark.parametrize(("stamped", "kind"), [("true", "PoseStamped"), ("false", "Pose")])
def test_pose_of_the_robot_is_published(start: Start, stamped: str, kind: str) -> None:
    parameters = f"_map_frame:=/a _base_frame:=c _publish_frequency:=50 _is_stamped:={stamped}"
    start("robot_pose_publisher", "robot_pose_publisher", *words(parameters))
    code = (
        "import rospy; from geometry_msgs.msg import Pose, PoseStamped; rospy.init_node('reader'); "
        f"found = rospy.wait_for_message('robot_pose', {kind}, {SECONDS}); "
        "pose = getattr(found, 'pose', found); print("
        "[round(each, 3) for each in (pose.position.x, pose.position.y, pose.orientation.w)], "
        "getattr(getattr(found, 'header', None), 'frame_id', None))"
    )
    frame = "/a" if stamped == "true" else None
    assert python(code) == f"[1.425, 2.232, 0.962] {frame}\n"


def test_pose_at_no_frequency_is_refused(start: Start) -> None:
    program = start("robot_pose_publisher", "robot_pose_publisher", "_publish_frequency:=0")
    _, errors = program.communicate(timeout=SECONDS)
    assert program.returncode == 1
    assert "~publish_frequency is 0: it is a number of messages a second" in errors
