"""The commands beside the real ones: the same graph, both tools, equal bytes on standard output."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

HERE = Path(__file__).parent
REAL = Path("/usr/bin")
OURS = Path(sys.executable).parent

# What differs from one call to the next: numbers of messages, times of answers.
CHANGING = re.compile(r"(?<=seq:)\s+\d+|(?<=time=)[\d.]+(?=ms)|(?<=ping average: )[\d.]+(?=ms)")
CHANGING_COLUMNS = re.compile(r"^\d{18,},|^(?:0|1000000002),\d+,", re.MULTILINE)

ASKING = """
rostopic list
rostopic list -v
rostopic list -p
rostopic list -s
rostopic list -vp
rostopic list -vs
rostopic list /ns
rostopic list ns
rostopic list /nope
rostopic list -v /ns
rostopic list --host
rostopic list -v --host
rostopic info /button_state
rostopic info listen
rostopic info /any
rostopic type /button_state
rostopic type /poly/polygon/points
rostopic type /poly/header/stamp
rostopic find std_msgs/Bool
rostopic find std_msgs/Nope
rosnode list
rosnode list -u
rosnode list -a
rosnode list /scene
rosnode info /scene
rosnode info -q scene
rosnode machine
rosnode machine localhost
rosnode ping -c 1 scene
rosnode ping -c 2 scene
rosnode cleanup
rosservice list
rosservice list -n
rosservice list /ns
rosservice list /nope
rosservice info /set_led_state
rosservice type ns/empty
rosservice args /set_led_state
rosservice args /ns/empty
rosservice uri /set_led_state
rosservice find std_srvs/SetBool
rosservice call /set_led_state True
rosservice call -v /set_led_state 'data: False'
rosservice call /set_led_state {}
rosservice call /ns/empty
rosparam list
rosparam list /p/d
rosparam list /nope
rosparam get /p
rosparam get -p /p
rosparam get /p/i
rosparam get /p/f
rosparam get /p/b
rosparam get /p/s
rosparam get -p /p/s
rosparam get /p/n
rosparam get -p /p/n
rosparam get /p/e
rosparam get /p/u
rosparam get -p /p/u
rosparam get /p/ml
rosparam get -p /p/ml
rosparam get /p/l
rosparam get -p /p/l
rosparam get -v /p/big
rosparam dump
rosmsg show std_msgs/Bool
rosmsg show Bool
rosmsg show PoseStamped
rosmsg show Log
rosmsg md5 Bool
rosmsg package std_msgs
rosmsg package -s std_msgs
rossrv show SetBool
rossrv show Empty
rossrv md5 std_srvs/SetBool
rossrv package std_srvs
""".strip().splitlines()

TOPICS = [
    "button_state",
    "ns/chatter",
    "poly",
    "scan",
    "joints",
    "image",
    "duration",
    "time",
    "bytes",
    "int8s",
    "signed_bytes",
    "char",
    "tiny",
    "empty",
    "poly/polygon",
    "poly/polygon/points",
    "poly/polygon/points[0]",
    "poly/polygon/points[0]/x",
    "poly/polygon/points[:]/x",
    "poly/polygon/points[1:]",
    "poly/header/stamp",
    "ns/chatter/data",
    "scan/ranges",
    "scan/ranges[1:3]",
    "joints/name",
    "joints/name[1]",
    "joints/name[-1]",
    "duration/data",
    "duration/data/secs",
]

ECHOING = [f"rostopic echo -n1 /{topic}" for topic in TOPICS] + [
    f"rostopic echo -n1 {option} /{topic}"
    for option in ("-p", "-c", "--nostr", "--noarr", "-w 6")
    for topic in ("button_state", "poly", "scan", "joints", "image", "ns/chatter", "time", "empty")
]

CHANGING_PARAMETERS = """
rosparam set -v /q 5
rosparam set -v /q/x -1.5
rosparam set -v /q/x deg(90)
rosparam set -v /q/y '{a: 1, b: [2, 3]}'
rosparam get /q
rosparam delete -v /q
""".strip().splitlines()


@pytest.fixture
def scene(request: pytest.FixtureRequest, any_master: str) -> Iterator[str]:
    """The URI of a master with the scene on it, a node of the stack that the test's parameter says."""
    python = "/usr/bin/python3" if request.param == "rospy" else sys.executable
    program = subprocess.Popen(
        [python, str(HERE / "scene.py")], env=_environment(any_master), stdout=subprocess.PIPE, text=True
    )
    try:
        assert program.stdout
        assert program.stdout.readline() == "ready\n"
        yield any_master
    finally:
        program.terminate()
        program.communicate(timeout=20)


ALL_REAL_AND_ALL_OURS = pytest.mark.parametrize(
    ("any_master", "scene"), [("rospy", "rospy"), ("ours", "ours")], indirect=True
)


@ALL_REAL_AND_ALL_OURS
@pytest.mark.timeout(300)
@pytest.mark.parametrize("lines", [ASKING, ECHOING], ids=["asking", "echoing"])
def test_the_same_bytes(scene: str, lines: list[str]) -> None:
    _assert_equal({line: _both_at_once(scene, line) for line in lines})


@ALL_REAL_AND_ALL_OURS
def test_the_same_bytes_of_what_changes_parameters(scene: str) -> None:
    real = {line: _run(scene, REAL, line) for line in CHANGING_PARAMETERS}
    ours = {line: _run(scene, OURS, line) for line in CHANGING_PARAMETERS}
    _assert_equal({line: (real[line], ours[line]) for line in CHANGING_PARAMETERS})


@pytest.mark.parametrize(("echoing", "publishing"), [(REAL, OURS), (OURS, REAL)])
@pytest.mark.parametrize(
    ("words", "shown"),
    [
        (["std_msgs/Bool", "data: True"], "data: True\n---\n"),
        (["-1", "std_msgs/Bool", "data: False"], "data: False\n---\n"),
        (["-r5", "geometry_msgs/Point32", "{x: 1, y: -2.5}"], "x: 1.0\ny: -2.5\nz: 0.0\n---\n"),
        (
            ["-1", "std_msgs/Header", "7", "[1, 2]", "map"],
            'seq: 7\nstamp: \n  secs: 1\n  nsecs:         2\nframe_id: "map"\n---\n',
        ),
    ],
)  # fmt: skip
def test_publishing_and_echoing(
    any_master: str, echoing: Path, publishing: Path, words: list[str], shown: str
) -> None:
    echo = _start(any_master, echoing, ["rostopic", "echo", "-n1", "/t"])
    options = [word for word in words if word.startswith("-") and len(word) < 4]
    values = words[len(options) :]
    pub = _start(any_master, publishing, ["rostopic", "pub", *options, "/t", *values])
    try:
        out, err = echo.communicate(timeout=30)
        assert out == shown, err
    finally:
        pub.terminate()
        pub.communicate(timeout=20)


@pytest.mark.parametrize("killing", [REAL, OURS])
@pytest.mark.parametrize("killed", [REAL, OURS])
def test_killing(any_master: str, killing: Path, killed: Path) -> None:
    """`rosnode kill` of one stack ends the nodes of the other."""
    pub = _start(any_master, killed, ["rostopic", "pub", "/t", "std_msgs/Bool", "data: True"])
    assert pub.stdout
    assert pub.stdout.readline() == "publishing and latching message. Press ctrl-C to terminate\n"
    nodes = _run(any_master, killing, "rosnode list").split()
    (name,) = [node for node in nodes if node != "/rosout"]
    assert _run(any_master, killing, f"rosnode kill {name}").startswith(f"killing {name}\n")
    pub.communicate(timeout=20)
    assert name not in _run(any_master, killing, "rosnode list").split()


def _environment(uri: str) -> dict[str, str]:
    return {**os.environ, "ROS_MASTER_URI": uri}


def _start(uri: str, tools: Path, words: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [str(tools / words[0]), *words[1:]],
        env=_environment(uri),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _run(uri: str, tools: Path, line: str) -> str:
    """What a tool prints on standard output."""
    return _start(uri, tools, shlex.split(line)).communicate(timeout=30)[0]


def _both_at_once(uri: str, line: str) -> tuple[str, str]:
    both = [_start(uri, tools, shlex.split(line)) for tools in (REAL, OURS)]
    real, ours = (CHANGING.sub("*", program.communicate(timeout=30)[0]) for program in both)
    if " -p " in line and "echo" in line:
        # The number of the message and, where it has no stamp, its time of arrival.
        return tuple(CHANGING_COLUMNS.sub("*,", text) for text in (real, ours))  # type: ignore[return-value]
    return real, ours


def _assert_equal(results: dict[str, tuple[str, str]]) -> None:
    different = {line: pair for line, pair in results.items() if pair[0] != pair[1]}
    text = "\n".join(
        f"$ {line}\n--- real\n{real}\n--- ours\n{ours}" for line, (real, ours) in different.items()
    )
    assert not different, text
