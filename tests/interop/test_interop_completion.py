"""TAB completion compared with rosbash's. On the same graph and packages, minirospy offers everything that rosbash offers."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

import minirospy
from tests.conftest import write_files

from .conftest import REAL_PYTHON, environment, running_master, start, stop

_ROSBASH = Path("/usr/share/bash-completion/completions/rosbash")
_OURS = Path(minirospy.__file__).parent / "workspace" / "shell" / "ros.bash"

_NODE = """
import rospy
from geometry_msgs.msg import PoseArray, Twist
from std_srvs.srv import SetBool, Trigger
rospy.init_node('robot')
publishers = [rospy.Publisher('/cmd_vel', Twist, queue_size=1), rospy.Publisher('/poses', PoseArray, queue_size=1)]
services = [rospy.Service('/led', SetBool, None), rospy.Service('~reset', Trigger, None)]
rospy.set_param('~gains', {'p': 1, 'i': 2})
print('ready', flush=True)
rospy.spin()
"""

_LINES = (
    "rostopic ", "rostopic echo ", "rostopic hz /c", "rostopic list ", "rostopic pub /cmd_vel ", "rostopic pub --",
    "rostopic pub -r 10 /poses geometry_msgs/PoseArray ", "rostopic find std_msgs/S",
    "rosservice ", "rosservice call ", "rosservice call /led ", "rosservice find std_s",
    "rosnode ", "rosnode kill ", "rosparam ", "rosparam get /robot/", "rosparam load ",
    "rosmsg ", "rosmsg show std_msgs/S", "rossrv show std_srvs/", "roslaunch my_robot ", "roslaunch my_robot all.launch ",
    "rosrun my_robot ", "rosrun --", "roscd my_robot/", "roscd lo", "rosed my_robot ", "roscat my_robot a",
    "rosmv my_robot a", "rospack ", "rosclean ", "rosconsole ", "rosconsole set /robot rosout ", "roswtf --", "rostest my_robot ",
)  # fmt: skip


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Create a package with a program and two launch files; the current folder has two files."""
    package = tmp_path / "src" / "my_robot"
    texts = {
        "scripts/talker.py": "#!/usr/bin/env python3\n",
        "launch/all.launch": '<launch><arg name="rate" default="10"/><arg name="port"/></launch>',
        "launch/deep/more.launch": "<launch/>",
        "config/a map.yaml": "{}",
        "package.xml": "<package><name>my_robot</name><version>1.2.3</version><description>d</description>"
        "<maintainer email='a@b.com'>m</maintainer><license>BSD</license></package>",
        "../../here/params.yaml": "{}",
        "../../here/x.launch": "<launch/>",
    }
    write_files(package, texts, executable=["scripts/talker.py"])
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'src'}:/usr/share")
    monkeypatch.chdir(tmp_path / "here")


@pytest.fixture
def uri(workspace: None) -> Iterator[str]:
    """Yield the URI of a master at which /robot publishes, serves and has parameters."""
    with running_master("ours") as uri:
        node = start([REAL_PYTHON, "-c", _NODE], uri, "rospy")
        try:
            assert node.stdout is not None
            assert node.stdout.readline() == "ready\n"
            yield uri
        finally:
            node.terminate()
            stop(node)


def offered(functions: Path, uri: str, stack: str) -> dict[str, list[str]]:
    """Return the completions that bash receives for TAB at the end of each line, by line."""
    script = [f". {functions}"]

    for line in _LINES:
        words = line.split(" ")
        script.append(
            f"""
            COMP_LINE={shlex.quote(line)}; COMP_POINT={len(line)}
            COMP_WORDS=({shlex.join(words)}); COMP_CWORD={len(words) - 1}; COMPREPLY=()
            function=$(complete -p {words[0]} | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
            "$function" {words[0]} "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD-1]}}"
            printf '%s\\a' "${{COMPREPLY[@]}}"; printf '\\f'
            """
        )

    done = subprocess.run(
        ["bash", "--norc", "--noprofile", "-c", "\n".join(script)],
        env={**environment(uri, stack), "HOME": os.getcwd()}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    answers = done.stdout.split("\f")[: len(_LINES)]
    return {
        line: [text.strip() for text in answer.split("\a") if text.strip()]
        for line, answer in zip(_LINES, answers, strict=True)
    }


def covers(ours: str, real: str) -> bool:
    """Return whether minirospy's candidate equals the real one or is its prefix.

    minirospy quotes candidates, adds :=, and completes types in two steps.
    """
    ours = ours.replace("\\ ", " ")
    return ours == real or (ours.endswith("/") and real.startswith(ours)) or ours == f"{real}:="


@pytest.mark.skipif(not _ROSBASH.exists(), reason="rosbash is not installed")
def test_completion_offers_the_words_of_rosbash(uri: str) -> None:
    real = offered(_ROSBASH, uri, "rospy")
    ours: dict[str, list[str]] = {line: [] for line in _LINES}
    missing: dict[str, list[str]] = {}
    for _ in range(5):
        # Repeat: TAB gives up if the graph does not respond within a second, and a user would press it again.
        ours = {line: ours[line] + found for line, found in offered(_OURS, uri, "ours").items()}
        missing = {
            line: lost
            for line in _LINES
            if (lost := [each for each in real[line] if not any(covers(own, each) for own in ours[line])])
        }
        if not missing:
            break
    assert sum(map(bool, real.values())) > 30, real
    assert missing == {}
