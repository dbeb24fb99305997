"""Sessions of JSON operations: refused operations, failures, and the cost of a client that leaves."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from collections.abc import Coroutine, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, cast

import pytest

from minirospy.base.errors import UsageError
from minirospy.web.dashboard import json_session
from minirospy.web.dashboard.json_session import (
    Fields,
    Handler,
    JsonEndpoint,
    JsonSession,
    number,
    text_of,
    texts_of,
    wait_until,
)
from tests import manual_loop
from tests.manual_loop import ManualLoop, run_manually
from tests.waiting import until

if TYPE_CHECKING:
    from minirospy.web.server.client import WebClient


class Client:
    """Records a session's output, and whether it has closed the connection."""

    def __init__(self, *, is_owner: bool = True) -> None:
        self.is_owner = is_owner
        self.sent: list[dict[str, Any]] = []
        self.closed: list[int] = []
        self.held = 0
        self._arrived = asyncio.Event()

    def holds(self, count: int) -> None:
        self.held = count

    def send_text(self, text: str) -> None:
        self.sent.append(json.loads(text))
        self._arrived.set()

    def close(self, code: int, reason: str) -> None:
        self.closed.append(code)
        self._arrived.set()

    def why_not_owner(self, what: str) -> str:
        return f"you may not {what}"

    async def until(self, count: int) -> list[dict[str, Any]]:
        """Return the sent messages as soon as there are ``count``."""
        while len(self.sent) < count and not self.closed:
            self._arrived.clear()
            await self._arrived.wait()
        return self.sent


class Session(JsonSession):
    subject: ClassVar[str] = "toys"
    owners_only: ClassVar[str] = "play"
    longest: ClassVar[int] = 1000
    max_waiting: ClassVar[int] = 3

    def __init__(self, client: WebClient) -> None:
        self.left_by: list[str] = []
        self.leaving = asyncio.Event()
        self.gate = threading.Event()
        self.follows = 0
        self.fault: Exception | None = None
        handlers: Mapping[str, Handler] = {"say": self._say, "fail": self._fail, "block": self._block}
        super().__init__(client, handlers)

    async def follow(self) -> float | None:
        self.follows += 1
        if self.fault:
            raise self.fault
        return None

    async def left(self) -> None:
        self.leaving.set()
        await asyncio.sleep(0.01)
        self.left_by.append("left")

    async def _say(self, fields: Fields) -> Fields:
        return {"said": fields["text"]}

    async def _fail(self, fields: Fields) -> None:
        raise FAULTS[str(fields["how"])]

    async def _block(self, _: Fields) -> None:
        await self.in_thread(lambda: self.gate.wait(60))


FAULTS = {
    "usage": UsageError("no such\n toy"),
    "os": OSError("no space"),
    "depth": RecursionError("too deep"),
    "size": OverflowError("too large"),
    "bug": ZeroDivisionError("by nothing"),
    "silent": ValueError(),
}


def run(work: Coroutine[object, object, None]) -> None:
    asyncio.run(asyncio.wait_for(work, 60))


def opened(client: Client) -> tuple[JsonEndpoint[Session], Session]:
    endpoint = JsonEndpoint("toys.v1", Session)
    return endpoint, endpoint.open(cast("WebClient", client))


@pytest.mark.parametrize(
    ("how", "text"),
    [
        ("usage", "no such toy"),
        ("os", "no space"),
        ("depth", "not an operation on toys: fail: too deep"),
        ("size", "not an operation on toys: fail: too large"),
        ("bug", "the dashboard failed on this operation: ZeroDivisionError"),
        ("silent", "not an operation on toys: fail: ValueError"),
    ],
)
def test_operation_that_fails_is_one_line_and_the_next_one_works(how: str, text: str) -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        session.received_text(json.dumps({"op": "fail", "how": how}))
        session.received_text('{"op": "say"}')
        session.received_text('{"op": "say", "text": "hello"}')
        assert (await client.until(4))[1:] == [
            {"error": text},
            {"error": "not an operation on toys: say: text is missing"},
            {"said": "hello"},
        ]
        await endpoint.close()

    run(work())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "1",
        "{}",
        '{"op": "fly"}',
        '{"op": []}',
        '{"op": "say"',
        "[" * 1000,
        '{"op": "' + "x" * 900 + '"}',
    ],
)
def test_text_that_is_no_operation_is_refused_with_one_line(text: str) -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        session.received_text(text)
        (error,) = client.sent
        assert error["error"].startswith("not an operation on toys: ")
        assert "\n" not in error["error"]
        assert len(error["error"]) < 200
        await endpoint.close()

    run(work())


def test_operation_that_is_too_long_is_not_parsed() -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        session.received_text(json.dumps({"op": "say", "text": "x" * 1000}))
        session.received_binary(b"x")
        assert client.sent == [
            {"error": "an operation on toys has 1000 characters at most"},
            {"error": "binary messages have no meaning here"},
        ]
        await endpoint.close()

    run(work())


def test_operations_that_wait_are_limited() -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        session.received_text('{"op": "block"}')
        await client.until(1)
        await until(lambda: not session._operations)
        for _ in range(5):
            session.received_text('{"op": "say", "text": "x"}')
        assert [*map(list, client.sent)] == [["writes"], ["error"], ["error"]]
        session.gate.set()
        assert (await client.until(6))[3:] == [{"said": "x"}] * 3
        await endpoint.close()

    run(work())


def test_client_that_is_no_owner_gets_the_reason_and_nothing_else() -> None:
    async def work(loop: ManualLoop) -> None:
        client = Client(is_owner=False)
        endpoint, session = opened(client)
        await client.until(2)
        session.received_text('{"op": "say", "text": "x"}')
        session.changed()
        await loop.advance(2 * session.pace)
        assert client.sent == [
            {"writes": False},
            {"error": "you may not play"},
            {"error": "you may not play"},
        ]
        assert session.follows == 0
        closing = asyncio.ensure_future(endpoint.close())
        await loop.advance(1.0)
        await closing

    run_manually(work)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (ZeroDivisionError("by nothing"), "ZeroDivisionError"),
        (UsageError("by nothing"), "by nothing"),
        (OSError(28, "by nothing"), "[Errno 28] by nothing"),
    ],
)
def test_look_that_fails_is_reported_once_and_repeated(
    fault: Exception, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        await client.until(1)
        session.fault = fault
        session.changed()
        assert (await client.until(2))[1] == {"error": f"the dashboard failed to show toys: {reason}"}
        failed = session.follows
        session.changed()
        await until(lambda: session.follows > failed)
        session.fault, failed = None, session.follows
        await until(lambda: session.follows > failed)
        assert len(client.sent) == 2
        await endpoint.close()

    with caplog.at_level(logging.ERROR):
        run(work())
    assert "by nothing" in caplog.text


def test_session_is_left_once_however_often_it_is_ended() -> None:
    async def work() -> None:
        client = Client()
        endpoint, session = opened(client)
        session.received_text('{"op": "block"}')
        await client.until(1)
        session.ended()
        await session.leaving.wait()
        session.ended()
        await endpoint.close()
        assert session.left_by == ["left"]
        assert not endpoint.sessions
        session.gate.set()

    run(work())


def test_session_that_opens_after_the_end_of_its_endpoint_ends() -> None:
    async def work() -> None:
        endpoint, _ = opened(Client())
        await endpoint.close()
        late = endpoint.open(cast("WebClient", Client()))
        await asyncio.wait([late._task])
        assert late.is_ended
        assert not endpoint.sessions

    run(work())


def test_changes_of_any_thread_are_looked_at_no_faster_than_the_pace() -> None:
    async def work(loop: ManualLoop) -> None:
        client = Client()
        endpoint, session = opened(client)
        await loop.advance(10.0)
        assert session.follows == 1

        def change() -> None:
            for _ in range(1000):
                session.post_change()
                endpoint.post_change()

        # The first refresh was long ago; a refresh after the next change waits for the rate limit.
        for pause, looks in ((0.0, 2), (0.9, 2), (0.2, 3)):
            changing = asyncio.ensure_future(asyncio.to_thread(change))
            await manual_loop.until(changing.done)
            await loop.advance(pause * session.pace)
            assert session.follows == looks
        closing = asyncio.ensure_future(endpoint.close())
        await loop.advance(1.0)
        await closing

    run_manually(work)


def test_wait_ends_when_the_clock_has_passed_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    tick = 1 / 64

    async def work(loop: ManualLoop) -> None:
        # This simulates Windows before Python 3.13, where timers fire up to a tick early.
        monkeypatch.setattr(loop, "_clock_resolution", tick)
        waiting = asyncio.ensure_future(wait_until(asyncio.Event(), loop.time() + 0.05))
        await loop.advance(3 * tick)
        assert not waiting.done()
        await loop.advance(tick)
        assert waiting.done()

    monkeypatch.setattr(json_session, "CLOCK_SECONDS", tick)
    run_manually(work)


def test_work_that_goes_on_is_waited_for_and_its_fault_logged(caplog: pytest.LogCaptureFixture) -> None:
    async def work() -> None:
        endpoint, _ = opened(Client())
        done: list[int] = []

        async def slow() -> None:
            await asyncio.sleep(0.05)
            done.append(1)
            raise ZeroDivisionError("by nothing")

        endpoint.spawn(slow())
        await endpoint.close()
        assert done == [1]

    with caplog.at_level(logging.ERROR):
        run(work())
    assert "by nothing" in caplog.text


def test_fields_are_of_their_types() -> None:
    fields: Fields = {"a": "x", "b": ["x", 1], "c": 1.5}
    assert text_of(fields, "a") == "x"
    assert texts_of(fields, "b") == ["x", "1"]
    assert number(fields["c"]) == 1.5
    for wrong in ("x", True, None, float("nan"), [1]):
        with pytest.raises(TypeError):
            number(wrong)
    with pytest.raises(OverflowError):
        number(10**400)
    with pytest.raises(TypeError):
        text_of(fields, "c")
    with pytest.raises(TypeError):
        texts_of(fields, "a")
