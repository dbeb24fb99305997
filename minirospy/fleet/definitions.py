"""The full definitions of message types, obtained from packages, publishers and peers.

Definitions from peers are checked against their md5sums.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

from minirospy.base.errors import DefinitionError, MinirospyError
from minirospy.core.idl.load import checked_text
from minirospy.core.idl.spec import MessageSpec
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.fleet.frames import FrameRewriter
from minirospy.fleet.keys import definition_key
from minirospy.fleet.network import FleetNetwork, QueryFailed
from minirospy.introspect.type_texts import TypeTexts

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Definitions", "checked_specs"]

_MOST = 5_000
ANSWER_SECONDS = 10.0
# maximum total length of the cached definitions, in characters; those of all ROS packages have 3 million
MAX_CHARACTERS = 64 << 20
# maximum number of concurrent queries, in total and per gateway; each times out after ANSWER_SECONDS
MAX_QUERIES, MAX_QUERIES_OF_GATEWAY = 256, 4
_NO_FIELDS = "d41d8cd98f00b204e9800998ecf8427e"


def checked_specs(name: str, text: str, md5sum: str) -> dict[str, MessageSpec]:
    """Return the specs in a full definition. Raise DefinitionError if the definition is invalid or its md5sum differs."""
    specs, found = checked_text(name, text)
    if found != md5sum:
        raise DefinitionError(name, 1, f"its md5sum is {found}, not {md5sum}")
    return specs


class Definitions:
    """Caches message definitions. Generates no message classes, because the gateway forwards serialized messages."""

    def __init__(self, node: Node, network: FleetNetwork) -> None:
        self.texts = TypeTexts(node)
        self._network = network
        self._known: dict[tuple[str, str], str] = {}
        self._known_characters = 0
        self._finding: dict[tuple[str, str, str], asyncio.Task[str]] = {}
        """The running queries, keyed by (type, md5sum, gateway)."""
        self._shares: WeakValueDictionary[str, asyncio.Semaphore] = WeakValueDictionary()
        self._querying = asyncio.Semaphore(MAX_QUERIES)
        self._rewriters: dict[tuple[str, str], FrameRewriter | None] = {}

    async def close(self) -> None:
        """Cancel the running queries."""
        tasks = list(self._finding.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self.texts.close()

    def learn(self, name: str, md5sum: str, text: str) -> None:
        """Store the definition of a type, as found in a publisher's connection header."""
        if not text or (name, md5sum) in self._known or len(self._known) >= _MOST:
            return
        if self._known_characters + len(text) <= MAX_CHARACTERS:
            self._known[name, md5sum] = text
            self._known_characters += len(text)

    async def md5sum(self, name: str) -> str:
        """Return the md5sum of an installed type, or "" if the type is not installed."""
        found = await self.texts.installed(name)
        return found.md5sum if found else ""

    async def text(self, name: str, md5sum: str) -> str:
        """Return a type's definition, or "" if it is not known locally."""
        if (name, md5sum) not in self._known:
            installed = await self.texts.installed(name)
            if installed is None or installed.md5sum != md5sum:
                return ""
            self.learn(name, md5sum, installed.definition)
        return self._known.get((name, md5sum), "")

    async def interface(self, name: str, md5sum: str, gateway: str) -> InterfaceType:
        """Return a type, with its definition if it is known here or at the peer ``gateway`` ("": ask no peer).

        Messages are forwarded even if the definition is not known.
        """
        text = await self.text(name, md5sum)
        if not text and gateway and md5sum != _NO_FIELDS:
            # Query each gateway separately, so that an unresponsive one delays only its own topics.
            key = name, md5sum, gateway
            task = self._finding.get(key)
            if task is None:
                task = self._finding[key] = asyncio.ensure_future(self._from_peer(name, md5sum, gateway))
                task.add_done_callback(lambda _: self._finding.pop(key, None))
            text = await asyncio.shield(task)
        return InterfaceType(name, md5sum, text)

    async def rewriter(self, name: str, md5sum: str) -> FrameRewriter | None:
        """Return the rewriter for the frame ids in messages of a type, or None if the type has none or is unknown."""
        key = name, md5sum
        if key not in self._rewriters:
            text = await self.text(name, md5sum)
            if not text:
                return None
            try:
                specs = checked_specs(name, text, md5sum)
                made = FrameRewriter(specs[name], specs.__getitem__)
            except MinirospyError:
                self._rewriters[key] = None
            else:
                self._rewriters[key] = made if made.has_frames else None
        return self._rewriters[key]

    async def _from_peer(self, name: str, md5sum: str, gateway: str) -> str:
        share = self._shares.get(gateway)
        if share is None:
            share = self._shares[gateway] = asyncio.Semaphore(MAX_QUERIES_OF_GATEWAY)
        try:
            # Acquire the peer's semaphore first, so that an unresponsive gateway cannot occupy all query slots.
            async with share, self._querying:
                if (name, md5sum) in self._known:
                    return self._known[name, md5sum]
                answer = await self._network.query(
                    definition_key(gateway, name, md5sum), seconds=ANSWER_SECONDS
                )
                text = answer.decode()
                loop = asyncio.get_running_loop()
                await loop.run_in_executor(None, checked_specs, name, text, md5sum)
        except (QueryFailed, DefinitionError, UnicodeDecodeError):
            return ""
        self.learn(name, md5sum, text)
        return text
