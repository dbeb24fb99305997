"""The rosbridge protocol, version 2: parse clients' operations into events, and encode fields as messages.

Pure. Error messages are those of rosbridge_library. Source: ROSBRIDGE_PROTOCOL.md in
https://github.com/RobotWebTools/rosbridge_suite, branch ros1.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from minirospy.base.errors import BridgeProtocolError
from minirospy.web.json_text import (
    MAX_QUICK_CHARACTERS,
    dump_json,
    is_quick_text,
    load_json,
    load_json_in_pieces,
)
from minirospy.web.rosbridge import png
from minirospy.web.rosbridge.cbor import decode_cbor, encode_cbor

__all__ = [
    "OPERATIONS",
    "Advertise",
    "AdvertiseService",
    "Auth",
    "CallService",
    "CancelActionGoal",
    "Event",
    "Fragment",
    "OperationError",
    "Publish",
    "SendActionGoal",
    "ServiceResponse",
    "SetLevel",
    "StatusLevel",
    "Subscribe",
    "Unadvertise",
    "UnadvertiseService",
    "Unsubscribe",
    "decode",
    "decode_in_pieces",
    "encode",
    "encode_messages",
    "fragments",
    "is_quick",
    "parse",
    "service_call",
    "service_response",
    "status",
]

Id = str | int | float | None
Compression = str
COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")

_MAX_FRAGMENTS = 2_000
"""Maximum number of fragments per message: a client may request fragments of a single character."""

_LONGEST_ID = 1000
_SHOWN = 200
"""Maximum number of characters quoted from a client's message in an error."""


class StatusLevel(IntEnum):
    """The severity of a status message. A client chooses the lowest severity that it receives."""

    NONE = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


class OperationError(BridgeProtocolError):
    """Raised if an operation is refused. ``id`` is the operation's id."""

    def __init__(self, text: str, id_: Id = None) -> None:
        super().__init__(text)
        self.id = id_


@dataclass(frozen=True)
class Event:
    """An operation from a client."""

    id: Id


@dataclass(frozen=True)
class TopicEvent(Event):
    """An operation on a topic."""

    topic: str


@dataclass(frozen=True)
class ServiceEvent(Event):
    """An operation on a service."""

    service: str


@dataclass(frozen=True)
class Advertise(TopicEvent):
    """A request to advertise a topic."""

    type: str
    latch: bool
    queue_size: int


class Unadvertise(TopicEvent):
    """A request to unadvertise a topic."""


@dataclass(frozen=True)
class Publish(TopicEvent):
    """A message to publish."""

    message: object
    latch: bool


@dataclass(frozen=True)
class Subscribe(TopicEvent):
    """A request to subscribe to a topic; ``throttle_rate`` is in milliseconds."""

    type: str | None
    throttle_rate: int
    queue_length: int
    fragment_size: int | None
    compression: Compression


class Unsubscribe(TopicEvent):
    """A request to unsubscribe from a topic."""


@dataclass(frozen=True)
class CallService(ServiceEvent):
    """A service call. ``arguments`` contains the request's fields, or a list of their values; any other value means none."""

    arguments: object
    fragment_size: int | None
    compression: Compression


@dataclass(frozen=True)
class ServiceResponse(ServiceEvent):
    """A client's response to a call. If ``result`` is False, ``values`` is an error message."""

    values: object
    result: bool


@dataclass(frozen=True)
class AdvertiseService(ServiceEvent):
    """A request to offer a service, whose calls the client answers."""

    type: str


class UnadvertiseService(ServiceEvent):
    """A request to stop offering a service."""


@dataclass(frozen=True)
class SendActionGoal(Event):
    """A goal for an action server. ``arguments`` contains the goal's fields, or a list of their values."""

    action: str
    type: str
    arguments: object
    feedback: bool
    fragment_size: int | None
    compression: Compression


@dataclass(frozen=True)
class CancelActionGoal(Event):
    """A request to cancel the goal that the client has sent with this id."""

    action: str


@dataclass(frozen=True)
class Fragment(Event):
    data: str
    number: int
    total: int


@dataclass(frozen=True)
class SetLevel(Event):
    level: StatusLevel


@dataclass(frozen=True)
class Auth(Event):
    """A client's authentication, as in http://wiki.ros.org/rosauth; times are in seconds."""

    mac: str
    client: str
    dest: str
    rand: str
    time: float
    level: str
    end: float


Fields = Mapping[str, Any]


# --- parsing


def is_quick(data: str | bytes) -> bool:
    """Return whether decoding a message takes only a few milliseconds."""
    return is_quick_text(data) if isinstance(data, str) else len(data) <= MAX_QUICK_CHARACTERS


def decode(data: str | bytes) -> Fields:
    """Decode an operation: JSON if it is a string, CBOR if it is bytes. Raise OperationError if it is invalid."""
    return _decode(data, load_json)


def decode_in_pieces(data: str | bytes) -> Fields:
    """Decode an operation like :func:`decode`, but without holding the GIL for long. For use outside the loop's thread."""
    return _decode(data, load_json_in_pieces)


def _decode(data: str | bytes, load: Callable[[str], object]) -> Fields:
    try:
        found = load(data) if isinstance(data, str) else decode_cbor(data)
    except (ValueError, RecursionError) as error:
        shown = data[:_SHOWN] if isinstance(data, str) else f"{len(data)} bytes of CBOR ({error})"
        raise OperationError(f"Unable to deserialize message from client: {shown}") from error
    if not isinstance(found, dict):
        shown = _shown(found)
        raise OperationError(f"Unable to deserialize message from client: {shown}")
    return found


def parse(fields: Fields) -> Event:
    """Parse an operation into an event. If the operation is a PNG, parse the operation that it contains.

    Raise OperationError if it is invalid.
    """
    id_ = _id(fields)
    op = fields.get("op")
    if op is None:
        raise _without_op(fields, id_)
    if not isinstance(op, str) or op not in OPERATIONS:
        raise OperationError(f"Unknown operation: {_shown(op)}.  Allowed operations: {list(OPERATIONS)}", id_)
    try:
        if op in _READERS:
            return _READERS[op](fields, id_)
        event, readers = _FIELDS[op]
        return event(id_, *(read(fields) for read in readers))
    except OperationError:
        raise
    except BridgeProtocolError as error:
        raise OperationError(f"{op}: {error}", id_) from error


def _without_op(fields: Fields, id_: Id) -> OperationError:
    shown = _shown(dict(fields))
    if "receiver" in fields:
        return OperationError(
            "Received a rosbridge v1.0 message.  Please refer to rosbridge.org for the correct format of rosbridge "
            f"v2.0 messages.  Original message was: {shown}"
        )
    return OperationError(
        "Received a message without an op.  All messages require 'op' field with value one of: "
        f"{list(OPERATIONS)}.  Original message was: {shown}",
        id_,
    )


def _shown(value: object) -> str:
    """Return the first characters of ``str(value)``, without formatting the whole value."""
    return _text_of(value, _SHOWN)[:_SHOWN]


def _text_of(value: object, most: int) -> str:
    """Return a string whose first ``most`` characters are those of ``str(value)``."""
    return value if isinstance(value, str) else str(_cut(value, most, itertools.count()))


def _cut(value: object, most: int, numbers: Iterator[int]) -> object:
    """Shorten a JSON or CBOR value: keep only as many items as can be visible, because each takes at least one character."""
    # Which quotes Python puts around a string depends on the quotes in it, so keep the quotes of the part that is cut off.
    if isinstance(value, str) and len(value) > most:
        return value[:most] + "".join(quote for quote in "'\"" if quote in value)
    if isinstance(value, bytes) and len(value) > most:
        return value[:most] + bytes(quote for quote in b"'\"" if quote in value)
    if isinstance(value, list):
        first = itertools.takewhile(lambda _: next(numbers) <= most, value)
        return [_cut(each, most, numbers) for each in first]
    if isinstance(value, dict):
        pairs = itertools.takewhile(lambda _: next(numbers) <= most, value.items())
        return {_cut(key, most, numbers): _cut(each, most, numbers) for key, each in pairs}
    return value


def _id(fields: Fields) -> Id:
    found = fields.get("id")
    if found is None or isinstance(found, bool | int | float):
        return found
    text = _text_of(found, _LONGEST_ID)
    if len(text) > _LONGEST_ID:
        raise OperationError(f"an id has {_LONGEST_ID} characters at most")
    return text


def _value(fields: Fields, name: str, types: tuple[type, ...], default: Any = ...) -> Any:
    """Return a field of an operation, or ``default`` if it is missing.

    Raise BridgeProtocolError, with rosbridge's message, if it is invalid.
    """
    found = fields.get(name)
    if found is None:
        if default is ...:
            raise BridgeProtocolError(f"Expected a {name} field but none was found.")
        return default
    if not isinstance(found, types) or (isinstance(found, bool) and bool not in types):
        raise BridgeProtocolError(
            f"Expected field {name} to be one of {types}. Invalid value: {_shown(found)}"
        )
    return found


def _text(fields: Fields, name: str, default: Any = ...) -> Any:
    return _value(fields, name, (str,), default)


def _compression(fields: Fields) -> Compression:
    found: str = _text(fields, "compression", "none")
    if found not in COMPRESSIONS:
        raise BridgeProtocolError(
            f"compression {found[:_SHOWN]!r} is unknown: there is {', '.join(COMPRESSIONS)}"
        )
    return found


def _fragment_size(fields: Fields) -> int | None:
    found: int | None = _value(fields, "fragment_size", (int,), None)
    if found is not None and found < 1:
        raise BridgeProtocolError(f"fragment_size is {found}: it is a number of characters")
    return found


def _number(fields: Fields, name: str, default: float | None = None) -> float:
    found = _value(fields, name, (int, float), ... if default is None else default)
    try:
        number = float(found)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise BridgeProtocolError(f"field {name} is not a number of seconds or milliseconds: {_shown(found)}")
    return number


def _throttle_rate(fields: Fields) -> int:
    return max(0, int(_number(fields, "throttle_rate", 0)))


def _queue_length(fields: Fields) -> int:
    return max(0, int(_value(fields, "queue_length", (int,), 0)))


_Read = Callable[[Fields], object]


def _required(name: str) -> _Read:
    return lambda fields: _text(fields, name)


def _latch(fields: Fields) -> bool:
    return bool(fields.get("latch"))


_TOPIC, _SERVICE, _TYPE = (_required(name) for name in ("topic", "service", "type"))

_FIELDS: Mapping[str, tuple[Callable[..., Event], tuple[_Read, ...]]] = {
    "advertise": (
        Advertise,
        (_TOPIC, _TYPE, _latch, lambda fields: _value(fields, "queue_size", (int,), 100)),
    ),
    "unadvertise": (Unadvertise, (_TOPIC,)),
    "publish": (Publish, (_TOPIC, lambda fields: fields.get("msg", {}), _latch)),
    "subscribe": (
        Subscribe,
        (
            _TOPIC,
            lambda fields: _text(fields, "type", None) or None,
            _throttle_rate,
            _queue_length,
            _fragment_size,
            _compression,
        ),
    ),
    "unsubscribe": (Unsubscribe, (_TOPIC,)),
    "service_response": (
        ServiceResponse,
        (_SERVICE, lambda fields: fields.get("values", {}), lambda fields: _value(fields, "result", (bool,))),
    ),
    "advertise_service": (AdvertiseService, (_SERVICE, _TYPE)),
    "unadvertise_service": (UnadvertiseService, (_SERVICE,)),
    "auth": (
        Auth,
        (
            *(_required(name) for name in ("mac", "client", "dest", "rand")),
            lambda fields: _number(fields, "t"),
            _required("level"),
            lambda fields: _number(fields, "end"),
        ),
    ),
}
"""Dict from operation to its event class and the functions that read the event's fields, in order."""


def _call_service(fields: Fields, id_: Id) -> Event:
    service: str = _text(fields, "service")
    name, _, old_id = service.partition("#")  # old clients append an id: /rosapi/topics#33
    return CallService(
        id_ if id_ is not None or not old_id else old_id,
        name,
        fields.get("args", []),
        _fragment_size(fields),
        _compression(fields),
    )


def _send_action_goal(fields: Fields, id_: Id) -> Event:
    name, old_id = _action(fields)
    return SendActionGoal(
        old_id if id_ is None else id_,
        name,
        _text(fields, "action_type"),
        fields.get("args", []),
        bool(fields.get("feedback")),
        _fragment_size(fields),
        _compression(fields),
    )


def _cancel_action_goal(fields: Fields, id_: Id) -> Event:
    name, old_id = _action(fields)
    return CancelActionGoal(old_id if id_ is None else id_, name)


def _action(fields: Fields) -> tuple[str, Id]:
    """Return an action's name, and the id that a client may have appended to it."""
    action: str = _text(fields, "action")
    name, _, old_id = action.partition("#")
    return name, old_id or None


def _fragment(fields: Fields, id_: Id) -> Event:
    number, total, data = (fields.get(name) for name in ("num", "total", "data"))
    if (
        id_ is None
        or type(number) is not int
        or type(total) is not int
        or not isinstance(data, str)
        or not 0 <= number < total
    ):
        raise OperationError("received invalid fragment!", id_)
    return Fragment(id_, data, number, total)


def _png(fields: Fields, _: Id) -> Event:
    text = png.decode(_text(fields, "data"))
    inner = decode(text)
    if inner.get("op") == "png":
        raise BridgeProtocolError("a PNG in a PNG")
    return parse(inner)


def _set_level(fields: Fields, id_: Id) -> Event:
    level: str = _text(fields, "level")
    try:
        return SetLevel(id_, StatusLevel[level.upper()])
    except KeyError:
        names = ", ".join(each.name.lower() for each in reversed(StatusLevel))
        raise BridgeProtocolError(f"Invalid status level {level[:_SHOWN]}; must be one of {names}") from None


_READERS: Mapping[str, Callable[[Fields, Id], Event]] = {
    "call_service": _call_service,
    "send_action_goal": _send_action_goal,
    "cancel_action_goal": _cancel_action_goal,
    "fragment": _fragment,
    "png": _png,
    "set_level": _set_level,
}
OPERATIONS = (
    *("call_service", "advertise", "unadvertise", "publish", "subscribe", "unsubscribe", "fragment"),
    *("advertise_service", "service_response", "unadvertise_service", "png", "set_level", "auth"),
    *("send_action_goal", "cancel_action_goal"),
)
"""The operations that clients may send, in the order used in error messages."""


# --- encoding


def encode(
    fields: Fields, compression: Compression = "none", dump: Callable[[object], str] = dump_json
) -> str | bytes:
    """Encode a message as a string or, for CBOR, as bytes. ``dump`` encodes a value as JSON."""
    if compression in ("cbor", "cbor-raw"):
        return encode_cbor(fields)
    text = dump(fields)
    if compression == "png":
        return dump({"op": "png", "data": png.encode(text)})
    return text


def encode_messages(
    fields: Fields,
    compression: Compression,
    fragment_size: int | None,
    dump: Callable[[object], str] = dump_json,
) -> list[str | bytes]:
    """Encode a message as one or more messages to send: fragments if it is a string and a fragment size is given."""
    data = encode(fields, compression, dump)
    if isinstance(data, bytes) or not fragment_size:
        return [data]
    return [*fragments(data, fragment_size, fields.get("id"))]


def fragments(text: str, size: int, id_: Id) -> list[str]:
    """Split text into fragments of at most ``size`` characters. Return text of at most this length unchanged.

    The fragments are longer if there would be too many.
    """
    size = max(size, -(-len(text) // _MAX_FRAGMENTS))
    if len(text) <= size:
        return [text]
    total = -(-len(text) // size)
    return [
        json.dumps(
            {
                "op": "fragment",
                "id": id_,
                "data": text[at * size : (at + 1) * size],
                "num": at,
                "total": total,
            },
            separators=(",", ":"),
        )
        for at in range(total)
    ]


def status(level: StatusLevel, text: str, id_: Id = None) -> dict[str, object]:
    """Return a status message."""
    fields: dict[str, object] = {"op": "status", "level": level.name.lower(), "msg": text}
    return fields if id_ is None else {**fields, "id": id_}


def service_response(service: str, values: object, id_: Id, *, result: bool) -> dict[str, object]:
    """Return the response to a service call. If ``result`` is False, ``values`` is an error message."""
    fields: dict[str, object] = {
        "op": "service_response",
        "service": service,
        "values": values,
        "result": result,
    }
    return fields if id_ is None else {**fields, "id": id_}


def service_call(service: str, arguments: object, id_: str) -> dict[str, object]:
    """Return the message that calls a client's service."""
    return {"op": "call_service", "id": id_, "service": service, "args": arguments}
