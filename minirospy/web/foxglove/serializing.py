"""Serialize a server's records as JSON and binary messages of the Foxglove protocol.

Pure. All integers are little-endian. Source: https://github.com/foxglove/ws-protocol (docs/spec.md).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping, Sequence

from minirospy.web.foxglove.protocol import (
    MESSAGE_ENCODING,
    SCHEMA_ENCODING,
    Channel,
    GraphTables,
    Parameter,
    PlaybackState,
    Schema,
    ServiceOffer,
    StatusLevel,
)

__all__ = [
    "advertise",
    "advertise_services",
    "asset_failure",
    "asset_head",
    "connection_graph_update",
    "message_head",
    "parameter_values",
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

_MESSAGE_HEAD = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_SERVICE_HEAD = struct.Struct("<BIII")
_ASSET_HEAD = struct.Struct("<BIBI")
_PLAYBACK_STATE = struct.Struct("<BBQfBI")


def server_info(
    name: str,
    capabilities: Iterable[str],
    metadata: Mapping[str, str],
    session_id: str,
    data_range: tuple[int, int] | None = None,
) -> str:
    """Return the first message to a client. ``data_range`` is the start and end of a player's recording, in nanoseconds."""
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
    """Return a status message. In the client, it replaces an earlier one with the same id."""
    fields: dict[str, object] = {"op": "status", "level": int(level), "message": message}
    if id_ is not None:
        fields["id"] = id_
    return _dump(fields)


def remove_status(ids: Iterable[str]) -> str:
    """Return the message that removes the status messages with these ids."""
    return _dump({"op": "removeStatus", "statusIds": list(ids)})


def advertise(channels: Iterable[Channel]) -> str:
    """Return the message that advertises channels."""
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
    """Return the message that removes the channels with these ids."""
    return _dump({"op": "unadvertise", "channelIds": list(ids)})


def advertise_services(services: Iterable[ServiceOffer]) -> str:
    """Return the message that advertises services. It includes fields that only older clients need."""

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
    """Return the message that removes the services with these ids."""
    return _dump({"op": "unadvertiseServices", "serviceIds": list(ids)})


def parameter_values(parameters: Iterable[Parameter], id_: str | None = None) -> str:
    """Return the message that contains parameter values."""
    fields: dict[str, object] = {
        "op": "parameterValues",
        "parameters": [_parameter_fields(parameter) for parameter in parameters],
    }
    if id_ is not None:
        fields["id"] = id_
    return _dump(fields)


def service_call_failure(service_id: int, call_id: int, message: str) -> str:
    """Return the message that reports a failed service call."""
    return _dump({"op": "serviceCallFailure", "serviceId": service_id, "callId": call_id, "message": message})


def connection_graph_update(
    changed: GraphTables, removed_topics: Iterable[str], removed_services: Iterable[str]
) -> str:
    """Return the message that updates the graph: the complete entries that have changed, and the names that were removed."""

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
    """Return the header that precedes a message on a topic."""
    return _MESSAGE_HEAD.pack(1, subscription_id, nanoseconds)


def time_frame(nanoseconds: int) -> bytes:
    """Return the frame that contains the current time."""
    return _TIME.pack(2, nanoseconds)


def service_response_head(service_id: int, call_id: int, encoding: str = MESSAGE_ENCODING) -> bytes:
    """Return the header that precedes the response of a service."""
    name = encoding.encode()
    return _SERVICE_HEAD.pack(3, service_id, call_id, len(name)) + name


def asset_head(request_id: int) -> bytes:
    """Return the header that precedes the bytes of a file."""
    return _ASSET_HEAD.pack(4, request_id, 0, 0)


def asset_failure(request_id: int, why: str) -> bytes:
    """Return the frame that reports that a file is not available."""
    text = why.encode("utf-8", "replace")
    return _ASSET_HEAD.pack(4, request_id, 1, len(text)) + text


def playback_state(state: PlaybackState) -> bytes:
    """Return the frame that contains a player's state."""
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
    """Convert a parameter's value for JSON: bytes to base64, and numbers that JSON cannot represent to strings."""
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
