"""However a node shuts down, it leaves the graph: the master no longer knows it, and its process exits with status 0."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from minirospy.base.errors import RpcRefused
from minirospy.runtime.rpc.master_proxy import MasterProxy, SlaveProxy

SPINNER = """
import rospy
from std_msgs.msg import Bool
rospy.init_node("leaver")
rospy.Subscriber("/t", Bool, print)
rospy.on_shutdown(lambda: print("hook", flush=True))
print("ready", flush=True)
rospy.spin()
print("spun", flush=True)
"""


@pytest.fixture
def node(master: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-c", SPINNER], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert process.stdout
    assert process.stdout.readline() == "ready\n"
    yield process
    process.kill()
    process.communicate()


def is_known(master: str) -> bool:
    proxy = MasterProxy(master, "/test")
    try:
        proxy.lookup_node("/leaver")
    except RpcRefused:
        return False
    finally:
        proxy.close()
    return True


def test_rosnode_kill(node: subprocess.Popen[str], master: str) -> None:
    proxy = MasterProxy(master, "/test")
    slave = SlaveProxy(proxy.lookup_node("/leaver"), "/test")
    slave.shutdown("please")
    slave.close()
    proxy.close()
    output, _ = node.communicate(timeout=30)
    assert output == "shutdown request: please\nhook\nspun\n"
    assert node.returncode == 0
    assert not is_known(master)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals between processes")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals(node: subprocess.Popen[str], master: str, number: int) -> None:
    os.kill(node.pid, number)
    output, _ = node.communicate(timeout=30)
    assert output == "hook\nspun\n"
    assert node.returncode == 0
    assert not is_known(master)


def test_a_script_that_just_ends(master: str) -> None:
    script = 'import rospy; rospy.init_node("leaver"); print("done")'
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=True
    )
    assert (done.stdout, done.stderr) == ("done\n", "")
    assert not is_known(master)


LOOPS = {
    "a sleep": "rospy.sleep(60)",
    "a loop that polls": """
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    rate.sleep()
rospy.sleep(0.05)
print("cleaned up", flush=True)""",
    "a loop that never polls": """
while True:
    sum(range(10000))
    rospy.sleep(0.001)""",
    "a wait for a service": "rospy.wait_for_service('/nobody')",
    "a wait for a message": "rospy.wait_for_message('/nobody', rospy.AnyMsg)",
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals between processes")
@pytest.mark.parametrize("what", LOOPS)
def test_ctrl_c_ends(master: str, what: str) -> None:
    script = f'import rospy\nrospy.init_node("leaver")\nprint("ready", flush=True)\n{LOOPS[what]}\n'
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")
    assert ("cleaned up" in output) == (what == "a loop that polls")
