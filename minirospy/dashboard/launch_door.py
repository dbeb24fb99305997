"""Launch files for the page: started, stopped, watched, by JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: list; describe {package, file, args}; start {package, file, args}; stop, restart,
remove {id}; end {id, node, restarts}; follow {id, node} (node "": roslaunch's own lines; id null: nothing). The server sends
``{"writes"}``, ``{"files"}``, ``{"describe"}``, ``{"launches"}``, ``{"log", "text", "isFirst"}``, ``{"error"}``.
Only who has the read-write token may do any of it: it starts programs as the user of the dashboard.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Coroutine, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from minirospy.bridge.tasks import Faults, keep_running
from minirospy.dashboard.launch_files import LaunchFile, LaunchFiles
from minirospy.dashboard.launch_run import LaunchRun
from minirospy.environment import Environment
from minirospy.errors import MinirospyError, UsageError
from minirospy.launch.load import resolved_arg_docs
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "LaunchDoor", "LaunchSession"]

SUBPROTOCOL = "minirospy.launch.v1"

_log = logging.getLogger(__name__)

_OWNERS_ONLY = "start programs"
_LOOK_SECONDS = 0.1
_MOST_WAITING = 100
_MOST_RUNS = 50
_TAIL_BYTES = 64 * 1024

_T = TypeVar("_T")
_Fields = Mapping[str, object]


class LaunchDoor:
    """Serves the launch files of the packages; all clients see the same launches."""

    def __init__(self, master_uri: str) -> None:
        self.environment = Environment.read(master_uri=master_uri)
        self.packages = Packages(self.environment)
        self.files = LaunchFiles(self.packages)
        self.runs: dict[int, LaunchRun] = {}
        self._sessions: set[asyncio.Task[None]] = set()

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> LaunchSession:
        """Start serving a client."""
        session = LaunchSession(self, client)
        self._sessions.add(session.task)
        session.task.add_done_callback(self._sessions.discard)
        return session

    def start(self, file: LaunchFile, args: Mapping[str, str]) -> None:
        """Start a launch file. Raise MinirospyError. Reads folders, so it blocks."""
        path = self.files.path_of(file)
        # Sessions change the table while this thread reads it.
        if sum(not run.is_ended for run in tuple(self.runs.values())) >= _MOST_RUNS:
            raise UsageError(f"{_MOST_RUNS} launch files run already")
        run = LaunchRun(file.package, file.path, path, args, self.environment, self.packages)
        self.runs[run.id] = run

    async def close(self) -> None:
        """End all sessions and all launches, and wait for that."""
        for task in list(self._sessions):
            task.cancel()
        await asyncio.gather(*self._sessions, return_exceptions=True)
        runs = list(self.runs.values())
        for run in runs:
            run.stop()
        loop = asyncio.get_running_loop()
        await asyncio.gather(*(loop.run_in_executor(None, run.join) for run in runs))


class _Tail:
    """The end of a file that grows."""

    def __init__(self, run: LaunchRun, node: str) -> None:
        self.run, self.node = run, node
        self.is_first = True
        self._path: Path | None = None
        self._position = 0
        self._count = 0

    def read(self) -> str:
        """Return what is new. Blocks."""
        if not self.node:
            new = self.run.output.count - self._count
            self._count += new
            return "".join(f"{line}\n" for line in list(self.run.output.lines)[-new:]) if new else ""
        path = self.run.log_file(self.node)
        if path is None:
            return ""

        try:
            size = path.stat().st_size
            if path != self._path or size < self._position:
                self._path, self._position = path, max(0, size - _TAIL_BYTES)
            with path.open("rb") as file:
                file.seek(self._position)
                data = file.read(_TAIL_BYTES)
        except OSError:
            return ""
        # Whole lines, unless one is endless: a character may be in two parts.
        end = data.rfind(b"\n") + 1
        data = data[:end] if end else data if len(data) == _TAIL_BYTES else b""
        self._position += len(data)
        return data.decode("utf-8", "replace")


class LaunchSession:
    """One client. What reads files blocks, so it runs in a thread of the session, one after another."""

    def __init__(self, door: LaunchDoor, client: WebClient) -> None:
        self._door = door
        self._client = client
        self._operations: asyncio.Queue[_Fields] = asyncio.Queue(_MOST_WAITING)
        self._thread = ThreadPoolExecutor(1, "launch-session")
        self._tail: _Tail | None = None
        self._sent = ""
        self._handlers: Mapping[str, Callable[[_Fields], Coroutine[object, object, None]]] = {
            "list": self._list,
            "describe": self._describe,
            "start": self._start,
            "stop": self._stop,
            "restart": self._restart,
            "remove": self._remove,
            "end": self._end_node,
            "follow": self._follow,
        }
        self._faults = Faults(_log, "serving launch files")
        self.task = asyncio.ensure_future(self._run())
        self.task.add_done_callback(self._faults.of_task)

    # --- from the connection

    def received_text(self, text: str) -> None:
        """Take over an operation."""
        if not self._client.is_owner:
            self._send_error(self._client.why_not_owner(_OWNERS_ONLY))
            return
        try:
            fields = json.loads(text)
            if not isinstance(fields, dict) or fields.get("op") not in self._handlers:
                raise ValueError(text[:80])
        except (ValueError, TypeError, RecursionError) as error:
            self._send_error(f"not an operation on launch files: {error}")
            return
        try:
            self._operations.put_nowait(fields)
        except asyncio.QueueFull:
            self._send_error("the launch is too slow: an operation was dropped")

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send_error("binary messages have no meaning here")

    def ended(self) -> None:
        """End the session; what it started runs on."""
        self.task.cancel()

    # --- the session's task

    async def _run(self) -> None:
        self._client.send_text(json.dumps({"writes": self._client.is_owner}))
        if not self._client.is_owner:
            self._send_error(self._client.why_not_owner(_OWNERS_ONLY))
        try:
            await keep_running(self._serve, self._faults)
        finally:
            self._thread.shutdown(wait=False)

    async def _serve(self) -> None:
        while True:
            while not self._operations.empty():
                await self._handle(self._operations.get_nowait())
            if self._client.is_owner:
                self._send_launches()
                await self._send_log()
            await asyncio.sleep(_LOOK_SECONDS)

    async def _handle(self, fields: _Fields) -> None:
        try:
            await self._handlers[str(fields["op"])](fields)
        except (MinirospyError, OSError) as error:
            self._send_error(str(error))
        except (ValueError, TypeError, LookupError) as error:
            self._send_error(f"not an operation on launch files: {fields['op']}: {error!r}")
        except Exception as error:  # noqa: BLE001 - the page waits for the answer, whatever happened here
            self._faults.report(error)
            self._send_error(f"the dashboard failed on this operation: {type(error).__name__}")

    async def _in_thread(self, work: Callable[[], _T]) -> _T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    async def _list(self, _: _Fields) -> None:
        files = await self._in_thread(self._door.files.scan)
        self._client.send_text(json.dumps({"files": files}))

    async def _describe(self, fields: _Fields) -> None:
        file, args = _file(fields), _args(fields)

        def read() -> list[list[str | None]]:
            path = self._door.files.path_of(file)
            docs = resolved_arg_docs(str(path), args, self._door.packages)
            return [[each.name, each.default, each.doc] for each in docs]

        found = {"package": file.package, "file": file.path, "args": await self._in_thread(read)}
        self._client.send_text(json.dumps({"describe": found}))

    async def _start(self, fields: _Fields) -> None:
        file, args = _file(fields), _args(fields)
        await self._in_thread(lambda: self._door.start(file, args))

    async def _stop(self, fields: _Fields) -> None:
        self._run_of(fields).stop()

    async def _restart(self, fields: _Fields) -> None:
        run = self._run_of(fields)
        run.stop()
        # Meanwhile this session does nothing else: others go on.
        await self._in_thread(run.join)
        self._door.runs.pop(run.id, None)
        await self._in_thread(lambda: self._door.start(LaunchFile(run.package, run.file), run.args))

    async def _remove(self, fields: _Fields) -> None:
        run = self._run_of(fields)
        if not run.is_ended:
            raise UsageError(f"{run.package}/{run.file} runs: stop it first")
        self._door.runs.pop(run.id, None)

    async def _end_node(self, fields: _Fields) -> None:
        self._run_of(fields).end_node(str(fields["node"]), restarts=bool(fields.get("restarts")))

    async def _follow(self, fields: _Fields) -> None:
        self._tail = (
            None if fields.get("id") is None else _Tail(self._run_of(fields), str(fields.get("node", "")))
        )

    def _run_of(self, fields: _Fields) -> LaunchRun:
        number = fields["id"]
        if not isinstance(number, int) or number not in self._door.runs:
            raise UsageError("this launch is not there any more")
        return self._door.runs[number]

    def _send_launches(self) -> None:
        launches = []
        # Threads of other sessions add launches meanwhile.
        for run in tuple(self._door.runs.values()):
            state = run.state()
            launches.append({**state._asdict(), "nodes": [node._asdict() for node in state.nodes]})
        text = json.dumps({"launches": launches})
        if text != self._sent:
            self._sent = text
            self._client.send_text_message("launches", text.encode(), newest_only=True)

    async def _send_log(self) -> None:
        tail = self._tail
        if tail is None:
            return
        text = await self._in_thread(tail.read)
        if text or tail.is_first:
            found = {"log": {"id": tail.run.id, "node": tail.node}, "text": text, "isFirst": tail.is_first}
            tail.is_first = False
            self._client.send_text(json.dumps(found))

    def _send_error(self, text: str) -> None:
        self._client.send_text(json.dumps({"error": text[:1000]}))


def _file(fields: _Fields) -> LaunchFile:
    return LaunchFile(str(fields["package"]), str(fields["file"]))


def _args(fields: _Fields) -> dict[str, str]:
    args = fields.get("args", {})
    if not isinstance(args, dict):
        raise TypeError("args is an object")
    return {str(name): str(value) for name, value in args.items()}
