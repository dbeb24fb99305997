"""rostest's test programs, run by rostest on the package `tested`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.workspace.packages import Packages

HERE = Path(__file__).parent
NODES = ["advertisetest", "hztest", "paramtest", "publishtest", "subscribetest"]


def test_rosrun_finds_them() -> None:
    packages = Packages()
    assert packages.executables("rostest") == NODES
    assert packages.find_executable("rostest", "hztest")[0] == sys.executable


def test_what_they_find(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(HERE))
    graph = (HERE / "tested" / "test" / "graph.test").read_text()
    subscribed = """<test test-name="{0}" name="{0}" pkg="rostest" type="subscribetest">
      <rosparam>topics: [{{name: {1}, timeout: {2}}}]</rosparam></test>"""
    text = "".join(
        [
            graph.replace("</launch>", ""),
            subscribed.format("subscribed", "/orders", 30),
            subscribed.format("not_subscribed", "orders/nobody", 0.2),
            subscribed.format("no_list", "''", 0.2),
            "</launch>",
        ]
    )
    file = tmp_path / "x.test"
    file.write_text(text)
    code = "import sys; from minirospy.ros.rostest.commands.rostest import rostest; sys.exit(rostest())"
    command = [sys.executable, "-c", code, "--package=p", f"--pkgdir={tmp_path}", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)
    output = done.stdout.split("[ROSTEST]---")[1]

    for line in (
        "[p.rosunit-advertised/test_advertise_topics][passed]",
        "[p.rosunit-advertised/test_advertise_services][passed]",
        "Topic type of [/chatter] is [std_msgs/String] instead of [std_msgs/Int32]",
        "[p.rosunit-param/test_param][passed]",
        "parameter [/there] is [5] instead of [6]",
        "[p.rosunit-subscribed/test_subscribe][passed]",
        "Topic [/orders/nobody] is not subscribed to",
        "bad parameter (topics): it is a list as [{name: /chatter, timeout: 5}]",
    ):
        assert line in output, line

    assert done.returncode == 2
