"""The manager's services, its loop, and what becomes of controllers and hardware that fail."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from tests.ros.control.manager.conftest import ROBOT, Start, call

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C for one process")

LOADS = """
rospy.set_param("/one", {"type": "my_controllers/Hold", "joint": "a", "step": 0.001})
rospy.set_param("/two", {"type": "my_controllers/Hold", "joint": "b"})
rospy.set_param("/again", {"type": "my_controllers/Hold", "joint": "a"})
rospy.set_param("/faulty", {"type": "my_controllers/Faulty", "joint": "b"})
"""


def lines_of(errors: str) -> list[str]:
    """Return the log's lines without times, and without the overruns of a busy machine."""
    return [line.partition("]: ")[2] for line in errors.splitlines() if "control loop: " not in line]


def test_controllers_are_loaded_switched_and_unloaded(start: Start) -> None:
    robot = start("-c", ROBOT)
    printed = call(
        LOADS
        + """
cm.list_controllers()
cm.load_controller("one"), cm.load_controller("two"), cm.load_controller("again")
cm.load_controller("one"), cm.load_controller("nothing"), cm.load_controller("a b")
cm.start_controllers(["one", "again"])
cm.start_controllers(["one", "two"])
cm.unload_controller("one")
cm.start_stop_controllers(["again"], ["one"])
cm.list_controllers()
cm.unload_controller("one")
cm.list_controllers()
cm.reload_libraries(False)
cm.reload_libraries(True)
cm.list_controllers()
"""
    )
    kind = "hardware_interface::PositionJointInterface"
    assert printed.splitlines() == [
        "No controllers are loaded in mechanism control",
        "Loaded 'one'",
        "Loaded 'two'",
        "Loaded 'again'",
        "Error when loading 'one'",
        "Error when loading 'nothing'",
        "Error when loading 'a b'",
        "Error when starting ['one', 'again'] and stopping []",
        "Started ['one', 'two'] successfully",
        "Error when unloading 'one'",
        "Started ['again'] successfully",
        "Stopped ['one'] successfully",
        f"'one' - '{kind}' ( stopped )",
        f"'two' - '{kind}' ( running )",
        f"'again' - '{kind}' ( running )",
        "Unloaded 'one' successfully",
        f"'two' - '{kind}' ( running )",
        f"'again' - '{kind}' ( running )",
        "Restore: False",
        "Failed to reload libraries. Do you still have controllers loaded?",
        "Restore: False",
        "Successfully reloaded libraries",
        "No controllers are loaded in mechanism control",
    ]
    robot.process.send_signal(signal.SIGINT)
    status, _, errors = robot.end()
    assert status == 0
    logged = lines_of(errors)
    assert logged == [
        "A controller named 'one' was already loaded inside the controller manager",
        "Could not load controller 'nothing' because the type was not specified. Did you load the controller "
        "configuration on the parameter server (namespace: '/nothing')?",
        "Exception thrown while constructing nodehandle for controller with name 'a b':",
        "",
        "Resource conflict on [a].  Controllers = [one, again, ]",
        "Could not switch controllers, due to resource conflict",
        "Could not unload controller with name 'one' because it is still running",
        "Controller manager: Cannot reload controller libraries because there are still 2 controllers running",
    ]


def test_classes_that_cannot_be_loaded_have_one_clear_line(start: Start) -> None:
    robot = start("-c", ROBOT)
    kinds = ["Broken", "Cpp", "Other", "Absent"]
    call(
        "".join(f"rospy.set_param('/{kind}', {{'type': 'my_controllers/{kind}'}})\n" for kind in kinds)
        + f"for name in {kinds}: cm.load_controller(name)"
    )
    robot.process.send_signal(signal.SIGINT)
    logged = lines_of(robot.end()[2])
    assert len(logged) == 3 + 2 * len(kinds)
    assert logged[0].startswith(
        "Could not load class 'my_controllers/Broken': cannot import my_controllers.broken.Broken ("
    )
    assert "ModuleNotFoundError: No module named 'nothing_of_that_name' (" in logged[0]
    assert "broken.py:1)" in logged[0]
    assert logged[1:3] == [
        "Could not load controller 'Broken' because controller type 'my_controllers/Broken' does not exist.",
        "Use 'rosservice call controller_manager/list_controller_types' to get the available types",
    ]
    assert "my_controllers::Cpp is written in C++ (" in logged[3]
    assert logged[6].endswith("is not a subclass of controller_interface.Controller")
    assert (
        logged[9]
        == "Could not load controller 'Absent' because controller type 'my_controllers/Absent' does not exist."
    )


def test_controller_that_raises_is_stopped_and_the_loop_goes_on(start: Start, workspace: Path) -> None:
    robot = start("-c", ROBOT)
    call(
        LOADS
        + 'cm.load_controller("one"), cm.load_controller("faulty")\ncm.start_controllers(["one", "faulty"])'
    )
    robot.read_until("faulty stops")
    for _ in range(3):
        robot.read_until("a 0.")
    assert "( stopped )" in call("cm.list_controllers()").splitlines()[1]
    robot.process.send_signal(signal.SIGINT)
    _, _, errors = robot.end()
    (line,) = lines_of(errors)
    place = f"({workspace / 'src' / 'my_controllers' / 'hold.py'}:29)"
    assert line.endswith(f"Controller 'faulty' is stopped: update raised RuntimeError: no oil {place}")


def test_start_that_fails_and_a_reload_of_changed_files(start: Start, workspace: Path) -> None:
    file = workspace / "src" / "my_controllers" / "hold.py"
    text = file.read_text()
    file.write_text(
        text.replace(
            "    def update(self, time, period):\n        raise",
            "    def starting(self, time):\n        raise",
        )
    )
    robot = start("-c", ROBOT)
    assert call(LOADS + 'cm.load_controller("faulty"), cm.start_controller("faulty")').splitlines() == [
        "Loaded 'faulty'",
        "Error when starting ['faulty'] and stopping []",
    ]

    # A reload reads changed files.
    loads = LOADS + 'cm.load_controller("one"), cm.start_controller("one")'
    call(loads)
    robot.read_until("one starts")
    file.write_text(file.read_text().replace('"starts"', '"begins"') + "# of another size\n")
    call("cm.reload_libraries(True)\n" + loads)
    robot.read_until("one begins")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_end_stops_the_controllers_and_releases_the_joints(start: Start, number: signal.Signals) -> None:
    robot = start("-c", ROBOT)
    call(LOADS + 'cm.load_controller("one"), cm.load_controller("two"); cm.start_controllers(["one", "two"])')
    robot.read_until("b 0.000")
    robot.process.send_signal(number)
    status, output, errors = robot.end()
    assert status == 0
    assert lines_of(errors) == []
    last = [line for line in output.splitlines() if not line.startswith(("a 0", "b 0"))]
    assert last == [
        "two stops",
        "one stops",
        "two closes",
        "one closes",
        "closed, active: [None, None]",
        "status 0",
    ]


def test_hardware_that_fails_ends_the_node_with_status_1(start: Start, workspace: Path) -> None:
    robot = start("-c", ROBOT)
    call(LOADS + 'cm.load_controller("one"); cm.start_controllers(["one"])')
    robot.read_until("a 0.")
    (workspace.parent / "fails").touch()
    status, output, errors = robot.end()
    assert status == 1
    last = [line for line in output.splitlines() if not line.startswith("a 0")]
    assert last == ["one stops", "one closes", "closed, active: [None, None]", "status 1"]
    (line,) = lines_of(errors)
    assert "the hardware failed, so the robot is stopped: OSError: the cable is loose (<string>:" in line


def test_driver_that_exits_stops_the_robot_and_ends_the_node(start: Start, workspace: Path) -> None:
    robot = start("-c", ROBOT.replace('raise OSError("the cable is loose")', "sys.exit(7)"))
    call(LOADS + 'cm.load_controller("one"); cm.start_controllers(["one"])')
    robot.read_until("a 0.")
    (workspace.parent / "fails").touch()
    status, output, errors = robot.end()
    assert status == 1
    last = [line for line in output.splitlines() if not line.startswith("a 0")]
    assert last == ["one stops", "one closes", "closed, active: [None, None]", "status 1"]
    (line,) = lines_of(errors)
    assert "the hardware failed, so the robot is stopped: SystemExit: 7 (<string>:" in line


def test_joints_are_released_before_controllers_close_their_topics(start: Start, workspace: Path) -> None:
    file = workspace / "src" / "my_controllers" / "hold.py"
    file.write_text(
        file.read_text() + "    def close(self):\n        import time\n        time.sleep(1000)\n"
    )
    file.write_text(file.read_text().replace("class Other:\n    pass", "class Faulty(Hold):"))
    write = "        if not any(joint.active for joint in self.joints.values()):\n            print('released', flush=True)\n"
    robot = start("-c", ROBOT.replace("        time_.sleep(", write + "        time_.sleep("))
    call(LOADS + 'cm.load_controller("faulty"); cm.start_controllers(["faulty"])')
    robot.read_until("b 0.")
    robot.process.send_signal(signal.SIGINT)
    robot.read_until("faulty stops")
    robot.read_until("released")
    assert robot.end()[0] == 1


CLOCK = """
import itertools, os, threading, time
import rospy
from controller_manager import controller_manager_interface as cm
from rosgraph_msgs.msg import Clock

rospy.init_node("clock", disable_signals=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=10)
publisher.wait_for_subscribers(2)  # the robot's, and this node's own
thread = threading.Thread(target=lambda: cm.load_controller("one") and cm.start_controller("one"))
thread.start()
before = itertools.takewhile(lambda _: thread.is_alive(), itertools.count(10_000_000_000, 10_000_000))
# After each jump, time advances by nanoseconds until the robot has seen it: a node reads only the newest time.
later = itertools.takewhile(lambda _: not os.path.exists("later"), itertools.count(50_000_000_000))
earlier = itertools.takewhile(lambda _: not os.path.exists("earlier"), itertools.count(1_000_000_000))
for nanoseconds in itertools.chain(before, later, earlier, itertools.count(1_010_000_000, 10_000_000)):
    publisher.publish(Clock(rospy.Time(*divmod(nanoseconds, 1_000_000_000))))
    time.sleep(0.01)
"""


def test_simulated_time_paces_the_loop_and_a_jump_restarts_controllers(start: Start, workspace: Path) -> None:
    call(LOADS + "rospy.set_param('/use_sim_time', True)")
    robot = start("-c", ROBOT)
    start("-c", CLOCK)
    assert 10_000_000_000 <= int(robot.read_until("one starts").split()[-1]) < 60_000_000_000
    period = int(robot.read_until("a 0.").split()[-1])
    assert period > 0
    assert period % 10_000_000 == 0
    while period < 1_000_000_000:
        period = int(robot.read_until("a 0.").split()[-1])
    (workspace.parent / "later").touch()
    robot.read_until("one stops")
    assert 1_000_000_000 <= int(robot.read_until("one starts").split()[-1]) < 10_000_000_000
    assert robot.read_until("a 0.").split()[-1] == "0"
    (workspace.parent / "earlier").touch()
    robot.read_until("a 0.")
    robot.process.send_signal(signal.SIGINT)
    status, _, errors = robot.end()
    assert status == 0
    assert "time jumped back by 49." in errors


JUMP = """
import sys
import rospy
from minirospy.client.session import current_session
from controller_manager import ControlLoop
from hardware_interface import RobotHardware

rospy.init_node("robot")
clock, times = current_session().clock, []


class Robot(RobotHardware):
    def write(self, time, period):
        times.append((time.to_nsec() // 10_000_000, period.to_nsec() // 10_000_000))
        if len(times) == 2:
            clock.set(1_000_000_000)  # a simulation is reset while a cycle runs
        elif len(times) == 5:
            loop._stop.set()
        cycled.set()


import threading
cycled = threading.Event()
loop = ControlLoop(Robot())
loop.start()
def tick():
    clock.set(50_000_000_000)
    while not loop._stop.is_set():
        cycled.wait(1)  # the time does not run ahead of a loop that stalls
        cycled.clear()
        clock.set(clock.now() + 10_000_000)
threading.Thread(target=tick, daemon=True).start()
loop.wait()
print(times, max(loop._times.take()[0]), flush=True)
"""


def test_loop_goes_on_if_time_jumps_back_during_a_cycle(start: Start) -> None:
    call("rospy.set_param('/use_sim_time', True)")
    robot = start("-c", JUMP)
    status, output, errors = robot.end()
    assert status == 0
    assert "time jumped back by 49." in errors
    times, _, late = output.strip().rpartition(" ")
    assert all(5000 <= hundredths < 5010 for hundredths, _ in eval(times)[:2])
    assert all(100 < hundredths < 110 for hundredths, _ in eval(times)[2:5])
    assert int(late) < 1_000_000_000  # also of the first cycle, although time began at 0


SET_BACK = """
import os, time
time_ns = time.time_ns
time.time_ns = lambda: time_ns() - (100_000_000_000 if os.path.exists("set_back") else 0)
"""


def test_controllers_are_started_again_if_the_computers_time_is_set_back(
    start: Start, workspace: Path
) -> None:
    robot = start("-c", SET_BACK + ROBOT)
    call(LOADS + 'cm.load_controller("one"), cm.start_controller("one")')
    before = int(robot.read_until("one starts").split()[-1])
    robot.read_until("a 0.")
    (workspace.parent / "set_back").touch()
    robot.read_until("one stops")
    assert int(robot.read_until("one starts").split()[-1]) < before
    # The period is measured by a clock that cannot be set.
    assert 0 < int(robot.read_until("a 0.").split()[-1]) < 90_000_000_000
    robot.process.send_signal(signal.SIGINT)
    assert "the controllers are started again" in robot.end()[2]


TWO_ROBOTS = """
import rospy
from controller_manager import ControlLoop
from hardware_interface import RobotHardware
from std_msgs.msg import Empty

rospy.init_node("robots")
loops = [ControlLoop(RobotHardware(), 100.0, namespace) for namespace in ("", "left")]
for loop in loops:
    loop.start()
rospy.wait_for_message("/stop", Empty)
for loop in loops:
    loop.stop()
rospy.spin()
"""


def test_diagnostics_have_the_times_of_each_loop_and_end_with_it(start: Start) -> None:
    start("-c", TWO_ROBOTS)
    printed = call(
        "from diagnostic_msgs.msg import DiagnosticArray\n"
        "rospy.init_node('reader')\n"
        "found = {}\n"
        "def receive(message):\n"
        "    found[message.status[0].name] = [pair.key for pair in message.status[0].values]\n"
        "rospy.Subscriber('/diagnostics', DiagnosticArray, receive)\n"
        "while len(found) < 2:\n"
        "    rospy.wait_for_message('/diagnostics', DiagnosticArray)\n"
        "for name in sorted(found): print(name, found[name])\n"
        "from std_msgs.msg import Empty\n"
        "rospy.Publisher('/stop', Empty, latch=True, queue_size=1).publish()\n"
        "while any(topic == '/diagnostics' for topic, _ in rospy.get_published_topics()):\n"
        "    rospy.sleep(0.05)\n"
    )
    keys = ["jitter mean", "jitter p99", "jitter max", "cycle mean", "cycle p99", "cycle max"]
    shown = ["rate (Hz)", "cycles", "overruns", *(f"{key} (us)" for key in keys)]
    assert printed == f"robots: control loop {shown}\nrobots: control loop /left {shown}\n"


def test_commands_are_limited_by_parameters(start: Start) -> None:
    call(LOADS + "rospy.set_param('/joint_limits/a', {'has_velocity_limits': True, 'max_velocity': 0.01})")
    call("rospy.set_param('/one/step', 1.0); rospy.set_param('/two/step', float('nan'))")
    robot = start("-c", ROBOT)
    call('cm.load_controller("one"), cm.load_controller("two"); cm.start_controllers(["one", "two"])')
    before = 0.0
    for _ in range(50):
        _, position, period = robot.read_until("a 0.").split()
        assert float(position) - before <= 0.01 * int(period) / 1e9 + 0.001
        before = float(position)
    assert before > 0.0
    robot.process.send_signal(signal.SIGINT)
    _, _, errors = robot.end()
    assert {line.split()[1] for line in robot.lines if line.startswith("b 0")} == {"0.000"}
    assert lines_of(errors) == ["commands that are not finite were replaced, joints: b"]


def test_overruns_are_counted_and_not_caught_up(start: Start, workspace: Path) -> None:
    (workspace.parent / "slow").touch()
    robot = start("-c", ROBOT)
    printed = call(
        "from diagnostic_msgs.msg import DiagnosticArray\n"
        "rospy.init_node('reader')\n"
        "status = rospy.wait_for_message('/diagnostics', DiagnosticArray).status[0]\n"
        "values = {pair.key: int(pair.value) for pair in status.values}\n"
        "print(status.level, 0 < values['cycles'] == values['overruns'], values['cycle mean (us)'] >= 30_000)"
    )
    assert printed == "1 True True\n"
    robot.process.send_signal(signal.SIGINT)
    _, _, errors = robot.end()
    assert "cycles ended after the next one was due; the period is 10 ms, the longest cycle took" in errors
    assert " ms late" in errors


def test_driver_that_hangs_does_not_keep_the_node(start: Start, workspace: Path) -> None:
    robot = start("-c", ROBOT)
    call(LOADS + 'cm.load_controller("one"), cm.start_controller("one")')
    (workspace.parent / "hangs").touch()
    robot.read_until("a 0.")
    robot.process.send_signal(signal.SIGINT)
    status, _, errors = robot.end()
    assert status == 1
    assert lines_of(errors)[-1] == (
        "the control loop does not end: a controller, or read() or write() of the hardware, hangs"
    )


def test_slow_loop_ends_at_once(start: Start) -> None:
    robot = start("-c", ROBOT, "_rate:=0.02")
    call("cm.list_controllers()")
    robot.process.send_signal(signal.SIGINT)
    status, output, errors = robot.end()
    assert (status, output, errors) == (0, "closed, active: [None, None]\nstatus 0\n", "")


def test_manager_starts_cleanly_after_a_kill_in_mid_motion(start: Start) -> None:
    for _ in range(3):
        robot = start("-c", ROBOT)
        printed = call(
            LOADS + 'cm.load_controller("one"); cm.start_controllers(["one"]); cm.list_controllers()'
        )
        assert printed.splitlines()[-1] == "'one' - 'hardware_interface::PositionJointInterface' ( running )"
        robot.read_until("a 0.003")
        robot.process.kill()
        robot.process.wait()
