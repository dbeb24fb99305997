"""The Foxglove WebSocket protocol, version 1: a client's JSON and binary messages in, events out; records in, frames out.

Pure. All integers are little-endian. Source: https://github.com/foxglove/ws-protocol (docs/spec.md), and for playback
https://github.com/foxglove/foxglove-sdk.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

from minirospy.errors import BridgeProtocolError

__all__ = [
    "SUBPROTOCOLS",
    "Channel",
    "ClientAdvertise",
    "ClientChannel",
    "ClientMessage",
    "ClientUnadvertise",
    "Event",
    "FetchAsset",
    "GetParameters",
    "GraphTables",
    "Parameter",
    "PlaybackCommand",
    "PlaybackControl",
    "PlaybackState",
    "PlaybackStatus",
    "Schema",
    "ServiceOffer",
    "ServiceRequest",
    "SetParameters",
    "StatusLevel",
    "Subscribe",
    "SubscribeConnectionGraph",
    "SubscribeParameterUpdates",
    "Unsubscribe",
    "UnsubscribeConnectionGraph",
    "UnsubscribeParameterUpdates",
    "advertise",
    "advertise_services",
    "asset",
    "asset_failure",
    "connection_graph_update",
    "message_head",
    "parameter_values",
    "parse_binary",
    "parse_text",
    "playback_state",
    "remove_status",
    "server_info",
    "service_call_failure",
    "service_response_head",
    "status",
    "time_frame",
    "unadvertise",
    "unadvertise_services",
]

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""The names of one protocol; the newer one is preferred where a client offers both."""

MESSAGE_ENCODING = "ros1"
SCHEMA_ENCODING = "ros1msg"

_Fields = Mapping[str, Any]
"""An operation as JSON gives it."""

_MOST_ITEMS = 100_000
"""Entries of one array of a client."""

_UINT32 = (1 << 32) - 1
_MESSAGE_HEAD = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_SERVICE_HEAD = struct.Struct("<BIII")
_ASSET_HEAD = struct.Struct("<BIBI")
_PLAYBACK_CONTROL = struct.Struct("<BBfBQI")
_PLAYBACK_STATE = struct.Struct("<BBQfBI")
_CHANNEL_ID = struct.Struct("<BI")


class StatusLevel(IntEnum):
    """The severity of a status message."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class PlaybackCommand(IntEnum):
    """A client's request to a player."""

    PLAY = 0
    PAUSE = 1


class PlaybackStatus(IntEnum):
    """The status of a player."""

    PLAYING = 0
    PAUSED = 1
    BUFFERING = 2
    ENDED = 3


class Schema(NamedTuple):
    """A type's name and its full text."""

    name: str
    text: str


class Channel(NamedTuple):
    """A topic that clients may subscribe to. An id belongs to one topic with one schema, and is not used again."""

    id: int
    topic: str
    schema: Schema


class ServiceOffer(NamedTuple):
    """A service that clients may call."""

    id: int
    name: str
    type: str
    request: Schema
    response: Schema


class Parameter(NamedTuple):
    """A parameter; ``is_set`` is false for one that is not set, or is to be deleted."""

    name: str
    value: object = None
    is_set: bool = True


class GraphTables(NamedTuple):
    """Names of topics or services -> the nodes on them."""

    published: Mapping[str, Sequence[str]]
    subscribed: Mapping[str, Sequence[str]]
    services: Mapping[str, Sequence[str]]


class PlaybackState(NamedTuple):
    """The status, position (nanoseconds) and speed of a player; ``request_id`` of the request that it answers."""

    status: PlaybackStatus
    now: int
    speed: float
    did_seek: bool = False
    request_id: str = ""


@dataclass(frozen=True)
class Subscribe:
    """``subscriptions``: (subscription id, channel id)."""

    subscriptions: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Unsubscribe:
    """End subscriptions."""

    ids: tuple[int, ...]


class ClientChannel(NamedTuple):
    """A topic that a client publishes; the id is the client's own."""

    id: int
    topic: str
    encoding: str
    schema: Schema


@dataclass(frozen=True)
class ClientAdvertise:
    """Publish topics."""

    channels: tuple[ClientChannel, ...]


@dataclass(frozen=True)
class ClientUnadvertise:
    """Publish topics no more."""

    ids: tuple[int, ...]


@dataclass(frozen=True)
class ClientMessage:
    """A message of a client; ``payload`` is a view of what was received."""

    channel_id: int
    payload: memoryview


@dataclass(frozen=True)
class GetParameters:
    """Request the values of parameters: of all where ``names`` is empty."""

    names: tuple[str, ...]
    id: str | None


@dataclass(frozen=True)
class SetParameters:
    """Set parameters, and delete those that are not set."""

    parameters: tuple[Parameter, ...]
    id: str | None


@dataclass(frozen=True)
class SubscribeParameterUpdates:
    """Report changes of parameters: of all where ``names`` is empty."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class UnsubscribeParameterUpdates:
    """Report changes no more: of no parameter where ``names`` is empty."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class SubscribeConnectionGraph:
    """Report the graph and its changes."""


@dataclass(frozen=True)
class UnsubscribeConnectionGraph:
    """Report the graph no more."""


@dataclass(frozen=True)
class FetchAsset:
    """Request a file."""

    uri: str
    request_id: int


@dataclass(frozen=True)
class ServiceRequest:
    """Call a service."""

    service_id: int
    call_id: int
    encoding: str
    payload: bytes


@dataclass(frozen=True)
class PlaybackControl:
    """Control a player; ``seek``: where to go on (nanoseconds), None: here."""

    command: PlaybackCommand
    speed: float
    seek: int | None
    request_id: str


Event = (
    Subscribe
    | Unsubscribe
    | ClientAdvertise
    | ClientUnadvertise
    | ClientMessage
    | GetParameters
    | SetParameters
    | SubscribeParameterUpdates
    | UnsubscribeParameterUpdates
    | SubscribeConnectionGraph
    | UnsubscribeConnectionGraph
    | FetchAsset
    | ServiceRequest
    | PlaybackControl
)


# --- from a client


def parse_text(text: str | bytes) -> Event:
    """Return the event of a JSON message. Raise BridgeProtocolError."""
    try:
        fields = json.loads(text)
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
    """Return the event of a binary message. Raise BridgeProtocolError."""
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


def _entries(fields: _Fields, key: str) -> list[Any]:
    found = fields.get(key)
    if not isinstance(found, list):
        raise BridgeProtocolError(f"'{key}' is not an array")
    if len(found) > _MOST_ITEMS:
        raise BridgeProtocolError(f"'{key}' has {len(found)} entries, {_MOST_ITEMS} are allowed")
    return found


def _objects(fields: _Fields, key: str) -> list[_Fields]:
    found = _entries(fields, key)
    if not all(isinstance(entry, dict) for entry in found):
        raise BridgeProtocolError(f"'{key}' is not an array of objects")
    return found


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
    if not all(isinstance(entry, str) for entry in found):
        raise BridgeProtocolError("'parameterNames' is not an array of strings")
    return tuple(found)


def _request_id(fields: _Fields) -> str | None:
    value = fields.get("id")
    return None if value is None else str(value)


# --- to a client


def server_info(
    name: str,
    capabilities: Iterable[str],
    metadata: Mapping[str, str],
    session_id: str,
    data_range: tuple[int, int] | None = None,
) -> str:
    """Return the first message; ``data_range``: start and end of what a player plays, in nanoseconds."""
    fields: dict[str, object] = {
        "op": "serverInfo",
        "name": name,
        "capabilities": list(capabilities),
        "supportedEncodings": [MESSAGE_ENCODING],
        "metadata": dict(metadata),
        "sessionId": session_id,
    }
    if data_range:
        for key, time in zip(("dataStartTime", "dataEndTime"), data_range, strict=True):
            sec, nsec = divmod(time, 1_000_000_000)
            fields[key] = {"sec": sec, "nsec": nsec}

    return _dump(fields)


def status(level: StatusLevel, message: str, id_: str | None = None) -> str:
    """Return a status message; a later one with the same id replaces it."""
    fields: dict[str, object] = {"op": "status", "level": int(level), "message": message}
    if id_ is not None:
        fields["id"] = id_
    return _dump(fields)


def remove_status(ids: Iterable[str]) -> str:
    """Return the message that withdraws status messages."""
    return _dump({"op": "removeStatus", "statusIds": list(ids)})


def advertise(channels: Iterable[Channel]) -> str:
    """Return the message that offers channels."""
    offered = [
        {
            "id": channel.id,
            "topic": channel.topic,
            "encoding": MESSAGE_ENCODING,
            "schemaName": channel.schema.name,
            "schema": channel.schema.text,
            "schemaEncoding": SCHEMA_ENCODING,
        }
        for channel in channels
    ]
    return _dump({"op": "advertise", "channels": offered})


def unadvertise(ids: Iterable[int]) -> str:
    """Return the message that withdraws channels."""
    return _dump({"op": "unadvertise", "channelIds": list(ids)})


def advertise_services(services: Iterable[ServiceOffer]) -> str:
    """Return the message that offers services, with the fields of old clients too."""

    def described(schema: Schema) -> dict[str, str]:
        return {
            "encoding": MESSAGE_ENCODING,
            "schemaName": schema.name,
            "schemaEncoding": SCHEMA_ENCODING,
            "schema": schema.text,
        }

    offered = [
        {
            "id": service.id,
            "name": service.name,
            "type": service.type,
            "request": described(service.request),
            "response": described(service.response),
            "requestSchema": service.request.text,
            "responseSchema": service.response.text,
        }
        for service in services
    ]
    return _dump({"op": "advertiseServices", "services": offered})


def unadvertise_services(ids: Iterable[int]) -> str:
    """Return the message that withdraws services."""
    return _dump({"op": "unadvertiseServices", "serviceIds": list(ids)})


def parameter_values(parameters: Iterable[Parameter], id_: str | None = None) -> str:
    """Return the message with values of parameters."""
    fields: dict[str, object] = {
        "op": "parameterValues",
        "parameters": [_parameter_fields(parameter) for parameter in parameters],
    }
    if id_ is not None:
        fields["id"] = id_
    return _dump(fields)


def service_call_failure(service_id: int, call_id: int, message: str) -> str:
    """Return the message about a call that failed."""
    return _dump({"op": "serviceCallFailure", "serviceId": service_id, "callId": call_id, "message": message})


def connection_graph_update(
    changed: GraphTables, removed_topics: Iterable[str], removed_services: Iterable[str]
) -> str:
    """Return the message with the tables' entries that have changed, each whole, and the names that are no more."""

    def listed(table: Mapping[str, Sequence[str]], key: str) -> list[dict[str, object]]:
        return [{"name": name, key: list(nodes)} for name, nodes in table.items()]

    return _dump(
        {
            "op": "connectionGraphUpdate",
            "publishedTopics": listed(changed.published, "publisherIds"),
            "subscribedTopics": listed(changed.subscribed, "subscriberIds"),
            "advertisedServices": listed(changed.services, "providerIds"),
            "removedTopics": list(removed_topics),
            "removedServices": list(removed_services),
        }
    )


def message_head(subscription_id: int, nanoseconds: int) -> bytes:
    """Return the bytes in front of a message of a topic."""
    return _MESSAGE_HEAD.pack(1, subscription_id, nanoseconds)


def time_frame(nanoseconds: int) -> bytes:
    """Return the frame with the time."""
    return _TIME.pack(2, nanoseconds)


def service_response_head(service_id: int, call_id: int, encoding: str = MESSAGE_ENCODING) -> bytes:
    """Return the bytes in front of a service's response."""
    name = encoding.encode()
    return _SERVICE_HEAD.pack(3, service_id, call_id, len(name)) + name


def asset(request_id: int, data: bytes) -> bytes:
    """Return the frame with a file."""
    return _ASSET_HEAD.pack(4, request_id, 0, 0) + data


def asset_failure(request_id: int, why: str) -> bytes:
    """Return the frame about a file that cannot be had."""
    text = why.encode()
    return _ASSET_HEAD.pack(4, request_id, 1, len(text)) + text


def playback_state(state: PlaybackState) -> bytes:
    """Return the frame with a player's state."""
    name = state.request_id.encode()
    return _PLAYBACK_STATE.pack(5, state.status, state.now, state.speed, state.did_seek, len(name)) + name


def _parameter_fields(parameter: Parameter) -> dict[str, object]:
    value = parameter.value
    fields: dict[str, object] = {"name": parameter.name}
    if not parameter.is_set:
        return fields
    if isinstance(value, bytes):
        import base64

        return {**fields, "value": base64.b64encode(value).decode(), "type": "byte_array"}
    fields["value"] = _json_value(value)
    if isinstance(value, float):
        fields["type"] = "float64"
    elif isinstance(value, list | tuple) and value and all(isinstance(each, float) for each in value):
        fields["type"] = "float64_array"
    return fields


def _json_value(value: object) -> object:
    """Return a parameter's value as JSON has it: bytes inside of it as base64, a number that JSON lacks as a text."""
    if isinstance(value, dict):
        return {str(key): _json_value(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(each) for each in value]
    if isinstance(value, bytes):
        import base64

        return base64.b64encode(value).decode()
    if isinstance(value, float) and not -float("inf") < value < float("inf"):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return str(value)


def _dump(fields: Mapping[str, object]) -> str:
    return json.dumps(fields, separators=(",", ":"), allow_nan=False)
