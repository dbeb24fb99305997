"""republish: images pass through a chain of minirospy's and Debian's programs; the usage messages of both are compared."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment, start, stop

OURS = Path(__file__).parents[2] / "minirospy" / "ros" / "image_transport" / "nodes" / "republish"
REAL = "/usr/lib/image_transport/republish"
USER = """
import hashlib, rospy
from sensor_msgs.msg import Image
rospy.init_node("user")
publisher, got = rospy.Publisher("/a", Image, queue_size=1), []
rospy.Subscriber("/d", Image, got.append)
sent = Image(height=48, width=64, encoding="bgr8", step=192, data=bytes(range(192)) * 48)
sent.header.frame_id = "camera"
rate = rospy.Rate(20)
while not got:
    publisher.publish(sent)
    rate.sleep()
found = got[0]
print(found.header.frame_id, found.width, found.height, found.encoding, found.step, found.data == sent.data)
"""


@pytest.mark.parametrize("user", ["ours", "rospy"])
def test_images_pass_through_both(real_master: str, user: str) -> None:
    chain = [
        ([REAL, "raw", "in:=/a", "raw", "out:=/b"], "rospy"),
        (
            [sys.executable, str(OURS), "raw", "in:=/b", "compressed", "out:=/c", "_compressed/format:=png"],
            "ours",
        ),
        ([sys.executable, str(OURS), "compressed", "in:=/c", "raw", "out:=/c"], "ours"),
        ([REAL, "raw", "in:=/c", "raw", "out:=/d"], "rospy"),
    ]
    programs = [start(command, real_master, stack) for command, stack in chain]
    try:
        done = subprocess.run(
            [sys.executable if user == "ours" else REAL_PYTHON, "-c", USER],
            env=environment(real_master, user),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    finally:
        for program in programs:
            stop(program)
    assert done.stdout == "camera 64 48 bgr8 192 True\n", done.stderr


def test_usage_is_the_real_one() -> None:
    real, ours = (
        subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        for command in ([REAL], [sys.executable, str(OURS)])
    )
    assert ours.stdout == real.stdout.replace(REAL, "republish")
    assert ours.returncode == real.returncode
