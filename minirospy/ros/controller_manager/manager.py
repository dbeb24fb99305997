"""The controller manager of a node: its services NS/controller_manager/..., and :meth:`ControllerManager.update`.

Source: http://wiki.ros.org/controller_manager.
"""

from __future__ import annotations

import functools
import threading
import time as wall

from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources
from controller_manager_msgs.srv import (
    ListControllers,
    ListControllersResponse,
    ListControllerTypes,
    ListControllerTypesResponse,
    LoadController,
    ReloadControllerLibraries,
    SwitchController,
    SwitchControllerRequest,
    UnloadController,
)

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import UrdfError
from minirospy.base.log_levels import DEBUG, ERROR, FATAL, INFO, WARN
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError
from minirospy.core.control.controller import ControllerState as State
from minirospy.core.control.hardware import RobotHardware
from minirospy.core.control.manager import BEST_EFFORT, ControllerTable
from minirospy.core.control.parameters import Parameters
from minirospy.core.urdf.model import Robot
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.controller_manager.plugins import Plugin, PluginError, find_plugins, forget_modules

__all__ = ["ControllerManager", "find_description", "log", "read_robot"]

_LOG = {
    DEBUG: rospy.logdebug,
    INFO: rospy.loginfo,
    WARN: rospy.logwarn,
    ERROR: rospy.logerr,
    FATAL: rospy.logfatal,
}
_EXTRA_SECONDS = 1.0  # maximum seconds that a switch waits beyond its timeout for a stopped loop, as in ROS
_BASE_CLASS = "controller_interface::ControllerBase"


def log(level: int, line: str) -> None:
    """Log a line at a rosgraph_msgs/Log level."""
    _LOG[level]("%s", line)


class ControllerManager:
    """Loads, starts and stops the controllers of one robot, as requested through the services that it offers.

    The node calls :meth:`update` in each cycle of its loop, between ``hardware.read`` and ``hardware.write``, as
    :func:`controller_manager.run` does. A service that changes controllers returns after the loop's next update.
    ``namespace``: for the services and controllers; by default the node's namespace.
    """

    def __init__(self, hardware: RobotHardware, namespace: str = "") -> None:
        """Offer the services. Raise ROSInitException if init_node has not been called."""
        self.hardware = hardware
        self.namespace = "/" + rospy.resolve_name(namespace or rospy.get_namespace()).strip("/")
        self.table = ControllerTable(hardware, log)
        self._plugins: dict[str, Plugin] | None = None
        self._lock = threading.RLock()  # held during each service call
        self._waiting: list[threading.Event] = []  # events to set at the end of the next update
        self._has_updated = False
        self._is_closed = False

        handlers = (
            (ListControllers, "list_controllers", lambda _: self._list()),
            (ListControllerTypes, "list_controller_types", lambda _: self._list_types()),
            (LoadController, "load_controller", lambda request: self.load(request.name)),
            (UnloadController, "unload_controller", lambda request: self.unload(request.name)),
            (SwitchController, "switch_controller", self._on_switch),
            (
                ReloadControllerLibraries,
                "reload_controller_libraries",
                lambda request: self._reload(request.force_kill),
            ),
        )
        self._services = [
            rospy.Service(f"{self._below(self.namespace, 'controller_manager')}/{name}", kind, handler)
            for kind, name, handler in handlers
        ]

    def update(self, time: Time, period: Duration, reset_controllers: bool = False) -> None:
        """Update the running controllers, then start and stop the controllers that services have requested.

        ``reset_controllers``: restart the running controllers first, for example after a simulation reset.
        """
        self.table.update(time, period, reset_controllers)
        self._has_updated = True
        while self._waiting:
            self._waiting.pop().set()

    def load(self, name: str) -> bool:
        """Load the controller with the parameters in NAMESPACE/name; return whether that succeeded. Failures are logged."""
        with self._lock:
            if self._is_closed:
                return False
            if self.table.find(name):
                log(ERROR, f"A controller named '{name}' was already loaded inside the controller manager")
                return False
            if problem := _invalid_name(name):
                log(
                    ERROR,
                    f"Exception thrown while constructing nodehandle for controller with name '{name}':\n{problem}",
                )
                return False
            namespace = name.rstrip("/") if name.startswith("/") else self._below(self.namespace, name)
            values = rospy.get_param(namespace, {})
            parameters = Parameters(namespace, values if isinstance(values, dict) else {})
            kind = parameters.get("type")
            if not isinstance(kind, str):
                log(
                    ERROR,
                    f"Could not load controller '{name}' because the type was not specified. Did you load the controller "
                    f"configuration on the parameter server (namespace: '{namespace}')?",
                )
                return False
            if not (found := self._find_class(name, kind)):
                return False
            robot = functools.cache(lambda: read_robot(self.namespace))
            context = ControllerContext(namespace, self.namespace, name, parameters, robot)
            return self.table.load(name, kind, found, context) is not None and self._wait_for_update()

    def unload(self, name: str) -> bool:
        """Unload a stopped controller; return whether that succeeded. Failures are logged."""
        with self._lock:
            if self._is_closed or not (found := self.table.unload(name)) or not self._wait_for_update():
                return False
            self.table.close(found)
            return True

    def switch(
        self,
        start: list[str],
        stop: list[str],
        strictness: int = BEST_EFFORT,
        start_asap: bool = False,
        timeout: float = 0.0,
    ) -> bool:
        """Start and stop controllers in the next update and wait for it; return whether that succeeded. Failures are logged.

        As in ROS, a start that the hardware aborts counts as a success. A start that fails in the controller does not, unlike in
        ROS. Wait without limit if ``timeout`` is 0, else for ``timeout`` plus one second.
        """
        with self._lock:
            if self._is_closed:
                return False
            plan = self.table.plan_switch(start, stop, strictness, start_asap, timeout, rospy.Time.now())
            if plan is None:
                return False
            done = SignalSafeEvent()
            plan.on_done = done.set
            self.table.begin(plan)
            end = None if timeout == 0 else wall.monotonic() + timeout + _EXTRA_SECONDS
            with rospy.interrupting(done.set):
                is_done = done.wait(None if end is None else end - wall.monotonic())
            if not is_done:
                self.table.withdraw()
            has_failed = any(each.state is State.STOPPED for each in plan.start)
            return is_done and not has_failed and not rospy.is_down() and not self._is_closed

    def stop(self, time: Time) -> None:
        """Stop all controllers and refuse further requests. Call this in the loop's thread or after the loop. Idempotent.

        Afterwards, a last ``hardware.write`` can stop the joints, before :meth:`close` calls the master and the controllers'
        code.
        """
        self._is_closed = True
        if pending := self.table.withdraw():
            pending.on_done()
        self.table.stop_all(time)
        while self._waiting:
            self._waiting.pop().set()

    def close(self, time: Time) -> None:
        """Stop and close all controllers, and shut down the services. Idempotent, like :meth:`stop`."""
        self.stop(time)
        loaded, self.table.loaded = self.table.loaded, ()
        for each in reversed(loaded):
            self.table.close(each)
        if not rospy.is_shutdown_requested():  # during a shutdown, rospy unregisters all services at once
            for service in self._services:
                service.shutdown("the controller manager is closed")

    def unregister(self) -> None:
        """Unregister the services after :meth:`close`, so that another controller manager in this node can use the namespace."""
        for service in self._services:
            service.shutdown()

    def _wait_for_update(self) -> bool:
        """Wait until a started loop has used the changed controller table; return False if closed or if the node shuts down."""
        if self._has_updated and not self._is_closed:
            updated = SignalSafeEvent()
            self._waiting.append(updated)
            with rospy.interrupting(updated.set):
                updated.wait()
        return not rospy.is_down() and not self._is_closed

    def _find_class(self, name: str, kind: str) -> type[Controller] | None:
        """Return the class of a controller type. On failure, log the reason and return None."""
        if (plugin := self._types().get(kind)) is not None:
            try:
                return plugin.load()
            except PluginError as error:
                log(ERROR, f"Could not load class '{kind}': {error}")
        log(ERROR, f"Could not load controller '{name}' because controller type '{kind}' does not exist.")
        log(
            ERROR, "Use 'rosservice call controller_manager/list_controller_types' to get the available types"
        )
        return None

    def _types(self) -> dict[str, Plugin]:
        if self._plugins is None:
            self._plugins = find_plugins()
        return self._plugins

    def _list(self) -> ListControllersResponse:
        with self._lock:
            return ListControllersResponse(
                [
                    ControllerState(
                        each.info.name,
                        each.state.value,
                        each.info.type,
                        [
                            HardwareInterfaceResources(claim.interface, list(claim.resources))
                            for claim in each.info.claimed
                        ],
                    )
                    for each in self.table.loaded
                ]
            )

    def _list_types(self) -> ListControllerTypesResponse:
        with self._lock:
            types = sorted(self._types())
            return ListControllerTypesResponse(types, [_BASE_CLASS] * len(types))

    def _on_switch(self, request: SwitchControllerRequest) -> bool:
        return self.switch(
            request.start_controllers,
            request.stop_controllers,
            request.strictness,
            request.start_asap,
            request.timeout,
        )

    def _reload(self, force_kill: bool) -> bool:
        with self._lock:
            cannot = "Controller manager: Cannot reload controller libraries because"
            names = [each.info.name for each in self.table.loaded]
            if names and not force_kill:
                log(ERROR, f"{cannot} there are still {len(names)} controllers running")
                return False
            if names:
                log(INFO, "Controller manager: Killing all running controllers")
                if not self.switch([], names, BEST_EFFORT):
                    log(ERROR, f"{cannot} failed to stop running controllers")
                    return False
                for name in names:
                    if not self.unload(name):
                        log(ERROR, f"{cannot} failed to unload controller '{name}'")
                        return False
            forget_modules((self._plugins or {}).values())
            self._plugins = None
            log(INFO, f"Controller manager: reloaded controller libraries for '{_BASE_CLASS}'")
            return True

    @staticmethod
    def _below(namespace: str, name: str) -> str:
        return f"{namespace.rstrip('/')}/{name.strip('/')}".rstrip("/") or "/"


def find_description(namespace: str, name: str = "robot_description") -> str | None:
    """Return the parameter ``name`` from a namespace or from its closest ancestor that has this parameter, or None."""
    while True:
        namespace = namespace.rstrip("/")
        text = rospy.get_param(f"{namespace}/{name}", None)
        if isinstance(text, str):
            return text
        if not namespace:
            return None
        namespace = namespace.rpartition("/")[0]


def read_robot(namespace: str, name: str = "robot_description") -> Robot:
    """Return the robot described by a parameter in a namespace or its parents. Raise ControllerError if there is no valid one."""
    text = find_description(namespace, name)
    if text is None:
        raise ControllerError(f"Could not find parameter {name} on parameter server")
    try:
        return parse_robot(text, name)
    except UrdfError as error:
        raise ControllerError(str(error)) from error


def _invalid_name(name: str) -> str:
    """Return roscpp's error text for an invalid graph name, or an empty string."""
    for number, character in enumerate(name):
        is_letter = character.isascii() and (character.isalpha() or character == "/")
        if number == 0 and not is_letter:
            return (
                f"Character [{character}] is not valid as the first character in Graph Resource Name [{name}].  "
                "Valid characters are a-z, A-Z, / and in some cases ~."
            )
        if not (is_letter or character == "_" or (character.isascii() and character.isdigit())):
            return (
                f"Character [{character}] at element [{number}] is not valid in Graph Resource Name [{name}].  "
                "Valid characters are a-z, A-Z, 0-9, / and _."
            )
    return ""
