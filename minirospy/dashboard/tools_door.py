"""What the views need besides the Foxglove protocol, by JSON over WebSocket: requests about nodes and files.

A client sends ``{"id": 1, "do": NAME, ...}``; the server answers ``{"id": 1, "result": ...}`` or ``{"id": 1, "error": "..."}``.
The requests are in ``ToolsSession._METHODS``.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from minirospy.errors import MinirospyError
from minirospy.introspect.configurations import parameter_values

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "ToolsDoor", "ToolsSession"]

SUBPROTOCOL = "minirospy.tools.v1"

_MOST_WAITING = 20
_LARGEST_TEXT = 1_000_000


class ToolsDoor:
    """Serves the requests of pages."""

    def __init__(self) -> None:
        self.tasks: set[asyncio.Task[None]] = set()

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> ToolsSession:
        """Start serving a client."""
        return ToolsSession(self, client)

    async def close(self) -> None:
        """Cancel what still runs."""
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


class ToolsSession:
    """One client."""

    def __init__(self, door: ToolsDoor, client: WebClient) -> None:
        self._door = door
        self._client = client
        self._running: set[asyncio.Task[None]] = set()

    def received_text(self, text: str) -> None:
        """Take over a request."""
        try:
            fields = json.loads(text)
            number = int(fields["id"])
            method = self._METHODS[fields["do"]]
        except (ValueError, TypeError, LookupError, OverflowError, RecursionError) as error:
            self._send({"error": f"not a request: {error}"[:300]})
            return
        if len(self._running) >= _MOST_WAITING:
            self._send({"id": number, "error": "too many requests wait for their answers"})
            return
        task = asyncio.ensure_future(self._answer(number, method, fields))
        for tasks in (self._running, self._door.tasks):
            tasks.add(task)
            task.add_done_callback(tasks.discard)

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send({"error": "binary messages have no meaning here"})

    def ended(self) -> None:
        """End what runs for this client."""
        for task in self._running:
            task.cancel()

    async def _answer(
        self,
        number: int,
        method: Callable[[ToolsSession, Mapping[str, object]], Awaitable[object]],
        fields: Mapping[str, object],
    ) -> None:
        try:
            result = await method(self, fields)
        except (MinirospyError, LookupError, ValueError, TypeError) as error:
            self._send({"id": number, "error": str(error)[:500]})
        else:
            self._send({"id": number, "result": result})

    def _send(self, fields: Mapping[str, object]) -> None:
        self._client.send_text(json.dumps(fields))

    async def _yaml(self, fields: Mapping[str, object]) -> object:
        """Return the values of a file of rqt_reconfigure or dynparam by name."""
        text = str(fields["text"])
        if len(text) > _LARGEST_TEXT:
            raise ValueError("the file is too large")
        values = await asyncio.to_thread(parameter_values, text)
        # JSON has no infinity.
        return {
            name: value if not isinstance(value, float) or math.isfinite(value) else str(value)
            for name, value in values.items()
        }

    _METHODS: ClassVar[Mapping[str, Callable[[ToolsSession, Mapping[str, object]], Awaitable[object]]]] = {
        "yaml": _yaml,
    }
