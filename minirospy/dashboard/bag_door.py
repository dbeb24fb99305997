"""Bags for the page: recording topics, and looking into a bag and playing it, by JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: list; record {topics, name, suffix, compression}, stop; open {name}, close;
play {paused, rate, seek, looping}, step, back; publish {topics, clock}; show {topics}; density {start, end, bins};
thumbnails {topic, times}. The server sends ``{"writes"}``, ``{"files", "folder", "given"}``, ``{"recording"}``,
``{"bag"}``, ``{"state"}``, ``{"density"}``, ``{"error"}``, and binary messages: a byte (1 the message of the moment, 2 one for a
thumbnail), the topic's number (u16), its time (f64), the serialized message.
Times are seconds since the bag's start. Only who has the read-write token may do any of it: files are read and written
as the user of the dashboard.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import struct
from collections import deque
from collections.abc import Callable, Coroutine, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from minirospy.bridge.tasks import Faults, keep_running
from minirospy.dashboard.bag_folder import BagFolder
from minirospy.dashboard.bag_player import GraphStage, OpenBag
from minirospy.dashboard.recording import Recording
from minirospy.errors import BagError, MinirospyError, UsageError

if TYPE_CHECKING:
    from minirospy.bridge.graph import SharedGraph
    from minirospy.bridge.web.client import WebClient

__all__ = ["SUBPROTOCOL", "BagDoor", "BagSession"]

SUBPROTOCOL = "minirospy.bag.v1"

_log = logging.getLogger(__name__)

_OWNERS_ONLY = "record or open bags"
_LOOK_SECONDS = 0.05
_RECORDING_SECONDS = 0.25
_MOST_WAITING = 200
_MOST_BINS = 4000
_MOST_THUMBNAILS = 60
_LEAST_RATE, _MOST_RATE = 0.1, 10.0
_HEAD = struct.Struct("<BHd")
_MOMENT, _THUMBNAIL = 1, 2
_SECOND = 10**9

_T = TypeVar("_T")
_Fields = Mapping[str, object]


class BagDoor:
    """Serves the bags of a folder; all clients see the same recording."""

    def __init__(self, folder: BagFolder, master_uri: str, graph: Callable[[], SharedGraph]) -> None:
        self.folder = folder
        self.graph = graph
        self.recording: Recording | None = None
        self._master_uri = master_uri
        self._sessions: set[asyncio.Task[None]] = set()
        self._starting: asyncio.Task[None] | None = None

    def select(self, offered: Sequence[str]) -> str:
        """Return the sub-protocol to use. Raise LookupError."""
        if SUBPROTOCOL in offered:
            return SUBPROTOCOL
        raise LookupError(f"sub-protocol {SUBPROTOCOL} is required")

    def open(self, client: WebClient) -> BagSession:
        """Start serving a client."""
        session = BagSession(self, client)
        self._sessions.add(session.task)
        session.task.add_done_callback(self._sessions.discard)
        return session

    async def record(self, name: str, suffix: str, topics: Sequence[str], compression: str) -> None:
        """Start a recording. Raise MinirospyError."""
        is_starting = self._starting and not self._starting.done()
        if is_starting or (self.recording and not self.recording.state().is_ended):
            raise UsageError("there is a recording already: stop it first")
        # The page may be closed meanwhile: its child must not be lost.
        self._starting = asyncio.ensure_future(self._start(name, suffix, topics, compression))
        await asyncio.shield(self._starting)

    async def _start(self, name: str, suffix: str, topics: Sequence[str], compression: str) -> None:
        await self._close_recording()
        path = self.folder.new_file(name, suffix)
        start = partial(Recording, path, topics, compression, self._master_uri)
        self.recording = await asyncio.get_running_loop().run_in_executor(None, start)

    async def stop(self) -> None:
        """Complete the recording, if there is one."""
        if self.recording:
            await self.recording.stop()

    async def close(self) -> None:
        """End all sessions, whose connections have ended, and complete the recording."""
        for task in list(self._sessions):
            task.cancel()
        await asyncio.gather(*self._sessions, return_exceptions=True)
        if self._starting:
            await asyncio.gather(self._starting, return_exceptions=True)
        await self._close_recording()

    async def _close_recording(self) -> None:
        recording, self.recording = self.recording, None
        if recording:
            await recording.stop()


class BagSession:
    """One client. What reads files blocks, so it runs in a thread of the session, one after another."""

    def __init__(self, door: BagDoor, client: WebClient) -> None:
        self._door = door
        self._client = client
        self._operations: asyncio.Queue[_Fields] = asyncio.Queue(_MOST_WAITING)
        self._thread = ThreadPoolExecutor(1, "bag-session")
        self._bag: OpenBag | None = None
        self._shown: dict[str, int] = {}
        """Topics whose messages are sent, and the time of the last one, -1 before."""
        self._thumbnails: deque[tuple[str, int]] = deque()
        self._sent: dict[str, str] = {}
        self._handlers: Mapping[str, Callable[[_Fields], Coroutine[object, object, None]]] = {
            "list": self._list,
            "record": self._record,
            "stop": self._stop,
            "open": self._open,
            "close": self._close,
            "play": self._play,
            "step": self._step,
            "back": self._back,
            "publish": self._publish,
            "show": self._show,
            "density": self._density,
            "thumbnails": self._request_thumbnails,
        }
        self._faults = Faults(_log, "serving bags")
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
            self._send_error(f"not an operation on bags: {error}")
            return
        try:
            self._operations.put_nowait(fields)
        except asyncio.QueueFull:
            self._send_error("the bag is too slow: an operation was dropped")

    def received_binary(self, data: bytes) -> None:
        """Refuse what no client sends."""
        self._send_error("binary messages have no meaning here")

    def ended(self) -> None:
        """End the player, and close the bag."""
        self.task.cancel()

    # --- the session's task

    async def _run(self) -> None:
        self._send("writes", self._client.is_owner)
        if not self._client.is_owner:
            self._send_error(self._client.why_not_owner(_OWNERS_ONLY))
        try:
            await keep_running(self._serve, self._faults)
        finally:
            await asyncio.shield(self._close_bag())
            self._thread.shutdown(wait=False)

    async def _serve(self) -> None:
        loop = asyncio.get_running_loop()
        looked = -math.inf
        while True:
            while not self._operations.empty():
                await self._handle(self._operations.get_nowait())
            if loop.time() - looked >= _RECORDING_SECONDS and self._client.is_owner:
                looked = loop.time()
                self._send_recording()
            if self._bag:
                await self._follow(self._bag)
            await asyncio.sleep(0.0 if self._thumbnails else _LOOK_SECONDS)

    async def _handle(self, fields: _Fields) -> None:
        """Carry out an operation."""
        try:
            await self._handlers[str(fields["op"])](fields)
        except (MinirospyError, OSError) as error:
            self._send_error(str(error))
        except (ValueError, TypeError, LookupError, OverflowError) as error:
            self._send_error(f"not an operation on bags: {fields['op']}: {error!r}")
        except Exception as error:  # noqa: BLE001 - the page waits for the answer, whatever happened here
            self._faults.report(error)
            self._send_error(f"the dashboard failed on this operation: {type(error).__name__}")

    async def _in_thread(self, work: Callable[[], _T]) -> _T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    # --- recording

    async def _list(self, _: _Fields) -> None:
        bags = await self._in_thread(self._door.folder.bags)
        folder = self._door.folder
        rows = [[bag.name, bag.size, bag.modified] for bag in bags]
        self._client.send_text(json.dumps({"files": rows, "folder": str(folder.root), "given": folder.given}))

    async def _record(self, fields: _Fields) -> None:
        suffix = _text(fields, "suffix")
        if suffix not in (".bag", ".mcap"):
            raise UsageError(f"recordings are .bag or .mcap, not '{suffix[:20]}'")
        await self._door.record(
            _text(fields, "name"), suffix, _texts(fields, "topics"), _text(fields, "compression")
        )
        self._send_recording()

    async def _stop(self, _: _Fields) -> None:
        await self._door.stop()
        self._send_recording()
        await self._list({})

    def _send_recording(self) -> None:
        recording = self._door.recording
        self._send("recording", recording.state()._asdict() if recording else None)

    # --- a bag

    def _opened(self) -> OpenBag:
        if self._bag is None:
            raise UsageError("no bag is open")
        return self._bag

    async def _open(self, fields: _Fields) -> None:
        await self._close_bag()
        name = _text(fields, "name")
        stage = GraphStage(self._door.graph())

        def opening() -> OpenBag:
            path = self._door.folder.path_of(name)
            try:
                return OpenBag(path, name, stage)
            except BagError as error:
                text = str(error)
                raise BagError(text if text.startswith(name) else f"{name}: {text}") from error

        future = self._thread.submit(opening)
        try:
            bag = self._bag = await asyncio.wrap_future(future)
        except asyncio.CancelledError:
            # The page was closed meanwhile: what is opened for nobody is closed in that thread.
            future.add_done_callback(_close_opened)
            raise
        start, end = bag.span
        topics = [
            [
                topic.name,
                topic.connections[0].type,
                topic.messages,
                topic.connections[0].definition,
                topic.is_latched,
            ]
            for topic in bag.timeline.topics.values()
        ]
        self._client.send_text(
            json.dumps(
                {"bag": {"name": name, "start": start / 1e9, "length": (end - start) / 1e9, "topics": topics}}
            )
        )

    async def _close(self, _: _Fields) -> None:
        await self._close_bag()

    async def _close_bag(self) -> None:
        bag, self._bag = self._bag, None
        self._shown.clear()
        self._thumbnails.clear()
        self._sent.pop("state", None)
        if bag:
            bag.stage.close()
            await self._in_thread(bag.close)

    async def _play(self, fields: _Fields) -> None:
        bag = self._opened()
        rate = fields.get("rate")
        seek = fields.get("seek")
        if rate is not None and not _LEAST_RATE <= _number(rate) <= _MOST_RATE:
            raise UsageError(f"the speed is between {_LEAST_RATE:g} and {_MOST_RATE:g}")
        bag.player.control(
            is_paused=_flag(fields, "paused"),
            rate=None if rate is None else _number(rate),
            seek=None if seek is None else self._time(bag, seek),
            is_looping=_flag(fields, "looping"),
        )

    async def _step(self, _: _Fields) -> None:
        bag = self._opened()
        bag.player.control(is_paused=True)
        now = bag.state.time
        # All messages of one time are a step; after a seek those of that very moment are shown already, and not published yet.
        count = bag.timeline.count_at(now) if bag.player.is_fresh else 0
        after = bag.timeline.time_after(now)
        if after is not None:
            bag.player.step(count + bag.timeline.count_at(after))

    async def _back(self, _: _Fields) -> None:
        bag = self._opened()
        before = bag.timeline.time_before(bag.state.time)
        if before is not None:
            bag.player.control(is_paused=True, seek=before)

    async def _publish(self, fields: _Fields) -> None:
        bag = self._opened()
        topics = [each for each in _texts(fields, "topics") if each in bag.timeline.topics]
        new = set(topics) - set(bag.stage.published)
        for line in bag.stage.switch(bag.timeline, topics, clock=bool(fields.get("clock"))):
            self._send_error(line)
        bag.player.control(has_clock=bag.stage.has_clock)
        # What was latched before would never reach those who subscribe now.
        time = bag.state.time
        for topic, body in await self._in_thread(lambda: bag.latched_before(new, time)):
            bag.stage.send(topic, body)

    # --- what is shown

    async def _show(self, fields: _Fields) -> None:
        bag = self._opened()
        self._shown = {topic: -1 for topic in _texts(fields, "topics") if topic in bag.timeline.topics}

    async def _density(self, fields: _Fields) -> None:
        bag = self._opened()
        bins = min(max(int(_number(fields["bins"])), 1), _MOST_BINS)
        start, end = (self._time(bag, fields[name]) for name in ("start", "end"))

        def count() -> dict[str, list[int]]:
            return {name: bag.timeline.density(name, start, end, bins) for name in bag.timeline.topics}

        rows = await self._in_thread(count)
        first = bag.span[0]
        found = {"start": (start - first) / 1e9, "end": (end - first) / 1e9, "rows": rows}
        self._client.send_text(json.dumps({"density": found}))

    async def _request_thumbnails(self, fields: _Fields) -> None:
        bag = self._opened()
        topic = _text(fields, "topic")
        times = fields["times"]
        if topic not in bag.timeline.topics or not isinstance(times, list):
            raise UsageError(f"'{topic[:200]}' is not a topic of this bag")
        self._thumbnails = deque(each for each in self._thumbnails if each[0] != topic)
        self._thumbnails += [(topic, self._time(bag, each)) for each in times[:_MOST_THUMBNAILS]]

    async def _follow(self, bag: OpenBag) -> None:
        """Send where the player is, the messages of the moment that are shown, and a thumbnail that waits."""
        state = bag.state
        if bag.failure:
            self._send_error(bag.failure)
            bag.failure = ""
        self._send(
            "state",
            {
                "time": (state.time - bag.span[0]) / 1e9,
                "rate": state.rate,
                "paused": state.is_paused,
                "ended": state.is_at_end,
                "looping": bag.player.is_looping,
                "published": bag.stage.published,
                "clock": bag.stage.has_clock,
            },
        )

        for topic, before in list(self._shown.items()):
            when = bag.timeline.time_at(topic, state.time)
            if when is not None and when != before:
                self._shown[topic] = when
                await self._send_message(bag, _MOMENT, topic, when)
        if self._thumbnails:
            await self._send_message(bag, _THUMBNAIL, *self._thumbnails.popleft())

    async def _send_message(self, bag: OpenBag, kind: int, topic: str, time: int) -> None:
        try:
            message = await self._in_thread(lambda: bag.timeline.message_at(topic, time))
        except (MinirospyError, OSError, ValueError) as error:
            self._send_error(f"{bag.name}: {topic}: {error}")
            return
        if message is None:
            return
        number = list(bag.timeline.topics).index(topic)
        head = _HEAD.pack(kind, number, (message.time - bag.span[0]) / 1e9)
        key = (kind, topic) if kind == _MOMENT else (kind, topic, time)
        self._client.send_message(key, head, message.body, newest_only=True)

    @staticmethod
    def _time(bag: OpenBag, seconds: object) -> int:
        """Return the bag's time of a client's number."""
        start, end = bag.span
        return min(max(start + round(_number(seconds) * _SECOND), start), end)

    def _send(self, name: str, value: object) -> None:
        """Send what has changed."""
        text = json.dumps({name: value})
        if self._sent.get(name) != text:
            self._sent[name] = text
            self._client.send_text_message(name, text.encode(), newest_only=True)

    def _send_error(self, text: str) -> None:
        self._client.send_text(json.dumps({"error": text[:500]}))


def _close_opened(future: Future[OpenBag]) -> None:
    if not future.cancelled() and not future.exception():
        future.result().close()


def _text(fields: _Fields, name: str) -> str:
    value = fields[name]
    if not isinstance(value, str):
        raise TypeError(f"{name} is a text")
    return value


def _texts(fields: _Fields, name: str) -> list[str]:
    value = fields[name]
    if not isinstance(value, list):
        raise TypeError(f"{name} is a list of texts")
    return [str(each) for each in value]


def _flag(fields: _Fields, name: str) -> bool | None:
    value = fields.get(name)
    return None if value is None else bool(value)


def _number(value: object) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError(f"{value!r:.40} is not a number")
    return float(value)
