"""The virtual board for the page: its lights, buttons and person, by JSON over WebSocket.

The server sends ``{"name", "boards", "leds": [[pin, color, level]], "buttons": [[pin, level]], "pins": [[pin, function, level]],
"person": [x, y] | null, "fields": [...], "writes"}`` whenever something has changed; a client sends ``{"press": pin}``,
``{"release": pin}`` and ``{"person": [x, y] | null}``. What a client holds down is released when it disconnects.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

from minirospy.bridge.tasks import Faults
from minirospy.errors import BoardError
from minirospy.gpio.board import Board
from minirospy.gpio.model import BUTTONS, LEDS, Function
from minirospy.gpio.place import Place
from minirospy.scanner import FIELDS

if TYPE_CHECKING:
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "BoardDoor", "BoardSession"]

SUBPROTOCOL = "minirospy.board.v1"

_log = logging.getLogger(__name__)

_LOOK_SECONDS = 0.02
_MOST_WAITING = 100


class BoardDoor:
    """Serves boards of this machine; each client names its own, ``?board=NAME``."""

    def __init__(self) -> None:
        self._sessions: set[asyncio.Task[None]] = set()

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> BoardSession:
        """Start serving a client."""
        session = BoardSession(client)
        self._sessions.add(session.task)
        session.task.add_done_callback(self._sessions.discard)
        return session

    async def close(self) -> None:
        """Wait until the sessions, whose connections have ended, have left their boards."""
        await asyncio.gather(*self._sessions, return_exceptions=True)


class BoardSession:
    """One client. The board's calls block, so they run in a thread of the session, one after another."""

    def __init__(self, client: WebClient) -> None:
        self._client = client
        self._pressed: set[int] = set()
        self._work: asyncio.Queue[Callable[[Board], None]] = asyncio.Queue(_MOST_WAITING)
        self._thread = ThreadPoolExecutor(1, "board-session")
        self._faults = Faults(_log, "serving the board")
        self.task = asyncio.ensure_future(self._run())
        self.task.add_done_callback(self._faults.of_task)

    def received_text(self, text: str) -> None:
        """Take over an operation."""
        if not self._client.may_write:
            self._send_error("this token is read-only: the board cannot be changed with it")
            return
        try:
            work = self._operation(json.loads(text))
        except (ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
            self._send_error(f"not an operation of the board: {error}")
            return
        try:
            self._work.put_nowait(work)
        except asyncio.QueueFull:
            self._send_error("the board is too slow: an operation was dropped")

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send_error("binary messages have no meaning here")

    def ended(self) -> None:
        """Release what the client holds down, and disconnect from the board."""
        self.task.cancel()

    def _operation(self, fields: Mapping[str, Any]) -> Callable[[Board], None]:
        ((name, value),) = fields.items()
        if name == "person":
            position = None if value is None else (float(value[0]), float(value[1]))
            return lambda board: board.move_person(position)
        if name not in ("press", "release") or not isinstance(value, int):
            raise ValueError(str(name)[:80])
        return partial(self._press if name == "press" else self._release, value)

    def _press(self, pin: int, board: Board) -> None:
        board.press(pin)
        self._pressed.add(pin)

    def _release(self, pin: int, board: Board) -> None:
        board.release(pin)
        self._pressed.discard(pin)

    async def _run(self) -> None:
        """Open the board and mirror it; when cancelled, leave it before this returns."""
        loop = asyncio.get_running_loop()
        name = self._client.request.query.get("board") or None
        opening = self._thread.submit(Board, name)
        try:
            board = await asyncio.wrap_future(opening)
            await self._mirror(board)
        except BoardError as error:
            self._send_error(str(error))
        except Exception as error:  # noqa: BLE001 - the page would wait for a board that nobody mirrors
            self._faults.report(error)
            self._send_error(f"the dashboard failed to show the board: {type(error).__name__}")
        finally:
            # In any case: a page that is closed meanwhile would cancel what waits for the thread.
            leaving = loop.run_in_executor(self._thread, _leave, opening, self._pressed)
            self._thread.shutdown(wait=False)
            await asyncio.shield(leaving)

    async def _mirror(self, board: Board) -> None:
        """Carry out what the client sends, and send what has changed, until cancelled."""
        loop = asyncio.get_running_loop()
        boards = Place.find().names()
        last = ""
        while True:
            while not self._work.empty():
                work = self._work.get_nowait()
                try:
                    await loop.run_in_executor(self._thread, work, board)
                except BoardError as error:
                    self._send_error(str(error))
            text = json.dumps({**state_of(board), "boards": boards, "writes": self._client.may_write})
            if text != last:
                last = text
                self._client.send_text_message("board", text.encode(), newest_only=True)
            await asyncio.sleep(_LOOK_SECONDS)

    def _send_error(self, text: str) -> None:
        self._client.send_text(json.dumps({"error": text[:300]}))


def state_of(board: Board) -> dict[str, object]:
    """Return what the page shows of a board."""
    state = board.state()
    wired = {*LEDS, *BUTTONS}
    others = [
        [pin, "out" if each.function is Function.OUT else "in", each.level]
        for pin, each in enumerate(state.pins)
        if pin not in wired and (each.function is Function.OUT or each.level)
    ]
    return {
        "name": state.name,
        "leds": [[pin, color, state.level(pin)] for pin, color in LEDS.items()],
        "buttons": [[pin, state.level(pin)] for pin in BUTTONS],
        "pins": others,
        "person": list(state.person) if state.person else None,
        "fields": list(FIELDS),
    }


def _leave(opening: Future[Board], pressed: set[int]) -> None:
    """Release the buttons, and disconnect from the board, if it was opened; on the session's thread."""
    if opening.cancelled() or opening.exception():
        return
    board = opening.result()
    try:
        for pin in pressed:
            board.release(pin)
    except BoardError as error:
        _log.warning("a button could not be released: %s", error)
    finally:
        board.close()
