"""spawner, unspawner and controller_group against a manager, the loopback, and controller_manager_msgs.utils.

The texts and statuses were compared with those of ROS's scripts under real rospy.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from tests.ros.control.manager.conftest import ROBOT, Program, Start, call

ARM = Path(__file__).parents[3] / "core" / "urdf" / "arm.urdf"
HOLD = """rospy.set_param("/%s", {"type": "my_controllers/Hold", "joint": "%s"})\n"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C for one process")


def texts(lines: str) -> list[str]:
    return [line.partition("]: ")[2] for line in lines.splitlines() if "control loop: " not in line]


def interrupt(program: Program) -> tuple[int, list[str], list[str]]:
    """Press Ctrl-C; return the status, and the log on both outputs."""
    program.process.send_signal(signal.SIGINT)
    status, _, errors = program.end()
    return status, texts("\n".join(program.lines)), texts(errors)


def test_spawner_starts_controllers_and_takes_them_down(start: Start, tmp_path: Path) -> None:
    start("-c", ROBOT)
    call(HOLD % ("one", "a") + HOLD % ("two", "b"))
    (tmp_path / "src" / "one").mkdir()  # in the spawner's folder: not a file of controllers
    spawner = start("controller_manager", "spawner", "one", "nope", "two")
    spawner.read_until("Started controllers: one, two")
    assert call("cm.list_controllers()").count("( running )") == 2
    status, log, errors = interrupt(spawner)
    assert (status, errors) == (0, ["Failed to load nope"])
    assert log == [
        "Controller Spawner: Waiting for service controller_manager/load_controller",
        "Controller Spawner: Waiting for service controller_manager/switch_controller",
        "Controller Spawner: Waiting for service controller_manager/unload_controller",
        "Loading controller: one",
        "Loading controller: nope",
        "Loading controller: two",
        "Controller Spawner: Loaded controllers: one, two",
        "Started controllers: one, two",
        "Shutting down spawner. Stopping and unloading controllers...",
        "Stopping all controllers...",
        "Unloading all loaded controllers...",
        "Trying to unload two",
        "Succeeded in unloading two",
        "Trying to unload one",
        "Succeeded in unloading one",
    ]
    assert call("cm.list_controllers()") == "No controllers are loaded in mechanism control\n"

    # A file, after a message on a topic.
    file = tmp_path / "controllers.yaml"
    file.write_text(
        "one: {type: my_controllers/Hold, joint: a}\ntwo: {type: my_controllers/Hold, joint: b}\n"
    )
    spawner = start("controller_manager", "spawner", "--stopped", "--wait-for", "/go", str(file))
    call(
        "from std_msgs.msg import Bool\nrospy.init_node('go')\n"
        "publisher = rospy.Publisher('/go', Bool, queue_size=5)\npublisher.wait_for_subscribers()\n"
        "publisher.publish(False); publisher.publish(True)"
    )
    spawner.read_until("Loaded controllers: one, two")
    assert call("cm.list_controllers()").count("( initialized )") == 2


def test_spawner_without_a_manager_warns_and_ends_with_status_0(start: Start) -> None:
    spawner = start("controller_manager", "spawner", "--namespace", "/arm", "--timeout", "0.1", "one")
    status, output, errors = spawner.end()
    assert status == 0
    assert texts(output) == [
        "Controller Spawner: Waiting for service /arm/controller_manager/load_controller"
    ]
    assert texts(errors) == [
        "Controller Spawner couldn't find the expected controller_manager ROS interface."
    ]


def test_spawner_ends_while_the_manager_is_busy_with_its_controller(start: Start, workspace: Path) -> None:
    file = workspace / "src" / "my_controllers" / "hold.py"
    init = "    def init(self, hardware, context):\n        print('waits', flush=True)\n        threading.Event().wait()\n"
    file.write_text("import threading\n" + file.read_text() + "\n\nclass Faulty(Hold):\n" + init)
    robot = start("-c", ROBOT)
    call("rospy.set_param('/slow', {'type': 'my_controllers/Faulty', 'joint': 'a'})")
    spawner = start("controller_manager", "spawner", "slow")
    robot.read_until("waits")
    status, log, errors = interrupt(spawner)
    assert (status, errors) == (0, [])
    assert log[-2:] == [
        "Shutting down spawner. Stopping and unloading controllers...",
        "Stopping all controllers...",
    ]


def test_unspawner_goes_on_without_the_manager(start: Start) -> None:
    robot = start("-c", ROBOT)
    call(HOLD % ("one", "a") + "cm.load_controller('one'), cm.start_controller('one')")
    unspawner = start("controller_manager", "unspawner", "one")
    unspawner.read_until("Inhibiting controllers: one")
    robot.read_until("one stops")
    call("cm.list_controllers()")  # answered after the switch
    robot.process.kill()
    robot.process.wait()
    assert unspawner.process.stderr
    assert "[WARN]" in (line := unspawner.process.stderr.readline()), line
    robot = start("-c", ROBOT)
    call("cm.load_controller('one'), cm.start_controller('one')")
    unspawner.read_until("Inhibiting controllers: one")
    robot.read_until("one stops")
    assert interrupt(unspawner)[0] == 0


def test_unspawner_and_groups(start: Start) -> None:
    start("-c", ROBOT)
    call(
        HOLD % ("one", "a")
        + HOLD % ("two", "a")
        + "rospy.set_param('/controller_groups', {'g': ['one'], 'h': ['two']})"
    )
    groups = start("controller_manager", "controller_group", "spawn", "g").end()
    assert groups[:2] == (0, "Loaded 'one'\nStarted ['one'] successfully\n")
    groups = start("controller_manager", "controller_group", "switch", "h").end()
    assert groups[1] == "Loaded 'two'\nStarted ['two'] successfully\nStopped ['one'] successfully\n"
    assert start("controller_manager", "controller_group", "list").end()[1] == (
        "Number of groups: 2\n  g\n      one\n  h\n      two\n"
    )

    unspawner = start("controller_manager", "unspawner", "two")
    unspawner.read_until("Inhibiting controllers: two")
    assert "'two' - 'hardware_interface::PositionJointInterface' ( stopped )" in call("cm.list_controllers()")
    assert interrupt(unspawner)[0] == 0
    assert "'two' - 'hardware_interface::PositionJointInterface' ( running )" in call("cm.list_controllers()")

    program = start("controller_manager", "controller_manager", "sing")
    assert program.end()[0] == 1
    assert program.lines[0] == "Commands:"


def test_loopback_in_a_namespace_and_utils(start: Start) -> None:
    call(
        f"rospy.set_param('/robot_description', open({str(ARM)!r}).read())\n"
        "rospy.set_param('/arm/one', {'type': 'my_controllers/Hold', 'joint': 'shoulder', 'step': 1.0})\n"
    )
    loopback = start("minirospy_hardware", "loopback", "__ns:=/arm", "_initial:={shoulder: 0.5}", "_rate:=50")
    printed = call(
        """
from controller_manager_msgs.utils import *
rospy.wait_for_service("/arm/controller_manager/list_controllers")
print(get_controller_managers(), ControllerManagerLister("/arm")(), is_controller_manager("/nope"))
print(get_rosparam_controller_names("/arm"))
from controller_manager_msgs.srv import *
print(rospy.ServiceProxy("/arm/controller_manager/load_controller", LoadController)("one").ok)
print(rospy.ServiceProxy("/arm/controller_manager/switch_controller", SwitchController)(["one"], [], 2, False, 0.0).ok)
found = ControllerLister("/arm/controller_manager")()
print([each.name for each in filter_by_state(found, "run", True)], filter_by_name(found, "on"))
print(len(filter_by_type(found, "my_controllers/Hold")), len(filter_by_resources(found, ["shoulder"])))
print(len(filter_by_hardware_interface(found, "Position", True)), filter_by_resources(found, ["a", "shoulder"]))
print(ControllerLister("/nope")())
"""
    )
    assert printed.splitlines() == [
        "['/arm/controller_manager'] ['/arm/controller_manager'] False",
        "['one']",
        "True",
        "True",
        "['one'] []",
        "1 1",
        "1 []",
        "[]",
    ]
    assert interrupt(loopback)[0] == 0


@pytest.mark.parametrize(
    ("description", "error"),
    [
        (None, "there is no parameter robot_description in the namespace / or above"),
        ("<robot name='r'>", "robot_description"),
        ("<robot name='r'><link name='a'/></robot>", "robot 'r' has no joint that can be commanded"),
        (
            "<robot name='r'><link name='a'/><link name='b'/>"
            + "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>" * 2
            + "</robot>",
            "joint 'j' is not unique.",
        ),
    ],
)
def test_loopback_without_a_robot(start: Start, description: str | None, error: str) -> None:
    if description:
        call(f"rospy.set_param('/robot_description', {description!r})")
    status, _, errors = start("minirospy_hardware", "loopback").end()
    assert status == 1
    (line,) = texts(errors)
    assert error in line
