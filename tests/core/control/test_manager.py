"""The table of controllers: loading, switching and faults, with ROS's texts and order of log lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pytest

from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import (
    ControllerInfo,
    HardwareError,
    Interface,
    RobotHardware,
    SwitchState,
)
from minirospy.core.control.manager import BEST_EFFORT, STRICT, ControllerTable, Loaded, Switch
from minirospy.core.control.parameters import Parameters

PERIOD = Duration(0, 10_000_000)
CONFLICT = "because of conflicting switching command"


class Hardware(RobotHardware):
    """Two joints, and an answer to each question about a switch."""

    def __init__(self) -> None:
        super().__init__()
        for name in ("a", "b"):
            self.add_joint(name, Interface.POSITION, Interface.VELOCITY, position=0.5)
        self.calls: list[tuple[list[str], list[str]]] = []
        self.result = SwitchState.DONE
        self.results: dict[str, SwitchState] = {}
        self.can_switch = True

    def prepare_switch(self, start: Sequence[ControllerInfo], stop: Sequence[ControllerInfo]) -> bool:
        return self.can_switch

    def do_switch(self, start: Sequence[ControllerInfo], stop: Sequence[ControllerInfo]) -> None:
        self.calls.append(([each.name for each in start], [each.name for each in stop]))

    def switch_result(self, controller: ControllerInfo | None = None) -> SwitchState:
        return self.results.get(controller.name, SwitchState.DONE) if controller else self.result


class Recorder(Controller):
    """A controller that records its calls, and raises in those of ``faults``."""

    interfaces = (Interface.POSITION,)
    joints: tuple[str, ...] = ("a",)

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.faults: dict[str, BaseException] = {}

    def _record(self, name: str) -> None:
        self.calls.append(name)
        if error := self.faults.get(name):
            raise error

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        for name in self.joints:
            hardware.joint(name, Interface.POSITION)
        self._record("init")

    def starting(self, time: Time) -> None:
        self._record("starting")

    def update(self, time: Time, period: Duration) -> None:
        self._record("update")

    def stopping(self, time: Time) -> None:
        self._record("stopping")

    def waiting(self, time: Time) -> None:
        self._record("waiting")

    def aborting(self, time: Time) -> None:
        self._record("aborting")

    def close(self) -> None:
        self._record("close")


class Bench:
    """A table with its hardware, its log, and a clock."""

    def __init__(self) -> None:
        self.hardware = Hardware()
        self.log: list[str] = []
        self.table = ControllerTable(self.hardware, lambda level, line: self.log.append(f"{level} {line}"))
        self.now = 100.0

    def load(self, name: str, controller: Recorder | None = None, **attributes: Any) -> Recorder:
        controller = controller or Recorder()
        for key, value in attributes.items():
            setattr(controller, key, value)
        context = ControllerContext(f"/{name}", "/", name, Parameters(f"/{name}", {}), lambda: None)  # type: ignore[arg-type, return-value]
        self.table.load(name, "test/Recorder", lambda: controller, context)
        return controller

    def plan(
        self, start: str = "", stop: str = "", strictness: int = STRICT, **options: Any
    ) -> Switch | None:
        return self.table.plan_switch(
            start.split(), stop.split(), strictness, now=Time.from_sec(self.now), **options
        )

    def switch(self, start: str = "", stop: str = "", strictness: int = STRICT, **options: Any) -> bool:
        """Perform a switch in one update; return whether it was accepted."""
        plan = self.plan(start, stop, strictness, **options)
        if plan:
            self.table.begin(plan)
            self.update()
        return plan is not None

    def update(self, seconds: float = 0.01, **options: Any) -> None:
        self.now += seconds
        self.table.update(Time.from_sec(self.now), PERIOD, **options)

    def states(self) -> dict[str, str]:
        return {each.info.name: each.state.value for each in self.table.loaded}

    def find(self, name: str) -> Loaded:
        found = self.table.find(name)
        assert found
        return found


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_controller_is_updated_from_the_cycle_after_its_start(bench: Bench) -> None:
    controller = bench.load("one")
    assert bench.states() == {"one": "initialized"}
    assert bench.find("one").info.claimed == ((Interface.POSITION.value, ("a",)),)
    bench.update()
    assert bench.switch(start="one")
    assert controller.calls == ["init", "starting"]
    bench.update()
    assert bench.switch(stop="one")
    assert controller.calls == ["init", "starting", "update", "update", "stopping"]
    bench.update()
    assert controller.calls[-1] == "stopping"
    assert bench.states() == {"one": "stopped"}
    assert bench.log == []


def test_joints_are_active_while_their_controller_runs(bench: Bench) -> None:
    bench.load("one")
    joint, other = bench.hardware.joints.values()
    bench.switch(start="one")
    assert (joint.active, other.active) == (Interface.POSITION, None)
    joint.velocity_command = joint.effort_command = 3.0
    bench.switch(stop="one")
    assert (joint.active, joint.velocity_command, joint.effort_command) == (None, 0.0, 0.0)


def test_start_forgets_an_old_position_command(bench: Bench) -> None:
    bench.load("one")
    joint = bench.hardware.joints["a"]
    joint.position, joint.position_command = 0.7, -2.0
    bench.switch(start="one")
    assert joint.position_command == 0.7


@pytest.mark.parametrize("position", [math.nan, math.inf])
def test_controller_is_not_started_while_the_position_of_its_joint_is_unknown(
    bench: Bench, position: float
) -> None:
    controller = bench.load("one")
    joint = bench.hardware.joints["a"]
    joint.position = position
    bench.switch(start="one")
    assert controller.calls == ["init"]
    assert (joint.active, joint.position_command) == (None, 0.5)
    assert bench.states() == {"one": "stopped"}
    assert bench.log == [f"8 Controller 'one' is not started: the position of joint 'a' is {position}"]
    joint.position = 0.6
    bench.switch(start="one")
    assert bench.states() == {"one": "running"}


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ControllerError("No joint given"), ["8 No joint given", "8 Failed to initialize the controller"]),
        (
            HardwareError("Could not find resource 'x' in 'y'."),
            ["8 Exception thrown while initializing controller 'one'.\nCould not find resource 'x' in 'y'."],
        ),
    ],
)
def test_init_that_fails_is_logged_and_closed(bench: Bench, error: Exception, lines: list[str]) -> None:
    controller = bench.load("one", faults={"init": error})
    assert bench.log == [*lines, "8 Initializing controller 'one' failed"]
    assert controller.calls == ["init", "close"]
    assert bench.states() == {}


def test_unknown_joint_has_ros_text(bench: Bench) -> None:
    bench.load("one", joints=("nope",))
    assert bench.log[0] == (
        "8 Exception thrown while initializing controller 'one'.\n"
        "Could not find resource 'nope' in 'hardware_interface::PositionJointInterface'."
    )


def test_missing_interface_has_ros_text(bench: Bench) -> None:
    bench.load("one", interfaces=(Interface.EFFORT,))
    assert bench.log == [
        "8 This controller requires a hardware interface of type 'hardware_interface::EffortJointInterface'. "
        "Make sure this is registered in the hardware_interface::RobotHW class.",
        "8 Initializing controller 'one' failed",
    ]


def test_fault_in_init_names_the_line(bench: Bench) -> None:
    bench.load("one", faults={"init": KeyError("p")})
    assert bench.log[0].startswith("8 Exception thrown while initializing controller 'one'.\nKeyError: 'p' (")
    assert f"{__file__}:" in bench.log[0]


def test_unload(bench: Bench) -> None:
    bench.load("one")
    bench.switch(start="one")
    assert bench.table.unload("one") is None
    assert bench.table.unload("two") is None
    assert bench.log == [
        "8 Could not unload controller with name 'one' because it is still running",
        "8 Could not unload controller with name 'two' because no controller with this name exists",
    ]
    bench.switch(stop="one")
    assert bench.table.unload("one")
    assert bench.states() == {}


def test_strict_switch_refuses_unknown_names(bench: Bench) -> None:
    bench.load("one")
    assert not bench.switch(start="one nope")
    assert not bench.switch(start="nope", stop="gone")
    assert bench.log == [
        "8 Could not start controller with name 'nope' because no controller with this name exists",
        "8 Could not stop controller with name 'gone' because no controller with this name exists",
    ]
    assert bench.states() == {"one": "initialized"}


def test_best_effort_switch_ignores_unknown_names(bench: Bench) -> None:
    bench.load("one")
    assert bench.switch(start="nope one", stop="gone", strictness=BEST_EFFORT)
    assert bench.states() == {"one": "running"}
    assert bench.log == []


def test_strictness_0_warns_and_is_best_effort(bench: Bench) -> None:
    assert bench.switch(start="nope", strictness=0)
    assert bench.log == [
        "4 Controller Manager: To switch controllers you need to specify a strictness level of "
        "controller_manager_msgs::SwitchController::STRICT (2) or ::BEST_EFFORT (1). Defaulting to ::BEST_EFFORT."
    ]


def test_double_start_and_stop(bench: Bench) -> None:
    controller = bench.load("one")
    assert not bench.switch(stop="one")
    assert bench.switch(stop="one", strictness=BEST_EFFORT)
    assert bench.switch(start="one")
    assert not bench.switch(start="one")
    assert bench.switch(start="one", strictness=BEST_EFFORT)
    assert bench.log == [
        "8 Could not stop controller 'one' since it is not running",
        "8 Controller 'one' is already running",
    ]
    # As in ROS, a best-effort start of a running controller calls starting() again, and tells the hardware nothing.
    assert controller.calls == ["init", "starting", "update", "starting"]
    assert bench.hardware.calls == [([], []), (["one"], []), ([], [])]


@pytest.mark.parametrize("strictness", [BEST_EFFORT, STRICT])
def test_start_and_stop_of_a_running_controller_conflict(bench: Bench, strictness: int) -> None:
    bench.load("one")
    bench.switch(start="one")
    assert not bench.switch(start="one", stop="one", strictness=strictness)
    assert bench.log == [f"8 Could no start or stop controller 'one' {CONFLICT}"]
    assert bench.states() == {"one": "running"}


def test_two_controllers_of_one_joint_conflict(bench: Bench) -> None:
    bench.load("one", joints=("a", "b"))
    bench.load("two", joints=("b",))
    assert not bench.switch(start="one two")
    bench.switch(start="one")
    assert not bench.switch(start="two")
    refusal = [
        "4 Resource conflict on [b].  Controllers = [one, two, ]",
        "8 Could not switch controllers, due to resource conflict",
    ]
    assert bench.log == refusal * 2
    assert bench.switch(start="two", stop="one")
    assert bench.states() == {"one": "stopped", "two": "running"}
    assert [joint.active for joint in bench.hardware.joints.values()] == [None, Interface.POSITION]


def test_hardware_refuses_a_switch(bench: Bench) -> None:
    bench.load("one")
    bench.hardware.can_switch = False
    assert not bench.switch(start="one")
    assert bench.log == [
        "8 Could not switch controllers. "
        "The hardware interface combination for the requested controllers is unfeasible."
    ]


def test_start_waits_for_the_hardware(bench: Bench) -> None:
    controller, done = bench.load("one"), []
    bench.hardware.result = SwitchState.ONGOING
    plan = bench.plan(start="one")
    assert plan
    plan.on_done = lambda: done.append(1)
    bench.table.begin(plan)
    bench.update()
    bench.update()
    assert bench.states() == {"one": "waiting"}
    assert bench.hardware.calls == [(["one"], [])]
    bench.hardware.result = SwitchState.DONE
    assert not done
    bench.update()
    bench.update()
    assert controller.calls == ["init", "waiting", "waiting", "starting", "update"]
    assert done == [1]


@pytest.mark.parametrize("result", [SwitchState.ERROR, SwitchState.ONGOING])
def test_start_is_aborted_by_an_error_or_a_timeout(bench: Bench, result: SwitchState) -> None:
    controller = bench.load("one")
    bench.hardware.result = result
    plan = bench.plan(start="one", timeout=2.0)
    assert plan
    bench.table.begin(plan)
    bench.update(1.9)
    bench.update(0.2)
    bench.hardware.result = SwitchState.DONE
    bench.update()
    assert bench.states() == {"one": "aborted"}
    assert controller.calls[-1] == "aborting"
    assert bench.hardware.joints["a"].active is None
    assert bench.switch(start="one")


def test_asap_starts_each_controller_when_its_joints_are_ready(bench: Bench) -> None:
    bench.load("one")
    bench.load("two", joints=("b",))
    bench.hardware.results = {"one": SwitchState.ONGOING}
    assert bench.switch(start="one two", start_asap=True)
    assert bench.states() == {"one": "waiting", "two": "running"}
    bench.hardware.results = {}
    bench.update()
    assert bench.states() == {"one": "running", "two": "running"}


def test_controller_that_raises_is_stopped_and_the_others_go_on(bench: Bench) -> None:
    bad = bench.load("bad")
    good = bench.load("good", joints=("b",))
    bench.switch(start="bad good")
    bad.faults = {"update": ZeroDivisionError("by zero")}
    bench.update()
    bench.update()
    assert bench.states() == {"bad": "stopped", "good": "running"}
    assert good.calls.count("update") == 2
    assert bad.calls[-2:] == ["update", "stopping"]
    assert [joint.active for joint in bench.hardware.joints.values()] == [None, Interface.POSITION]
    assert len(bench.log) == 1
    assert bench.log[0].startswith(
        f"8 Controller 'bad' is stopped: update raised ZeroDivisionError: by zero ({__file__}:"
    )


def test_controller_that_raises_in_starting_is_stopped(bench: Bench) -> None:
    bench.load("one", faults={"starting": RuntimeError()})
    assert bench.switch(start="one")
    assert bench.states() == {"one": "stopped"}
    assert bench.hardware.joints["a"].active is None
    assert "starting raised RuntimeError (" in bench.log[0]


@pytest.mark.parametrize("method", ["init", "starting", "update", "stopping", "close"])
def test_controller_that_exits_is_stopped_and_the_loop_goes_on(bench: Bench, method: str) -> None:
    bad = bench.load("bad", faults={method: SystemExit(3)})
    good = bench.load("good", joints=("b",))
    bench.switch(start="good")
    bench.switch(start="bad", strictness=BEST_EFFORT)
    bench.update()
    bench.switch(stop="bad", strictness=BEST_EFFORT)
    if unloaded := bench.table.unload("bad"):
        bench.table.close(unloaded)
    assert bench.hardware.joints["a"].active is None
    assert good.calls.count("update") == 3
    assert method in bad.calls
    assert any("SystemExit: 3" in line for line in bench.log)


def test_commands_that_a_failed_controller_sets_in_stopping_are_forgotten(bench: Bench) -> None:
    bad = bench.load("bad")
    joint = bench.hardware.joints["a"]
    bad.stopping = lambda time: setattr(joint, "velocity_command", 2.0)  # type: ignore[method-assign]
    bench.switch(start="bad")
    bad.faults = {"update": ValueError()}
    bench.update()
    assert (joint.active, joint.velocity_command) == (None, 0.0)


def test_reset_restarts_running_controllers(bench: Bench) -> None:
    running = bench.load("one")
    other = bench.load("two", joints=("b",))
    bench.switch(start="one")
    bench.update(reset_controllers=True)
    assert running.calls == ["init", "starting", "stopping", "starting", "update"]
    assert other.calls == ["init"]
    assert bench.hardware.joints["a"].active is Interface.POSITION


def test_withdrawn_switch_starts_nothing(bench: Bench) -> None:
    bench.load("one")
    plan = bench.plan(start="one")
    assert plan
    bench.table.begin(plan)
    assert bench.table.withdraw() is plan
    bench.update()
    assert bench.states() == {"one": "initialized"}
