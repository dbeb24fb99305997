"""Reading and saving .rviz files for the 3D view, by JSON over WebSocket: one operation, one answer.

``{"read": true}`` -> ``{"config": {...} | null, "name", "writes"}``: the file of the command, null where it does not exist yet;
``{"save": config}`` -> ``{"name"}``: saved there, for who has the read-write token; ``{"parse": text}`` -> ``{"config"}`` and
``{"format": config}`` -> ``{"text"}`` for files of the browser. A failure is ``{"error": text}``. No operation names a file.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.bridge.tasks import Faults
from minirospy.dashboard.rviz_file import MOST_CHARACTERS, format_rviz, parse_rviz
from minirospy.errors import BridgeError, RvizFileError

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "RvizDoor", "RvizSession", "read_file"]

SUBPROTOCOL = "minirospy.rviz.v1"

_log = logging.getLogger(__name__)

_MOST_WAITING = 20


def read_file(path: Path) -> dict[str, object] | None:
    """Return the contents of a .rviz file, None where there is none. Raise RvizFileError."""
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            text = file.read(MOST_CHARACTERS + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise RvizFileError(str(path), 0, error.strerror or str(error)) from None
    return parse_rviz(text, str(path))


class RvizDoor:
    """Serves the file of the command, if there is one."""

    def __init__(self, file: Path | None = None) -> None:
        self.file = file
        self.working: set[asyncio.Task[None]] = set()

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> RvizSession:
        """Start serving a client."""
        return RvizSession(client, self)


class RvizSession:
    """One client; its operations read and parse in threads, one after another."""

    def __init__(self, client: WebClient, door: RvizDoor) -> None:
        self._client = client
        self._door = door
        self._turn = asyncio.Lock()
        self._waiting = 0
        self._faults = Faults(_log, "an operation on an .rviz file")

    def received_text(self, text: str) -> None:
        """Carry out an operation, and send its answer."""
        if self._waiting >= _MOST_WAITING:
            self._send({"error": "too many operations wait for their answers"})
            return
        self._waiting += 1
        task = asyncio.ensure_future(self._answer(text))
        task.add_done_callback(self._answered)
        self._door.working.add(task)
        task.add_done_callback(self._door.working.discard)

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send({"error": "binary messages have no meaning here"})

    def ended(self) -> None:
        """Forget the client; an operation that has started is finished."""

    def _answered(self, _: asyncio.Task[None]) -> None:
        self._waiting -= 1

    async def _answer(self, text: str) -> None:
        loop = asyncio.get_running_loop()
        async with self._turn:
            try:
                answer = await loop.run_in_executor(None, self._operate, text)
            except (RvizFileError, BridgeError) as error:
                answer = {"error": str(error)[:500]}
            except (ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
                answer = {"error": f"not an operation on .rviz files: {error}"[:500]}
            except Exception as error:  # noqa: BLE001 - the page waits for the answer, whatever happened here
                self._faults.report(error)
                answer = {"error": f"the dashboard failed on this operation: {type(error).__name__}"}
            self._send(answer)

    def _operate(self, text: str) -> dict[str, object]:
        ((name, value),) = json.loads(text).items()
        if name == "read":
            return self._read()
        if name == "parse" and isinstance(value, str):
            return {"config": parse_rviz(value)}
        if name == "format" and isinstance(value, dict):
            return {"text": format_rviz(value)}
        if name == "save" and isinstance(value, dict):
            return self._save(format_rviz(value))
        raise ValueError(str(name)[:80])

    def _read(self) -> dict[str, object]:
        file = self._file()
        return {"config": read_file(file), "name": file.name, "writes": self._client.is_owner}

    def _save(self, text: str) -> dict[str, object]:
        file = self._file()
        if not self._client.is_owner:
            raise BridgeError(self._client.why_not_owner("save the file"))
        parse_rviz(text)
        # Whole or not at all: a file that is half written would be lost.
        part = file.with_name(f".{file.name}.part")
        try:
            part.write_text(text, encoding="utf-8")
            part.replace(file)
        except OSError as error:
            raise RvizFileError(str(file), 0, error.strerror or str(error)) from None
        return {"name": file.name}

    def _file(self) -> Path:
        if self._door.file is None:
            raise BridgeError("the dashboard was not started with a .rviz file (rviz -d FILE)")
        return self._door.file

    def _send(self, answer: dict[str, object]) -> None:
        self._client.send_text(json.dumps(answer))
