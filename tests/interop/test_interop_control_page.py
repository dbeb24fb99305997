"""Controllers and their joints in the dashboard, in Debian's chromium.

Most tests have a manager of their own, which is only services; the last one moves the joints of the loopback.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from control_msgs.msg import JointTrajectoryControllerState
from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources
from controller_manager_msgs.srv import (
    ListControllers,
    LoadController,
    SwitchController,
    UnloadController,
)
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.interop.browser import PATIENCE, Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher
from tests.web.dashboard.conftest import Served, serve
from tests.web.dashboard.robot import ROBOT

__all__ = ["browse", "serve"]

TRAJECTORIES = "position_controllers/JointTrajectoryController"
JOINTS = ("lift", "shoulder")
SWITCH = ".publish-switch input"


class Manager:
    """A controller manager's services over a table of states, without controllers."""

    def __init__(self, served: Served, namespace: str = "") -> None:
        self.states: dict[str, str] = {}
        self.calls: list[str] = []
        self.is_willing = True
        self._types = {"arm": TRAJECTORIES, "states": "joint_state_controller/JointStateController"}
        node = served.node("manager" + namespace.replace("/", "_"))

        async def start() -> None:
            for name, type_ in self._types.items():
                await node.set_param(f"{namespace}/{name}/type", type_)
            for call, service, handler in (
                ("list", ListControllers, self._list),
                ("load", LoadController, self._load),
                ("unload", UnloadController, self._unload),
                ("switch", SwitchController, self._switch),
            ):
                name = f"{namespace}/controller_manager/{call}_controller{'s' if call == 'list' else ''}"
                await node.serve(name, service, handler)

        served.run(start())

    def _list(self, _: Any) -> list[list[ControllerState]]:
        claims = [HardwareInterfaceResources("hardware_interface::PositionJointInterface", list(JOINTS))]
        return [
            [
                ControllerState(name, state, self._types[name], claims if name == "arm" else [])
                for name, state in self.states.items()
            ]
        ]

    def _load(self, request: Any) -> tuple[bool]:
        self.calls.append(f"load {request.name}")
        if self.is_willing:
            self.states[request.name] = "initialized"
        return (self.is_willing,)

    def _unload(self, request: Any) -> tuple[bool]:
        self.calls.append(f"unload {request.name}")
        del self.states[request.name]
        return (True,)

    def _switch(self, request: Any) -> tuple[bool]:
        assert (request.strictness, request.start_asap, request.timeout) == (2, False, 0)
        for verb, names in (("start", request.start_controllers), ("stop", request.stop_controllers)):
            for name in names:
                self.calls.append(f"{verb} {name}")
                self.states[name] = {"start": "running", "stop": "stopped"}[verb]
        return (True,)


def badge(name: str) -> str:
    return f"tr[data-controller='{name}'] .badge"


@needs_chromium
def test_controllers_are_loaded_started_stopped_and_unloaded(
    serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    served = serve()
    page = browse(address(served, "controllers"))
    page.wait_text(".empty", "No controller manager runs")
    manager = Manager(served)
    page.wait_text(badge("arm"), "uninitialized")
    page.wait_text("tr[data-controller='arm']", TRAJECTORIES)
    page.click("tr[data-controller='arm'] button", "Load and start")
    page.wait_text(badge("arm"), "running")
    page.wait_text("tr[data-controller='arm'] .claim", "PositionJointInterface: lift, shoulder")
    page.click("tr[data-controller='states'] button", "Load")
    page.wait_text(badge("states"), "initialized")
    page.click("tr[data-controller='states'] button", "Start")
    page.wait_text(badge("states"), "running")
    page.click("tr[data-controller='arm'] button", "Stop")
    page.wait_text(badge("arm"), "stopped")
    page.click("tr[data-controller='states'] button", "Stop and unload")
    page.wait_text(badge("states"), "uninitialized")
    assert manager.calls == [
        "load arm", "start arm", "load states", "start states", "stop arm", "stop states", "unload states",
    ]  # fmt: skip
    # A change by another program appears by itself.
    manager.states["arm"] = "running"
    page.wait_text(badge("arm"), "running")
    manager.is_willing = False
    page.click("tr[data-controller='states'] button", "Load")
    page.wait_text("p.error", "states was not loaded")
    # A second manager can be chosen.
    other = Manager(served, "/left")
    page.wait(
        "return document.querySelectorAll('select[aria-label=\"Controller manager\"] option').length === 2"
    )
    page.choose("select[aria-label='Controller manager']", "/left/controller_manager")
    page.wait_text(badge("arm"), "uninitialized")
    assert page.evaluate("location.hash").endswith("manager=%2Fleft%2Fcontroller_manager")
    assert other.calls == []


@pytest.fixture
def patient_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time after which the server stops the joints of a silent page, which may stall on a busy machine."""
    monkeypatch.setattr("minirospy.web.dashboard.drive_endpoint.SILENT_SECONDS", PATIENCE)


def switch_on(page: Page) -> None:
    """Switch the commands on. Try again while the page says that its connection for commands is not open yet."""
    page.click(SWITCH)
    while not page.evaluate(f"document.querySelector('{SWITCH}').checked"):
        page.wait_text("p.error", "Try again in a moment")
        page.click(SWITCH)


@pytest.fixture
def arm(
    serve: Callable[..., Served], browse: Callable[..., Page], patient_server: None
) -> tuple[Served, Page, Callable[..., Any]]:
    """Return a dashboard, its page with a running controller, and a function that returns the next matching command."""
    served = serve()
    manager = Manager(served)
    manager.states["arm"] = "running"
    robot = served.node("robot")

    async def prepare() -> Any:
        await robot.set_param("/robot_description", ROBOT)
        return await robot.subscribe("/arm/command", JointTrajectory)

    subscription = served.run(prepare())
    telling = publisher(served, "/arm/state", JointTrajectoryControllerState, latch=True)
    actual = JointTrajectoryPoint(positions=[0.2, 0.5])
    served.run(telling.publish(JointTrajectoryControllerState(joint_names=list(JOINTS), actual=actual)))
    page = browse(address(served, "trajectory"))
    page.wait("return document.querySelector('[data-joint=shoulder] input[type=number]').value === '0.5'")

    def until(is_right: Callable[[JointTrajectory], bool]) -> JointTrajectory:
        while not is_right(message := served.run(subscription.next(PATIENCE))):
            pass
        return message

    return served, page, until


def positions(command: JointTrajectory) -> list[float]:
    return list(command.points[0].positions) if command.points else []


@needs_chromium
def test_sliders_send_commands_only_while_they_are_on(
    arm: tuple[Served, Page, Callable[..., JointTrajectory]],
) -> None:
    _, page, until = arm
    assert page.evaluate("document.querySelector('[data-joint=shoulder] input[type=range]').disabled")
    switch_on(page)
    # The first command is where the joints are, whatever was sent before.
    first = until(lambda command: True)
    assert (list(first.joint_names), positions(first)) == (list(JOINTS), [0.2, 0.5])
    assert first.points[0].time_from_start.to_sec() == 1.0
    assert first.header.stamp.to_sec() > 0
    page.type("[data-joint=shoulder] input[type=number]", "-4")
    page.evaluate("document.activeElement.blur()")
    moved = until(lambda command: positions(command)[1:] != [0.5])
    # It is cut to the URDF's limit, and lasts as long as 1.5 rad need at half of 1 rad/s.
    assert positions(moved) == [0.2, -1.0]
    assert moved.points[0].time_from_start.to_sec() == 3.0
    page.click(SWITCH)
    held = until(lambda command: not command.points)
    assert list(held.joint_names) == []
    page.wait("return document.querySelector('[data-joint=shoulder] input[type=range]').disabled")
    page.wait("return document.querySelector('[data-joint=shoulder] input[type=number]').value === '0.5'")


@needs_chromium
@pytest.mark.parametrize("ending", ["is closed", "is shown another view"])
def test_joints_are_held_when_the_page(
    arm: tuple[Served, Page, Callable[..., JointTrajectory]], ending: str
) -> None:
    _, page, until = arm
    switch_on(page)
    page.type("[data-joint=shoulder] input[type=number]", "1.5")
    page.evaluate("document.activeElement.blur()")
    until(lambda command: positions(command) == [0.2, 1.5])
    if ending == "is closed":
        page.open("about:blank")
    else:
        page.evaluate("location.hash = '#/topics'")
    until(lambda command: not command.points)


@needs_chromium
def test_robot_without_limits_is_named(serve: Callable[..., Served], browse: Callable[..., Page]) -> None:
    served = serve()
    Manager(served).states["arm"] = "running"
    page = browse(address(served, "trajectory"))
    page.wait_text("p.error", "there is no robot_description")
    text = ROBOT.replace('<limit lower="0.1" upper="0.3" effort="1" velocity="1"/>', "")

    served.run(served.node("robot").set_param("/robot_description", text))
    page.wait_text("p.error", "no limits of position and velocity for lift")
    assert page.evaluate("document.querySelector('.publish-switch input').disabled")


@needs_chromium
def test_joint_of_the_loopback_moves_and_stands_when_the_page_is_closed(
    serve: Callable[..., Served], browse: Callable[..., Page], master: str, patient_server: None
) -> None:
    served = serve()
    robot = served.node("robot")

    async def prepare() -> Any:
        await robot.set_param("/robot_description", ROBOT)
        await robot.set_param("/arm", {"type": TRAJECTORIES, "joints": list(JOINTS)})
        return await robot.subscribe("/arm/state", JointTrajectoryControllerState)

    subscription = served.run(prepare())

    def until(is_right: Callable[[Any], bool]) -> Any:
        while not is_right(message := served.run(subscription.next(PATIENCE)).actual):
            pass
        return message

    environment = {**os.environ, "ROS_MASTER_URI": master}
    program = "from minirospy.ros.minirospy_hardware.loopback import main; main()"
    loopback = subprocess.Popen([sys.executable, "-c", program], env=environment)
    try:
        page = browse(address(served, "controllers"))
        page.click("tr[data-controller='arm'] button", "Load and start")
        page.wait_text(badge("arm"), "running")
        page.evaluate("location.hash = '#/trajectory?speed=2'")
        page.wait(f"return document.querySelector('{SWITCH}')?.disabled === false")
        switch_on(page)
        page.type("[data-joint=shoulder] input[type=number]", "2")
        page.evaluate("document.activeElement.blur()")
        # At 2 % of 1 rad/s the motion takes 100 s.
        until(lambda actual: actual.positions[1] > 0.02)
        page.open("about:blank")
        last: deque[float] = deque(maxlen=50)

        def stands(actual: Any) -> bool:
            # One state does not tell: there is no motion in the cycle in which a command begins.
            last.append(actual.positions[1])
            return len(last) == last.maxlen and len(set(last)) == 1

        assert 0.02 < until(stands).positions[1] < 1.9
    finally:
        loopback.terminate()
        loopback.wait(PATIENCE)
