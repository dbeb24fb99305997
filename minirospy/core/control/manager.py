"""The table of a robot's controllers: loads, unloads and switches them, with the decisions and messages of ROS.

Methods for services (:meth:`ControllerTable.load`, :meth:`ControllerTable.plan_switch`) run in one thread at a time;
:meth:`ControllerTable.update` runs in the loop's thread. Data passes between the two by the assignment of one attribute.
Source: http://wiki.ros.org/controller_manager, and the code of the noetic release.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from minirospy.base.log_levels import ERROR, WARN
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import (
    Controller,
    ControllerContext,
    ControllerError,
    ControllerState,
    Resources,
)
from minirospy.core.control.hardware import (
    COMMAND_INTERFACES,
    ControllerInfo,
    HardwareError,
    Interface,
    Joint,
    RobotHardware,
    SwitchState,
)

__all__ = ["BEST_EFFORT", "STRICT", "ControllerTable", "Loaded", "Switch", "describe_error"]

BEST_EFFORT, STRICT = 1, 2  # values of ``strictness`` in controller_manager_msgs/SwitchController

_LIBRARY = (os.path.dirname(os.__file__), "<frozen ")  # prefixes of the standard library's file names
_MINIROSPY = str(Path(__file__).parents[2])

_RAISED = (Exception, SystemExit)  # exceptions that user code may raise, including SystemExit from sys.exit()

Log = Callable[[int, str], object]
"""Called with a rosgraph_msgs/Log level and a line of text."""


@dataclass(slots=True, eq=False)
class Loaded:
    """A loaded controller and its state."""

    info: ControllerInfo
    controller: Controller
    joints: tuple[tuple[Joint, Interface], ...]
    """The joints that the controller commands while it is running."""
    state: ControllerState = ControllerState.INITIALIZED

    @property
    def is_running(self) -> bool:
        """Return whether the loop currently updates the controller."""
        return self.state is ControllerState.RUNNING


@dataclass(slots=True, eq=False)
class Switch:
    """A requested change to the set of running controllers. The loop performs the change."""

    start: Sequence[Loaded]
    stop: Sequence[Loaded]
    hardware_start: Sequence[ControllerInfo]  # controllers to start that are not running yet
    hardware_stop: Sequence[ControllerInfo]  # controllers to stop that are running
    start_asap: bool
    timeout: float  # maximum wait for the hardware in seconds; 0 or less: no limit
    requested: Time
    is_begun: bool = False  # True once the hardware has been asked to switch
    on_done: Callable[[], object] = lambda: None


class ControllerTable:
    """The loaded controllers of one robot, in loading order."""

    def __init__(self, hardware: RobotHardware, log: Log) -> None:
        self._hardware = hardware
        self._log = log
        self._switch: Switch | None = None
        self.loaded: tuple[Loaded, ...] = ()

    def find(self, name: str) -> Loaded | None:
        """Return a loaded controller, or None."""
        return next((each for each in self.loaded if each.info.name == name), None)

    def load(
        self, name: str, kind: str, create: Callable[[], Controller], context: ControllerContext
    ) -> Loaded | None:
        """Create, initialize and add a controller. On failure, log the reason and return None."""
        resources = Resources(self._hardware)
        controller: Controller | None = None
        try:
            controller = create()
            if missing := _missing_interface(controller, resources):
                self._log(ERROR, missing)
            else:
                controller.init(resources, context)
                return self._add(
                    ControllerInfo(name, kind, resources.claimed(controller.interfaces)), controller
                )
        except (ControllerError, ValueError) as error:
            self._log(ERROR, str(error))
            self._log(ERROR, "Failed to initialize the controller")
        except HardwareError as error:
            self._log(ERROR, f"Exception thrown while initializing controller '{name}'.\n{error}")
        except _RAISED as error:
            self._log(
                ERROR, f"Exception thrown while initializing controller '{name}'.\n{describe_error(error)}"
            )
        self._log(ERROR, f"Initializing controller '{name}' failed")
        if controller:
            self._close(controller, name)
        return None

    def unload(self, name: str) -> Loaded | None:
        """Remove a controller and return it; the caller closes it. On failure, log the reason and return None."""
        found = self.find(name)
        if found is None or found.is_running:
            why = "it is still running" if found else "no controller with this name exists"
            self._log(ERROR, f"Could not unload controller with name '{name}' because {why}")
            return None
        self.loaded = tuple(each for each in self.loaded if each is not found)
        return found

    def close(self, loaded: Loaded) -> None:
        """Close the topics of an unloaded controller, once the loop no longer updates it."""
        self._close(loaded.controller, loaded.info.name)

    def plan_switch(
        self,
        start: Sequence[str],
        stop: Sequence[str],
        strictness: int = BEST_EFFORT,
        start_asap: bool = False,
        timeout: float = 0.0,
        now: Time | None = None,
    ) -> Switch | None:
        """Return the change to pass to :meth:`begin`. If it is refused, log the reason and return None."""
        if strictness == 0:
            self._log(
                WARN,
                "Controller Manager: To switch controllers you need to specify a strictness level of "
                f"controller_manager_msgs::SwitchController::STRICT ({STRICT}) or ::BEST_EFFORT ({BEST_EFFORT}). "
                "Defaulting to ::BEST_EFFORT.",
            )
        is_strict = strictness == STRICT
        to_stop = self._named(stop, is_strict, "stop")
        to_start = None if to_stop is None else self._named(start, is_strict, "start")
        if to_start is None or to_stop is None:
            return None

        starting, stopping, together = [], [], []
        for each in self.loaded:
            is_stopped, is_started = each in to_stop, each in to_start
            name = each.info.name
            if is_stopped and not each.is_running:
                if is_strict:
                    self._log(ERROR, f"Could not stop controller '{name}' since it is not running")
                    return None
                is_stopped = False
            if is_started and each.is_running and not is_stopped:
                if is_strict:
                    self._log(ERROR, f"Controller '{name}' is already running")
                    return None
                is_started = False
            if is_started and is_stopped:
                # ROS's spelling: "no" instead of "not"
                self._log(
                    ERROR,
                    f"Could no start or stop controller '{name}' because of conflicting switching command",
                )
                return None

            if is_stopped:
                stopping.append(each.info)
            elif is_started:
                starting.append(each.info)
            if is_started or (each.is_running and not is_stopped):
                together.append(each.info)

        conflicts = self._hardware.find_conflicts(together)
        for conflict in conflicts:
            owners = "".join(f"{name}, " for name in conflict.controllers)
            self._log(WARN, f"Resource conflict on [{conflict.resource}].  Controllers = [{owners}]")
        if conflicts:
            self._log(ERROR, "Could not switch controllers, due to resource conflict")
            return None
        if not self._hardware.prepare_switch(starting, stopping):
            self._log(
                ERROR,
                "Could not switch controllers. "
                "The hardware interface combination for the requested controllers is unfeasible.",
            )
            return None
        return Switch(to_start, to_stop, starting, stopping, start_asap, timeout, now or Time())

    def begin(self, switch: Switch) -> None:
        """Schedule a change for the next update."""
        self._switch = switch

    def withdraw(self) -> Switch | None:
        """Cancel and return the change that the loop has not finished yet; return None if there is none."""
        switch, self._switch = self._switch, None
        return switch

    def update(self, time: Time, period: Duration, reset_controllers: bool = False) -> None:
        """Update the running controllers, after a restart if ``reset_controllers`` is set; then perform a requested change."""
        loaded = self.loaded
        if reset_controllers:
            for each in loaded:
                if each.state is ControllerState.RUNNING:
                    self._stop(each, time)
                    self._start(each, time)
        for each in loaded:
            if each.state is ControllerState.RUNNING:
                try:
                    each.controller.update(time, period)
                except _RAISED as error:
                    self._fail(each, "update", time, error)

        switch = self._switch
        if switch and self._advance(switch, time) and self._switch is switch:
            self._switch = None
            switch.on_done()

    def stop_all(self, time: Time) -> None:
        """Stop the running controllers, last loaded first, and release their joints."""
        for each in reversed(self.loaded):
            if each.is_running:
                self._stop(each, time)

    def _add(self, info: ControllerInfo, controller: Controller) -> Loaded:
        joints = tuple(
            (self._hardware.joints[name], interface)
            for interface in COMMAND_INTERFACES
            for claim in info.claimed
            if claim.interface == interface.value
            for name in claim.resources
        )
        added = Loaded(info, controller, joints)
        self.loaded = (*self.loaded, added)
        return added

    def _close(self, controller: Controller, name: str) -> None:
        try:
            controller.close()
        except _RAISED as error:
            self._log(ERROR, f"Controller '{name}' raised in close: {describe_error(error)}")

    def _named(self, names: Iterable[str], is_strict: bool, verb: str) -> list[Loaded] | None:
        """Return the controllers with these names. If a name is unknown, skip it, or return None if ``is_strict``."""
        found = []
        for name in names:
            if each := self.find(name):
                found.append(each)
            elif is_strict:
                why = "because no controller with this name exists"
                self._log(ERROR, f"Could not {verb} controller with name '{name}' {why}")
                return None
        return found

    def _advance(self, switch: Switch, time: Time) -> bool:
        """Stop and start the controllers for which the hardware is ready; return whether the change is complete."""
        if not switch.is_begun:
            self._hardware.do_switch(switch.hardware_start, switch.hardware_stop)
            switch.is_begun = True
        for each in switch.stop:
            if each.is_running:
                self._stop(each, time)

        is_late = switch.timeout > 0 and (time - switch.requested).to_sec() > switch.timeout
        if not switch.start_asap:
            result = self._hardware.switch_result()
            for each in switch.start:
                self._start_if_ready(each, result, is_late, time)
            return is_late or result is not SwitchState.ONGOING

        waiting = [
            each for each in switch.start if not (each.is_running or each.state is ControllerState.ABORTED)
        ]
        for each in waiting:
            self._start_if_ready(each, self._hardware.switch_result(each.info), is_late, time)
        return not any(each.state is ControllerState.WAITING for each in waiting)

    def _start_if_ready(self, each: Loaded, result: SwitchState, is_late: bool, time: Time) -> None:
        if result is SwitchState.DONE:
            self._start(each, time)
        elif result is SwitchState.ERROR or is_late:
            self._call(each, "aborting", ControllerState.ABORTED, time)
        else:
            self._call(each, "waiting", ControllerState.WAITING, time)

    def _start(self, each: Loaded, time: Time) -> None:
        for joint, interface in each.joints:
            if joint.active is not None:
                continue
            if math.isfinite(joint.position):
                joint.position_command = joint.position  # so that an old command does not move the joint
            elif interface not in (Interface.VELOCITY, Interface.EFFORT):
                each.state = ControllerState.STOPPED
                self._log(
                    ERROR,
                    f"Controller '{each.info.name}' is not started: the position of joint '{joint.name}' is {joint.position}",
                )
                return
        if self._call(each, "starting", ControllerState.RUNNING, time):
            for joint, interface in each.joints:
                joint.active = interface

    def _stop(self, each: Loaded, time: Time) -> None:
        self._call(each, "stopping", ControllerState.STOPPED, time)
        _release(each)

    def _call(self, each: Loaded, method: str, state: ControllerState, time: Time) -> bool:
        """Call a controller's method and set the controller's state. If it raises, stop the controller and return False."""
        try:
            getattr(each.controller, method)(time)
        except _RAISED as error:
            self._fail(each, method, time, error)
            return False
        each.state = state
        return True

    def _fail(self, each: Loaded, method: str, time: Time, error: BaseException) -> None:
        """Stop a controller that raised an exception, and release its joints. The other controllers keep running."""
        was_running, each.state = each.is_running, ControllerState.STOPPED
        self._log(ERROR, f"Controller '{each.info.name}' is stopped: {method} raised {describe_error(error)}")
        if was_running and method != "stopping":
            self._call(each, "stopping", ControllerState.STOPPED, time)
        _release(each)


def describe_error(error: BaseException) -> str:
    """Return an exception as one line, with the file and line number of the code that raised it."""
    text = " ".join(str(error).split())
    shown = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return f"{shown} ({place})" if (place := _place(error.__traceback__)) else shown


def _place(trace: TracebackType | None) -> str:
    """Return ``file:line`` of the innermost frame in the user's code, or else in minirospy."""
    frames = []
    while trace:
        file = trace.tb_frame.f_code.co_filename
        if not file.startswith(_LIBRARY):
            frames.append((file.startswith(_MINIROSPY), f"{file}:{trace.tb_lineno}"))
        trace = trace.tb_next
    users = [place for is_ours, place in frames if not is_ours]
    return (users or [place for _, place in frames] or [""])[-1]


def _missing_interface(controller: Controller, resources: Resources) -> str:
    """Return an error text if the robot lacks an interface that the controller needs, else an empty string."""
    try:
        for interface in controller.interfaces:
            resources.names(interface)
    except HardwareError as error:
        return str(error)
    return ""


def _release(each: Loaded) -> None:
    """Release a controller's joints: set velocity and effort commands to zero, and keep position commands."""
    for joint, _ in each.joints:
        joint.active = None
        joint.velocity_command = joint.acceleration_command = joint.effort_command = 0.0
