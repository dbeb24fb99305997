"""Parse clients' JSON and binary messages of the Foxglove protocol into events.

Pure. All integers are little-endian. Source: https://github.com/foxglove/ws-protocol (docs/spec.md).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

from minirospy.base.errors import BridgeProtocolError
from minirospy.web.foxglove.protocol import (
    ClientAdvertise,
    ClientChannel,
    ClientMessage,
    ClientUnadvertise,
    Event,
    FetchAsset,
    GetParameters,
    Parameter,
    PlaybackCommand,
    PlaybackControl,
    Schema,
    ServiceRequest,
    SetParameters,
    Subscribe,
    SubscribeConnectionGraph,
    SubscribeParameterUpdates,
    Unsubscribe,
    UnsubscribeConnectionGraph,
    UnsubscribeParameterUpdates,
)
from minirospy.web.json_text import load_json

__all__ = [
    "parse_binary",
    "parse_text",
]

_Fields = Mapping[str, Any]  # a parsed JSON operation

_MAX_ITEMS = 100_000  # maximum number of entries in an array in a client's message

_MAX_VALUES = 1_000_000
_MAX_COLLECTIONS = 100_000
"""Maximum number of brackets in a JSON message, even within strings. Keeps the parsing time below 50 ms.

Messages that clients publish are binary and not affected.
"""

_UINT32 = (1 << 32) - 1
_SERVICE_HEAD = struct.Struct("<BIII")
_PLAYBACK_CONTROL = struct.Struct("<BBfBQI")
_CHANNEL_ID = struct.Struct("<BI")


def parse_text(text: str | bytes) -> Event:
    """Parse a JSON message. Raise BridgeProtocolError if it is invalid."""
    try:
        fields = load_json(text, max_values=_MAX_VALUES, max_collections=_MAX_COLLECTIONS)
    except (ValueError, RecursionError) as error:
        raise BridgeProtocolError(f"a message that is not JSON: {error}") from None
    if not isinstance(fields, dict):
        raise BridgeProtocolError("a message that is not a JSON object")
    op = fields.get("op")
    parse = _OPS.get(op) if isinstance(op, str) else None
    if parse is None:
        raise BridgeProtocolError(f'Unrecognized client opcode "{str(op)[:80]}"')
    try:
        return parse(fields)
    except BridgeProtocolError as error:
        raise BridgeProtocolError(f"{op}: {error}") from None


def parse_binary(data: bytes | bytearray | memoryview) -> Event:
    """Parse a binary message. Raise BridgeProtocolError if it is invalid."""
    view = memoryview(data)
    if not view:
        raise BridgeProtocolError("Received an empty binary message")
    parse = _OPCODES.get(view[0])
    if parse is None:
        raise BridgeProtocolError(f"Unrecognized client opcode {view[0]}")
    try:
        return parse(view)
    except struct.error:
        raise BridgeProtocolError(f"Invalid message length {len(view)} of opcode {view[0]}") from None
    except UnicodeDecodeError:
        raise BridgeProtocolError(f"a text of opcode {view[0]} is not UTF-8") from None


def _subscribe(fields: _Fields) -> Subscribe:
    entries = _objects(fields, "subscriptions")
    return Subscribe(tuple((_id(entry, "id"), _id(entry, "channelId")) for entry in entries))


def _unsubscribe(fields: _Fields) -> Unsubscribe:
    return Unsubscribe(_ids(fields, "subscriptionIds"))


def _advertise(fields: _Fields) -> ClientAdvertise:
    return ClientAdvertise(
        tuple(
            ClientChannel(
                _id(entry, "id"),
                _text(entry, "topic"),
                _text(entry, "encoding"),
                Schema(_text(entry, "schemaName"), _text(entry, "schema", "")),
            )
            for entry in _objects(fields, "channels")
        )
    )


def _unadvertise(fields: _Fields) -> ClientUnadvertise:
    return ClientUnadvertise(_ids(fields, "channelIds"))


def _get_parameters(fields: _Fields) -> GetParameters:
    return GetParameters(_names(fields), _request_id(fields))


def _set_parameters(fields: _Fields) -> SetParameters:
    parameters = tuple(_parameter(entry) for entry in _objects(fields, "parameters"))
    return SetParameters(parameters, _request_id(fields))


def _parameter(entry: _Fields) -> Parameter:
    name, value, type_ = _text(entry, "name"), entry.get("value"), entry.get("type")
    if value is None:
        return Parameter(name, is_set=False)
    try:
        if type_ == "byte_array":
            import base64

            return Parameter(name, base64.b64decode(value, validate=True))
        if type_ == "float64":
            return Parameter(name, float(value))
        if type_ == "float64_array":
            return Parameter(name, [float(each) for each in value])
    except (TypeError, ValueError):
        raise BridgeProtocolError(f"the value of '{name}' is not of type {type_}") from None
    return Parameter(name, value)


def _subscribe_parameters(fields: _Fields) -> SubscribeParameterUpdates:
    return SubscribeParameterUpdates(_names(fields))


def _unsubscribe_parameters(fields: _Fields) -> UnsubscribeParameterUpdates:
    return UnsubscribeParameterUpdates(_names(fields))


def _fetch_asset(fields: _Fields) -> FetchAsset:
    return FetchAsset(_text(fields, "uri"), _id(fields, "requestId"))


_OPS: Mapping[str, Callable[[_Fields], Event]] = {
    "subscribe": _subscribe,
    "unsubscribe": _unsubscribe,
    "advertise": _advertise,
    "unadvertise": _unadvertise,
    "getParameters": _get_parameters,
    "setParameters": _set_parameters,
    "subscribeParameterUpdates": _subscribe_parameters,
    "unsubscribeParameterUpdates": _unsubscribe_parameters,
    "subscribeConnectionGraph": lambda _: SubscribeConnectionGraph(),
    "unsubscribeConnectionGraph": lambda _: UnsubscribeConnectionGraph(),
    "fetchAsset": _fetch_asset,
}


def _client_message(view: memoryview) -> ClientMessage:
    _, channel = _CHANNEL_ID.unpack_from(view)
    return ClientMessage(channel, view[_CHANNEL_ID.size :])


def _service_request(view: memoryview) -> ServiceRequest:
    _, service, call, length = _SERVICE_HEAD.unpack_from(view)
    encoding, rest = _sized_text(view[_SERVICE_HEAD.size :], length)
    return ServiceRequest(service, call, encoding, bytes(rest))


def _playback_control(view: memoryview) -> PlaybackControl:
    _, command, speed, has_seek, time, length = _PLAYBACK_CONTROL.unpack_from(view)
    request_id, _ = _sized_text(view[_PLAYBACK_CONTROL.size :], length)
    if command not in tuple(PlaybackCommand):
        raise BridgeProtocolError(f"an unknown playback command {command}")
    if not 0 < speed < float("inf"):
        raise BridgeProtocolError(f"a playback speed of {speed}: it has to be above 0")
    return PlaybackControl(PlaybackCommand(command), speed, time if has_seek else None, request_id)


_OPCODES: Mapping[int, Callable[[memoryview], Event]] = {
    1: _client_message,
    2: _service_request,
    3: _playback_control,
}


def _sized_text(view: memoryview, length: int) -> tuple[str, memoryview]:
    if length > len(view):
        raise BridgeProtocolError(f"a text of {length} bytes in a message where {len(view)} are left")
    return bytes(view[:length]).decode(), view[length:]


def _entries(fields: _Fields, key: str) -> list[object]:
    found = fields.get(key)
    if not isinstance(found, list):
        raise BridgeProtocolError(f"'{key}' is not an array")
    if len(found) > _MAX_ITEMS:
        raise BridgeProtocolError(f"'{key}' has {len(found)} entries, {_MAX_ITEMS} are allowed")
    return found


def _objects(fields: _Fields, key: str) -> list[_Fields]:
    found = _entries(fields, key)
    objects: list[_Fields] = [entry for entry in found if isinstance(entry, dict)]
    if len(objects) < len(found):
        raise BridgeProtocolError(f"'{key}' is not an array of objects")
    return objects


def _ids(fields: _Fields, key: str) -> tuple[int, ...]:
    return tuple(_checked_id(entry, key) for entry in _entries(fields, key))


def _id(fields: _Fields, key: str) -> int:
    return _checked_id(fields.get(key), key)


def _checked_id(value: object, key: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _UINT32:
        raise BridgeProtocolError(f"'{key}' is not a number from 0 to {_UINT32}")
    return value


def _text(fields: _Fields, key: str, default: str | None = None) -> str:
    value = fields.get(key)
    if value is None and default is not None:
        return default
    if not isinstance(value, str):
        raise BridgeProtocolError(f"'{key}' is not a string")
    return value


def _names(fields: _Fields) -> tuple[str, ...]:
    found = _entries(fields, "parameterNames")
    names = tuple(entry for entry in found if isinstance(entry, str))
    if len(names) < len(found):
        raise BridgeProtocolError("'parameterNames' is not an array of strings")
    return names


def _request_id(fields: _Fields) -> str | None:
    value = fields.get("id")
    return None if value is None else str(value)
