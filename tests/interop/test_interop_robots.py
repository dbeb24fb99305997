"""Debian's programs for robots and frames have the same transforms, output and exit statuses as minirospy's.

`RECORD=1 pytest tests/interop/test_interop_robots.py` records tests/core/urdf/check_urdf.json again.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy

from .conftest import OUR_BIN, PATIENCE, REAL_PYTHON, start, stop

URDFS = Path(__file__).parents[1] / "core" / "urdf"
ARM = (URDFS / "arm.urdf").read_text(encoding="utf-8")
GOLDEN = URDFS / "check_urdf.json"
STACKS = ("real", "ours")
PYTHON_PROGRAMS = ("joint_state_publisher", "tf2_tools", "tf/view_frames", "tf/tf_remap")

Numbers = list[float]


def command(stack: str, program: str) -> list[str]:
    """Return the command that runs PACKAGE/PROGRAM of a stack."""
    if stack == "ours":
        return [str(OUR_BIN / "rosrun"), *program.split("/")]
    python = [REAL_PYTHON] if program.startswith(PYTHON_PROGRAMS) else []
    return [*python, f"/usr/lib/{program}"]


class Programs:
    """Programs from either stack that use one master; they are stopped after the test."""

    def __init__(self, uri: str, running: ExitStack) -> None:
        self.uri = uri
        self._running = running

    def start(self, stack: str, program: str, *words: str) -> subprocess.Popen[str]:
        """Start PACKAGE/PROGRAM, which runs until the test finishes."""
        process = start([*command(stack, program), *words], self.uri, "ours" if stack == "ours" else "rospy")
        self._running.callback(end, process)
        return process

    def set(self, name: str, value: object) -> None:
        """Set a parameter."""
        proxy = MasterProxy(self.uri, "/test")
        proxy.set_param(name, value)
        proxy.close()


def end(process: subprocess.Popen[str]) -> None:
    """Stop a program that does not read stdin."""
    process.terminate()
    stop(process)


@pytest.fixture
def programs(real_master: str) -> Iterator[Programs]:
    with ExitStack() as running:
        yield Programs(real_master, running)


def run_node(uri: str, body: Callable[[Node], object]) -> None:
    async def main() -> None:
        async with Node("test", master_uri=uri, rosout=False) as node:
            await asyncio.wait_for(body(node), PATIENCE)  # type: ignore[arg-type]

    asyncio.run(main())


def poses(message: TFMessage) -> dict[tuple[str, str], Numbers]:
    """Return the pose of each frame."""
    found = {}
    for each in message.transforms:
        place, turn = each.transform.translation, each.transform.rotation
        numbers = [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]
        found[(each.header.frame_id, each.child_frame_id)] = numbers
    return found


STATES: list[dict[str, float]] = [
    {"shoulder": 0.5, "elbow": 1.0, "left": 0.02},
    {"shoulder": -1.2, "elbow": 3.0, "left": 0.01, "right": 0.04},
    {"elbow": -100.0},
    {"unknown": 1.0, "shoulder": 1e-9},
]


def random_robot(seed: int) -> tuple[str, list[dict[str, float]]]:
    """Return a description with 30 joints, and some states of these joints."""
    chance = random.Random(seed)
    kinds = ["revolute", "continuous", "prismatic", "fixed", "planar"]

    def vector(size: float) -> str:
        return " ".join(f"{chance.uniform(-size, size):.6f}" for _ in range(3))

    parts = ['<link name="l0"/>']
    names = []
    for number in range(1, 31):
        kind = chance.choice(kinds)
        names += [f"j{number}"] if kind in kinds[:3] else []
        parts.append(
            f'<link name="l{number}"/><joint name="j{number}" type="{kind}"><parent link="l{chance.randrange(number)}"/>'
            f'<child link="l{number}"/><origin xyz="{vector(2)}" rpy="{vector(4)}"/><axis xyz="{vector(1)}"/>'
            '<limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'
        )
    states = [{name: chance.uniform(-7, 7) for name in names} for _ in range(5)]
    return f'<robot name="r">{"".join(parts)}</robot>', states


def published(
    programs: Programs, stack: str, *words: str, states: list[dict[str, float]] = STATES
) -> list[dict[tuple[str, str], Numbers]]:
    """Return the transforms that a robot_state_publisher publishes for STATES, the fixed frames first."""
    process = programs.start(
        stack, "robot_state_publisher/robot_state_publisher", *words, f"__name:=rsp_{stack}"
    )
    found: list[dict[tuple[str, str], Numbers]] = []
    topic = "/tf" if "_use_tf_static:=false" in words else "/tf_static"

    async def body(node: Node) -> None:
        async for fixed in node.subscribe(topic, TFMessage):
            if fixed.transforms:
                found.append(poses(fixed))
                break
        sender = node.advertise("joint_states", JointState)
        moving = node.subscribe("/tf", TFMessage, queue_size=100)
        await sender.wait_for_subscribers()
        await moving.wait_for_publishers()
        for positions in states:
            state = JointState(name=[*positions], position=[*positions.values()])
            await node.sleep(0.1)
            state.header.stamp = node.now()
            await sender.publish(state)
            async for message in moving:
                if message.transforms and message.transforms[0].header.stamp == state.header.stamp:
                    found.append(poses(message))
                    break

    run_node(programs.uri, body)
    end(process)
    return found


@pytest.mark.parametrize(
    "words", [(), ("_tf_prefix:=/left",), ("_use_tf_static:=false", "_publish_frequency:=20")], ids=" ".join
)
def test_robot_state_publishers_publish_the_same(programs: Programs, words: tuple[str, ...]) -> None:
    programs.set("/robot_description", ARM)
    real, ours = (published(programs, stack, *words) for stack in STACKS)
    assert [sorted(message) for message in ours] == [sorted(message) for message in real]
    for mine, theirs in zip(ours, real, strict=True):
        for frame, numbers in theirs.items():
            assert mine[frame] == pytest.approx(numbers, abs=1e-12), frame


@pytest.mark.parametrize("seed", range(3))
def test_random_robots_move_the_same(programs: Programs, seed: int) -> None:
    description, states = random_robot(seed)
    programs.set("/robot_description", description)
    real, ours = (published(programs, stack, states=states) for stack in STACKS)
    for mine, theirs in zip(ours, real, strict=True):
        assert mine.keys() == theirs.keys()
        for frame, numbers in theirs.items():
            assert mine[frame] == pytest.approx(numbers, abs=1e-12), frame


PARAMETERS: list[dict[str, object]] = [
    {},
    {
        "zeros": {"elbow": 1.5, "left": 0.02},
        "publish_default_velocities": True,
        "publish_default_efforts": True,
    },
    {"use_mimic_tags": False, "publish_default_positions": False},
    {
        "dependent_joints": {"elbow": {"parent": "shoulder", "factor": -2, "offset": 0.25}},
        "zeros": {"shoulder": 1},
    },
]


@pytest.mark.parametrize("parameters", PARAMETERS)
def test_joint_state_publishers_publish_the_same(programs: Programs, parameters: dict[str, object]) -> None:
    programs.set("/robot_description", ARM)
    seen = []
    for stack in STACKS:
        programs.set(f"/jsp_{stack}", {**parameters, "rate": 50})
        process = programs.start(stack, "joint_state_publisher/joint_state_publisher", f"__name:=jsp_{stack}")

        async def body(node: Node) -> None:
            message = await node.wait_for_message("joint_states", JointState)
            seen.append(
                [list(each) for each in (message.name, message.position, message.velocity, message.effort)]
            )

        run_node(programs.uri, body)
        end(process)
    assert seen[0] == seen[1]


def test_real_publishers_move_our_frames_and_the_reverse(programs: Programs) -> None:
    programs.set("/robot_description", ARM)
    seen = []
    for sender, listener in (("real", "ours"), ("ours", "real")):
        nodes = [
            programs.start(sender, f"{name}/{name}", f"__name:={name}_{sender}")
            for name in ("joint_state_publisher", "robot_state_publisher")
        ]
        echo = programs.start(listener, "tf/tf_echo", "base_link", "tool", "10")
        until(echo, "At time")
        seen.append(until(echo, " +in RPY .degree"))
        for node in (*nodes, echo):
            end(node)
    assert seen[0] == seen[1]


# --- words


def until(process: subprocess.Popen[str], pattern: str) -> str:
    """Return a program's output up to a line that matches."""
    assert process.stdout
    read = ""
    for line in process.stdout:
        read += line
        if re.match(pattern, line):
            return read
    raise AssertionError(f"the program ended: {read} {process.communicate()}")


def masked(text: str) -> str:
    """Return the text without colours, times and other parts that differ between runs."""
    text = re.sub(r"\x1b\[[\d;]*m", "", text)
    text = re.sub(r"\[ *(INFO|WARN|ERROR|FATAL)\] \[[\d.]+\]", r"[\1]", text)
    text = re.sub(r"\d{10}\.\d+", "TIME", text)
    text = re.sub(r"(extrapolation )[\d.]+s", r"\1Ns", text)
    text = re.sub(r"published by \S+?(\(static\))? Average", r"published by NODE\1 Average", text)
    text = re.sub(r"(Average Delay|Max Delay|Average rate|Buffer length|max): -?[\d.e+-]+", r"\1: N", text)
    text = re.sub(r"-?[\d.]+ sec old", "N sec old", text)
    return re.sub(r"(avg =) -?[\d.e+-]+", r"\1 N", text)


def words_of(line: str) -> list[str]:
    return line.split()


def ended(programs: Programs, stack: str, line: str) -> tuple[int, str, str]:
    """Return a program's exit status and output."""
    program, *words = line.split()
    process = programs.start(stack, program, *words)
    output, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, masked(output), masked(errors)


@pytest.fixture
def frames(programs: Programs) -> Programs:
    """Publish the frame a -> b on /tf, and b -> c and p -> q on /tf_static."""
    programs.start(
        "real", "tf/static_transform_publisher", *words_of("1 2 3 0.5 0.25 0.1 a b 100"), "__name:=moving"
    )
    for words in ("0.5 0 0 0 0 0 1 b c", "1 2.5 0 0 0 0 p q"):
        name = f"__name:=fixed_{words[-1]}"
        programs.start("ours", "tf2_ros/static_transform_publisher", *words.split(), name)

    async def body(node: Node) -> None:
        seen: set[tuple[str, str]] = set()
        await node.wait_for_message("/tf", TFMessage)
        async for message in node.subscribe("/tf_static", TFMessage):
            seen |= poses(message).keys()
            if seen == {("b", "c"), ("p", "q")}:
                break

    run_node(programs.uri, body)
    return programs


@pytest.mark.parametrize("line", ["tf/tf_echo a c 10", "tf/tf_echo /b /c 10 _precision:=6"])
def test_transforms_are_printed_alike(frames: Programs, line: str) -> None:
    program, *words = line.split()
    said = []
    for stack in STACKS:
        process = frames.start(stack, program, *words)
        first = until(process, "At time|Failure")
        said.append([masked(first.splitlines()[0])] if "Precision" in first else [])
        until(process, "At time")
        said[-1].append(until(process, " +in RPY .degree"))
    assert said[1] == said[0]


@pytest.mark.parametrize("line", ["tf/tf_monitor", "tf/tf_monitor a c"])
def test_delays_are_printed_alike(frames: Programs, line: str) -> None:
    program, *words = line.split()
    said = []
    for stack in STACKS:
        process = frames.start(stack, program, *words)
        first = masked(until(process, "RESULTS"))
        waiting = [first.splitlines()[0].rstrip(". "), first.splitlines()[-1]]
        report: list[str] = []
        while sum(line.startswith("Frame: ") for line in report) < (2 if words else 3):
            # Some frames have not arrived yet.
            until(process, "Frames:")
            report = masked(until(process, "Node: ")).splitlines()
        said.append((waiting, [line for line in report if line.startswith("Frame")]))
    assert said[1] == said[0]


@pytest.mark.parametrize(
    "line",
    [
        "tf/static_transform_publisher",
        "tf/static_transform_publisher 1 2 3",
        "tf2_ros/static_transform_publisher",
        "tf2_ros/static_transform_publisher 1 2 3",
        "tf2_ros/static_transform_publisher nothing",
        "tf2_ros/static_transform_publisher 1 2 3 0 0 0 a a",
        "tf/tf_echo",
        "tf/tf_echo a",
        "tf/tf_echo a b c d",
        "tf/tf_echo a b 0",
        "tf/tf_echo a b x",
        "tf/tf_echo a b _precision:=0",
        "tf/tf_monitor a",
        "tf/view_frames -h",
        "tf2_tools/echo.py",
        "tf2_tools/echo.py -h",
        "tf2_tools/echo.py a b -r 0",
    ],
)
def test_usage_errors_are_the_same(programs: Programs, line: str) -> None:
    assert ended(programs, "ours", line) == ended(programs, "real", line)


@pytest.mark.parametrize(
    "words", ["a c -l 2 -r 1 -p 4", "b c -l 1 -r 1", "a zz -l 1 -r 1", "a c -o -100 -l 1 -r 1"]
)
def test_echo_of_tf2_tools_says_the_same(frames: Programs, words: str) -> None:
    line = f"tf2_tools/echo.py {words}"
    found: list[tuple[int, str, str]] = []
    for _ in range(5):
        # The frames at a program's first lookup, which may be its last, depend on timing.
        found = [ended(frames, stack, line) for stack in STACKS]
        if found[0] == found[1]:
            break
    assert found[1] == found[0]


def test_frames_are_drawn_alike(frames: Programs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    graphs = []
    for stack in STACKS:
        for program in ("tf/view_frames", "tf2_tools/view_frames.py"):
            folder = tmp_path / stack / program
            folder.mkdir(parents=True)
            monkeypatch.chdir(folder)
            graph = ""
            while not all(arrow in graph for arrow in ('"a" -> "b"', '"b" -> "c"', '"p" -> "q"')):
                # The program listens for five seconds, during which a busy machine may stall.
                frames.start(stack, program).communicate(timeout=PATIENCE)
                graph = (folder / "frames.gv").read_text(encoding="utf-8")
            # The frames are listed in order of arrival.
            lines = masked(graph).splitlines()
            graphs.append(sorted(re.sub(r'}->"[ap]"', '}->"ROOT"', line) for line in lines))
            if stack == "ours":
                assert (folder / "frames.pdf").read_bytes().startswith(b"%PDF")
    assert graphs[2:] == graphs[:2]


def test_description_is_checked_alike(tmp_path: Path) -> None:
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    seen = {}
    for name, case in golden.items():
        file = tmp_path / f"{name}.urdf"
        file.write_text(case["urdf"], encoding="utf-8")
        done = subprocess.run(["/usr/bin/check_urdf", file], capture_output=True, text=True, check=False)
        errors = [line for line in done.stderr.splitlines() if not line.startswith("         at")]
        seen[name] = {
            "urdf": case["urdf"],
            "stdout": done.stdout.splitlines(),
            "stderr": errors,
            "status": done.returncode,
        }
    if os.environ.get("RECORD"):
        GOLDEN.write_text(json.dumps(seen, indent=1, ensure_ascii=False), encoding="utf-8")
    assert seen == golden


def test_description_is_drawn_alike(tmp_path: Path) -> None:
    graphs = []
    for folder in ("/usr/bin", OUR_BIN):
        tool = [f"{folder}/urdf_to_graphviz", str(URDFS / "arm.urdf"), str(tmp_path / Path(folder).name)]
        done = subprocess.run(tool, capture_output=True, text=True, check=True)
        assert done.stdout == f"Created file {tool[2]}.gv\nCreated file {tool[2]}.pdf\n"
        graphs.append(Path(f"{tool[2]}.gv").read_text(encoding="utf-8"))
    assert graphs[1] == graphs[0]


def test_interrupts_end_all_alike(frames: Programs) -> None:
    for program in ("tf/tf_echo a c", "tf/tf_monitor", "tf2_ros/buffer_server"):
        statuses = []
        for stack in STACKS:
            name, *words = program.split()
            process = frames.start(stack, name, *words)
            if words or "monitor" in name:
                until(process, "At time|Frame: b")
            else:
                run_node(
                    frames.uri, lambda node: node.wait_for_message("tf2_buffer_server/status", _status())
                )
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            statuses.append(process.returncode)
        assert statuses[1] == statuses[0] == 0, program


def _status() -> type:
    from actionlib_msgs.msg import GoalStatusArray

    return GoalStatusArray
