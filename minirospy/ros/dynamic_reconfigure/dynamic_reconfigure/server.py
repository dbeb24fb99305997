"""dynamic_reconfigure.server: lets other nodes change a node's parameters.

The server offers the latched topics ``~parameter_descriptions`` and ``~parameter_updates``, and the service
``~set_parameters``.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest

from minirospy import client as rospy
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import (
    ConfigType,
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
    Entry,
    Value,
    Values,
)
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.encoding import (
    Config,
    decode_config,
    encode_config,
    encode_description,
    extract_params,
    get_tree,
    initial_config,
)

if TYPE_CHECKING:
    from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
    from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv

__all__ = ["ConfigDescrMsg", "ConfigMsg", "ReconfigureSrv", "Server"]

# Python types allowed for each parameter type.
# An int is allowed for a double, because rosparam stores a number without a decimal point as an int.
_TYPES: dict[str, tuple[type, ...]] = {
    "int": (int,),
    "double": (float, int),
    "bool": (bool, int),
    "str": (str,),
}


class Server:
    """Serves a configuration.

    Calls ``callback(config, level)`` at the start and on each change. The callback returns the configuration.

    ``level`` combines the bits of all changed parameters; it is -1 in the first call. Values are clamped to the limits.
    """

    def __init__(
        self, type: ConfigType, callback: Callable[[Config, int], Config | None], namespace: str = ""
    ) -> None:
        """Start serving. ``type`` is the module package.cfg.NAMEConfig.

        ``namespace`` is appended to the node's name to form the namespace of the topics and the service. Raise
        DynamicReconfigureCallbackException if the callback returns None. Exceptions from the callback are propagated.
        """
        self.mutex = threading.Lock()
        if not namespace or namespace == "~":
            self.ns = "~"
        else:
            self.ns = (namespace if namespace[0] in "/~" else f"~{namespace}").rstrip("/") + "/"
        self.type = type
        self.callback = callback
        self._params: list[Entry] = extract_params(type.config_description)
        self.description = encode_description(type)

        config = Config(type.defaults)
        self._copy_from_parameter_server(config)
        self._clamp(config)
        config["groups"] = get_tree(self.description)
        self.config: Config = initial_config(encode_config(config), type.config_description)

        self.descr_topic = rospy.Publisher(
            self.ns + "parameter_descriptions", ConfigDescription, latch=True, queue_size=10
        )
        self.descr_topic.publish(self.description)
        self.update_topic = rospy.Publisher(
            self.ns + "parameter_updates", ConfigMsg, latch=True, queue_size=10
        )
        self._change_config(self.config, ~0)
        self.set_service = rospy.Service(self.ns + "set_parameters", Reconfigure, self._set_callback)

    def update_configuration(self, changes: Values) -> Config:
        """Change values; return the configuration that the callback returns. Exceptions from the callback propagate."""
        with self.mutex:
            config = copy.deepcopy(self.config)
            config.update(changes)
            self._check_types(config)
            self._clamp(config)
            return self._change_config(config, self._calc_level(config, self.config))

    def _set_callback(self, request: ReconfigureRequest) -> ConfigMsg:
        changes = decode_config(request.config, self.type.config_description)
        return encode_config(self.update_configuration(changes))

    def _copy_from_parameter_server(self, config: Config) -> None:
        """Load the values from the parameter server; log an error for each value of the wrong type."""
        for param in self._params:
            name = param["name"]
            value = rospy.get_param(self.ns + name, None)
            if value is None:
                continue
            if _fits(param, value):
                config[name] = _converted(param, value)
            else:
                rospy.logerr(
                    "Parameter %s is %r, not of type %s: using its default, %r",
                    rospy.resolve_name(self.ns + name),
                    value,
                    param["type"],
                    config[name],
                )

    def _copy_to_parameter_server(self) -> None:
        for param in self._params:
            rospy.set_param(self.ns + param["name"], self.config[param["name"]])

    def _check_types(self, config: Config) -> None:
        for param in self._params:
            name, value = param["name"], config[param["name"]]
            if not _fits(param, value):
                raise DynamicReconfigureParameterException(
                    f"can't set parameter '{name}' of type {param['type']} to {value!r}"
                )
            config[name] = _converted(param, value)

    def _change_config(self, config: Config, level: int) -> Config:
        changed = self.callback(config, level)
        if changed is None:
            text = "Reconfigure callback should return a possibly updated configuration."
            rospy.logerr(text)
            raise DynamicReconfigureCallbackException(text)
        self.config = changed
        self._copy_to_parameter_server()
        self.update_topic.publish(encode_config(changed))
        return changed

    def _calc_level(self, config1: Values, config2: Values) -> int:
        level = 0
        for param in self._params:
            if config1[param["name"]] != config2[param["name"]]:
                level |= param["level"]
        return level

    def _clamp(self, config: Config) -> None:
        for param in self._params:
            name = param["name"]
            least, greatest = self.type.min[name], self.type.max[name]
            if greatest != "" and config[name] > greatest:
                config[name] = greatest
            elif least != "" and config[name] < least:
                config[name] = least


def _fits(param: Entry, value: object) -> bool:
    """Return whether the value's type is allowed for a parameter."""
    allowed = _TYPES.get(param["type"])
    if allowed is None:
        return True
    return isinstance(value, allowed) and (bool in allowed or not isinstance(value, bool))


def _converted(param: Entry, value: Value) -> Value:
    """Convert a value to the Python type that its message field requires."""
    if param["type"] == "double":
        return float(value)
    return bool(value) if param["type"] == "bool" else value
