"""Read and save .rviz files for the 3D view, with JSON over WebSocket: one response per operation.

``{"read": true}`` -> ``{"config": {...} | null, "name", "writes"}`` reads the command's file (null: it does not exist
yet); ``{"save": config}`` -> ``{"name"}`` saves it, for clients with the read-write token; ``{"parse": text}`` ->
``{"config"}`` and ``{"format": config}`` -> ``{"text"}`` for files that the browser opens or saves. A failure is
``{"error": text}``. Operations cannot name a file.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, TypeVar

from minirospy.base.errors import BridgeError, RvizFileError
from minirospy.base.private_files import create_file
from minirospy.web.dashboard.json_session import Fields, Handler, JsonEndpoint, JsonSession, text_of
from minirospy.web.dashboard.rviz_file import MAX_CHARACTERS, format_rviz, parse_rviz

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "RvizEndpoint", "RvizSession", "read_file"]

SUBPROTOCOL = "minirospy.rviz.v1"

_T = TypeVar("_T")


def read_file(path: Path) -> dict[str, object] | None:
    """Return the contents of a .rviz file, or None if it does not exist. Raise RvizFileError if it is invalid."""
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            text = file.read(MAX_CHARACTERS + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise RvizFileError(str(path), 0, error.strerror or str(error)) from None
    return parse_rviz(text, str(path))


def _write_file(path: Path, text: str) -> None:
    """Replace a file atomically, so that it is never incomplete. Raise RvizFileError if that fails."""
    # Write to the target of a link, so that the link remains, and the target keeps its permissions.
    file = path.resolve()
    part = file.with_name(f".{file.name}.part")
    try:
        # The name is predictable, but create_file() does not follow a link that another user has created there.
        with os.fdopen(create_file(part, 0o666), "w", encoding="utf-8") as stream:
            stream.write(text)
        with contextlib.suppress(FileNotFoundError):
            shutil.copymode(file, part)
        part.replace(file)
    except (OSError, ValueError) as error:
        with contextlib.suppress(OSError):
            part.unlink()
        why = error.strerror if isinstance(error, OSError) else None
        raise RvizFileError(str(path), 0, why or str(error)) from None


class RvizEndpoint(JsonEndpoint["RvizSession"]):
    """Serves the .rviz file from the command line, if there is one."""

    def __init__(self, file: Path | None = None) -> None:
        super().__init__(SUBPROTOCOL, lambda client: RvizSession(self, client))
        self.file = file
        self.thread = ThreadPoolExecutor(1, "rviz-files")
        """The thread for all sessions.

        There is only one, because parsing in parallel would delay the loop longer, and saves could conflict.
        """

    async def close(self) -> None:
        """End all sessions, after the saves in progress have been completed."""
        await super().close()
        self.thread.shutdown(wait=False)


class RvizSession(JsonSession):
    """The session of one client. The endpoint's thread reads, writes and parses files."""

    subject: ClassVar[str] = ".rviz files"
    longest: ClassVar[int] = 600_000
    max_waiting: ClassVar[int] = 20

    def __init__(self, endpoint: RvizEndpoint, client: WebClient) -> None:
        self._endpoint = endpoint
        handlers: Mapping[str, Handler] = {
            "read": self._read,
            "parse": self._parse,
            "format": self._format,
            "save": self._save,
        }
        super().__init__(client, handlers)

    def parse(self, fields: Fields) -> tuple[str, Fields]:
        """See :meth:`JsonSession.parse`. An operation has a single field, named like the operation."""
        (name,) = fields
        return name, fields

    async def started(self) -> None:
        """See :meth:`JsonSession.started`. Sends nothing before the client's first request."""

    async def in_thread(self, work: Callable[[], _T]) -> _T:
        """See :meth:`JsonSession.in_thread`. Runs the function in the endpoint's thread."""
        return await asyncio.get_running_loop().run_in_executor(self._endpoint.thread, work)

    async def _read(self, _: Fields) -> Fields:
        file = self._file()
        config = await self.in_thread(partial(read_file, file))
        return {"config": config, "name": file.name, "writes": self.client.is_owner}

    async def _parse(self, fields: Fields) -> Fields:
        return {"config": await self.in_thread(partial(parse_rviz, text_of(fields, "parse")))}

    async def _format(self, fields: Fields) -> Fields:
        return {"text": await self.in_thread(partial(format_rviz, _config(fields["format"])))}

    async def _save(self, fields: Fields) -> Fields:
        file, config = self._file(), _config(fields["save"])
        if not self.client.is_owner:
            raise BridgeError(self.client.why_not_owner("save the file"))

        def save() -> None:
            text = format_rviz(config)
            parse_rviz(text)
            _write_file(file, text)

        # Complete the save even if the page is closed meanwhile.
        await asyncio.shield(self._endpoint.spawn(self.in_thread(save)))
        return {"name": file.name}

    def _file(self) -> Path:
        if self._endpoint.file is None:
            raise BridgeError("the dashboard was not started with a .rviz file (rviz -d FILE)")
        return self._endpoint.file


def _config(value: object) -> dict[str, object]:
    if not isinstance(value, dict):
        raise TypeError("the contents of a file are an object")
    return value
