"""The virtual board for the page: LEDs, buttons and simulated person, as JSON over WebSocket.

The server sends ``{"name", "boards", "leds": [[pin, color, level]], "buttons": [[pin, level]], "pins": [[pin, function,
level]], "person": [x, y] | null, "fields": [...], "writes"}`` after each change; a client sends ``{"press": pin}``,
``{"release": pin}`` and ``{"person": [x, y] | null}``. Buttons that a client has pressed are released when it disconnects.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Mapping
from concurrent.futures import Future
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from minirospy.base.errors import BoardError
from minirospy.board.board import Board
from minirospy.board.directory import BoardDirectory
from minirospy.board.model import BUTTONS, LEDS, PINS, Function
from minirospy.board.scanner import FIELDS
from minirospy.web.dashboard.json_session import Fields, Handler, JsonEndpoint, JsonSession, number

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "BoardEndpoint", "BoardSession"]

SUBPROTOCOL = "minirospy.board.v1"

_log = logging.getLogger(__name__)

_LOOK_SECONDS = 0.02


class BoardEndpoint(JsonEndpoint["BoardSession"]):
    """Serves the boards on this machine. A client selects its board with ``?board=NAME``."""

    def __init__(self) -> None:
        super().__init__(SUBPROTOCOL, BoardSession)


class BoardSession(JsonSession):
    """The session of one client. The board's calls block, so they run in the session's thread."""

    subject: ClassVar[str] = "the board"
    longest: ClassVar[int] = 1000
    pace: ClassVar[float] = _LOOK_SECONDS

    def __init__(self, client: WebClient) -> None:
        self._pressed: set[int] = set()
        self._opening: Future[Board] | None = None
        self._board: Board | None = None
        self._boards: list[str] = []
        self._sent = ""
        handlers: Mapping[str, Handler] = {
            "press": self._press,
            "release": self._release,
            "person": self._move_person,
        }
        super().__init__(client, handlers)

    def refusal(self) -> str:
        """See :meth:`JsonSession.refusal`."""
        return "" if self.client.may_write else "this token is read-only: the board cannot be changed with it"

    def parse(self, fields: Fields) -> tuple[str, Fields]:
        """See :meth:`JsonSession.parse`. An operation has a single field, named like the operation."""
        (name,) = fields
        return name, fields

    async def started(self) -> None:
        """Open the client's board."""
        name = self.client.request.query.get("board") or None
        try:
            directory = BoardDirectory.find(name)
            self._boards = await self.in_thread(directory.names)
            # Only the owner may open a board that is not running, because that starts a process.
            if name and name not in self._boards and not self.client.is_owner:
                raise BoardError(
                    f"there is no board [{directory.name}]: {self.client.why_not_owner('start boards')}"
                )
            self._opening = self._thread.submit(Board, name)
            self._board = await asyncio.wrap_future(self._opening)
            self._boards = await self.in_thread(directory.names)
        except BoardError as error:
            self.send_error(str(error))

    async def follow(self) -> float | None:
        """Send the board's state if it has changed."""
        if self._board is None:
            return None
        state = {**state_of(self._board), "boards": self._boards, "writes": self.client.may_write}
        text = json.dumps(state)
        if text != self._sent:
            self._sent = text
            self.client.send_text_message("board", text.encode(), newest_only=True)
        return _LOOK_SECONDS

    async def left(self) -> None:
        """Release the client's pressed buttons, and disconnect from the board."""
        if self._opening:
            await asyncio.wrap_future(self._thread.submit(_leave, self._opening, self._pressed))

    async def _press(self, fields: Fields) -> None:
        pin = _pin(fields["press"])
        # Record the pin first, so that it is released even if the client disconnects before the response.
        self._pressed.add(pin)
        await self.in_thread(partial(self._opened().press, pin))

    async def _release(self, fields: Fields) -> None:
        pin = _pin(fields["release"])
        await self.in_thread(partial(self._opened().release, pin))
        self._pressed.discard(pin)

    async def _move_person(self, fields: Fields) -> None:
        place = fields["person"]
        if place is not None and not (isinstance(place, list) and len(place) == 2):
            raise TypeError("a person is at [x, y]")
        position = (number(place[0]), number(place[1])) if place else None
        await self.in_thread(partial(self._opened().move_person, position))

    def _opened(self) -> Board:
        if self._board is None:
            raise BoardError("the board is not open")
        return self._board


def state_of(board: Board) -> dict[str, object]:
    """Return a board's state for the page."""
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


def _pin(value: object) -> int:
    if not isinstance(value, int):
        raise TypeError(f"{value!r:.40} is not a pin")
    if not 0 <= value < PINS:
        raise BoardError(f"pin {value!s:.40} does not exist: BCM numbers are 0 to {PINS - 1}")
    return value


def _leave(opening: Future[Board], pressed: set[int]) -> None:
    """Release the buttons; disconnect from the board if it has been opened. Runs in the session's thread."""
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
