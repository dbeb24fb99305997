"""The timeline for `rosbag play --foxglove`: a bridge in the player's process, whose clients control the player."""

from __future__ import annotations

import asyncio
from functools import partial
from types import TracebackType

from minirospy.aio.node import Node
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.ros.rosbag.recording.player import Player
from minirospy.runtime.transport.loop import LoopThread
from minirospy.web.addresses import links
from minirospy.web.bridge import Bridge, BridgeOptions
from minirospy.web.foxglove import serializing
from minirospy.web.foxglove.protocol import PlaybackCommand, PlaybackControl, PlaybackState, PlaybackStatus

__all__ = ["PlayerBridge", "PlayerPlayback"]

_TICK_SECONDS = 1 / 30
_START_SECONDS = 30.0
_MAX_RATE = 100.0


class PlayerPlayback:
    """Lets clients of the Foxglove protocol control a player."""

    def __init__(self, player: Player, span: tuple[int, int]) -> None:
        self.range = span
        self._player = player
        self._request_id = ""
        self._did_seek = False

    def now(self) -> int:
        """Return the time in the bag, in nanoseconds, with which messages are stamped."""
        return self._player.state().time

    def state(self) -> PlaybackState:
        """Return the player's state. The first call after a request includes the request's id."""
        state = self._player.state()
        status = (
            PlaybackStatus.ENDED
            if state.is_at_end
            else PlaybackStatus.PAUSED
            if state.is_paused
            else PlaybackStatus.PLAYING
        )
        answer = PlaybackState(status, state.time, state.rate, self._did_seek, self._request_id)
        self._request_id, self._did_seek = "", False
        return answer

    def control(self, control: PlaybackControl) -> None:
        """Execute a playback request from a client."""
        self._request_id, self._did_seek = control.request_id, control.seek is not None
        self._player.control(
            is_paused=control.command is PlaybackCommand.PAUSE,
            rate=min(control.speed, _MAX_RATE),
            seek=control.seek,
        )


class PlayerBridge:
    """Context manager that runs a bridge for a player on a separate loop. Raise BridgeError if the bridge cannot start."""

    def __init__(self, player: Player, span: tuple[int, int], port: int) -> None:
        self._playback = PlayerPlayback(player, span)
        self._port = port
        self._loop = LoopThread("player-bridge")
        self._ticking: asyncio.Task[None] | None = None
        self._node = Node("play_bridge", anonymous=True, rosout=False)
        self._bridge: Bridge | None = None
        self.lines: list[str] = []
        """The lines to print, with the URLs for front ends."""

    def __enter__(self) -> PlayerBridge:
        try:
            self._loop.run(self._start(), _START_SECONDS)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._loop.run(self._close())
        self._loop.close()

    async def _start(self) -> None:
        await self._node.start()
        options = BridgeOptions(foxglove_port=self._port, diagnostics=False)
        self._bridge = Bridge(self._node, options, self._playback)
        await self._bridge.start()
        found = links(["localhost"], self._bridge.listeners["foxglove"].port, encrypted=False)
        self.lines = [
            f"Foxglove protocol at {found.websocket[0]}",
            f"open in Foxglove:   {found.foxglove}",
            f"open in Lichtblick: {found.lichtblick}",
        ]
        reporter = ErrorReporter(self._node.log, "the timeline of the bag")
        self._ticking = asyncio.ensure_future(keep_running(partial(self._tick, self._bridge), reporter))

    async def _tick(self, bridge: Bridge) -> None:
        """Send the time in the bag. Send the player's state, too, if a client or a pressed key has changed it."""
        shown: tuple[object, ...] = ()
        time = -1
        while True:
            state = self._playback.state()
            if (state.status, state.speed) != shown:
                shown = (state.status, state.speed)
                bridge.foxglove.playback_changed(state)
            if state.now != time:
                time = state.now
                frame = serializing.time_frame(time)
                for session in list(bridge.foxglove.sessions):
                    session.send_time(frame)
            await asyncio.sleep(_TICK_SECONDS)

    async def _close(self) -> None:
        if self._ticking:
            self._ticking.cancel()
            await asyncio.gather(self._ticking, return_exceptions=True)
        if self._bridge:
            await self._bridge.close()
        await self._node.close()
