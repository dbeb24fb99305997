"""A user's program that launches nodes, with every class of roslaunch's API; and `import roslaunch` as it is typed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.runtime.master_proxy import MasterProxy

SAID = """\
the master's run id True given
before start RLException
launched deep/one-1 True None x a:=b __name:=one True
stopped False True
no such program: RLException
ended True 3
after stop False
parent __name:=b ['b-1'] b
spins True True False
killed True True b-1
a text __name:=t
no file RLException
no launch file RLException
['robot', 'a.launch', 'x:=1'] ['robot/a.launch']
['robot/a.launch'] ['robot/a.launch']
['robot/a.launch', 'robot/a.launch'] ['robot/a.launch', 'robot/a.launch']
['robot', 'nope.launch'] RLException
['/no/such'] RLException
Node('', 't') raises ValueError | package must be non-empty
Node('p', '') raises ValueError | type must be non-empty
Node('p', 't', 'a/b') raises ValueError | node name cannot contain a namespace
output raises ValueError | output must be one of 'log', 'screen'
cwd raises ValueError | cwd must be one of 'ROS_HOME', 'node'
p t n /a/b/  False [] [] None
k True
[('n', (None, 'a'))]
['/a']
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")
def test_a_program_launches_nodes(master: str) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/run_id", "run")
    proxy.close()
    program = Path(__file__).parent / "api_program.py"
    done = subprocess.run(
        [sys.executable, str(program)], capture_output=True, text=True, timeout=50, check=False
    )
    assert done.stdout == SAID, done.stderr


def test_nothing_is_left_of_a_program_that_forgets_its_launch(master: str, package: Path) -> None:
    """The nodes end, though nobody called shutdown()."""
    code = (
        "import roslaunch, sys\n"
        "launch = roslaunch.scriptapi.ROSLaunch()\nlaunch.start()\n"
        "process = launch.launch(roslaunch.core.Node('pkg', 'wait.py', 'a', output='screen'))\n"
        "print('pid', process.pid, flush=True)\n"
    )
    # Its output ends only when the node, which holds the pipe too, has ended.
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=30, check=False
    )
    assert "pid " in done.stdout
    assert done.returncode == 0
