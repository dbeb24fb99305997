"""minirospy's commands compared with the real ones: on the same graph, both tools print the same bytes to stdout."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest

from tests.interop.conftest import PATIENCE

sys.path.insert(0, str(Path(__file__).parent))
from command_table import (
    ASKING,
    CHANGING,
    ECHOING,
    HELP,
    OTHER_WORDS,
    OURS,
    PAGE,
    REAL,
    STREAMING,
    UNREACHABLE,
    WITHOUT_MASTER,
    WRONG,
    compare,
    more_words,
    other_words,
    page,
    unexpected,
    verdicts,
)

sys.path.pop(0)

HERE = Path(__file__).parent

ON_OUR_GRAPH = """
rostopic list -v
rostopic list --host
rostopic info /button_state
rostopic type /poly/header/stamp
rosnode info /scene
rosnode info -q scene
rosnode ping -c 1 scene
rosnode machine
rosservice list -n
rosservice info /set_led_state
rosparam get /p
rosparam dump
"""
JOINING_OUR_GRAPH = """
rosservice call /set_led_state True
rosservice call -v /set_led_state 'data: False'
rostopic echo -n1 /poly
rostopic echo -n1 /joints
rostopic echo -n1 -p /scan
"""


@pytest.fixture
def scene(request: pytest.FixtureRequest, any_master: str) -> Iterator[str]:
    """Yield the URI of a master with the scene, which is a node from the stack that the test's parameter selects."""
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
        program.communicate(timeout=PATIENCE)


@pytest.mark.timeout(3000)
@pytest.mark.parametrize(("any_master", "scene"), [("rospy", "rospy")], indirect=True)
def test_the_table(scene: str, tmp_path: Path) -> None:
    """Each line prints the same bytes as in real ROS, or is known to differ. The page in docs/ is up to date."""
    (tmp_path / "text.txt").write_text("a text\nof two lines\n")
    (tmp_path / "values.yaml").write_text("a: 1\nb: {c: [1, 2]}\n---\n_ns: inner\nx: 2\n")
    sections = {"Questions to the graph, and types": compare(ASKING, scene, tmp_path)}
    sections["Help"] = compare(HELP, scene, tmp_path)
    sections["Usage errors"] = compare(WRONG, scene, tmp_path)
    sections["Messages, and publishing"] = compare(ECHOING, scene, tmp_path)
    with _publishers(scene):
        sections["Streams, until Ctrl-C"] = compare(STREAMING, scene, tmp_path, streaming=True)
    sections["Parameters that change"] = compare(CHANGING, scene, tmp_path, prepare=lambda: None)
    sections["Nodes that do not answer"] = compare(
        UNREACHABLE, scene, tmp_path, prepare=lambda: _register_ghosts(scene)
    )
    sections["Without a master"] = compare(WITHOUT_MASTER, "http://localhost:1", tmp_path)
    if os.environ.get("WRITE"):
        PAGE.write_text(page(sections))
    different = unexpected(row for rows in sections.values() for row in rows)

    assert not different, different
    assert other_words(row for rows in sections.values() for row in rows) == OTHER_WORDS
    # Scripts look for ROS's line at the end of stderr.
    assert more_words(sections["Without a master"]) == set()
    assert verdicts(page(sections)) == verdicts(PAGE.read_text())


@pytest.mark.parametrize(("any_master", "scene"), [("ours", "ours")], indirect=True)
def test_the_same_bytes_on_our_graph(scene: str, tmp_path: Path) -> None:
    # A command that echoes or calls is itself a node, which the other lines would list.
    rows = [row for text in (ON_OUR_GRAPH, JOINING_OUR_GRAPH) for row in compare(text, scene, tmp_path)]
    different = unexpected(rows)
    assert not different, different


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
    # The command waits for the topic.
    assert echo.stderr
    assert "does not appear to be published yet" in echo.stderr.readline()
    # `pub -1` exits after three seconds; a busy machine may stall for that long.
    out = err = ""

    for _ in range(6):
        pub = _start(any_master, publishing, ["rostopic", "pub", *options, "/t", *values])

        try:
            out, err = echo.communicate(timeout=30)
            break
        except subprocess.TimeoutExpired:
            continue
        finally:
            pub.terminate()
            pub.communicate(timeout=PATIENCE)

    echo.kill()
    assert out == shown, err


@pytest.mark.parametrize("killing", [REAL, OURS])
@pytest.mark.parametrize("killed", [REAL, OURS])
def test_killing(any_master: str, killing: Path, killed: Path) -> None:
    """`rosnode kill` from one stack stops nodes of the other."""
    pub = _start(any_master, killed, ["rostopic", "pub", "/t", "std_msgs/Bool", "data: True"])
    assert pub.stdout
    assert pub.stdout.readline() == "publishing and latching message. Press ctrl-C to terminate\n"
    nodes = _run(any_master, killing, "rosnode list").split()
    (name,) = [node for node in nodes if node != "/rosout"]
    assert _run(any_master, killing, f"rosnode kill {name}").startswith(f"killing {name}\n")
    pub.communicate(timeout=PATIENCE)
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
    """Return a tool's stdout."""
    return _start(uri, tools, shlex.split(line)).communicate(timeout=PATIENCE)[0]


@contextmanager
def _publishers(uri: str) -> Iterator[None]:
    """Publish stamped messages on /fast at 20 Hz and on /slow at 5 Hz."""
    stamped = ["-s", "/fast", "geometry_msgs/PointStamped", "{header: auto, point: {x: 1.5}}"]
    words = [["-r", "20", *stamped], ["-r", "5", "/slow", "std_msgs/String", "hello"]]
    running = [_start(uri, OURS, ["rostopic", "pub", *each]) for each in words]
    try:
        for topic in ("/fast", "/slow"):
            _run(uri, OURS, f"rostopic echo -n1 {topic}")
        yield
    finally:
        for program in running:
            program.terminate()
            program.communicate(timeout=PATIENCE)


def _register_ghosts(uri: str) -> None:
    """Register two nodes that no longer run.

    Nothing listens at the first one's address; the host of the second has no address.
    """
    with ServerProxy(uri) as master:
        for name, host in (("/dead", "localhost:9"), ("/unresolved", "no-such-host.invalid:1234")):
            master.registerPublisher(name, f"/t{name}", "std_msgs/String", f"http://{host}/")
            master.registerService(name, f"{name}/srv", f"rosrpc://{host}", f"http://{host}/")
