"""The tools' door over WebSocket: requests of the page that the Foxglove protocol has no message for."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from minirospy.dashboard.tools_door import SUBPROTOCOL

if TYPE_CHECKING:
    from tests.dashboard.conftest import Served


class Tools:
    """A client of the door."""

    def __init__(self, served: Served, token: str = "") -> None:
        names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
        self._stack = contextlib.ExitStack()
        self.socket = self._stack.enter_context(
            connect(f"ws://127.0.0.1:{served.port}/", subprotocols=names, compression=None)
        )

    def receive(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.socket.recv(timeout=60))
        return found

    def request(self, **fields: object) -> dict[str, Any]:
        """Return the answer to a request."""
        self.socket.send(json.dumps({"id": 7, **fields}))
        while (found := self.receive()).get("id") != 7:
            pass
        return found

    def __enter__(self) -> Tools:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def test_values_of_a_file_are_read(serve: Callable[..., Served]) -> None:
    of_ros = (
        "!!python/object/new:dynamic_reconfigure.encoding.Config\ndictitems:\n  angle: .inf\n  label: 2026-01-01\n"
        "  groups: !!python/object/new:dynamic_reconfigure.encoding.Config\n    dictitems: {id: 0}\n    state: []\n"
        "  is_on: true\n  nothing: null\nstate: []\n"
    )
    with Tools(serve()) as tools:
        assert tools.request(do="yaml", text="power: 3\n---\npower: 4\nlabel: a b\n")["result"] == {
            "power": 4,
            "label": "a b",
        }
        assert tools.request(do="yaml", text=of_ros)["result"] == {
            "angle": "inf",
            "label": "2026-01-01",
            "is_on": True,
        }
        assert "not YAML" in tools.request(do="yaml", text="{")["error"]
        assert "is not a dictionary" in tools.request(do="yaml", text="- 1")["error"]
        bomb = "a0: &a0 [1, 1]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 60))
        assert "unfold to more than" in tools.request(do="yaml", text=bomb)["error"]
        assert "too large" in tools.request(do="yaml", text="a" * 1_000_001)["error"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"id": 1}',
        '{"id": "x", "do": "yaml"}',
        '{"id": 1, "do": "exec"}',
        '{"id": 1, "do": []}',
        '{"id": Infinity, "do": "yaml"}',
    ],
)
def test_what_is_not_a_request_is_refused(serve: Callable[..., Served], text: str) -> None:
    with Tools(serve()) as tools:
        tools.socket.send(text)
        assert tools.receive()["error"].startswith("not a request")
        tools.socket.send(b"\0")
        assert "binary" in tools.receive()["error"]
        assert tools.request(do="yaml", text="a: 1")["result"] == {"a": 1}
