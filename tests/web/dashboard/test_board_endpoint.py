"""The board over WebSocket: states for the page, and commands from it."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from minirospy.board.board import Board
from minirospy.web.access import Access
from minirospy.web.dashboard import board_endpoint
from minirospy.web.dashboard.board_endpoint import SUBPROTOCOL
from tests.web.dashboard.conftest import TOKEN

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served


def opened(served: Served, query: str = "", token: str = "") -> Any:
    names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
    return connect(
        f"ws://127.0.0.1:{served.port}/{query}", subprotocols=names, compression=None, open_timeout=100
    )


def state(socket: Any, accepts: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the first state that ``accepts`` accepts."""
    while True:
        found: dict[str, Any] = json.loads(socket.recv(timeout=60))
        if accepts(found):
            return found


def test_lights_and_buttons_are_shown_and_pressed(serve: Callable[..., Served]) -> None:
    with Board() as board, opened(serve()) as socket:
        first = state(socket, lambda each: "leds" in each)
        assert [pin for pin, _, _ in first["leds"]] == [2, 3, 4, 5, 6, 7]
        assert first["name"] == board.name
        assert board.name in first["boards"]
        assert first["writes"] is True
        board.set(7, 1)
        state(socket, lambda each: each["leds"][-1] == [7, "red", 1])
        socket.send('{"press": 11}')
        state(socket, lambda each: each["buttons"][0] == [11, 1])
        socket.send('{"release": 11}')
        state(socket, lambda each: each["buttons"][0] == [11, 0])
        socket.send('{"person": [0.3, -0.1]}')
        assert state(socket, lambda each: each["person"])["person"] == [0.3, -0.1]
        socket.send('{"person": null}')
        state(socket, lambda each: each["person"] is None)


def test_button_is_released_when_the_page_is_closed(serve: Callable[..., Served]) -> None:
    served = serve()
    with Board() as board:
        edges = board.watch([12], timeout=60)
        with opened(served) as socket:
            socket.send('{"press": 12}')
            assert next(edges).level == 1
        assert next(edges).level == 0


def test_another_board_is_named_in_the_address(serve: Callable[..., Served]) -> None:
    name = f"other-{Board.__name__}"
    with opened(serve(), f"?board={name}", TOKEN) as socket:
        assert state(socket, lambda each: True)["name"] == name


def test_board_is_started_only_with_the_token(serve: Callable[..., Served]) -> None:
    with opened(serve(), "?board=nobodys") as socket:
        assert (
            "only a client that has the token may start boards"
            in state(socket, lambda each: "error" in each)["error"]
        )
        socket.send('{"press": 11}')
        assert "not open" in state(socket, lambda each: "error" in each)["error"]
    with Board("nobodys"), opened(serve(), "?board=nobodys") as socket:
        assert state(socket, lambda each: True)["name"] == "nobodys"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"press": "x"}',
        '{"person": [1]}',
        '{"fly": 1}',
        '{"press": 1, "a": 2}',
        '{"person": [1' + "0" * 400 + ", 0]}",
        '{"person": [NaN, 0]}',
        '{"person": [' + "[" * 900,
    ],
)
def test_invalid_operation_is_refused_with_one_line(serve: Callable[..., Served], text: str) -> None:
    with opened(serve()) as socket:
        socket.send(text)
        assert "not an operation on the board" in state(socket, lambda each: "error" in each)["error"]


def test_pin_that_does_not_exist_is_refused(serve: Callable[..., Served]) -> None:
    with opened(serve()) as socket:
        socket.send('{"press": 99}')
        assert "pin 99 does not exist" in state(socket, lambda each: "error" in each)["error"]


def test_illegal_name_of_a_board_is_refused(serve: Callable[..., Served]) -> None:
    with opened(serve(), "?board=..%2Fx") as socket:
        assert "the board's name" in state(socket, lambda each: "error" in each)["error"]


def test_read_only_client_presses_nothing(serve: Callable[..., Served]) -> None:
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    with opened(serve(access=access), token="read-token-00") as socket:
        assert state(socket, lambda each: "leds" in each)["writes"] is False
        socket.send('{"press": 11}')
        assert "read-only" in state(socket, lambda each: "error" in each)["error"]


def test_board_that_cannot_be_shown_has_its_error(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Board) -> dict[str, object]:
        raise ZeroDivisionError

    monkeypatch.setattr(board_endpoint, "state_of", fail)
    with opened(serve()) as socket:
        # The client disconnects as soon as this arrives. The connection to the board must still be closed, which a
        # fixture checks.
        found = state(socket, lambda each: "error" in each)
    assert found["error"] == "the dashboard failed to show the board: ZeroDivisionError"
