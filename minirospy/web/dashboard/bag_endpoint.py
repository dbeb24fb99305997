"""Bags for the page: record topics, open bags and play them, with JSON over WebSocket.

A client sends ``{"op": NAME, ...}``: list; record {topics, name, suffix, compression}, stop; open {name}, close;
play {paused, rate, seek, looping}, step, back; publish {topics, clock}; show {topics}; density {start, end, bins};
thumbnails {topic, times}; for plots: fields {name}, series {id, start, end, columns, series};
export {topics, format}. The server sends
``{"writes"}``, ``{"files", "folder", "given"}``, ``{"recording"}``, ``{"bag"}``, ``{"state"}``, ``{"density"}``,
``{"fields"}``, ``{"series"}``, ``{"sampling"}`` (the progress of series), ``{"exported"}``, ``{"error"}``, and binary
messages: a byte (1: the current message, 2: a message for a thumbnail), the topic's number (u16), its time (f64), the
serialized message.
Times are seconds since the bag's start. All operations require the read-write token, because files are read and written as the
dashboard's user.
"""

from __future__ import annotations

import asyncio
import json
import os
import struct
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from minirospy.base.errors import BagError, MinirospyError, UsageError
from minirospy.introspect.bag_export import Exported, export
from minirospy.web.dashboard.bag_folder import BagFolder
from minirospy.web.dashboard.bag_player import GraphOutput, OpenBag
from minirospy.web.dashboard.bag_plot import SeriesRequest, fields_of, series_of
from minirospy.web.dashboard.json_session import (
    Fields,
    Handler,
    JsonEndpoint,
    JsonSession,
    number,
    text_of,
    texts_of,
)
from minirospy.web.dashboard.recording import Recording

if TYPE_CHECKING:
    from minirospy.web.graph import SharedGraph
    from minirospy.web.server.client import WebClient

__all__ = ["SUBPROTOCOL", "BagEndpoint", "BagSession"]

SUBPROTOCOL = "minirospy.bag.v1"

_PLAYING_SECONDS = 0.05
_RECORDING_SECONDS = 0.25
_SAMPLING_SECONDS = 0.25  # seconds between progress reports while a bag is being read
_MAX_BINS = 4000
_MAX_THUMBNAILS = 60
_LEAST_RATE, _MAX_RATE = 0.1, 10.0
_HEAD = struct.Struct("<BHd")
_MOMENT, _THUMBNAIL = 1, 2
_SECOND = 10**9


class BagEndpoint(JsonEndpoint["BagSession"]):
    """Serves the bags in a folder. All clients share a single recording."""

    def __init__(self, folder: BagFolder, master_uri: str, graph: Callable[[], SharedGraph]) -> None:
        super().__init__(SUBPROTOCOL, lambda client: BagSession(self, client))
        self.folder = folder
        self.graph = graph
        self.recording: Recording | None = None
        self._master_uri = master_uri
        self._starting: asyncio.Task[None] | None = None

    async def record(self, name: str, suffix: str, topics: Sequence[str], compression: str) -> None:
        """Start a recording. Raise MinirospyError if that fails."""
        is_starting = self._starting and not self._starting.done()
        if is_starting or (self.recording and not self.recording.state().is_ended):
            raise UsageError("there is a recording already: stop it first")
        # A separate task, so that the child process is stopped even if the page is closed during the start.
        self._starting = self.spawn(self._start(name, suffix, topics, compression))
        await asyncio.shield(self._starting)

    async def _start(self, name: str, suffix: str, topics: Sequence[str], compression: str) -> None:
        await self._close_recording()
        path = self.folder.new_file(name, suffix)
        start = partial(Recording, path, topics, compression, self._master_uri)
        self.recording = await asyncio.get_running_loop().run_in_executor(None, start)
        self.changed()

    async def stop(self) -> None:
        """Finish the recording, if one is running or starting."""
        if self._starting:
            await asyncio.wait([self._starting])
        if self.recording:
            await self.recording.stop()
            self.changed()

    async def close(self) -> None:
        """End all sessions, whose connections are already closed, and finish the recording."""
        await super().close()
        await self._close_recording()

    async def _close_recording(self) -> None:
        recording, self.recording = self.recording, None
        if recording:
            await recording.stop()


class BagSession(JsonSession):
    """The session of one client. File access blocks, so it runs in the session's thread."""

    subject: ClassVar[str] = "bags"
    owners_only: ClassVar[str] = "record or open bags"

    def __init__(self, endpoint: BagEndpoint, client: WebClient) -> None:
        self._endpoint = endpoint
        self._bag: OpenBag | None = None
        self._shown: dict[str, int] = {}
        """The time of the last message sent for each topic that the page shows, or -1 if none has been sent."""
        self._thumbnails: deque[tuple[str, int]] = deque()
        self._sent: dict[str, str] = {}
        handlers: Mapping[str, Handler] = {
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
            "fields": self._fields,
            "series": self._series,
            "export": self._export,
        }
        super().__init__(client, handlers)

    async def follow(self) -> float | None:
        """Send the states of the recording and the player, the current messages of the shown topics, and a thumbnail."""
        recording = self._endpoint.recording
        state = recording.state() if recording else None
        self._send_changed("recording", state._asdict() if state else None)
        pause = _RECORDING_SECONDS if state and not state.is_ended else None
        if self._bag:
            await self._follow_bag(self._bag)
        if self._bag:
            now = self._bag.state
            pause = pause if now.is_paused or now.is_at_end else _PLAYING_SECONDS
        return 0.0 if self._thumbnails else pause

    async def left(self) -> None:
        """Stop the player and close the bag."""
        await self._close_bag()

    # --- recording

    async def _list(self, _: Fields) -> Fields:
        bags = await self.in_thread(self._endpoint.folder.bags)
        folder = self._endpoint.folder
        rows = [[bag.name, bag.size, bag.modified] for bag in bags]
        return {"files": rows, "folder": str(folder.root), "given": folder.given}

    async def _record(self, fields: Fields) -> None:
        suffix = text_of(fields, "suffix")
        if suffix not in (".bag", ".mcap"):
            raise UsageError(f"recordings are .bag or .mcap, not '{suffix[:20]}'")
        await self._endpoint.record(
            text_of(fields, "name"), suffix, texts_of(fields, "topics"), text_of(fields, "compression")
        )

    async def _stop(self, fields: Fields) -> Fields:
        await self._endpoint.stop()
        return await self._list(fields)

    # --- bag

    def _opened(self) -> OpenBag:
        if self._bag is None:
            raise UsageError("no bag is open")
        return self._bag

    async def _open(self, fields: Fields) -> Fields:
        await self._close_bag()
        name = text_of(fields, "name")
        output = GraphOutput(self._endpoint.graph())

        def opening() -> OpenBag:
            path = self._endpoint.folder.path_of(name)
            try:
                return OpenBag(path, name, output, self.post_change)
            except BagError as error:
                text = str(error)
                raise BagError(text if text.startswith(name) else f"{name}: {text}") from error

        future = self._thread.submit(opening)
        try:
            bag = self._bag = await asyncio.wrap_future(future)
        except asyncio.CancelledError:
            # The page was closed while the bag was being opened, so close the bag once it is open.
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
        opened = {"name": name, "start": start / 1e9, "length": (end - start) / 1e9, "topics": topics}
        return {"bag": {**opened, "format": bag.format, "left_out": bag.left_out}}

    async def _close(self, _: Fields) -> None:
        await self._close_bag()

    async def _close_bag(self) -> None:
        bag, self._bag = self._bag, None
        self._shown.clear()
        self._thumbnails.clear()
        self._sent.pop("state", None)
        if bag:
            bag.output.close()
            # If the client disconnects now, cancel only the wait, so that the bag is still closed.
            await asyncio.shield(asyncio.wrap_future(self._thread.submit(bag.close)))

    async def _play(self, fields: Fields) -> None:
        bag = self._opened()
        rate = fields.get("rate")
        seek = fields.get("seek")
        if rate is not None and not _LEAST_RATE <= number(rate) <= _MAX_RATE:
            raise UsageError(f"the speed is between {_LEAST_RATE:g} and {_MAX_RATE:g}")
        bag.player.control(
            is_paused=_flag(fields, "paused"),
            rate=None if rate is None else number(rate),
            seek=None if seek is None else self._time(bag, seek),
            is_looping=_flag(fields, "looping"),
        )

    async def _step(self, _: Fields) -> None:
        bag = self._opened()
        bag.player.control(is_paused=True)
        now = bag.state.time
        # A step publishes all messages with the same time. After a seek, the messages at the current time are still unpublished.
        count = bag.timeline.count_at(now) if bag.player.is_fresh else 0
        after = bag.timeline.time_after(now)
        if after is not None:
            bag.player.step(count + bag.timeline.count_at(after))

    async def _back(self, _: Fields) -> None:
        bag = self._opened()
        before = bag.timeline.time_before(bag.state.time)
        if before is not None:
            bag.player.control(is_paused=True, seek=before)

    async def _publish(self, fields: Fields) -> None:
        bag = self._opened()
        topics = [each for each in texts_of(fields, "topics") if each in bag.timeline.topics]
        new = set(topics) - set(bag.output.published)
        for line in bag.output.switch(bag.timeline, topics, clock=bool(fields.get("clock"))):
            self.send_error(line)
        bag.player.control(has_clock=bag.output.has_clock)
        # Publish the last earlier message of each latched topic, which new subscribers would otherwise not receive.
        now = bag.state.time
        for topic, body in await self.in_thread(lambda: bag.latched_before(new, now)):
            bag.output.send(topic, body)

    # --- shown messages

    async def _show(self, fields: Fields) -> None:
        bag = self._opened()
        self._shown = {topic: -1 for topic in texts_of(fields, "topics") if topic in bag.timeline.topics}

    async def _density(self, fields: Fields) -> Fields:
        bag = self._opened()
        bins = min(max(int(number(fields["bins"])), 1), _MAX_BINS)
        start, end = (self._time(bag, fields[name]) for name in ("start", "end"))

        def count() -> dict[str, list[int]]:
            return {name: bag.timeline.density(name, start, end, bins) for name in bag.timeline.topics}

        rows = await self.in_thread(count)
        first = bag.span[0]
        found = {"start": (start - first) / 1e9, "end": (end - first) / 1e9, "rows": rows}
        return {"density": found}

    async def _request_thumbnails(self, fields: Fields) -> None:
        bag = self._opened()
        topic = text_of(fields, "topic")
        times = fields["times"]
        if topic not in bag.timeline.topics or not isinstance(times, list):
            raise UsageError(f"'{topic[:200]}' is not a topic of this bag")
        self._thumbnails = deque(each for each in self._thumbnails if each[0] != topic)
        self._thumbnails += [(topic, self._time(bag, each)) for each in times[:_MAX_THUMBNAILS]]

    # --- tables

    async def _export(self, fields: Fields) -> None:
        name, topics, format_ = self._opened().name, texts_of(fields, "topics"), text_of(fields, "format")
        if not topics:
            raise UsageError("no topic is chosen")
        # Do not wait for the export, so that the player remains responsive.
        self._endpoint.spawn(self._write_tables(name, topics, format_))

    async def _write_tables(self, name: str, topics: Sequence[str], format_: str) -> None:
        folder = self._endpoint.folder

        def check(done: int) -> None:
            if self.is_ended:
                raise BagError("the page has left")

        def write() -> list[Exported]:
            return export(str(folder.path_of(name)), topics, str(folder.root), format_, step=check)

        try:
            found = await self._loop.run_in_executor(None, write)
        except (MinirospyError, OSError) as error:
            self.send_error(f"{name}: {error}")
        except Exception as error:  # noqa: BLE001 the page waits for an answer, also if the Parquet library fails
            self.send_error(f"{name}: {type(error).__name__}: {' '.join(str(error).split())}")
        else:
            rows = [[os.path.basename(each.path), each.rows, each.columns, each.left_out] for each in found]
            self.send({"exported": rows})

    # --- plots

    async def _fields(self, fields: Fields) -> Fields:
        name = text_of(fields, "name")
        return {"fields": await self.in_thread(lambda: fields_of(self._endpoint.folder, name))}

    async def _series(self, fields: Fields) -> Fields:
        request = SeriesRequest.parse(fields)
        last = 0.0

        def report(share: float) -> None:
            """Send the progress to the page; called in the session's thread. Raise BagError if the page has disconnected."""
            nonlocal last
            if self.is_ended:
                raise BagError("the page has left")
            now = time.monotonic()
            if now - last > _SAMPLING_SECONDS:
                last = now
                self._loop.call_soon_threadsafe(self._send_sampling, request.id, share)

        return {"series": await self.in_thread(lambda: series_of(self._endpoint.folder, request, report))}

    def _send_sampling(self, request: object, share: float) -> None:
        text = json.dumps({"sampling": {"id": request, "share": round(share, 3)}})
        self.client.send_text_message("sampling", text.encode(), newest_only=True)

    async def _follow_bag(self, bag: OpenBag) -> None:
        state = bag.state
        if bag.failure:
            self.send_error(bag.failure)
            bag.failure = ""
        self._send_changed(
            "state",
            {
                "time": (state.time - bag.span[0]) / 1e9,
                "rate": state.rate,
                "paused": state.is_paused,
                "ended": state.is_at_end,
                "looping": bag.player.is_looping,
                "published": bag.output.published,
                "clock": bag.output.has_clock,
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
            message = await self.in_thread(lambda: bag.timeline.message_at(topic, time))
        except (MinirospyError, OSError, ValueError) as error:
            self.send_error(f"{bag.name}: {topic}: {error}")
            return
        if message is None:
            return
        place = list(bag.timeline.topics).index(topic)
        head = _HEAD.pack(kind, place, (message.time - bag.span[0]) / 1e9)
        key = (kind, topic) if kind == _MOMENT else (kind, topic, time)
        self.client.send_message(key, head, message.body, newest_only=True)

    @staticmethod
    def _time(bag: OpenBag, seconds: object) -> int:
        """Convert seconds sent by a client to a time in the bag."""
        start, end = bag.span
        return min(max(start + round(number(seconds) * _SECOND), start), end)

    def _send_changed(self, name: str, value: object) -> None:
        text = json.dumps({name: value})
        if self._sent.get(name) != text:
            self._sent[name] = text
            self.client.send_text_message(name, text.encode(), newest_only=True)


def _close_opened(future: Future[OpenBag]) -> None:
    if not future.cancelled() and not future.exception():
        future.result().close()


def _flag(fields: Fields, name: str) -> bool | None:
    value = fields.get(name)
    return None if value is None else bool(value)
