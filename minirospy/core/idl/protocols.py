"""The protocols of messages, services and actions, for code that works with all of them.

These are protocols, because the classes come from several generators: minirospy's, real genpy's in packages built with
ROS, and classes created at run time. The names are genpy's (http://docs.ros.org/api/genpy/html/).
"""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias, TypeGuard

from minirospy.base.times import Time

__all__ = [
    "Action",
    "ActionFeedback",
    "ActionGoal",
    "ActionResult",
    "Buffer",
    "GoalID",
    "GoalStatus",
    "Header",
    "Message",
    "ServiceClass",
    "Stamped",
    "Writer",
    "declared",
    "is_message",
    "is_stamped",
]

Buffer: TypeAlias = bytes | bytearray | memoryview  # types of the bytes from which a message is read


class Writer(Protocol):
    """The target of ``serialize``, such as a BytesIO or a list of byte strings."""

    def write(self, data: bytes, /) -> object:
        """Append the next bytes."""


class Message(Protocol):
    """A message of any type. Its fields are attributes, in the order of ``__slots__``."""

    __slots__: list[str]
    _type: str
    _md5sum: str
    _full_text: str
    _has_header: bool
    _slot_types: list[str]
    _connection_header: dict[str, str]

    # Use Any instead of object: otherwise pyright regards a class with other parameters as incompatible.
    def __init__(self, *args: Any, **kwds: Any) -> None:
        """Set all fields in order, or some by name."""

    def serialize(self, buff: Writer) -> None:
        """Write the message. Raise genpy.SerializationError if a field's value is invalid."""

    def deserialize(self, data: Buffer, /) -> Message:
        """Read the message from bytes and return it. Raise genpy.DeserializationError if the bytes are invalid."""


class GoalID(Message, Protocol):
    """actionlib_msgs/GoalID."""

    stamp: Time
    id: str


class GoalStatus(Message, Protocol):
    """actionlib_msgs/GoalStatus."""

    @property
    def goal_id(self) -> GoalID:
        """The id of the goal that has this status."""

    status: int
    text: str


class Header(Message, Protocol):
    """std_msgs/Header."""

    seq: int
    stamp: Time
    frame_id: str


class Stamped(Message, Protocol):
    """A message that starts with a header."""

    @property
    def header(self) -> Header:
        """The message's sequence number, time and frame."""


class ServiceClass(Protocol):
    """A service class. It contains the classes of its request and response, and has no instances."""

    @property
    def _type(self) -> str: ...

    @property
    def _md5sum(self) -> str: ...

    @property
    def _request_class(self) -> type[Message]: ...

    @property
    def _response_class(self) -> type[Message]: ...


class ActionGoal(Stamped, Protocol):
    """The message that an action client sends to start a goal."""

    @property
    def goal_id(self) -> GoalID:
        """The goal's id and time."""

    @property
    def goal(self) -> Message:
        """Return the client's request."""


class ActionResult(Stamped, Protocol):
    """The message that an action server sends when a goal ends."""

    @property
    def status(self) -> GoalStatus:
        """Return the goal's final status."""

    @property
    def result(self) -> Message:
        """Return the result."""


class ActionFeedback(Stamped, Protocol):
    """The message that an action server sends while it executes a goal."""

    @property
    def status(self) -> GoalStatus:
        """Return the goal's status."""

    @property
    def feedback(self) -> Message:
        """Return the goal's progress."""


class Action(Message, Protocol):
    """An action: a message with a goal, a result and a feedback message. An action's class is ``type[Action]``."""

    @property
    def action_goal(self) -> ActionGoal:
        """The action's goal message."""

    @property
    def action_result(self) -> ActionResult:
        """The action's result message."""

    @property
    def action_feedback(self) -> ActionFeedback:
        """The action's feedback message."""


def declared(message_class: type[Message], method: str, name: str) -> object:
    """Return the class attribute ``name``, which describes a generated method; None if a subclass overrides the method.

    Such a subclass inherits the attribute, but need not read or write the message as the generated method does.
    """
    owner = next((each for each in message_class.__mro__ if method in vars(each)), None)
    return vars(owner).get(name) if owner else None


def is_message(value: object) -> TypeGuard[Message]:
    """Return whether a value, such as a field's value or an argument, is a message."""
    return hasattr(value, "_slot_types")


def is_stamped(value: object) -> TypeGuard[Stamped]:
    """Return whether a value is a message that starts with a header."""
    return bool(getattr(value, "_has_header", False))
