"""Find controller managers, list and filter their controllers, and find the parameters of controllers.

Source: http://docs.ros.org/en/noetic/api/controller_manager_msgs/html/.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.srv import ListControllers

from minirospy.client import ROSException, ServiceException, ServiceProxy
from minirospy.ros.rosparam.rosparam import list_params
from minirospy.ros.rosservice.rosservice import ROSServiceIOException, get_service_list, get_service_type

__all__ = [
    "ControllerLister",
    "ControllerManagerLister",
    "cm_services",
    "filter_by_hardware_interface",
    "filter_by_name",
    "filter_by_resources",
    "filter_by_state",
    "filter_by_type",
    "get_controller_managers",
    "get_rosparam_controller_names",
    "is_controller_manager",
]

_LIST = "list_controllers"

cm_services = {
    _LIST: "controller_manager_msgs/ListControllers",
    "list_controller_types": "controller_manager_msgs/ListControllerTypes",
    "load_controller": "controller_manager_msgs/LoadController",
    "unload_controller": "controller_manager_msgs/UnloadController",
    "switch_controller": "controller_manager_msgs/SwitchController",
    "reload_controller_libraries": "controller_manager_msgs/ReloadControllerLibraries",
}
"""The services of a controller manager, each with its type."""

Controllers = Iterable[ControllerState]


def get_controller_managers(namespace: str = "/", initial_guess: Sequence[str] | None = None) -> list[str]:
    """Return the sorted namespaces of controller managers, such as ``/controller_manager``, below a namespace.

    ``initial_guess``: an earlier result; checking its managers again takes fewer calls.
    """
    present = _namespaces_with_list(namespace)
    known = [each for each in initial_guess or () if each in present]
    return sorted(known + [each for each in present if each not in known and is_controller_manager(each)])


def is_controller_manager(namespace: str) -> bool:
    """Return whether a namespace offers all services of a controller manager."""
    prefix = namespace if namespace.endswith("/") else namespace + "/"
    return all(get_service_type(prefix + name) == kind for name, kind in cm_services.items())


def _namespaces_with_list(namespace: str) -> list[str]:
    try:
        services = get_service_list(namespace=namespace)
    except ROSServiceIOException:
        return []
    return [name.split(f"/{_LIST}")[0] or "/" for name in services if f"/{_LIST}" in name]


class ControllerManagerLister:
    """Callable that returns the controller managers below a namespace; repeated calls are cheaper."""

    def __init__(self, namespace: str = "/") -> None:
        self._namespace = namespace
        self._found: list[str] = []

    def __call__(self) -> list[str]:
        self._found = get_controller_managers(self._namespace, self._found)
        return self._found


class ControllerLister:
    """Callable that returns a manager's controllers; the list is empty if the manager is not running."""

    def __init__(self, namespace: str = "/controller_manager") -> None:
        self._name = f"{namespace}/{_LIST}"
        self._service = self._connect()

    def __call__(self) -> list[ControllerState]:
        for _ in range(2):
            try:
                return list(self._service().controller)
            except (ServiceException, ROSException):
                self._service = self._connect()
        return []

    def _connect(self) -> ServiceProxy[ListControllers]:
        return ServiceProxy(self._name, ListControllers, persistent=True)


def filter_by_name(
    ctrl_list: Controllers, ctrl_name: str, match_substring: bool = False
) -> list[ControllerState]:
    """Return the controllers whose name is ``ctrl_name`` or, with ``match_substring``, contains it."""
    return _filter(ctrl_list, "name", ctrl_name, match_substring)


def filter_by_type(
    ctrl_list: Controllers, ctrl_type: str, match_substring: bool = False
) -> list[ControllerState]:
    """Return the controllers whose type is ``ctrl_type`` or, with ``match_substring``, contains it."""
    return _filter(ctrl_list, "type", ctrl_type, match_substring)


def filter_by_state(
    ctrl_list: Controllers, ctrl_state: str, match_substring: bool = False
) -> list[ControllerState]:
    """Return the controllers whose state is ``ctrl_state`` or, with ``match_substring``, contains it."""
    return _filter(ctrl_list, "state", ctrl_state, match_substring)


def filter_by_hardware_interface(
    ctrl_list: Controllers, hardware_interface: str, match_substring: bool = False
) -> list[ControllerState]:
    """Return the controllers that use a hardware interface whose name equals, or contains, a string."""
    return [
        each
        for each in ctrl_list
        if any(
            _matches(claim.hardware_interface, hardware_interface, match_substring)
            for claim in each.claimed_resources
        )
    ]


def filter_by_resources(
    ctrl_list: Controllers,
    resources: Sequence[str],
    hardware_interface: str | None = None,
    match_any: bool = False,
) -> list[ControllerState]:
    """Return the controllers that claim all these resources through the given hardware interface (None: through any one).

    ``match_any``: one matching resource is enough.
    """
    enough = any if match_any else all
    return [
        each
        for each in ctrl_list
        if any(
            enough(name in claim.resources for name in resources)
            for claim in each.claimed_resources
            if hardware_interface in (None, claim.hardware_interface)
        )
    ]


def get_rosparam_controller_names(namespace: str = "/") -> list[str]:
    """Return the sorted names of the controllers in a namespace, recognized by their parameter ``NAME/type``."""
    prefix = namespace if namespace.endswith("/") else namespace + "/"
    below = [name.split(prefix, 1)[1].split("/") for name in list_params(namespace) if prefix in name]
    return sorted(parts[0] for parts in below if len(parts) == 2 and parts[1] == "type")


def _filter(controllers: Controllers, attribute: str, text: str, is_part: bool) -> list[ControllerState]:
    return [each for each in controllers if _matches(getattr(each, attribute), text, is_part)]


def _matches(value: str, text: str, is_part: bool) -> bool:
    return text in value if is_part else value == text
