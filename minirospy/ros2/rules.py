"""The mapping of types and their fields between ROS 1 and ROS 2. Pure.

Most types have the same name and fields on both sides. Special cases are listed here. Users can add more in a file in the
format of ros1_bridge's mapping rules. Source: https://github.com/ros2/ros1_bridge/blob/master/doc/index.rst.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import yaml

from minirospy.base.errors import BridgeError
from minirospy.base.yaml_text import safe_load

__all__ = ["BUILT_IN", "Rules", "TypeRule", "parse_rules", "snake_case"]


@dataclass(frozen=True)
class TypeRule:
    """The differences between a ROS 1 type and the corresponding ROS 2 type.

    ``names`` are its possible names in ROS 2, as ``pkg/Name``. ``fields`` maps all forwarded fields to ROS 2's fields. If
    ``fields`` is None, fields are matched by name, except for ``only_ros1`` and ``only_ros2``, which the other side
    lacks. ``inlined`` is a field that ROS 2 replaces by the fields it contains.
    """

    names: tuple[str, ...] = ()
    fields: Mapping[str, str] | None = None
    only_ros1: frozenset[str] = frozenset()
    only_ros2: frozenset[str] = frozenset()
    inlined: str = ""


_NO_RULE = TypeRule()


@dataclass(frozen=True)
class Rules:
    """The rules for messages, services and actions, keyed by ``pkg/Name``.

    The requests and responses of services, and the goals, results and feedback of actions, count as messages, with ROS 1's
    names.
    """

    messages: Mapping[str, TypeRule] = field(default_factory=dict)
    services: Mapping[str, TypeRule] = field(default_factory=dict)
    actions: Mapping[str, TypeRule] = field(default_factory=dict)

    def message(self, ros1_type: str) -> TypeRule:
        """Return the rule for a message type, or an empty rule if there is none."""
        return self.messages.get(ros1_type, _NO_RULE)

    def ros2_messages(self, ros1_type: str) -> tuple[str, ...]:
        """Return the names that a ROS 1 message type may have in ROS 2."""
        return self.message(ros1_type).names or (ros1_type,)

    def ros1_message(self, ros2_type: str) -> str:
        """Return the ROS 1 type for a ROS 2 message type: the type stated in a rule, or the type of the same name."""
        if not self.message(ros2_type).names:
            kept = [name for name, rule in self.messages.items() if ros2_type in rule.names]
            other = [name for name in kept if name.partition("/")[0] != "tf"]
            return other[0] if other else ros2_type
        return ros2_type

    def ros2_services(self, ros1_type: str) -> tuple[str, ...]:
        """Return the names that a ROS 1 service type may have in ROS 2."""
        return self.services.get(ros1_type, _NO_RULE).names or (ros1_type,)

    def ros2_actions(self, ros1_type: str) -> tuple[str, ...]:
        """Return the names that a ROS 1 action type may have in ROS 2."""
        return self.actions.get(ros1_type, _NO_RULE).names or (ros1_type,)

    def ros1_actions(self, ros2_type: str) -> tuple[str, ...]:
        """Return the names that a ROS 2 action type may have in ROS 1."""
        return _of_ros1(self.actions, ros2_type)

    def ros1_services(self, ros2_type: str) -> tuple[str, ...]:
        """Return the names that a ROS 2 service type may have in ROS 1."""
        return _of_ros1(self.services, ros2_type)

    def with_(self, other: Rules) -> Rules:
        """Return these rules combined with ``other``, whose rules take precedence."""
        return Rules(
            {**self.messages, **other.messages},
            {**self.services, **other.services},
            {**self.actions, **other.actions},
        )


def _of_ros1(rules: Mapping[str, TypeRule], ros2_type: str) -> tuple[str, ...]:
    renamed = [name for name, rule in rules.items() if ros2_type in rule.names]
    kept = [] if rules.get(ros2_type, _NO_RULE).names else [ros2_type]
    return (*kept, *renamed)


def snake_case(name: str) -> str:
    """Convert a field name to ROS 2's style: ``seqNumber`` becomes ``seq_number``."""
    parts = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name)
    return re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1_\2", parts).lower()


def _only(*, ros1: tuple[str, ...] = (), ros2: tuple[str, ...] = ()) -> TypeRule:
    return TypeRule(only_ros1=frozenset(ros1), only_ros2=frozenset(ros2))


BUILT_IN = Rules(
    MappingProxyType(
        {
            "std_msgs/Header": _only(ros1=("seq",)),
            "std_msgs/Time": TypeRule(names=("builtin_interfaces/Time",), inlined="data"),
            "std_msgs/Duration": TypeRule(names=("builtin_interfaces/Duration",), inlined="data"),
            "rosgraph_msgs/Log": TypeRule(
                names=("rcl_interfaces/Log",),
                only_ros1=frozenset({"seq", "frame_id", "topics"}),
                inlined="header",
            ),
            "tf/tfMessage": TypeRule(names=("tf2_msgs/TFMessage",)),
            "uuid_msgs/UniqueID": TypeRule(names=("unique_identifier_msgs/UUID",)),
            # Fields that exist only in ROS 2: empty in messages from ROS 1, and dropped from messages to ROS 1.
            "sensor_msgs/BatteryState": _only(ros2=("temperature",)),
            "sensor_msgs/Range": _only(ros2=("variance",)),
            "shape_msgs/SolidPrimitive": _only(ros2=("polygon",)),
            "visualization_msgs/Marker": _only(
                ros2=("texture_resource", "texture", "uv_coordinates", "mesh_file")
            ),
            "visualization_msgs/InteractiveMarkerInit": _only(),
        }
    ),
    MappingProxyType(
        {
            "roscpp_tutorials/TwoInts": TypeRule(names=("example_interfaces/AddTwoInts",)),
            "rospy_tutorials/AddTwoInts": TypeRule(names=("example_interfaces/AddTwoInts",)),
        }
    ),
    MappingProxyType(
        {
            "actionlib_tutorials/Fibonacci": TypeRule(names=("example_interfaces/Fibonacci",)),
        }
    ),
)
"""The rules for the common packages."""

_TYPE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_KEYS = {
    "ros1_package_name",
    "ros1_message_name",
    "ros1_service_name",
    "ros1_action_name",
    "ros2_package_name",
    "ros2_message_name",
    "ros2_service_name",
    "ros2_action_name",
    "fields_1_to_2",
    "request_fields_1_to_2",
    "response_fields_1_to_2",
    "goal_fields_1_to_2",
    "result_fields_1_to_2",
    "feedback_fields_1_to_2",
    "enable_foreign_mappings",
}


def parse_rules(text: str, where: str) -> Rules:
    """Parse a file of rules. If a rule is invalid, raise BridgeError with its number and the reason."""
    try:
        loaded = safe_load(text)
    except yaml.YAMLError as error:
        problem = " ".join(str(error).split())
        raise BridgeError(f"{where}: is not YAML: {problem}") from error
    if loaded is None:
        return Rules()
    if not isinstance(loaded, list):
        raise BridgeError(f"{where}: is not a list of rules: start each with '- ros1_package_name: ...'")

    messages: dict[str, TypeRule] = {}
    others: dict[str, dict[str, TypeRule]] = {"service": {}, "action": {}}
    for number, rule in enumerate(loaded, 1):
        _add_rule(rule, f"{where}: rule {number}", messages, others)
    return Rules(messages, others["service"], others["action"])


_PARTS = {
    "service": {"request": "Request", "response": "Response"},
    "action": {"goal": "Goal", "result": "Result", "feedback": "Feedback"},
}


def _add_rule(
    rule: object, where: str, messages: dict[str, TypeRule], others: dict[str, dict[str, TypeRule]]
) -> None:
    if not isinstance(rule, dict):
        raise BridgeError(f"{where}: is not a mapping such as 'ros1_package_name: my_msgs'")
    unknown = [str(key) for key in rule if key not in _KEYS]
    if unknown:
        raise BridgeError(f"{where}: has an unknown key [{unknown[0]}]")
    kind = next((each for each in _PARTS if f"ros1_{each}_name" in rule), "message")
    if kind == "message" and "ros1_message_name" not in rule:
        raise BridgeError(
            f"{where}: names neither a message nor a service nor an action: rules for whole packages do not exist, name each type"
        )
    ros1 = _type_name(rule, "ros1", kind, where)
    ros2 = _type_name(rule, "ros2", kind, where)

    if kind == "message":
        fields = _field_names(rule, "fields_1_to_2", where)
        messages[ros1] = TypeRule((ros2,), fields)
        return
    others[kind][ros1] = TypeRule((ros2,))
    for part, suffix in _PARTS[kind].items():
        fields = _field_names(rule, f"{part}_fields_1_to_2", where)
        if fields is not None:
            messages[f"{ros1}{suffix}"] = TypeRule((), fields)


def _type_name(rule: dict[object, object], side: str, kind: str, where: str) -> str:
    parts = []
    for key in (f"{side}_package_name", f"{side}_{kind}_name"):
        value = rule.get(key)
        if not isinstance(value, str) or not _TYPE_NAME.fullmatch(value):
            raise BridgeError(f"{where}: {key} is missing, or not a name")
        parts.append(value)
    return "/".join(parts)


def _field_names(rule: dict[object, object], key: str, where: str) -> Mapping[str, str] | None:
    found = rule.get(key)
    if found is None:
        return None
    if not isinstance(found, dict):
        raise BridgeError(f"{where}: {key} is not a mapping of fields, 'ros1_name: ros2_name'")
    names: dict[str, str] = {}
    for ros1, ros2 in found.items():
        for name in (ros1, ros2):
            if not isinstance(name, str) or not _TYPE_NAME.fullmatch(name):
                raise BridgeError(
                    f"{where}: {key}: [{name}] is not the name of a field; a field of a field cannot be named"
                )
        if ros2 in names.values():
            raise BridgeError(f"{where}: {key}: two fields become [{ros2}]")
        names[ros1] = ros2
    return names
