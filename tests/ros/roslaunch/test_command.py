"""The command that runs a node, built from the node's attributes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from minirospy.ros.roslaunch.launcher.command import node_command
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.workspace.packages import Packages


@pytest.mark.parametrize(
    ("prefix", "in_front"),
    [
        ("", [sys.executable]),
        ("nice -n 5", ["nice", "-n", "5", sys.executable]),
        ("xterm -e python3 -u", ["xterm", "-e", "python3", "-u"]),
        ("/usr/bin/python3.11 -m pdb", ["/usr/bin/python3.11", "-m", "pdb"]),
        ("coverage run", ["coverage", "run"]),
    ],
)
def test_launch_prefix_that_runs_python_replaces_our_interpreter(
    package: Path, prefix: str, in_front: list[str]
) -> None:
    node = NodeSpec("/n", "pkg", "stop.py", args="1", launch_prefix=prefix)

    command = node_command(node, Packages.below(package))

    assert command == [*in_front, str(package / "stop.py"), "1", "__name:=n"]
