"""The types of rospy and of messages that mypy and editors find in a student's file."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from minirospy.core.idl.protocols import Message

PROGRAM = """
import rospy
from sensor_msgs.msg import Image, LaserScan
from std_srvs.srv import SetBool, SetBoolResponse

scan = LaserScan()
reveal_type(scan.ranges)
reveal_type(scan.header.frame_id)
reveal_type(scan.header.stamp)
reveal_type(Image().data)
reveal_type(SetBoolResponse().success)
scan.rangs
rospy.init_nod("x")
"""


def test_types_of_user_programs(tmp_path: Path) -> None:
    """Messages' constructors are typed, too. One run of mypy checks both files, because it has to read rospy's first."""
    (tmp_path / "node.py").write_text(PROGRAM)
    (tmp_path / "constructors.py").write_text(CONSTRUCTORS)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "node.py", "constructors.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    found = [line for line in done.stdout.splitlines() if "defined in" not in line]
    assert [line for line in found if line.startswith("node.py:")] == [
        'node.py:7: note: Revealed type is "list[float]"',
        'node.py:8: note: Revealed type is "str"',
        'node.py:9: note: Revealed type is "minirospy.base.times.Time"',
        'node.py:10: note: Revealed type is "bytes"',
        'node.py:11: note: Revealed type is "bool"',
        'node.py:12: error: "LaserScan" has no attribute "rangs"; maybe "ranges"?  [attr-defined]',
        'node.py:13: error: Module has no attribute "init_nod"; maybe "init_node"?  [attr-defined]',
    ]
    check_constructors([line for line in found if not line.startswith("node.py:")])


CONSTRUCTORS = """
import numpy as np
from geometry_msgs.msg import Point, Twist, Vector3
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Float64MultiArray, Header, String
from std_srvs.srv import SetBoolRequest
from gazebo_msgs.srv import SpawnModel, SpawnModelRequest

Twist(linear=Vector3(x=1.0), angular=Vector3(0, 0, 1))
JointState(name=["a"], position=(1.0, 2), velocity=np.zeros(2))
Image(data=bytearray(3), header=Header(frame_id="camera"))
SetBoolRequest(True)
SpawnModelRequest(model_name="box")
reveal_type(SpawnModel._request_class)
reveal_type(LaserScan.__init__)
Twist(lin=Vector3())
String(data=3)
Point(1.0, 2.0, "3")
JointState(name="a", position=1.0)
"""


def check_constructors(lines: list[str]) -> None:
    # mypy's versions format a function's type differently.
    (scan,) = (line for line in lines if "LaserScan" in line)
    assert "angle_min: float =, angle_max: float =" in scan
    assert [line for line in lines if line != scan] == [
        'constructors.py:14: note: Revealed type is "type[gazebo_msgs.srv.SpawnModelRequest]"',
        'constructors.py:16: error: Unexpected keyword argument "lin" for "Twist"  [call-arg]',
        'constructors.py:17: error: Argument "data" to "String" has incompatible type "int"; expected "str"  [arg-type]',
        'constructors.py:18: error: Argument 3 to "Point" has incompatible type "str"; expected "float"  [arg-type]',
        'constructors.py:19: error: Argument "position" to "JointState" has incompatible type "float"; '
        'expected "Collection[float]"  [arg-type]',
    ]


MAX_ANY = 2.0  # uses of `Any` in 1,000 lines


def test_any_stays_rare() -> None:
    """`Any` disables the checker; a value that is only passed on should be an `object`, and a message should have a protocol."""
    package = Path(__file__).parents[1] / "minirospy"
    texts = {
        path.relative_to(package): path.read_text(encoding="utf-8")
        for path in package.rglob("*.py")
        if "overlay" not in path.relative_to(package).parts
    }
    lines = {
        f"{path}:{token.start[0]}: {token.line.strip()}"
        for path, text in texts.items()
        if re.search(r"\bAny\b", text)
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type == tokenize.NAME and token.string == "Any" and "import" not in token.line
    }
    total = sum(text.count("\n") for text in texts.values())
    assert 1000 * len(lines) / total < MAX_ANY, "\n".join(sorted(lines))


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Python 3.10 replaces the constructor of a protocol")
def test_message_protocol_takes_any_constructor() -> None:
    # pyright also compares the constructors of protocols: with `object`, it would reject Publisher("x", Twist).
    hints = get_type_hints(Message.__init__)
    assert (hints["args"], hints["kwds"]) == (Any, Any)
