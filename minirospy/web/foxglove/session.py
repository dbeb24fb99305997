"""One client of the Foxglove protocol: its subscriptions, publications, calls and requests."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from minirospy.base.errors import (
    BridgeError,
    BridgeProtocolError,
    MasterUnreachableError,
    RpcError,
    ServiceException,
)
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.web.foxglove import parsing, protocol, serializing
from minirospy.web.foxglove.protocol import (
    Channel,
    Event,
    GraphTables,
    Parameter,
    Playback,
    PlaybackState,
    StatusLevel,
)
from minirospy.web.graph import Arrival, Publication, SharedGraph
from minirospy.web.server.files import FileAnswer

if TYPE_CHECKING:
    from minirospy.core.wire.header import Header
    from minirospy.web.foxglove.assets import Assets
    from minirospy.web.foxglove.channels import Channels, Services
    from minirospy.web.foxglove.parameters import Parameters
    from minirospy.web.server.client import WebClient

__all__ = ["FoxgloveServer", "FoxgloveSession"]

_log = logging.getLogger(__name__)

_MAX_CALLS = 200
"""Maximum number of concurrent calls and requests per client."""

_MAX_CHANNELS = 1000
"""Maximum number of topics that a client may publish, and maximum number of its subscriptions, which all get every message."""

_MAX_PARAMETERS = 10_000
"""Maximum number of parameters that a client may subscribe to by name."""

# maximum number of status messages per client message, which may contain thousands of invalid channels
_MAX_STATUSES = 100
_VALUE_FACTOR = 4
"""Bytes of memory that a parsed operation takes per byte of JSON text, measured for objects and lists of numbers."""

_TIME = "time"  # key of time messages in a client's queue, which keeps only the newest message per key


class FoxgloveServer(Protocol):
    """The endpoint, as used by the session of a client."""

    graph: SharedGraph
    assets: Assets
    playback: Playback | None
    channels: Channels
    services: Services
    parameters: Parameters

    def capabilities_of(self, client: WebClient) -> list[str]:
        """Return the capabilities of a client."""

    def definition_differs(self, channel: Channel, header: Header) -> None:
        """Replace a channel because its publisher's definition differs from the installed one."""

    def playback_changed(self, state: PlaybackState) -> None:
        """Send the state of a player to all clients."""

    def left(self, session: FoxgloveSession) -> None:
        """Remove a client that has disconnected."""


class FoxgloveSession:
    """The session of one client. Its connection calls the methods on the loop."""

    def __init__(self, endpoint: FoxgloveServer, client: WebClient) -> None:
        self.client = client
        self.wants_graph = False
        self._endpoint = endpoint
        self._graph = endpoint.graph
        self._subscriptions: dict[int, tuple[Channel, Callable[[Arrival], None]]] = {}
        self._publications: dict[int, Publication] = {}
        self._calls: set[asyncio.Task[None]] = set()
        self._calls_size = 0  # memory of the calls in progress, in bytes
        self._operation_size = 0  # memory of the operation being handled, in bytes
        self._dropped = 0
        self._are_drops_shown = False
        self._statuses = 0
        # _statuses is the number of status messages about the client message being handled.

        self._handlers: Mapping[type[Event], Callable[[Any], None]] = {
            protocol.Subscribe: self._subscribe,
            protocol.Unsubscribe: self._unsubscribe,
            protocol.ClientAdvertise: self._advertise,
            protocol.ClientUnadvertise: self._unadvertise,
            protocol.ClientMessage: self._publish,
            protocol.GetParameters: self._get_parameters,
            protocol.SetParameters: self._set_parameters,
            protocol.SubscribeParameterUpdates: self._subscribe_parameters,
            protocol.UnsubscribeParameterUpdates: self._unsubscribe_parameters,
            protocol.SubscribeConnectionGraph: self._subscribe_graph,
            protocol.UnsubscribeConnectionGraph: self._unsubscribe_graph,
            protocol.FetchAsset: self._fetch_asset,
            protocol.ServiceRequest: self._call_service,
            protocol.PlaybackControl: self._control_playback,
        }

    # --- called by the client's connection

    def received_text(self, text: str) -> None:
        """Handle a JSON message."""
        self._operation_size = _VALUE_FACTOR * sys.getsizeof(text)
        self._handle(parsing.parse_text, text)

    def received_binary(self, data: bytes) -> None:
        """Handle a binary message."""
        self._operation_size = len(data)
        self._handle(parsing.parse_binary, data)

    def ended(self) -> None:
        """Close the client's subscriptions and publications, and cancel its calls."""
        for channel, listener in self._subscriptions.values():
            self._graph.unsubscribe(channel.topic, listener)
        self._subscriptions.clear()
        for publication in self._publications.values():
            publication.close()
        self._publications.clear()
        for task in list(self._calls):
            task.cancel()
        self._endpoint.parameters.forget(self)
        self._endpoint.left(self)

    # --- called by the endpoint

    def send(self, text: str) -> None:
        """Send a JSON message."""
        self.client.send_text(text)

    def send_time(self, frame: bytes) -> None:
        """Send the time; a slow client's queue keeps only the newest time."""
        self.client.send_message(_TIME, frame, b"", newest_only=True)

    def channels_removed(self, ids: list[int]) -> None:
        """Cancel the subscriptions to removed channels."""
        for subscription_id, (channel, listener) in list(self._subscriptions.items()):
            if channel.id in ids:
                del self._subscriptions[subscription_id]
                self._graph.unsubscribe(channel.topic, listener)
        self.send(serializing.unadvertise(ids))

    def report_drops(self) -> None:
        """Notify the client when messages start to be dropped, or are no longer dropped. Called periodically."""
        dropped = self.client.queue.dropped
        if dropped > self._dropped:
            counts = self.client.queue.dropped_of.most_common(3)
            topics = [self._subscriptions[key][0].topic for key, _ in counts if key in self._subscriptions]
            self._status(
                StatusLevel.WARNING,
                f"Send buffer limit reached: {dropped} messages dropped, most of {', '.join(topics) or 'the time'}: "
                "this connection is slower than what it subscribes to",
                "drops",
            )
            self._are_drops_shown = True
        elif self._are_drops_shown:
            self.send(serializing.remove_status(["drops"]))
            self._are_drops_shown = False
        self._dropped = dropped

    def parameters_changed(self, changed: list[Parameter]) -> None:
        """Send changed parameters to the client."""
        self.send(serializing.parameter_values(changed))

    # --- internals

    def _handle(self, parse: Callable[[Any], Event], data: str | bytes) -> None:
        self._statuses = 0
        try:
            event = parse(data)
            self._handlers[type(event)](event)
        except (BridgeProtocolError, BridgeError) as error:
            self._status(StatusLevel.ERROR, str(error))

    def _status(self, level: StatusLevel, text: str, id_: str | None = None) -> None:
        if id_ is None:
            self._statuses += 1
            if self._statuses > _MAX_STATUSES:
                return
            if self._statuses == _MAX_STATUSES:
                text = "further faults of this message are not reported"
        self.send(serializing.status(level, text, id_))

    def _require(self, capability: str, doing: str) -> None:
        """Raise BridgeError if the client lacks a capability. ``doing`` describes the refused activity in the message."""
        if capability not in self._endpoint.capabilities_of(self.client):
            why = (
                "this token is read-only" if not self.client.may_write else f"'{capability}' is switched off"
            )
            raise BridgeError(f"{doing} is not allowed: {why}")

    def _spawn(self, work: Coroutine[object, object, object]) -> None:
        """Start a task for the received request. The request's memory is counted until the task ends."""
        if len(self._calls) >= _MAX_CALLS:
            work.close()
            raise BridgeError(f"{_MAX_CALLS} requests are under way: wait for an answer")
        task = self._graph.spawn(work)
        self._calls.add(task)
        size = self._operation_size
        self._count_call(size)

        def ended(task: asyncio.Task[None]) -> None:
            self._calls.discard(task)
            self._count_call(-size)

        task.add_done_callback(ended)

    def _count_call(self, size: int) -> None:
        self._calls_size += size
        self.client.holds(self._calls_size)

    def _subscribe(self, event: protocol.Subscribe) -> None:
        for subscription_id, channel_id in event.subscriptions:
            channel = self._endpoint.channels.by_id.get(channel_id)
            if subscription_id in self._subscriptions:
                self._status(
                    StatusLevel.ERROR,
                    f"Client subscription id {subscription_id} was already used; ignoring subscription",
                )
            elif channel is None:
                self._status(
                    StatusLevel.WARNING,
                    f"Channel {channel_id} is not available; ignoring subscription {subscription_id}",
                )
            elif len(self._subscriptions) >= _MAX_CHANNELS:
                raise BridgeError(f"a client may have {_MAX_CHANNELS} subscriptions")
            else:
                listener = partial(
                    self._arrived,
                    subscription_id,
                    channel,
                    self._endpoint.channels.type_of(channel_id).md5sum,
                )
                self._subscriptions[subscription_id] = (channel, listener)
                self._graph.subscribe(channel.topic, listener)

    def _arrived(self, subscription_id: int, channel: Channel, md5sum: str, arrival: Arrival) -> None:
        if (arrival.header["md5sum"] != md5sum and md5sum != ANY) or (
            not channel.schema.text and md5sum == ANY
        ):
            # The client would decode the message with a definition that does not match the publisher's.
            self._endpoint.definition_differs(channel, arrival.header)
            return
        head = serializing.message_head(subscription_id, arrival.nanoseconds)
        self.client.send_message(subscription_id, head, arrival.body)

    def _unsubscribe(self, event: protocol.Unsubscribe) -> None:
        for subscription_id in event.ids:
            found = self._subscriptions.pop(subscription_id, None)
            if found is None:
                self._status(
                    StatusLevel.WARNING,
                    f"Client subscription id {subscription_id} did not exist; ignoring unsubscription",
                )
                continue
            self._graph.unsubscribe(found[0].topic, found[1])
            self.client.discard(subscription_id)

    def _advertise(self, event: protocol.ClientAdvertise) -> None:
        self._require("clientPublish", "publishing")
        for channel in event.channels:
            if channel.id in self._publications:
                self._status(StatusLevel.ERROR, f"Channel {channel.id} is advertised already; ignoring it")
            elif channel.encoding != protocol.MESSAGE_ENCODING:
                self._status(
                    StatusLevel.ERROR,
                    f"Unsupported encoding '{channel.encoding}' of channel {channel.id}. Only 'ros1' encoding is "
                    "supported at the moment.",
                )
            elif len(self._publications) >= _MAX_CHANNELS:
                raise BridgeError(f"a client may publish {_MAX_CHANNELS} topics")
            else:
                self._advertise_topic(channel)

    def _advertise_topic(self, channel: protocol.ClientChannel) -> None:
        from minirospy.introspect.graph import why_illegal
        from minirospy.introspect.type_texts import installed_type, type_of_text

        why = why_illegal(channel.topic)
        if why:
            raise BridgeError(f"topic [{channel.topic}]: {why}")
        name = channel.schema.name
        type_: InterfaceType | None = installed_type(name)
        if type_ is None and channel.schema.text:
            type_ = type_of_text(name, channel.schema.text)
        if type_ is None:
            raise BridgeError(
                f"Failed to retrieve type information of data type '{name}': its package is not installed here. "
                f"Unable to advertise topic {channel.topic}"
            )
        self._publications[channel.id] = self._graph.advertise(self._graph.node.resolve(channel.topic), type_)

    def _unadvertise(self, event: protocol.ClientUnadvertise) -> None:
        for id_ in event.ids:
            publication = self._publications.pop(id_, None)
            if publication:
                publication.close()
            else:
                self._status(StatusLevel.WARNING, f"Channel {id_} is not advertised; ignoring it")

    def _publish(self, event: protocol.ClientMessage) -> None:
        publication = self._publications.get(event.channel_id)
        if publication is None:
            raise BridgeError(f"Channel {event.channel_id} is not advertised: its message is dropped")
        publication.publish_when_joined(bytes(event.payload))

    def _get_parameters(self, event: protocol.GetParameters) -> None:
        self._require("parameters", "reading parameters")
        self._spawn(self._send_parameters(event.names, event.id, lists_unset=True))

    async def _send_parameters(self, names: tuple[str, ...], id_: str | None, *, lists_unset: bool) -> None:
        try:
            found = await self._endpoint.parameters.read(names)
        except (MasterUnreachableError, RpcError) as error:
            self._status(StatusLevel.ERROR, f"parameters cannot be read: {error}")
            return
        unset = [parameter.name for parameter in found if not parameter.is_set]
        if unset and lists_unset:
            self._status(
                StatusLevel.ERROR, f"Failed to retrieve the following parameters: {', '.join(unset[:20])}"
            )
        self.send(serializing.parameter_values((each for each in found if each.is_set), id_))

    def _set_parameters(self, event: protocol.SetParameters) -> None:
        self._require("parameters", "setting parameters")
        if not self.client.may_write:
            raise BridgeError("setting parameters is not allowed: this token is read-only")
        self._spawn(self._write_parameters(event))

    async def _write_parameters(self, event: protocol.SetParameters) -> None:
        for why in await self._endpoint.parameters.write(event.parameters):
            self._status(StatusLevel.ERROR, why)
        if event.id is not None:
            names = tuple(parameter.name for parameter in event.parameters)
            if names:
                await self._send_parameters(names, event.id, lists_unset=False)

    def _subscribe_parameters(self, event: protocol.SubscribeParameterUpdates) -> None:
        self._require("parametersSubscribe", "subscribing to parameters")
        if self._endpoint.parameters.count(self) + len(event.names) > _MAX_PARAMETERS:
            raise BridgeError(
                f"a client may subscribe to {_MAX_PARAMETERS} parameters, or to all without names"
            )
        self._endpoint.parameters.subscribe(self, event.names)

    def _unsubscribe_parameters(self, event: protocol.UnsubscribeParameterUpdates) -> None:
        self._endpoint.parameters.unsubscribe(self, event.names)

    def _subscribe_graph(self, _: protocol.SubscribeConnectionGraph) -> None:
        self._require("connectionGraph", "subscribing to the graph")
        self.wants_graph = True
        snapshot = self._graph.snapshot
        tables = GraphTables(snapshot.publishers, snapshot.subscribers, snapshot.services)
        self.send(serializing.connection_graph_update(tables, (), ()))

    def _unsubscribe_graph(self, _: protocol.UnsubscribeConnectionGraph) -> None:
        if not self.wants_graph:
            raise BridgeError("Client was not subscribed to connection graph updates")
        self.wants_graph = False

    def _fetch_asset(self, event: protocol.FetchAsset) -> None:
        try:
            self._require("assets", "fetching assets")
        except BridgeError as error:
            self.client.send_binary(serializing.asset_failure(event.request_id, str(error)))
            return
        self.client.send_file(
            FileAnswer(
                partial(self._endpoint.assets.open, event.uri),
                lambda _: serializing.asset_head(event.request_id),
                partial(serializing.asset_failure, event.request_id),
            )
        )

    def _call_service(self, event: protocol.ServiceRequest) -> None:
        try:
            self._require("services", "calling services")
            info = self._endpoint.services.infos.get(event.service_id)
            if info is None:
                raise BridgeError(f"Service with id {event.service_id} does not exist")
            if event.encoding != protocol.MESSAGE_ENCODING:
                raise BridgeError(
                    f"Service request encoding '{event.encoding}' is not supported. Only 'ros1' encoding is supported"
                )
            self._spawn(self._call(event, info.name, info.md5sum))
        except BridgeError as error:
            self._call_failed(event, str(error))

    async def _call(self, event: protocol.ServiceRequest, name: str, md5sum: str) -> None:
        try:
            response = await self._graph.call(name, md5sum, event.payload)
        except (ServiceException, BridgeError) as error:
            self._call_failed(event, str(error))
        except Exception:
            # The task logs the error, but the client also needs a response.
            self._call_failed(event, "the bridge failed on this call")
            raise
        else:
            self.client.send_binary(
                serializing.service_response_head(event.service_id, event.call_id), response
            )

    def _call_failed(self, event: protocol.ServiceRequest, why: str) -> None:
        self.send(serializing.service_call_failure(event.service_id, event.call_id, why))

    def _control_playback(self, event: protocol.PlaybackControl) -> None:
        self._require("playbackControl", "controlling the player")
        assert self._endpoint.playback
        self._endpoint.playback.control(event)
        self._endpoint.playback_changed(self._endpoint.playback.state())
