"""Ctrl-C at random moments of a publisher, a subscriber, a service, an action server and a launch file.

Usage: python benchmarks/ctrl_c.py [TRIALS]. Prints for each how long the program takes to exit, and every trial with a
traceback, an exit status other than 0, a hanging program, or a node that the master still knows. Needs no running master.
"""

from __future__ import annotations

import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread

HANG_SECONDS = 30.0

HEAD = """
import sys, time
import rospy
from std_msgs.msg import Int32
rospy.init_node("trial", argv=[])
class Flag:
    is_set = False
def stop():
    Flag.is_set = True
    last.publish(0)
    rospy.loginfo("stopped")
last = rospy.Publisher("/last", Int32, queue_size=1)
rospy.on_shutdown(stop)
def ready():
    print("ready", flush=True)
"""
PROGRAMS = {
    "publisher, polls": """
pub = rospy.Publisher("/numbers", Int32, queue_size=10)
rate = rospy.Rate(100)
ready()
while not rospy.is_shutdown():
    pub.publish(1)
    rospy.loginfo("published")
    rate.sleep()
""",
    "publisher, own flag": """
pub = rospy.Publisher("/numbers", Int32, queue_size=10)
ready()
try:
    while not Flag.is_set:
        pub.publish(1)
except rospy.ROSInterruptException:
    pass
""",
    "subscriber": """
pub = rospy.Publisher("/numbers", Int32, queue_size=10)
sub = rospy.Subscriber("/numbers", Int32, lambda message: rospy.loginfo(message.data))
timer = rospy.Timer(rospy.Duration(0.005), lambda event: pub.publish(1))
ready()
rospy.spin()
""",
    "service": """
from std_srvs.srv import Trigger
server = rospy.Service("/trigger", Trigger, lambda request: {"success": True})
call = rospy.ServiceProxy("/trigger", Trigger)
ready()
try:
    while True:
        call()
except (rospy.ROSInterruptException, rospy.ServiceException):
    pass
""",
    "action": """
import actionlib
from actionlib_msgs.msg import GoalStatus
from actionlib.msg import TestAction, TestGoal, TestFeedback, TestResult
def execute(goal):
    for number in range(goal.goal):
        if server.is_preempt_requested() or rospy.is_shutdown():
            server.set_preempted()
            return
        server.publish_feedback(TestFeedback(number))
        rospy.sleep(0.001)
    server.set_succeeded(TestResult(goal.goal))
server = actionlib.SimpleActionServer("/count", TestAction, execute, False)
server.start()
client = actionlib.SimpleActionClient("/count", TestAction)
client.wait_for_server()
ready()
while not rospy.is_shutdown():
    client.send_goal(TestGoal(5))
    client.wait_for_result()
""",
}


def trial(command: list[str], uri: str, folder: str, marks: int) -> tuple[float, str]:
    """Run a program and send SIGINT at a random moment; return the time until it has exited, and the fault."""
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={
            **os.environ,
            "ROS_MASTER_URI": uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_PACKAGE_PATH": folder,
            "ROS_HOME": folder,
        },
        start_new_session=True,
    )
    assert process.stdout
    while marks:
        line = process.stdout.readline()
        assert line, process.communicate()
        marks -= line.startswith("ready")
    # Sleep, because the moment must be random.
    time.sleep(random.random())
    process.send_signal(signal.SIGINT)
    start = time.monotonic()
    try:
        _, errors = process.communicate(timeout=HANG_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        return HANG_SECONDS, f"hangs: {process.communicate()[1][-1000:]}"

    took = time.monotonic() - start
    proxy = MasterProxy(uri, "/ctrl_c")
    publishers, subscribers, services = proxy.get_system_state()
    proxy.close()
    left = {name for table in (publishers, subscribers, services) for _, names in table for name in names}
    faults = [] if process.returncode == 0 else [f"status {process.returncode}"]
    faults += [f"still known: {sorted(left)}"] if left else []
    faults += [errors[-1000:]] if "Traceback" in errors or "Exception" in errors else []
    return took, "; ".join(faults)


def main() -> int:
    """Run the trials; return 1 if one of them failed."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    loop = LoopThread("master")

    async def start() -> Master:
        serving = Master()
        await serving.start()
        return serving

    master = loop.run(start())
    uri = f"http://localhost:{master.port}"
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        commands = {name: ([sys.executable, "-c", HEAD + body], 1) for name, body in PROGRAMS.items()}
        commands["launch"] = (_launch(Path(folder)), 2)
        for name, (command, marks) in commands.items():
            results = [trial(command, uri, folder, marks) for _ in range(trials)]
            times = [took for took, _ in results]
            faults = [why for _, why in results if why]
            failed += len(faults)
            print(
                f"{name:20} {trials} trials: {len(faults)} failed; median {statistics.median(times):.2f} s, "
                f"longest {max(times):.2f} s",
                flush=True,
            )
            for why in faults:
                print(f"    {why}")
    loop.run(master.close(), 30.0)
    loop.close()
    return 1 if failed else 0


def _launch(folder: Path) -> list[str]:
    """Write a launch file with two nodes and return the command that starts it."""
    script = folder / "node.py"
    script.write_text(f"#!{sys.executable}\n{HEAD}{PROGRAMS['subscriber']}".replace(", argv=[]", ""))
    script.chmod(0o755)
    file = folder / "trial.launch"
    nodes = [f'<node name="n{number}" pkg="trials" type="node.py" output="screen"/>' for number in range(2)]
    file.write_text(f"<launch>{''.join(nodes)}</launch>")
    (folder / "package.xml").write_text(
        "<package><name>trials</name><version>0.1.0</version><description>d</description>"
        "<maintainer email='a@b.c'>m</maintainer><license>MIT</license></package>"
    )
    return [sys.executable, "-m", "minirospy", "launch", str(file)]


if __name__ == "__main__":
    sys.exit(main())
