"""Converts action messages between their ROS 1 and ROS 2 types."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from minirospy.aio.raw import raw_class
from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.core.idl.cdr import Transcoder
from minirospy.core.idl.digest import Lookup, full_text, message_md5
from minirospy.core.idl.protocols import Message
from minirospy.core.idl.spec import FieldType, MessageSpec
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros2.layouts import TypesDiffer, ros2_spec, transcoder
from minirospy.ros2.links import Direction
from minirospy.ros2.rules import Rules

if TYPE_CHECKING:
    from minirospy.core.idl.load import Catalogue
    from minirospy.ros2.interface import Ros2Side

__all__ = ["ActionCodec", "ActionCodecs", "empty_message"]

_WIDTHS = {"time": 8, "duration": 8, "string": 4}


@dataclass(frozen=True)
class ActionCodec:
    """Converts the messages of an action. ``classes`` maps the last part of a ROS 1 topic name to its message class."""

    goal: Transcoder
    result: Transcoder
    feedback: Transcoder
    empty_result: bytes
    classes: Mapping[str, type[Message]]


class ActionCodecs:
    """Creates and caches the codecs of actions, keyed by the ROS 1 and ROS 2 types."""

    def __init__(self, side: Ros2Side, rules: Rules, catalogue: Catalogue) -> None:
        self._side = side
        self._rules = rules
        self._lookup: Lookup = catalogue.message
        self._codecs: dict[tuple[str, str], ActionCodec] = {}

    def partner(self, type_: str, direction: Direction) -> str:
        """Return an action's type on the client's side, given its type on the server's side."""
        names: tuple[str, ...]
        if direction is Direction.TO_ROS1:
            names = self._rules.ros2_actions(type_)
            return next((name for name in names if self._is_in_ros2(name)), names[0])
        names = self._rules.ros1_actions(type_) or (type_,)
        return next((name for name in names if self._is_in_ros1(name)), names[0])

    def codec(self, ros1_type: str, ros2_type: str) -> ActionCodec:
        """Return the codec for an action. Raise TypesDiffer if its types cannot be converted."""
        key = (ros1_type, ros2_type)
        if key not in self._codecs:
            self._codecs[key] = self._made(ros1_type, ros2_type)
        return self._codecs[key]

    def _made(self, ros1_type: str, ros2_type: str) -> ActionCodec:
        goal, result, feedback = (self._spec(ros1_type + part) for part in ("Goal", "Result", "Feedback"))
        fields = self._side.action_fields(ros2_type)
        halves = [
            transcoder(spec, self._lookup, ros2_spec(ros2_type, each), self._ros2_spec, self._rules)
            for spec, each in zip((goal, result, feedback), fields, strict=True)
        ]
        classes = {
            "goal": self._class(f"{ros1_type}ActionGoal"),
            "result": self._class(f"{ros1_type}ActionResult"),
            "feedback": self._class(f"{ros1_type}ActionFeedback"),
            "cancel": self._class("actionlib_msgs/GoalID"),
            "status": self._class("actionlib_msgs/GoalStatusArray"),
        }
        return ActionCodec(halves[0], halves[1], halves[2], empty_message(result, self._lookup), classes)

    def _class(self, name: str) -> type[Message]:
        spec = self._spec(name)
        return raw_class(InterfaceType(name, message_md5(spec, self._lookup), full_text(spec, self._lookup)))

    def _ros2_spec(self, name: str) -> MessageSpec:
        return ros2_spec(name, self._side.fields(name))

    def _spec(self, name: str) -> MessageSpec:
        try:
            return self._lookup(name)
        except (KeyError, NotFoundError, DefinitionError) as error:
            raise TypesDiffer(
                f"[{name}] is not defined here: put its package on ROS_PACKAGE_PATH ({error})"
            ) from error

    def _is_in_ros1(self, name: str) -> bool:
        try:
            return bool(self._spec(f"{name}Goal"))
        except TypesDiffer:
            return False

    def _is_in_ros2(self, name: str) -> bool:
        try:
            return bool(self._side.action_fields(name))
        except TypesDiffer:
            return False


def empty_message(spec: MessageSpec, lookup: Lookup) -> bytes:
    """Return a serialized ROS 1 message whose fields are all zero or empty."""

    def of_type(type_: FieldType) -> bytes:
        if type_.is_array and type_.length is None:
            return bytes(4)
        if not type_.is_primitive:
            one = empty_message(lookup(type_.base), lookup)
        elif type_.base in _WIDTHS:
            one = bytes(_WIDTHS[type_.base])
        else:
            one = bytes(int("".join(filter(str.isdigit, type_.base)) or 8) // 8)
        return one * (type_.length if type_.length is not None else 1)

    return b"".join(of_type(field.type) for field in spec.fields)
