"""`python benchmarks/actions.py`: goals per second with send_goal_and_wait, with server and client in separate processes.

Measures each pairing of minirospy and real actionlib (if /usr/bin/python3 has one) with one minirospy master. Latencies are in
microseconds, from the call of send_goal_and_wait to its return.
"""

import json
import os
import subprocess
import sys

REAL = "/usr/bin/python3"

SERVER = """
import sys, actionlib, rospy
from actionlib.msg import TestAction, TestResult
rospy.init_node("server", argv=[], anonymous=True)
server = actionlib.SimpleActionServer(
    "bench", TestAction, lambda goal: server.set_succeeded(TestResult(goal.goal)), auto_start=False
)
server.start()
print("ready", flush=True)
sys.stdin.read()
rospy.signal_shutdown("")
"""

CLIENT = """
import json, sys, time, actionlib, rospy
from actionlib.msg import TestAction, TestGoal
rospy.init_node("client", argv=[], anonymous=True)
client = actionlib.SimpleActionClient("bench", TestAction)
client.wait_for_server()
wait, times, failures = rospy.Duration(10), [], 0
start = time.perf_counter()
while time.perf_counter() - start < float(sys.argv[1]):
    start = time.perf_counter()
    failures += client.send_goal_and_wait(TestGoal(5), wait) != 3
    times.append(time.perf_counter() - start)
took = time.perf_counter() - start
times.sort()
print(json.dumps([len(times) / took, 1e6 * times[len(times) // 2], 1e6 * times[len(times) * 99 // 100], failures]))
rospy.signal_shutdown("")
"""


def measure(server: str, client: str, uri: str, seconds: float) -> list[float]:
    """Return the goals per second, the median and the p99 latency in microseconds, and the number of failures."""
    environment = {**os.environ, "ROS_MASTER_URI": uri, "ROS_HOSTNAME": "localhost"}
    serving = subprocess.Popen(
        [server, "-c", SERVER], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert serving.stdout
    serving.stdout.readline()
    output = subprocess.run(
        [client, "-c", CLIENT, str(seconds)], env=environment, capture_output=True, text=True, check=True
    ).stdout
    serving.communicate()
    figures: list[float] = json.loads(output.splitlines()[-1])
    return figures


def main() -> None:
    """Measure and print."""
    from minirospy.runtime.master.master import Master
    from minirospy.runtime.transport.loop import LoopThread

    async def start() -> Master:
        master = Master()
        await master.start()
        return master

    loop = LoopThread("bench-master")
    master = loop.run(start())
    stacks = {"minirospy": sys.executable}
    if subprocess.run([REAL, "-c", "import actionlib"], capture_output=True, check=False).returncode == 0:
        stacks["actionlib"] = REAL
    print(f"{'server':12}{'client':12}{'goals/s':>9}{'median us':>11}{'p99 us':>9}{'failures':>10}")
    for server, server_python in stacks.items():
        for client, client_python in stacks.items():
            rate, median, p99, failures = measure(
                server_python, client_python, f"http://localhost:{master.port}", 5.0
            )
            print(f"{server:12}{client:12}{rate:9,.0f}{median:11,.0f}{p99:9,.0f}{failures:10.0f}")
    loop.run(master.close(), 5.0)
    loop.close()


if __name__ == "__main__":
    main()
