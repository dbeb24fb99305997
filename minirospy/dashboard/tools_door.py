"""What the views need besides the Foxglove protocol, by JSON over WebSocket: requests about nodes, types and files.

A client sends ``{"id": 1, "do": NAME, ...}``; the server answers ``{"id": 1, "result": ...}`` or ``{"id": 1, "error": "..."}``.
The requests are in ``ToolsSession._METHODS``. After ``watch`` it sends ``{"report": ...}`` every few seconds until ``unwatch``:
the graph and all nodes, as minirospy/introspect/survey.py describes them.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from minirospy.bridge.tasks import Faults, keep_running
from minirospy.bridge.types import installed_type
from minirospy.errors import MinirospyError, NotFoundError
from minirospy.introspect.configurations import parameter_values
from minirospy.introspect.graph import Graph
from minirospy.introspect.nodes import find_node, forget_node, kill_node, ping_node, unreachable_nodes
from minirospy.introspect.survey import Survey, describe, survey
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "ToolsDoor", "ToolsSession"]

SUBPROTOCOL = "minirospy.tools.v1"

_log = logging.getLogger(__name__)

_MOST_WAITING = 20
_REPORT_SECONDS = 2.0
_LARGEST_TEXT = 1_000_000


class ToolsDoor:
    """Serves the requests of pages. ``tool`` is the name by which nodes are called."""

    def __init__(self, master_uri: str, tool: str = "minirospy_dashboard") -> None:
        self.tasks: set[asyncio.Task[None]] = set()
        self._master_uri = master_uri
        self._tool = tool
        self._watching: set[ToolsSession] = set()
        self._reporting: asyncio.Task[None] | None = None
        self._last: Survey | None = None

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
        self._watching.clear()
        running = [*self.tasks, *([self._reporting] if self._reporting else [])]
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)

    def graph(self) -> Graph:
        """Return the graph, with a separate connection to the master: calls run in threads."""
        return Graph(MasterProxy(self._master_uri, f"/{self._tool}"), self._tool)

    def watch(self, session: ToolsSession) -> None:
        """Send a session a report of the graph now and every few seconds."""
        self._watching.add(session)
        if self._reporting is None or self._reporting.done():
            self._last = None
            faults = Faults(_log, "the report of the nodes")
            self._reporting = asyncio.ensure_future(keep_running(self._report, faults))
        elif self._last:
            session.report(describe(self._last))

    def unwatch(self, session: ToolsSession) -> None:
        """End it; nobody queries the nodes while nobody watches."""
        self._watching.discard(session)
        if not self._watching and self._reporting:
            self._reporting.cancel()
            self._reporting = None

    async def _report(self) -> None:
        while True:
            started = time.monotonic()
            try:
                now = await asyncio.to_thread(self._survey)
            except MinirospyError as error:
                for session in tuple(self._watching):
                    session.report({"trouble": str(error)})
            else:
                fields = describe(now, self._last)
                self._last = now
                for session in tuple(self._watching):
                    session.report(fields)
            # Nodes that answer slowly are not queried without a pause.
            await asyncio.sleep(max(_REPORT_SECONDS, 2 * (time.monotonic() - started)))

    def _survey(self) -> Survey:
        with self.graph() as graph:
            return survey(graph)


class ToolsSession:
    """One client."""

    def __init__(self, door: ToolsDoor, client: WebClient) -> None:
        self._door = door
        self._client = client
        self._running: set[asyncio.Task[None]] = set()
        self._faults = Faults(_log, "a request of a page")

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
        self._door.unwatch(self)
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
        except Exception as error:  # noqa: BLE001 - the page waits for the answer, whatever happened here
            self._faults.report(error)
            self._send(
                {"id": number, "error": f"the dashboard failed on this request: {type(error).__name__}"}
            )
        else:
            self._send({"id": number, "result": result})

    def report(self, fields: Mapping[str, object]) -> None:
        """Send a report; an older one that waits is dropped."""
        self._client.send_text_message("report", json.dumps({"report": fields}).encode(), newest_only=True)

    def _send(self, fields: Mapping[str, object]) -> None:
        self._client.send_text(json.dumps(fields))

    async def _watch(self, _: Mapping[str, object]) -> object:
        self._door.watch(self)
        return {}

    async def _unwatch(self, _: Mapping[str, object]) -> object:
        self._door.unwatch(self)
        return {}

    async def _ping(self, fields: Mapping[str, object]) -> object:
        """Return the seconds that a call to ``node`` takes."""

        def ping() -> float:
            with self._door.graph() as graph:
                return ping_node(graph, find_node(graph, str(fields["node"])))

        return {"seconds": await asyncio.to_thread(ping)}

    async def _kill(self, fields: Mapping[str, object]) -> object:
        """Request ``node`` to shut down."""
        self._require_writing("shuts down no node")

        def kill() -> None:
            with self._door.graph() as graph:
                kill_node(graph, find_node(graph, str(fields["node"])), "requested in the dashboard")

        await asyncio.to_thread(kill)
        return {}

    async def _cleanup(self, fields: Mapping[str, object]) -> object:
        """Unregister those of ``nodes`` that still do not answer, as `rosnode cleanup` does; return their names."""
        self._require_writing("unregisters no node")
        wanted = fields["nodes"]
        if not isinstance(wanted, list):
            raise TypeError("nodes: not a list of names")

        def clean() -> list[str]:
            with self._door.graph() as graph:
                silent = [node for node in unreachable_nodes(graph) if node.name in wanted]
                for node in silent:
                    forget_node(graph, node)
                return [node.name for node in silent]

        return await asyncio.to_thread(clean)

    async def _type(self, fields: Mapping[str, object]) -> object:
        """Return the full definition of the message type ``name``, of the packages that are installed here."""
        name = str(fields["name"])
        found = await asyncio.to_thread(installed_type, name)
        if found is None:
            raise NotFoundError("message type", name, ())
        return {"definition": found.definition}

    def _require_writing(self, what: str) -> None:
        if not self._client.may_write:
            raise ValueError(f"this token is read-only: it {what}")

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
        "watch": _watch,
        "unwatch": _unwatch,
        "ping": _ping,
        "kill": _kill,
        "cleanup": _cleanup,
        "type": _type,
        "yaml": _yaml,
    }
