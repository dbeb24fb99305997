"""ROS 2's definitions of types, made of those of ROS 1 and the rules, where no ROS 2 is installed. Pure.

What rclpy's classes answer is answered here: fields and their types, by which CDR is laid out. That they are those of the
other side is checked by their hash, which is part of each key of rmw_zenoh.
"""

from __future__ import annotations

import contextlib
from types import MappingProxyType

from minirospy.bridge.ros2.layouts import TypesDiffer
from minirospy.bridge.ros2.rules import Rules, snake_case
from minirospy.errors import DefinitionError, NotFoundError
from minirospy.idl.load import Catalogue
from minirospy.idl.spec import FieldType, MessageSpec, ServiceSpec
from minirospy.idl.type_hash import Fields, type_hash

__all__ = ["NO_HASH", "Definitions"]

NO_HASH = "TypeHashNotSupported"
"""In the keys of ROS 2 Humble, which has no hashes."""

_TIME = {"sec": "int32", "nanosec": "uint32"}
_STAMP = "builtin_interfaces/Time"
_ID = "unique_identifier_msgs/UUID"

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
    "service_msgs/ServiceEventInfo": {
        "event_type": "uint8",
        "stamp": _STAMP,
        "client_gid": "uint8[16]",
        "sequence_number": "int64",
    },
    "visualization_msgs/MeshFile": {"filename": "string", "data": "sequence<uint8>"},
    "visualization_msgs/UVCoordinate": {"u": "float32", "v": "float32"},
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
"""Fields that ROS 2 has after one of ROS 1."""
_ADDED_AFTER_HUMBLE = {("sensor_msgs/Range", "range")}
_BOUNDED = {("shape_msgs/SolidPrimitive", "dimensions"): "sequence<double, 3>"}
_BASES = {"char": "uint8", "time": _STAMP, "duration": "builtin_interfaces/Duration"}


class Definitions:
    """The types of ROS 2, ``pkg/Name``, with the fields of ROS 1's under the rules. All raise TypesDiffer."""

    def __init__(self, rules: Rules, catalogue: Catalogue) -> None:
        self._rules = rules
        self._catalogue = catalogue
        self._found: dict[tuple[str, bool], Fields] = {}
        self._hashes: dict[str, str] = {}

    def message(self, name: str, *, is_humble: bool = False) -> Fields:
        """Return the fields of a message; ``is_humble``: as ROS 2 Humble has them."""
        key = (name, is_humble)
        if key not in self._found:
            self._found[key] = _ONLY_IN_ROS2.get(name) or self._of_ros1(name, is_humble)
        return self._found[key]

    def service(self, name: str) -> tuple[Fields, Fields]:
        """Return the fields of a service's request and response."""
        whole = name.replace("/", "/srv/")
        return self._part(f"{whole}_Request"), self._part(f"{whole}_Response")

    def message_hash(self, name: str) -> str:
        """Return the hash of a message."""
        return self._hash(name, {})

    def service_hash(self, name: str) -> str:
        """Return the hash of a service."""
        whole = name.replace("/", "/srv/")
        request, response, event = (f"{whole}_{part}" for part in ("Request", "Response", "Event"))
        return self._hash(
            whole,
            {
                whole: {"request_message": request, "response_message": response, "event_message": event},
                event: {
                    "info": "service_msgs/ServiceEventInfo",
                    "request": f"sequence<{request}, 1>",
                    "response": f"sequence<{response}, 1>",
                },
            },
        )

    def _hash(self, name: str, own: dict[str, Fields]) -> str:
        if name not in self._hashes:
            try:
                self._hashes[name] = type_hash(
                    name, lambda each: own[each] if each in own else self._part(each)
                )
            except ValueError as error:
                raise TypesDiffer(str(error)) from error
        return self._hashes[name]

    def _part(self, name: str) -> Fields:
        """Return the fields of a message, or of a part of a service: ``pkg/srv/Name_Request``."""
        if name.count("/") == 1:
            return self.message(name)
        package, _, inner = name.split("/")
        base, _, part = inner.rpartition("_")
        service = self._service(f"{package}/{base}")
        spec = service.request if part == "Request" else service.response
        return self._fields(spec, spec.full_name, f"{package}/{base}", is_humble=False)

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
        # Newer definitions of ROS 1 have the temperature of a battery, too.
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
