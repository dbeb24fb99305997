"""The views' requests about nodes, types and files, which the Foxglove protocol lacks, as JSON over WebSocket.

A client sends ``{"id": 1, "do": NAME, ...}``; the server responds with ``{"id": 1, "result": ...}`` or ``{"id": 1,
"error": "..."}``. The requests are in ``ToolsSession.handlers``. After ``watch``, the server sends ``{"report": ...}``
every few seconds until ``unwatch``, with the graph and all nodes, as minirospy/introspect/survey.py describes them.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, ClassVar, TypeVar

from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError, NotFoundError, UsageError
from minirospy.introspect.configurations import parameter_values
from minirospy.introspect.graph import Graph, why_illegal
from minirospy.introspect.nodes import find_node, forget_node, kill_node, ping_node, unreachable_nodes
from minirospy.introspect.parameters import set_parameter
from minirospy.introspect.processes import ProcessLoads
from minirospy.introspect.survey import Survey, describe, survey
from minirospy.introspect.type_texts import installed_type
from minirospy.introspect.values import check_parameter, format_value, parse_value
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.dashboard.health import Examiner, last_log_lines, running_boards
from minirospy.web.dashboard.json_session import Fields, Handler, JsonEndpoint, JsonSession, text_of, texts_of

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "ToolsEndpoint", "ToolsSession"]

SUBPROTOCOL = "minirospy.tools.v1"

_T = TypeVar("_T")
_log = logging.getLogger(__name__)

# bool comes first, because it is a subclass of int.
_TYPE_NAMES: Mapping[type, str] = {
    bool: "bool", int: "int", float: "double", str: "string", bytes: "binary", list: "list", tuple: "list", dict: "dictionary",
}  # fmt: skip
_MAX_PREVIEW = 200
"""Maximum number of characters shown of a value that the user is entering."""

REPORT_SECONDS = 2.0
_MAX_CONCURRENT = 4
"""Maximum number of concurrent requests per client; each takes seconds if a node does not respond."""


class ToolsEndpoint(JsonEndpoint["ToolsSession"]):
    """Serves the pages' requests. ``tool`` is the caller_id for calls to nodes."""

    def __init__(self, master_uri: str, tool: str = "minirospy_dashboard") -> None:
        super().__init__(SUBPROTOCOL, lambda client: ToolsSession(self, client))
        self.parser = ThreadPoolExecutor(1, "tools-parser")
        """Parses one file at a time; parsing several in parallel would delay the loop for longer."""
        self._master_uri = master_uri
        self._tool = tool
        self._watching: set[ToolsSession] = set()
        self._reporting: asyncio.Task[None] | None = None
        self._surveyor = ThreadPoolExecutor(1, "tools-survey")
        self._last: Survey | None = None
        self._processes = ProcessLoads()
        self.examiner = Examiner(master_uri)

    async def close(self) -> None:
        """End all sessions, and cancel their requests and the graph reports. Idempotent."""
        await super().close()
        await asyncio.get_running_loop().run_in_executor(None, self.examiner.close)
        reporting, self._reporting = self._reporting, None
        if reporting:
            reporting.cancel()
            await asyncio.gather(reporting, return_exceptions=True)
        for threads in (self.parser, self._surveyor):
            threads.shutdown(wait=False, cancel_futures=True)

    def graph(self) -> Graph:
        """Return a graph that calls the master over its own connection, because requests run in several threads."""
        return Graph(MasterProxy(self._master_uri, f"/{self._tool}"), self._tool)

    def watch(self, session: ToolsSession) -> None:
        """Send a session a graph report now, and then every few seconds."""
        self._watching.add(session)
        if self._reporting is None or self._reporting.done():
            self._last = None
            reporter = ErrorReporter(_log, "the report of the nodes")
            self._reporting = asyncio.ensure_future(keep_running(self._report, reporter))
        elif self._last:
            session.report(_report_of(describe(self._last)))

    def unwatch(self, session: ToolsSession) -> None:
        """Stop sending reports to a session. Without sessions, the nodes are not queried."""
        self._watching.discard(session)
        if not self._watching and self._reporting:
            self._reporting.cancel()
            self._reporting = None

    async def _report(self) -> None:
        while True:
            started = time.monotonic()
            try:
                # Use a single thread: the next survey then starts only after a cancelled one has ended.
                now = await asyncio.get_running_loop().run_in_executor(self._surveyor, self._survey)
            except (MinirospyError, OSError) as error:
                fields: Mapping[str, object] = {"trouble": str(error)}
            else:
                fields = describe(now, self._last)
                self._last = now
            data = _report_of(fields)
            for session in tuple(self._watching):
                session.report(data)
            # Wait longer before the next survey if nodes respond slowly.
            await asyncio.sleep(max(REPORT_SECONDS, 2 * (time.monotonic() - started)))

    def topic_types(self) -> Mapping[str, str]:
        """Return a dict from topic to type. The type is ``*`` if all subscribers of a topic accept any type."""
        with self.graph() as graph:
            return graph.master.get_topic_types()

    def _survey(self) -> Survey:
        with self.graph() as graph:
            return survey(graph, self._processes)


class ToolsSession(JsonSession):
    """The session of one client. The response to a request contains the request's ``id``."""

    subject: ClassVar[str] = "the graph"
    longest: ClassVar[int] = 100_000
    max_waiting: ClassVar[int] = 20

    def __init__(self, endpoint: ToolsEndpoint, client: WebClient) -> None:
        self._endpoint = endpoint
        self._running: set[asyncio.Task[None]] = set()
        self._threads = ThreadPoolExecutor(_MAX_CONCURRENT, "tools")
        handlers: Mapping[str, Handler] = {
            "watch": self._watch,
            "unwatch": self._unwatch,
            "ping": self._ping,
            "kill": self._kill,
            "cleanup": self._cleanup,
            "type": self._type,
            "yaml": self._yaml,
            "value": self._value,
            "set": self._set,
            "examine": self._examine,
            "boards": self._boards,
            "log": self._log,
        }
        super().__init__(client, handlers)

    def parse(self, fields: Fields) -> tuple[str, Fields]:
        """See :meth:`JsonSession.parse`."""
        number = fields["id"]
        if not isinstance(number, int):
            raise TypeError("id is an integer")
        return text_of(fields, "do"), fields

    async def started(self) -> None:
        """See :meth:`JsonSession.started`. Sends nothing before the client's first request."""

    def dispatch(self, name: str, fields: Fields) -> None:
        """See :meth:`JsonSession.dispatch`."""
        if len(self._running) >= self.max_waiting:
            self.send_error("too many requests wait for their answers", fields)
            return
        task = asyncio.ensure_future(self.carry_out(name, fields))
        size = self._operation_size
        self._running.add(task)
        self._carried_out_size += size
        self.count()

        def ended(task: asyncio.Task[None]) -> None:
            self._running.discard(task)
            self._carried_out_size -= size
            self.count()

        task.add_done_callback(ended)

    def send_answer(self, answer: object, fields: Fields) -> None:
        """See :meth:`JsonSession.send_answer`."""
        self.send({"id": fields["id"], "result": answer})

    def send_error(self, text: str, fields: Fields | None = None) -> None:
        """See :meth:`JsonSession.send_error`."""
        self.send({**({"id": fields["id"]} if fields else {}), "error": text[:500]})

    async def in_thread(self, work: Callable[[], _T]) -> _T:
        """See :meth:`JsonSession.in_thread`. Runs the function in one of several threads."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    def ended(self) -> None:
        """See :meth:`JsonSession.ended`."""
        super().ended()
        self._endpoint.unwatch(self)
        for task in tuple(self._running):
            task.cancel()
        self._threads.shutdown(wait=False, cancel_futures=True)

    def report(self, data: bytes) -> None:
        """Send a report, replacing an older one that is still queued."""
        self.client.send_text_message("report", data, newest_only=True)

    async def _watch(self, _: Fields) -> Fields:
        self._endpoint.watch(self)
        return {}

    async def _unwatch(self, _: Fields) -> Fields:
        self._endpoint.unwatch(self)
        return {}

    async def _ping(self, fields: Fields) -> Fields:
        """Call the node ``node``; return the round-trip time in seconds."""

        name = text_of(fields, "node")

        def ping() -> float:
            with self._endpoint.graph() as graph:
                return ping_node(graph, find_node(graph, name))

        return {"seconds": await self.in_thread(ping)}

    async def _kill(self, fields: Fields) -> Fields:
        """Ask the node ``node`` to shut down."""
        self._require_writing("shuts down no node")
        name = text_of(fields, "node")

        def kill() -> None:
            with self._endpoint.graph() as graph:
                node = find_node(graph, name)
                ping_node(graph, node)  # raises an error with the reason if the node has already exited
                kill_node(graph, node, "requested in the dashboard")

        await self.in_thread(kill)
        return {}

    async def _cleanup(self, fields: Fields) -> list[str]:
        """Unregister those of ``nodes`` that still do not respond, like `rosnode cleanup`; return their names."""
        self._require_writing("unregisters no node")
        wanted = texts_of(fields, "nodes")

        def clean() -> list[str]:
            with self._endpoint.graph() as graph:
                silent = [node for node in unreachable_nodes(graph) if node.name in wanted]
                for node in silent:
                    forget_node(graph, node)
                return [node.name for node in silent]

        return await self.in_thread(clean)

    async def _type(self, fields: Fields) -> Fields:
        """Return the full definition of the installed message type ``name``.

        With ``topic`` instead of ``name``, return the definition of the type that the master has for the topic, even if
        the topic has only subscribers.
        """
        if "topic" in fields:
            topic = text_of(fields, "topic")
            name = (await self.in_thread(self._endpoint.topic_types)).get(topic, "")
            if "/" not in name:
                raise NotFoundError("topic", topic, ())
        else:
            name = text_of(fields, "name")
        found = await self.in_thread(partial(installed_type, name))
        if found is None:
            raise NotFoundError("message type", name, ())
        return {"name": name, "definition": found.definition}

    async def _examine(self, _: Fields) -> Fields:
        """Run `minirospy doctor`, which takes seconds; return its findings."""
        return {"findings": await self.in_thread(self._endpoint.examiner.findings)}

    async def _boards(self, _: Fields) -> Fields:
        """Return the names of this machine's boards that are in use."""
        return {"names": await self.in_thread(running_boards)}

    async def _log(self, _: Fields) -> Fields:
        """Return the last lines of the master's rosout.log, or "" if the file is not on this machine."""

        def read() -> str:
            with self._endpoint.graph() as graph:
                return last_log_lines(Environment.read().log_dir, graph.master.get_param("/run_id"))

        return {"text": await self.in_thread(read)}

    def _require_writing(self, what: str) -> None:
        if not self.client.may_write:
            raise UsageError(f"this token is read-only: it {what}")

    async def _yaml(self, fields: Fields) -> Fields:
        """Return the values in a file that rqt_reconfigure or dynparam has saved, keyed by name."""
        text = text_of(fields, "text")
        loop = asyncio.get_running_loop()
        values = await loop.run_in_executor(self._endpoint.parser, parameter_values, text)
        # JSON cannot represent infinity, so convert it to a string.
        return {
            name: value if not isinstance(value, float) or math.isfinite(value) else str(value)
            for name, value in values.items()
        }

    async def _value(self, fields: Fields) -> Fields:
        """Parse ``text`` like `rosparam set`; return the value's type, and the value as YAML."""
        value = await self._parsed(fields)
        return {"type": _type_name(value), "text": format_value(value)[:_MAX_PREVIEW]}

    async def _set(self, fields: Fields) -> Fields:
        """Set the parameter ``name`` to the value in ``text``, like `rosparam set`."""
        self._require_writing("sets no parameter")
        name = text_of(fields, "name")
        why = why_illegal(name)
        if why:
            raise UsageError(f"parameter [{name}]: {why}")
        value = await self._parsed(fields)

        def set_value() -> None:
            with self._endpoint.graph() as graph:
                set_parameter(graph, graph.resolve(name), value)

        await self.in_thread(set_value)
        return {}

    async def _parsed(self, fields: Fields) -> object:
        text = text_of(fields, "text")

        def parse() -> object:
            # As on the command line, an empty string stays a string, although YAML would parse it as null.
            value = parse_value(text) if text.strip() else ""
            check_parameter(value, "the value")
            return value

        return await asyncio.get_running_loop().run_in_executor(self._endpoint.parser, parse)


def _type_name(value: object) -> str:
    """Return the name of a parameter's type, as used in roscpp and the wiki."""
    for type_, name in _TYPE_NAMES.items():
        if isinstance(value, type_):
            return name
    raise AssertionError(f"a {type(value).__name__} is not a parameter")


def _report_of(fields: Fields) -> bytes:
    return json.dumps({"report": fields}).encode()
