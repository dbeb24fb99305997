"""Launch files for the page: start, stop and watch them, with JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: list; describe {package, file, args}; start {package, file, args}; stop, restart,
remove {id}; end {id, node, restarts}; follow {id, node} (node "": roslaunch's own lines; id null: nothing). The server sends
``{"writes"}``, ``{"files"}``, ``{"describe"}``, ``{"launches"}``, ``{"log", "text", "isFirst"}``, ``{"error"}``.
All operations require the read-write token, because programs are started as the dashboard's user.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError, UsageError
from minirospy.ros.roslaunch.launcher.arg_docs import resolved_arg_docs
from minirospy.web.dashboard.json_session import Fields, Handler, JsonEndpoint, JsonSession
from minirospy.web.dashboard.launch_files import LaunchFile, LaunchFiles
from minirospy.web.dashboard.launch_run import LaunchRun
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "LaunchEndpoint", "LaunchSession"]

SUBPROTOCOL = "minirospy.launch.v1"

_LOG_SECONDS = 0.2
"""Seconds between checks for new lines in a log file that a page shows."""

_STOPPING_SECONDS = 0.2
_MAX_RUNS = 50
_MAX_ENDED = 20
"""Maximum number of launches kept after they have ended, each with its last lines of output."""

_TAIL_BYTES = 64 * 1024


class LaunchEndpoint(JsonEndpoint["LaunchSession"]):
    """Serves the packages' launch files. All clients share the same launches."""

    def __init__(self, master_uri: str) -> None:
        super().__init__(SUBPROTOCOL, lambda client: LaunchSession(self, client))
        self.environment = Environment.read(master_uri=master_uri)
        self.packages = Packages(self.environment)
        self.files = LaunchFiles(self.packages)
        self.runs: dict[int, LaunchRun] = {}
        """The launches by id, in order. Changed only on the loop."""
        self._restarting: set[int] = set()

    def start(self, file: LaunchFile, path: Path, args: Mapping[str, str]) -> None:
        """Start a launch file with these arguments. Raise UsageError if that fails."""
        if self.is_closed:
            raise UsageError("the dashboard is shut down")
        if sum(not run.is_ended for run in self.runs.values()) >= _MAX_RUNS:
            raise UsageError(f"{_MAX_RUNS} launch files run already")
        on_change = self.post_change
        run = LaunchRun(file.package, file.path, path, args, self.environment, self.packages, on_change)
        self.runs[run.id] = run
        self.changed()

    async def restart(self, run: LaunchRun) -> None:
        """Stop a launch and start its file again with the same arguments.

        Do nothing if another client is restarting the launch or has restarted it. Raise UsageError if the file cannot be
        started.
        """
        if run.id in self._restarting or run.id not in self.runs:
            return
        self._restarting.add(run.id)
        try:
            run.stop()
            await asyncio.get_running_loop().run_in_executor(None, run.join)
            self.start(LaunchFile(run.package, run.file), run.path, run.args)
            self.runs.pop(run.id, None)
        finally:
            self._restarting.discard(run.id)

    def changed(self) -> None:
        """See :meth:`JsonEndpoint.changed`. Also discard the oldest launches that have ended."""
        ended = [run.id for run in self.runs.values() if run.is_ended and run.id not in self._restarting]
        for number in ended[:-_MAX_ENDED]:
            del self.runs[number]
        super().changed()

    async def close(self) -> None:
        """End all sessions; stop all launches, and wait until they have ended."""
        self.is_closed = True
        runs = list(self.runs.values())
        for run in runs:
            run.stop()
        await super().close()
        loop = asyncio.get_running_loop()
        await asyncio.gather(*(loop.run_in_executor(None, run.join) for run in runs))


class _Tail:
    """Reads the last part of a growing log file, and then new lines."""

    def __init__(self, run: LaunchRun, node: str) -> None:
        self.run, self.node = run, node
        self.is_first = True
        self._path: Path | None = None
        self._position = 0
        self._count = 0

    def read(self) -> str:
        """Return the new lines of the log. Blocks."""
        if not self.node:
            lines, self._count = self.run.output.since(self._count)
            return "".join(f"{line}\n" for line in lines)
        # Check whether the node has exited before reading: the file then contains everything that the node wrote.
        has_exited = self.run.has_exited(self.node)
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
        # The data may end within a character, so return only complete lines, unless a line is very long or the last one.
        end = data.rfind(b"\n") + 1
        is_whole = not end if len(data) == _TAIL_BYTES else has_exited
        data = data if is_whole else data[:end]
        self._position += len(data)
        return data.decode("utf-8", "replace")


class LaunchSession(JsonSession):
    """The session of one client. File access blocks, so it runs in the session's thread."""

    subject: ClassVar[str] = "launch files"
    owners_only: ClassVar[str] = "start programs"
    pace: ClassVar[float] = 0.1

    def __init__(self, endpoint: LaunchEndpoint, client: WebClient) -> None:
        self._endpoint = endpoint
        self._tail: _Tail | None = None
        self._sent = ""
        handlers: Mapping[str, Handler] = {
            "list": self._list,
            "describe": self._describe,
            "start": self._start,
            "stop": self._stop,
            "restart": self._restart,
            "remove": self._remove,
            "end": self._end_node,
            "follow": self._follow_log,
        }
        super().__init__(client, handlers)

    async def follow(self) -> float | None:
        """Send the list of launches if it has changed, and new lines of the log that the page shows."""
        # Read this before sending: if a launch ends while data is being sent, another call must send its final state.
        is_stopping = any(run.is_stopping for run in self._endpoint.runs.values())
        self._send_launches()
        is_growing = await self._send_log()
        return _LOG_SECONDS if is_growing else _STOPPING_SECONDS if is_stopping else None

    async def _list(self, _: Fields) -> Fields:
        return {"files": await self.in_thread(self._endpoint.files.scan)}

    async def _describe(self, fields: Fields) -> Fields:
        file, args = _file(fields), _args(fields)

        def read() -> list[list[str | None]]:
            path = self._endpoint.files.path_of(file)
            docs = resolved_arg_docs(str(path), args, self._endpoint.packages)
            return [[each.name, each.default, each.doc] for each in docs]

        found = {"package": file.package, "file": file.path, "args": await self.in_thread(read)}
        return {"describe": found}

    async def _start(self, fields: Fields) -> None:
        file, args = _file(fields), _args(fields)
        path = await self.in_thread(partial(self._endpoint.files.path_of, file))
        self._endpoint.start(file, path, args)

    async def _stop(self, fields: Fields) -> None:
        self._run_of(fields).stop()

    async def _restart(self, fields: Fields) -> None:
        # The restart continues even if the page is closed. Meanwhile, the session shows its progress.
        self._endpoint.spawn(self._report_restart(self._run_of(fields)))

    async def _report_restart(self, run: LaunchRun) -> None:
        try:
            await self._endpoint.restart(run)
        except MinirospyError as error:
            self.send_error(str(error))

    async def _remove(self, fields: Fields) -> None:
        run = self._run_of(fields)
        if not run.is_ended:
            raise UsageError(f"{run.package}/{run.file} runs: stop it first")
        self._endpoint.runs.pop(run.id, None)
        self._endpoint.changed()

    async def _end_node(self, fields: Fields) -> None:
        self._run_of(fields).end_node(str(fields["node"]), restarts=bool(fields.get("restarts")))

    async def _follow_log(self, fields: Fields) -> None:
        self._tail = (
            None if fields.get("id") is None else _Tail(self._run_of(fields), str(fields.get("node", "")))
        )

    def _run_of(self, fields: Fields) -> LaunchRun:
        number = fields["id"]
        if not isinstance(number, int) or number not in self._endpoint.runs:
            raise UsageError("this launch is not there any more")
        return self._endpoint.runs[number]

    def _send_launches(self) -> None:
        launches = []
        for run in self._endpoint.runs.values():
            state = run.state()
            launches.append({**state._asdict(), "nodes": [node._asdict() for node in state.nodes]})
        text = json.dumps({"launches": launches})
        if text != self._sent:
            self._sent = text
            self.client.send_text_message("launches", text.encode(), newest_only=True)

    async def _send_log(self) -> bool:
        """Send new lines of the shown log. Return whether the log must be polled again even if no launch changes."""
        tail = self._tail
        if tail is None:
            return False
        is_growing = bool(tail.node) and not tail.run.is_ended
        text = await self.in_thread(tail.read)
        if text or tail.is_first:
            found = {"log": {"id": tail.run.id, "node": tail.node}, "text": text, "isFirst": tail.is_first}
            tail.is_first = False
            self.send(found)
        # There may be more data in the file than a single read returns.
        return is_growing or bool(tail.node and text)


def _file(fields: Fields) -> LaunchFile:
    return LaunchFile(str(fields["package"]), str(fields["file"]))


def _args(fields: Fields) -> dict[str, str]:
    args = fields.get("args", {})
    if not isinstance(args, dict):
        raise TypeError("args is an object")
    return {str(name): str(value) for name, value in args.items()}
