"""rosrun, rosversion, rosclean, rosconsole and rosgraph compared with the real ones, with the same folders and the same node."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import write_files

from .conftest import OUR_BIN, PATIENCE, REAL_BIN, REAL_PYTHON

_NODE = """
import rospy
from std_msgs.msg import Bool
rospy.init_node('talker')
publisher = rospy.Publisher('/chat', Bool, queue_size=1)
subscriber = rospy.Subscriber('/chat', Bool, lambda message: None)
print('ready', flush=True)
rospy.spin()
"""


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a package with programs, and of a log folder."""
    package = tmp_path / "src" / "my"
    programs = {
        "scripts/status": '#!/bin/sh\necho "$@"\nexit 7\n',
        "scripts/deep/down": "#!/bin/sh\necho deep\n",
        "scripts/twin": "#!/bin/sh\necho twin of scripts\n",
        "nodes/twin": "#!/bin/sh\necho twin of nodes\n",
        "scripts/bare": "echo bare\n",
    }
    write_files(package, programs, executable=programs)
    (package / "package.xml").write_text(
        "<package><name>my</name><version>1.2.3</version><description>d</description>"
        "<maintainer email='a@b.com'>m</maintainer><license>BSD</license></package>"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'src'}:/usr/share")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("ROS_LOG_DIR")
    return tmp_path


def run(program: str, *words: str, stdin: str = "", path: Path = OUR_BIN) -> tuple[int, str]:
    """Return a command's exit status and its stdout."""
    done = subprocess.run(
        [str(path / program), *words], input=stdin, capture_output=True, text=True, timeout=PATIENCE, check=False,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )  # fmt: skip
    return done.returncode, done.stdout


def both(program: str, *words: str, stdin: str = "") -> tuple[tuple[int, str], tuple[int, str]]:
    """Return the results of minirospy's program and of the real one."""
    ours, real = (run(program, *words, stdin=stdin, path=path) for path in (OUR_BIN, REAL_BIN))
    return ours, real


def test_rosrun(workspace: Path) -> None:
    for words in (["my", "status", "-h", "a b"], ["my", "down"], ["my", "scripts/deep/down"], ["my", "bare"],
                  ["--prefix", "echo in front", "my", "status", "x"]):  # fmt: skip
        ours, real = both("rosrun", *words)
        assert ours == real, words
    # This runs /usr/lib/topic_tools/relay.
    ours, real = both("rosrun", "topic_tools", "relay")
    assert ours == real
    assert "usage: relay" in ours[1]
    for choice in ("1\n", "2\n"):
        ours, real = both("rosrun", "my", "twin", stdin=choice)
        assert ours == real


def test_rosversion(workspace: Path) -> None:
    for words in (["my"], ["-s", "my"]):
        ours, real = both("rosversion", *words)
        assert ours == real


def test_rosversion_of_the_packages_that_both_bring_along() -> None:
    ours, real = (
        dict(line.split(": ") for line in run("rosversion", "-a", path=path)[1].splitlines())
        for path in (OUR_BIN, REAL_BIN)
    )
    both_have = ours.keys() & real.keys()
    assert {"std_msgs", "sensor_msgs", "roscpp", "catkin"} <= both_have
    # ros_comm is at the last version of Noetic, which is the same for all its packages.
    assert {name: ours[name] for name in both_have} == {
        name: "1.17.0" if real[name] == real["rosmaster"] else real[name] for name in both_have
    }


def test_rosclean(workspace: Path) -> None:
    log = workspace / "home" / "log"

    def make() -> None:
        for name, megabytes, changed in (("old", 3, 1_000_000_000), ("new", 1, 1_700_000_000)):
            (log / name).mkdir(parents=True, exist_ok=True)
            (log / name / "a.log").write_bytes(b"x" * (megabytes * 1024 * 1024))
            os.utime(log / name, (changed, changed))

    make()
    (log / "small.log").write_bytes(b"x" * 1500)
    ours, real = both("rosclean", "check")
    assert ours == real
    for words, stdin in (
        ([], "n\n"),
        ([], "y\n"),
        (["-y"], ""),
        (["-y", "--size", "2"], ""),
        (["-y", "--size", "9"], ""),
    ):
        left = []
        for path in (OUR_BIN, REAL_BIN):
            make()
            said = run("rosclean", "purge", *words, stdin=stdin, path=path)
            left.append((said, sorted(each.name for each in log.rglob("*"))))
        assert left[0] == left[1], words


@pytest.fixture
def talker(real_master: str) -> Iterator[str]:
    """Run a node of real rospy."""
    with subprocess.Popen(
        [REAL_PYTHON, "-c", _NODE], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
        env={**os.environ, "ROS_MASTER_URI": real_master, "PYTHONWARNINGS": "ignore"},
    ) as process:  # fmt: skip
        try:
            assert process.stdout
            assert process.stdout.readline() == "ready\n"
            yield real_master
        finally:
            process.terminate()


def test_rosconsole(talker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", talker)
    for words in (["list", "talker"], ["get", "/talker", "rosout"], ["set", "talker", "rosout", "ERROR"],
                  ["get", "talker", "rosout"]):  # fmt: skip
        ours, real = both("rosconsole", *words)
        assert ours == real, words


def test_rosgraph(talker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The real program never exits, and prints in no fixed order, so compare one round as a set of lines."""
    monkeypatch.setenv("ROS_MASTER_URI", talker)
    monkeypatch.setenv("PYTHONUNBUFFERED", "1")
    _, ours = run("rosgraph", "--once")
    with subprocess.Popen([str(REAL_BIN / "rosgraph")], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        try:
            wanted = set(ours.splitlines())
            seen: set[str] = set()
            for line in process.stdout:
                seen.add(line.rstrip("\n"))
                if seen >= wanted:
                    break
        finally:
            process.kill()
    assert seen == wanted


def test_catkin(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(workspace)
    for words in (["my", "src"], ["my"], ["nope"]):
        ours, real = both("catkin_find_pkg", *words)
        assert ours == real, words

    for name, needs in (("a", "<depend>my</depend>"), ("zz", "<depend>a</depend>"), ("b", "")):
        (workspace / "src" / name).mkdir()
        (workspace / "src" / name / "package.xml").write_text(
            f'<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>'
            f'<maintainer email="a@b.com">m</maintainer><license>BSD</license>{needs}</package>'
        )

    for words in (["src"], ["--only-names", "src"], ["--only-folders"]):
        ours, real = both("catkin_topological_order", *words)
        assert ours == real, words
    devel = workspace / "devel"
    for name in ("share/my", "lib/my"):
        (devel / name).mkdir(parents=True)
    (devel / ".catkin").write_text(str(workspace / "src"))
    monkeypatch.setenv("CMAKE_PREFIX_PATH", str(devel))

    for words in (
        ["my"],
        ["my", "scripts"],
        ["--share", "my"],
        ["--libexec", "my"],
        ["--first-only", "my"],
    ):
        ours, real = both("catkin_find", *words)
        assert ours == real, words
