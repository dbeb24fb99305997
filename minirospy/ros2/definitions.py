"""Derives ROS 2 type definitions from ROS 1 definitions and the rules, for use without an installed ROS 2. Pure.

The results (fields and their types) replace the information from rclpy's classes and determine the CDR layout. The type
hash, which is part of each key of rmw_zenoh, verifies that they match the other side's definitions.
"""

from __future__ import annotations

import contextlib
from types import MappingProxyType

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.core.idl.load import Catalogue
from minirospy.core.idl.spec import FieldType, MessageSpec, ServiceSpec
from minirospy.core.idl.type_hash import Fields, type_hash
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.rules import Rules, snake_case

__all__ = ["NO_HASH", "Definitions"]

NO_HASH = "TypeHashNotSupported"  # stands for a hash in the keys of ROS 2 Humble, which has no type hashes

_TIME = {"sec": "int32", "nanosec": "uint32"}
_STAMP = "builtin_interfaces/Time"
_ID = "unique_identifier_msgs/UUID"
_GOAL = "action_msgs/GoalInfo"
_RANGE = ("from_value", "to_value", "step")

_ONLY_IN_ROS2: dict[str, Fields] = {
    "builtin_interfaces/Time": _TIME,
    "builtin_interfaces/Duration": _TIME,
    "rcl_interfaces/Log": {
        "stamp": _STAMP,
        "level": "uint8",
        "name": "string",
        "msg": "string",
        "file": "string",
        "function": "string",
        "line": "uint32",
    },
    _ID: {"uuid": "uint8[16]"},
    _GOAL: {"goal_id": _ID, "stamp": _STAMP},
    "action_msgs/GoalStatus": {"goal_info": _GOAL, "status": "int8"},
    "action_msgs/GoalStatusArray": {"status_list": "sequence<action_msgs/GoalStatus>"},
    "rcl_interfaces/FloatingPointRange": dict.fromkeys(_RANGE, "double"),
    "rcl_interfaces/IntegerRange": {"from_value": "int64", "to_value": "int64", "step": "uint64"},
    "rcl_interfaces/ListParametersResult": dict.fromkeys(("names", "prefixes"), "sequence<string>"),
    "rcl_interfaces/Parameter": {"name": "string", "value": "rcl_interfaces/ParameterValue"},
    "rcl_interfaces/ParameterDescriptor": {
        "name": "string",
        "type": "uint8",
        "description": "string",
        "additional_constraints": "string",
        "read_only": "boolean",
        "dynamic_typing": "boolean",
        "floating_point_range": "sequence<rcl_interfaces/FloatingPointRange, 1>",
        "integer_range": "sequence<rcl_interfaces/IntegerRange, 1>",
    },
    "rcl_interfaces/ParameterValue": {
        "type": "uint8",
        "bool_value": "boolean",
        "integer_value": "int64",
        "double_value": "double",
        "string_value": "string",
        "byte_array_value": "sequence<octet>",
        "bool_array_value": "sequence<boolean>",
        "integer_array_value": "sequence<int64>",
        "double_array_value": "sequence<double>",
        "string_array_value": "sequence<string>",
    },
    "rcl_interfaces/SetParametersResult": {"successful": "boolean", "reason": "string"},
    "service_msgs/ServiceEventInfo": {
        "event_type": "uint8",
        "stamp": _STAMP,
        "client_gid": "uint8[16]",
        "sequence_number": "int64",
    },
    "visualization_msgs/MeshFile": {"filename": "string", "data": "sequence<uint8>"},
    "visualization_msgs/UVCoordinate": {"u": "float32", "v": "float32"},
}

_NAMES: Fields = {"names": "sequence<string>"}
_PARAMETERS: Fields = {"parameters": "sequence<rcl_interfaces/Parameter>"}
_RESULT = "rcl_interfaces/SetParametersResult"
_SERVICES_ONLY_IN_ROS2: dict[str, tuple[Fields, Fields]] = {
    "action_msgs/CancelGoal": (
        {"goal_info": _GOAL},
        {"return_code": "int8", "goals_canceling": f"sequence<{_GOAL}>"},
    ),
    "rcl_interfaces/DescribeParameters": (
        _NAMES,
        {"descriptors": "sequence<rcl_interfaces/ParameterDescriptor>"},
    ),
    "rcl_interfaces/GetParameters": (_NAMES, {"values": "sequence<rcl_interfaces/ParameterValue>"}),
    "rcl_interfaces/GetParameterTypes": (_NAMES, {"types": "sequence<uint8>"}),
    "rcl_interfaces/ListParameters": (
        {"prefixes": "sequence<string>", "depth": "uint64"},
        {"result": "rcl_interfaces/ListParametersResult"},
    ),
    "rcl_interfaces/SetParameters": (_PARAMETERS, {"results": f"sequence<{_RESULT}>"}),
    "rcl_interfaces/SetParametersAtomically": (_PARAMETERS, {"result": _RESULT}),
}

_ADDED: dict[tuple[str, str], Fields] = {
    ("sensor_msgs/BatteryState", "voltage"): {"temperature": "float32"},
    ("sensor_msgs/Range", "range"): {"variance": "float32"},
    ("shape_msgs/SolidPrimitive", "dimensions"): {"polygon": "geometry_msgs/Polygon"},
    ("visualization_msgs/Marker", "colors"): {
        "texture_resource": "string",
        "texture": "sensor_msgs/CompressedImage",
        "uv_coordinates": "sequence<visualization_msgs/UVCoordinate>",
    },
    ("visualization_msgs/Marker", "mesh_resource"): {"mesh_file": "visualization_msgs/MeshFile"},
}
"""The fields that ROS 2 adds, keyed by message type and by the ROS 1 field after which they follow."""
_ADDED_AFTER_HUMBLE = {("sensor_msgs/Range", "range")}
_BOUNDED = {("shape_msgs/SolidPrimitive", "dimensions"): "sequence<double, 3>"}
_BASES = {"char": "uint8", "time": _STAMP, "duration": "builtin_interfaces/Duration"}


class Definitions:
    """ROS 2 types (``pkg/Name``), whose fields are derived from ROS 1 definitions and the rules.

    All methods raise TypesDiffer if a type cannot be derived.
    """

    def __init__(self, rules: Rules, catalogue: Catalogue) -> None:
        self._rules = rules
        self._catalogue = catalogue
        self._found: dict[tuple[str, bool], Fields] = {}
        self._hashes: dict[str, str] = {}

    def message(self, name: str, *, is_humble: bool = False) -> Fields:
        """Return the fields of a message; if ``is_humble`` is true, those in ROS 2 Humble."""
        key = (name, is_humble)
        if key not in self._found:
            self._found[key] = _ONLY_IN_ROS2.get(name) or self._of_ros1(name, is_humble)
        return self._found[key]

    def service(self, name: str) -> tuple[Fields, Fields]:
        """Return the fields of a service's request and response. ``name`` is ``pkg/Name``."""
        whole = name.replace("/", "/srv/")
        return self.fields(f"{whole}_Request"), self.fields(f"{whole}_Response")

    def action(self, name: str) -> tuple[Fields, Fields, Fields]:
        """Return the fields of an action's goal, result and feedback. ``name`` is ``pkg/Name``."""
        whole = name.replace("/", "/action/")
        return (
            self.fields(f"{whole}_Goal"),
            self.fields(f"{whole}_Result"),
            self.fields(f"{whole}_Feedback"),
        )

    def hash(self, name: str) -> str:
        """Return the type hash of a message ``pkg/Name``, or of any other type that :meth:`fields` accepts."""
        if name not in self._hashes:
            try:
                self._hashes[name] = type_hash(name, self.fields)
            except ValueError as error:
                raise TypesDiffer(str(error)) from error
        return self._hashes[name]

    def fields(self, name: str) -> Fields:
        """Return the fields of a message, or of a type that ROS 2 generates for a service or action.

        The generated types are ``pkg/srv/Name``, ``pkg/action/Name_SendGoal``, ``pkg/action/Name_FeedbackMessage``, and
        their parts.
        """
        if name.count("/") == 1:
            return self.message(name)
        package, kind, inner = name.split("/")
        base, _, part = inner.rpartition("_")
        whole = f"{package}/{kind}/{base}"
        if part in ("Request", "Response", "Event"):
            return self._part_of_service(whole, part)
        if kind == "srv" or part in ("SendGoal", "GetResult"):
            parts = (
                ("request_message", "Request"),
                ("response_message", "Response"),
                ("event_message", "Event"),
            )
            return {field: f"{name}_{each}" for field, each in parts}
        if part == "FeedbackMessage":
            return {"goal_id": _ID, "feedback": f"{whole}_Feedback"}
        return self._part_of_action(f"{package}/{base}", part, name)

    def _part_of_service(self, whole: str, part: str) -> Fields:
        """Return the fields of a service's request, response or event."""
        if part == "Event":
            return {
                "info": "service_msgs/ServiceEventInfo",
                "request": f"sequence<{whole}_Request, 1>",
                "response": f"sequence<{whole}_Response, 1>",
            }
        package, kind, inner = whole.split("/")
        name = f"{package}/{inner}"
        place = part == "Response"
        if kind == "action":
            action, _, service = whole.rpartition("_")
            if service == "SendGoal":
                return ({"goal_id": _ID, "goal": f"{action}_Goal"}, {"accepted": "boolean", "stamp": _STAMP})[
                    place
                ]
            return ({"goal_id": _ID}, {"status": "int8", "result": f"{action}_Result"})[place]
        if name in _SERVICES_ONLY_IN_ROS2:
            return _SERVICES_ONLY_IN_ROS2[name][place]
        service_spec = self._service(name)
        spec = service_spec.response if place else service_spec.request
        return self._fields(spec, spec.full_name, name, is_humble=False)

    def _part_of_action(self, name: str, part: str, whole: str) -> Fields:
        """Return the fields of an action's goal, result or feedback."""
        for action in self._rules.ros1_actions(name) or (name,):
            with contextlib.suppress(KeyError, NotFoundError, DefinitionError):
                ros1 = f"{action}{part}"
                return self._fields(self._catalogue.message(ros1), ros1, whole, is_humble=False)
        raise TypesDiffer(
            f"the action type [{name}] is not defined here: put its package on ROS_PACKAGE_PATH"
        )

    def _service(self, name: str) -> ServiceSpec:
        for each in self._rules.ros1_services(name) or (name,):
            with contextlib.suppress(KeyError, NotFoundError, DefinitionError):
                return self._catalogue.service(each)
        raise TypesDiffer(
            f"the service type [{name}] is not defined here: put its package on ROS_PACKAGE_PATH"
        )

    def _of_ros1(self, name: str, is_humble: bool) -> Fields:
        ros1 = self._rules.ros1_message(name)
        try:
            spec = self._catalogue.message(ros1)
        except (KeyError, NotFoundError, DefinitionError) as error:
            raise TypesDiffer(
                f"[{ros1}] is not defined here: put its package on ROS_PACKAGE_PATH ({error})"
            ) from error
        return self._fields(spec, ros1, name, is_humble)

    def _fields(self, spec: MessageSpec, ros1: str, name: str, is_humble: bool) -> Fields:
        rule = self._rules.message(ros1)
        # Add the temperature only if it is missing: newer ROS 1 definitions of BatteryState have it.
        has = {field.name for field in spec.fields}
        found: dict[str, str] = {}
        for field in spec.fields:
            if field.name in rule.only_ros1 or (rule.fields is not None and field.name not in rule.fields):
                continue
            new = rule.fields[field.name] if rule.fields is not None else snake_case(field.name)
            text = _BOUNDED.get((name, new)) or self._text(field.type)
            if new in found:
                raise TypesDiffer(f"two fields of [{ros1}] have one name in ROS 2")
            found[new] = text
            if not (is_humble and (name, new) in _ADDED_AFTER_HUMBLE):
                found.update(
                    {key: type_ for key, type_ in _ADDED.get((name, new), {}).items() if key not in has}
                )
        return MappingProxyType(found)

    def _text(self, type_: FieldType) -> str:
        base = _BASES.get(type_.base, type_.base)
        if "/" in base:
            base = self._rules.ros2_messages(base)[0]
        if not type_.is_array:
            return base
        return f"{base}[{type_.length}]" if type_.length is not None else f"sequence<{base}>"
