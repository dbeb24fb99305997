"""dynamic_reconfigure.client: read and change the parameters of another node."""

from __future__ import annotations

import ast
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription
from dynamic_reconfigure.srv import Reconfigure

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeCondition
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
    Entry,
    Values,
)
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.encoding import (
    Config,
    decode_config,
    decode_description,
    encode_config,
    extract_params,
)

if TYPE_CHECKING:
    from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
    from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv

__all__ = ["Client", "ConfigDescrMsg", "ConfigMsg", "ReconfigureSrv"]

_SLICE_SECONDS = 0.25  # seconds between checks for a shutdown of the node

_TYPES: dict[str, type] = {"int": int, "double": float, "str": str, "bool": bool}
_TRUE = ("yes", "true", "t", "1")

ConfigCallback = Callable[[Config | None], object]
DescriptionCallback = Callable[[list[Entry] | None], object]


class Client:
    """A client that reads and changes a server's configuration, usually in another node."""

    def __init__(
        self,
        name: str,
        timeout: float | None = None,
        config_callback: ConfigCallback | None = None,
        description_callback: DescriptionCallback | None = None,
    ) -> None:
        """Wait up to ``timeout`` seconds for the server ``name`` (None or 0: no timeout).

        ``config_callback(config)`` is called on each change. Raise ROSException if the server does not appear in time.
        """
        if not isinstance(name, str):
            # Without this check, the client could wait forever, for a server whose name cannot exist.
            raise TypeError(f"the name of a server is a string, not {name!r}")
        self.name = name
        self.config: Config | None = None
        self.param_description: list[Entry] | None = None
        self.group_description: Config | None = None
        self._param_types: dict[str, type] = {}
        self._changed = SignalSafeCondition()
        self._config_callback = config_callback
        self._description_callback = description_callback

        service = rospy.resolve_name(f"{name}/set_parameters")
        _wait_for(service, timeout)
        self._set_service = rospy.ServiceProxy(service, Reconfigure)
        self._descriptions_sub = rospy.Subscriber(
            rospy.resolve_name(f"{name}/parameter_descriptions"), ConfigDescription, self._descriptions_msg
        )
        self._updates_sub = rospy.Subscriber(
            rospy.resolve_name(f"{name}/parameter_updates"), ConfigMsg, self._updates_msg
        )

    def get_configuration(self, timeout: float | None = None) -> Config | None:
        """Return the server's latest configuration; wait if none has arrived.

        Return None after ``timeout`` seconds or at shutdown.
        """
        if not timeout:
            if not self._wait(lambda: self.config is not None, 1.0):
                print("Waiting for configuration...", file=sys.stderr)
            timeout = None
        self._wait(lambda: self.config is not None, timeout)
        return self.config

    def get_parameter_descriptions(self, timeout: float | None = None) -> list[Entry] | None:
        """Return the server's parameter descriptions, or None after ``timeout`` seconds or at shutdown."""
        self._wait(lambda: self.param_description is not None, timeout)
        return self.param_description

    def get_group_descriptions(self, timeout: float | None = None) -> Config | None:
        """Return the server's tree of groups, or None after ``timeout`` seconds or at shutdown."""
        self._wait(lambda: self.group_description is not None, timeout)
        return self.group_description

    def update_configuration(self, changes: Values) -> Config:
        """Change values at the server; return the resulting configuration.

        Strings are converted to the parameter's type; for an enum parameter, the name of a constant is accepted.
        Raise DynamicReconfigureParameterException for an unknown parameter or an invalid value,
        DynamicReconfigureCallbackException if the server failed or has disappeared.
        """
        descriptions = self.get_parameter_descriptions() or []
        by_name = {each["name"]: each for each in descriptions}
        config: dict[str, object] = {}
        for name, value in changes.items():
            if name == "groups":
                config[name] = self.update_groups(value)
            elif name in by_name:
                config[name] = self._converted(by_name[name], value)
            else:
                raise DynamicReconfigureParameterException(f"don't know parameter: {name}")

        try:
            answer = self._set_service(encode_config(config)).config
        except rospy.ServiceException as error:
            raise DynamicReconfigureCallbackException("service call failed") from error
        return decode_config(answer, self.get_group_descriptions())

    def update_groups(self, changes: Values) -> Config | None:
        """Return the server's tree of groups with changed states, without sending it. ``changes`` maps group names to states."""
        description = self.get_group_descriptions()
        groups = [description] if description else []
        while groups:
            for each in groups.pop()["groups"].values():
                state = changes.get(each["name"])
                each["state"] = state if isinstance(state, bool) else each["state"]
                groups.append(each)
        return description

    def close(self) -> None:
        """Close the connections to the server."""
        self._descriptions_sub.unregister()
        self._updates_sub.unregister()

    def get_config_callback(self) -> ConfigCallback | None:
        """Return the callback for configuration changes."""
        return self._config_callback

    def set_config_callback(self, value: ConfigCallback | None) -> None:
        """Set the callback for configuration changes, and call it with the current configuration."""
        self._config_callback = value
        if value is not None:
            value(self.config)

    config_callback = property(get_config_callback, set_config_callback)

    def get_description_callback(self) -> DescriptionCallback | None:
        """Return the callback for parameter descriptions."""
        return self._description_callback

    def set_description_callback(self, value: DescriptionCallback | None) -> None:
        """Set the callback for parameter descriptions, and call it with the current descriptions."""
        self._description_callback = value
        if value is not None:
            value(self.param_description)

    description_callback = property(get_description_callback, set_description_callback)

    def _wait(self, is_there: Callable[[], bool], timeout: float | None) -> bool:
        """Wait until ``is_there()`` is true; return its last result.

        If ``timeout`` is None or 0, wait until the node shuts down.
        """
        end = time.monotonic() + timeout if timeout else None
        while not is_there() and not rospy.is_shutdown():
            left = _SLICE_SECONDS if end is None else min(_SLICE_SECONDS, end - time.monotonic())
            if left <= 0:
                break
            self._changed.wait_for(is_there, left)
        return is_there()

    def _updates_msg(self, msg: ConfigMsg) -> None:
        self.config = config = decode_config(msg, self.get_group_descriptions())
        self._changed.notify_all()
        if self._config_callback is not None:
            self._config_callback(config)

    def _descriptions_msg(self, msg: ConfigDescription) -> None:
        groups = decode_description(msg)
        params = extract_params(groups)
        self._param_types = {each["name"]: self._param_type_from_string(each["type"]) for each in params}
        self.group_description, self.param_description = groups, params
        self._changed.notify_all()
        if self._description_callback is not None:
            self._description_callback(params)

    def _param_type_from_string(self, type_str: str) -> type:
        if type_str not in _TYPES:
            raise DynamicReconfigureParameterException(
                f"parameter has unknown type: {type_str}. This is a bug in dynamic_reconfigure."
            )
        return _TYPES[type_str]

    def _converted(self, description: Entry, value: object) -> object:
        """Return a value converted to a parameter's type."""
        name = description["name"]
        wanted = self._param_types[name]
        if isinstance(value, str):
            if wanted is bool:
                return value.lower() in _TRUE
            for constant in _constants(description["edit_method"]):
                if value.lower() == str(constant.get("name")).lower():
                    return self._param_type_from_string(constant["type"])(constant["value"])
        try:
            return wanted(value)
        except (TypeError, ValueError, OverflowError) as error:
            raise DynamicReconfigureParameterException(
                f"can't set parameter '{name}' of {wanted}: {error}"
            ) from error


def _constants(edit_method: str) -> list[dict[str, Any]]:
    """Return an enum's constants.

    ``edit_method`` is Python source from another node, so parse it without executing it.
    """
    try:
        found = ast.literal_eval(edit_method)["enum"] if edit_method else []
    except (ValueError, SyntaxError, KeyError, TypeError, MemoryError, RecursionError):
        return []
    return [each for each in found if isinstance(each, dict)]


def _wait_for(service: str, timeout: float | None) -> None:
    """Wait for a service. Raise ROSException after ``timeout`` seconds, or if the node shuts down."""
    if timeout:
        rospy.wait_for_service(service, timeout)
        return
    try:
        rospy.wait_for_service(service, 1.0)
    except rospy.ROSException:
        if rospy.is_shutdown():
            raise
        print(f"Waiting for service {service}...", file=sys.stderr)
        rospy.wait_for_service(service)
