"""`python benchmarks/control.py`: the CPU time and the jitter of a control loop whose joints move, in one run.

Each case is `rosrun minirospy_hardware loopback` with its controllers; this program sends the trajectories, and subscribes to
/joint_states and to the states of all controllers. The CPU time is the process's over the measured seconds. The times of the
cycles are those that the loop publishes on /diagnostics once a second. All traffic is on loopback.
"""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from typing import NamedTuple

from cases import measure_cases

WARM_UP = 3.0  # seconds of motion before the measurement
COLUMNS = ("CPU, %", "cycle, us", "cycle p99, us", "jitter p99, us", "jitter max, us", "overruns", "states/s")


class Case(NamedTuple):
    """A loop with ``controllers`` trajectory controllers that share the joints. ``target``: percent of a core."""

    name: str
    rate: int  # Hz
    joints: int
    controllers: int
    target: float
    kind: str = "position"


CASES = {
    "arm1000": Case("arm of 7 joints, 1 kHz", 1000, 7, 1, 35.0),
    "arm500": Case("arm of 7 joints, 500 Hz", 500, 7, 1, 20.0),
    "effort1000": Case("arm of 7 joints by effort, with PID, 1 kHz", 1000, 7, 1, 35.0, "effort"),
    "many": Case("20 controllers, 40 joints, 100 Hz", 100, 40, 20, 40.0),
}


def description(joints: int) -> str:
    """Return a robot that is a chain of joints with limits."""
    links = "".join(f'<link name="l{number}"/>' for number in range(joints + 1))
    chain = "".join(
        f'<joint name="j{number}" type="revolute"><parent link="l{number}"/><child link="l{number + 1}"/>'
        '<axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="100"/></joint>'
        for number in range(joints)
    )
    return f'<robot name="bench">{links}{chain}</robot>'


def shares(case: Case) -> dict[str, list[str]]:
    """Return the joints of each controller."""
    size = case.joints // case.controllers
    return {f"c{each}": [f"j{each * size + n}" for n in range(size)] for each in range(case.controllers)}


def parameters(case: Case) -> dict[str, object]:
    """Return the parameters of a case: those of an arm of the usual kind, with tolerances."""
    found: dict[str, object] = {
        "robot_description": description(case.joints),
        "loopback": {"rate": case.rate},
        "joint_state_controller": {"type": "joint_state_controller/JointStateController", "publish_rate": 50},
    }
    for name, joints in shares(case).items():
        found[name] = {
            "type": f"{case.kind}_controllers/JointTrajectoryController",
            "joints": joints,
            "constraints": {
                "goal_time": 0.6,
                **{joint: {"trajectory": 0.2, "goal": 0.1} for joint in joints},
            },
            "gains": {joint: {"p": 600, "d": 30, "i": 1, "i_clamp": 1} for joint in joints},
            "state_publish_rate": 50,
        }
    return found


def oscillation(joints: list[str], seconds: float):
    """Return a trajectory with positions and velocities, a point each half second."""
    import rospy
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    points = [
        JointTrajectoryPoint(
            positions=[math.sin(0.5 * step)] * len(joints),
            velocities=[math.cos(0.5 * step)] * len(joints),
            time_from_start=rospy.Duration(0.5 * step),
        )
        for step in range(1, int(2 * seconds))
    ]
    return JointTrajectory(joint_names=joints, points=points)


def start_controllers(names: list[str]) -> None:
    """Load and start controllers."""
    import rospy
    from controller_manager_msgs.srv import LoadController, SwitchController

    load = rospy.ServiceProxy("/controller_manager/load_controller", LoadController)
    load.wait_for_service(60)
    for name in names:
        assert load(name).ok, name
    switch = rospy.ServiceProxy("/controller_manager/switch_controller", SwitchController)
    assert switch(names, [], 2, False, 0.0).ok


def measure(case: Case, seconds: float, node: list[str]) -> dict[str, float]:
    """Run a case, in a process with a node and a new master."""
    import psutil
    import rospy
    from control_msgs.msg import JointTrajectoryControllerState
    from diagnostic_msgs.msg import DiagnosticArray
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory

    for name, value in parameters(case).items():
        rospy.set_param(f"/{name}", value)
    process = subprocess.Popen([*node, "__name:=loopback"])
    try:
        received = 0  # states of controllers
        speeds: dict[str, float] = {}  # of the controllers, in the last state
        times: list[dict[str, str]] = []

        def told(name: str):
            def counted(state: JointTrajectoryControllerState) -> None:
                nonlocal received
                received += 1
                speeds[name] = max(abs(each) for each in state.actual.velocities)

            return counted

        def diagnosed(message: DiagnosticArray) -> None:
            times.extend({each.key: each.value for each in status.values} for status in message.status)

        controllers = shares(case)
        start_controllers(["joint_state_controller", *controllers])
        rospy.Subscriber("/joint_states", JointState, lambda _: None)
        rospy.Subscriber("/diagnostics", DiagnosticArray, diagnosed)
        publishers = {}
        for name in controllers:
            rospy.Subscriber(f"/{name}/state", JointTrajectoryControllerState, told(name))
            publishers[name] = rospy.Publisher(f"/{name}/command", JointTrajectory, queue_size=1, latch=True)
        for name, joints in controllers.items():
            publishers[name].publish(oscillation(joints, seconds + 10))
        time.sleep(WARM_UP)

        watched = psutil.Process(process.pid)
        times.clear()
        before, started = watched.cpu_times(), time.monotonic()
        known = received
        time.sleep(seconds)
        after, ended = watched.cpu_times(), time.monotonic()
        used = after.user + after.system - before.user - before.system
        last = list(times)
        assert len(speeds) == case.controllers, f"not all told their states: {speeds}"
        assert min(speeds.values()) > 0.01, f"not all moved: {speeds}"

        def middle(key: str) -> float:
            return statistics.median(float(each[key]) for each in last)

        return {
            "CPU, %": 100 * used / (ended - started),
            "cycle, us": middle("cycle mean (us)"),
            "cycle p99, us": middle("cycle p99 (us)"),
            "jitter p99, us": middle("jitter p99 (us)"),
            "jitter max, us": max(float(each["jitter max (us)"]) for each in last),
            "overruns": float(last[-1]["overruns"]) - float(last[0]["overruns"]),
            "states/s": (received - known) / (ended - started),
        }
    finally:
        process.terminate()
        process.wait(20)


def measure_row(name: str, seconds: float, profile: str) -> list[str]:
    """Measure a case; return its row."""
    import rospy

    rospy.init_node("bench", disable_signals=True)
    program = ["-m", "cProfile", "-o", profile] if profile else []
    case = CASES[name]
    found = measure(case, seconds, [sys.executable, *program, __file__, "--node"])
    cells = (f"{found[key]:.0f}" if found[key] >= 100 else f"{found[key]:.1f}" for key in COLUMNS)
    return [case.name, f"{case.target:g}", *cells]


def main() -> int:
    """Measure the cases; return the exit status."""
    if "--node" in sys.argv:
        from minirospy.ros.minirospy_hardware.loopback import main as loopback

        return loopback()
    return measure_cases(__file__, __doc__, CASES, ("", "target, %", *COLUMNS), measure_row)


if __name__ == "__main__":
    sys.exit(main())
