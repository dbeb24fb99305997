"""The Foxglove WebSocket protocol, version 1: events from clients, and records sent by the server.

``parsing.py`` parses messages into events, ``serializing.py`` serializes records. Pure.
Source: https://github.com/foxglove/ws-protocol (docs/spec.md), and for playback https://github.com/foxglove/foxglove-sdk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

__all__ = [
    "MESSAGE_ENCODING",
    "SCHEMA_ENCODING",
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
    "Playback",
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
]

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Two names for the same protocol. If a client offers both, the newer one is chosen."""

MESSAGE_ENCODING = "ros1"
SCHEMA_ENCODING = "ros1msg"


class StatusLevel(IntEnum):
    """The severity of a status message."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class PlaybackCommand(IntEnum):
    """A playback command from a client."""

    PLAY = 0
    PAUSE = 1


class PlaybackStatus(IntEnum):
    """A player's status."""

    PLAYING = 0
    PAUSED = 1
    BUFFERING = 2
    ENDED = 3


class Schema(NamedTuple):
    """The name of a type, and its full definition."""

    name: str
    text: str


class Channel(NamedTuple):
    """A topic to which clients may subscribe. Its id is never reused for another topic or schema."""

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
    """A parameter. ``is_set`` is False if the parameter is not set, or is to be deleted."""

    name: str
    value: object = None
    is_set: bool = True


class GraphTables(NamedTuple):
    """Dicts from topic or service to the nodes that use it."""

    published: Mapping[str, Sequence[str]]
    subscribed: Mapping[str, Sequence[str]]
    services: Mapping[str, Sequence[str]]


class PlaybackState(NamedTuple):
    """A player's status, position in nanoseconds, and speed. ``request_id`` identifies the request being answered, if any."""

    status: PlaybackStatus
    now: int
    speed: float
    did_seek: bool = False
    request_id: str = ""


@dataclass(frozen=True)
class Subscribe:
    """A client's request to subscribe to channels. ``subscriptions`` contains pairs (subscription id, channel id)."""

    subscriptions: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Unsubscribe:
    """A client's request to cancel the subscriptions with these ids."""

    ids: tuple[int, ...]


class ClientChannel(NamedTuple):
    """A topic that a client publishes. The client chooses its id."""

    id: int
    topic: str
    encoding: str
    schema: Schema


@dataclass(frozen=True)
class ClientAdvertise:
    """A client's request to advertise topics, which it will publish."""

    channels: tuple[ClientChannel, ...]


@dataclass(frozen=True)
class ClientUnadvertise:
    """A client's request to unadvertise the topics with these ids."""

    ids: tuple[int, ...]


@dataclass(frozen=True)
class ClientMessage:
    """A message from a client; ``payload`` is a view into the received data."""

    channel_id: int
    payload: memoryview


@dataclass(frozen=True)
class GetParameters:
    """A client's request for the values of parameters, or of all parameters if ``names`` is empty."""

    names: tuple[str, ...]
    id: str | None


@dataclass(frozen=True)
class SetParameters:
    """A client's request to set parameters, and to delete those with ``is_set`` False."""

    parameters: tuple[Parameter, ...]
    id: str | None


@dataclass(frozen=True)
class SubscribeParameterUpdates:
    """A client's request to subscribe to changes of parameters, or of all parameters if ``names`` is empty."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class UnsubscribeParameterUpdates:
    """A client's request to unsubscribe from changes of parameters, or of all parameters if ``names`` is empty."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class SubscribeConnectionGraph:
    """A client's request to subscribe to the graph and its changes."""


@dataclass(frozen=True)
class UnsubscribeConnectionGraph:
    """A client's request to unsubscribe from the graph."""


@dataclass(frozen=True)
class FetchAsset:
    """A client's request for a file, given by its URI."""

    uri: str
    request_id: int


@dataclass(frozen=True)
class ServiceRequest:
    """A client's request to call a service."""

    service_id: int
    call_id: int
    encoding: str
    payload: bytes


@dataclass(frozen=True)
class PlaybackControl:
    """A client's request to control a player. ``seek`` is the new position in nanoseconds, or None to keep the current one."""

    command: PlaybackCommand
    speed: float
    seek: int | None
    request_id: str


class Playback(Protocol):
    """A player that clients may control."""

    @property
    def range(self) -> tuple[int, int]:
        """Return the recording's start and end times, in nanoseconds."""

    def now(self) -> int:
        """Return the playback time, in nanoseconds, with which messages are stamped."""

    def state(self) -> PlaybackState: ...

    def control(self, control: PlaybackControl) -> None: ...


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
