"""The channels and services offered to all clients of the Foxglove protocol. Assigns ids to the graph's topics and services."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.introspect.type_texts import ServiceInfo
from minirospy.web.foxglove.protocol import Channel, Schema, ServiceOffer
from minirospy.web.graph import SharedGraph

__all__ = ["Channels", "Services"]

TYPE_SECONDS = 3.0
"""Timeout in seconds for querying types that are not installed; short, because all clients wait for their channels meanwhile."""


class Channels:
    """Offers the graph's topics as channels. A topic gets a new channel if its type or definition changes."""

    def __init__(self) -> None:
        self.by_id: dict[int, Channel] = {}
        self._ids = itertools.count(1)
        self._by_topic: dict[str, Channel] = {}
        self._types: dict[int, InterfaceType] = {}
        self._declared: dict[int, str] = {}
        self._definitions: dict[str, set[str]] = {}

    def clear(self) -> None:
        """Remove all channels. Their ids are not reused."""
        for table in (self.by_id, self._by_topic, self._types, self._declared, self._definitions):
            table.clear()

    def type_of(self, channel_id: int) -> InterfaceType:
        """Return the message type of a channel."""
        return self._types[channel_id]

    async def update(self, graph: SharedGraph) -> tuple[list[Channel], list[int]]:
        """Match the channels to the graph; return new channels, and the ids of removed ones."""
        snapshot = graph.snapshot
        wanted = {
            topic: snapshot.types[topic]
            for topic in snapshot.publishers
            if snapshot.types.get(topic, ANY) != ANY
        }
        removed = [
            channel.id
            for topic, channel in self._by_topic.items()
            if wanted.get(topic) != self._declared[channel.id]
        ]
        for id_ in removed:
            self._remove(id_)

        new = []
        others = {}
        for topic, declared in wanted.items():
            if topic in self._by_topic:
                continue
            type_ = await graph.texts.installed(declared)
            if type_:
                new.append(self._add(topic, declared, type_))
            else:
                others[topic] = snapshot.publishers.get(topic, ())

        # If no publisher responds in time, the first message will provide the type.
        found = await graph.texts.of_publishers(others, TYPE_SECONDS)
        new += [
            self._add(topic, wanted[topic], found.get(topic) or InterfaceType(wanted[topic], ANY))
            for topic in others
        ]
        return new, removed

    def redefine(self, channel: Channel, header: Header) -> Channel | None:
        """Replace a channel whose publisher uses another definition; return the new channel.

        Return None if the channel has been removed, or if it was replaced before, because its publishers then contradict
        each other.
        """
        md5sum = header.get("md5sum", ANY)
        if self.by_id.get(channel.id) is not channel or md5sum in self._definitions[channel.topic]:
            return None
        declared = self._declared[channel.id]
        self._remove(channel.id, forgets=False)
        type_ = InterfaceType(header.get("type", declared), md5sum, header.get("message_definition", ""))
        return self._add(channel.topic, declared, type_)

    def _add(self, topic: str, declared: str, type_: InterfaceType) -> Channel:
        channel = Channel(next(self._ids), topic, Schema(type_.name, type_.definition))
        self.by_id[channel.id] = self._by_topic[topic] = channel
        self._types[channel.id] = type_
        self._declared[channel.id] = declared
        if type_.md5sum != ANY:
            self._definitions.setdefault(topic, set()).add(type_.md5sum)
        else:
            self._definitions.setdefault(topic, set())
        return channel

    def _remove(self, id_: int, *, forgets: bool = True) -> None:
        channel = self.by_id.pop(id_)
        del self._by_topic[channel.topic], self._types[id_], self._declared[id_]
        if forgets:
            self._definitions.pop(channel.topic, None)


class Services:
    """The graph's services, each with an id. A service gets a new id if its type changes."""

    def __init__(self) -> None:
        self.by_id: dict[int, ServiceOffer] = {}
        self.infos: dict[int, ServiceInfo] = {}
        self._ids = itertools.count(1)

    def clear(self) -> None:
        """Remove all services. Their ids are not reused."""
        self.by_id.clear()
        self.infos.clear()

    def update(self, graph: SharedGraph) -> tuple[list[ServiceOffer], list[int]]:
        """Match the services to the graph; return new services, and the ids of removed ones."""
        infos = (graph.service_info(name) for name in graph.snapshot.services)
        wanted: Mapping[str, ServiceInfo] = {info.name: info for info in infos if info}
        removed = [id_ for id_, info in self.infos.items() if wanted.get(info.name) != info]
        for id_ in removed:
            del self.infos[id_], self.by_id[id_]

        known = {info.name for info in self.infos.values()}
        new = []
        for name, info in wanted.items():
            if name not in known:
                offer = ServiceOffer(
                    next(self._ids),
                    name,
                    info.type,
                    Schema(info.request.name, info.request.definition),
                    Schema(info.response.name, info.response.definition),
                )
                self.by_id[offer.id], self.infos[offer.id] = offer, info
                new.append(offer)
        return new, removed
