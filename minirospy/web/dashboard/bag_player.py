"""An open bag: its timeline, and `rosbag play`'s player, which publishes to the dashboard's graph."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import BagError, BagUnindexedError, BridgeError, MinirospyError
from minirospy.core.bag.base import StoredMessage
from minirospy.core.bag.records import Connection
from minirospy.core.bag.timeline import Timeline
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.bags import left_out
from minirospy.ros.rosbag.recording.output import CLOCK, Controls
from minirospy.ros.rosbag.recording.playback import PlayerState
from minirospy.ros.rosbag.recording.player import Player
from minirospy.ros.rosbag.recording.schedule import PlayOptions
from minirospy.ros.rosbag.recording.sources import Bags, open_reader

if TYPE_CHECKING:
    from minirospy.web.graph import Publication, SharedGraph

__all__ = ["GraphOutput", "OpenBag"]

_log = logging.getLogger(__name__)

_SECOND = 10**9
_MAX_WAITING = 200
"""Maximum number of messages queued for the loop; the player waits while the queue is full."""


class GraphOutput:
    """Publishes a player's messages, and optionally the clock, on the loop's graph. Topics are enabled individually."""

    def __init__(self, graph: SharedGraph) -> None:
        """Create the output for ``graph``. Must be called on the loop."""
        self._graph = graph
        self._loop = asyncio.get_running_loop()
        self._publications: dict[str, Publication] = {}
        self._clock: Publication | None = None
        self._free = threading.BoundedSemaphore(_MAX_WAITING)
        self._is_closed = SignalSafeEvent()

    # --- on the loop

    @property
    def published(self) -> list[str]:
        """Return the topics that are enabled."""
        return sorted(self._publications)

    @property
    def has_clock(self) -> bool:
        """Return whether the clock is published."""
        return self._clock is not None

    def switch(self, timeline: Timeline, topics: Collection[str], *, clock: bool) -> list[str]:
        """Enable these topics, and no others; return one line for each topic that cannot be published."""
        refused = []
        for topic in [each for each in self._publications if each not in topics]:
            self._publications.pop(topic).close()
        for topic in topics:
            if topic in self._publications:
                continue
            connection = timeline.topics[topic].connections[0]
            type_ = InterfaceType(connection.type, connection.md5sum, connection.definition)
            try:
                self._publications[topic] = self._graph.advertise(
                    topic, type_, latch=timeline.topics[topic].is_latched
                )
            except BridgeError as error:
                refused.append(str(error))

        if clock and self._clock is None:
            from rosgraph_msgs.msg import Clock

            try:
                self._clock = self._graph.advertise("/clock", InterfaceType.of(Clock))
            except BridgeError as error:
                refused.append(str(error))
        elif not clock and self._clock:
            self._clock.close()
            self._clock = None
        return refused

    def send(self, topic: str, body: bytes) -> None:
        """Publish a message if its topic is enabled."""
        publication = self._publications.get(topic)
        if publication:
            publication.publish(body)

    def close(self) -> None:
        """Stop publishing. Idempotent."""
        self._is_closed.set()
        for publication in self._publications.values():
            publication.close()
        self._publications.clear()
        if self._clock:
            self._clock.close()
            self._clock = None

    # --- in the player's thread

    def open(self, player: Controls) -> None:
        """See :meth:`Output.open`. Does nothing, because the session stops the player."""

    def advertise(self, connections: Sequence[tuple[int, Connection]]) -> None:
        """See :meth:`Output.advertise`. Does nothing, because topics are advertised when they are enabled."""

    def offer(self, player: Controls) -> None:
        """See :meth:`Output.offer`. Does nothing, because the page controls the player."""

    def has_all_subscribers(self) -> bool:
        """See :meth:`Output.has_all_subscribers`."""
        return True

    def running(self, on_key: Callable[[str], object]) -> AbstractContextManager[None]:
        """See :meth:`Output.running`. Reads no keys, because the terminal belongs to the dashboard's process."""
        return nullcontext()

    def publish(self, number: int, message: StoredMessage) -> None:
        """See :meth:`Output.publish`."""
        topic = message.connection.topic
        if topic in self._publications:
            self._post(lambda: self.send(topic, message.body))

    def publish_clock(self, time: int) -> None:
        """See :meth:`Output.publish_clock`."""
        if self._clock:
            self._post(lambda: self._send_clock(time))

    def waiting_bytes(self) -> int:
        """See :meth:`Output.waiting_bytes`. Returns 0, because queued messages are sent even after the player has stopped."""
        return 0

    def print(self, text: str, end: str = "\n") -> None:
        """See :meth:`Output.print`. Prints nothing, because the page shows the state."""

    def _send_clock(self, time: int) -> None:
        if self._clock:
            self._clock.publish(CLOCK.pack(*divmod(time, _SECOND)))

    def _post(self, send: Callable[[], None]) -> None:
        """Call ``send`` on the loop. Block while too many messages are queued."""

        def run() -> None:
            self._free.release()
            send()

        while not self._free.acquire(timeout=0.2):
            if self._is_closed.is_set():
                return
        try:
            self._loop.call_soon_threadsafe(run)
        except RuntimeError:
            # The loop has been closed, so the message was not queued.
            self._free.release()


class OpenBag:
    """An open bag with its timeline and a player, which is paused at the start. Methods block, so do not call them on the loop.

    ``on_change`` is called in the player's thread when the player has moved or stopped. Raise BagError if the bag is
    invalid, OSError if it cannot be read.
    """

    def __init__(
        self, path: Path, name: str, output: GraphOutput, on_change: Callable[[], object] = lambda: None
    ) -> None:
        self.name = name
        self.output = output
        self.failure = ""  # the error that stopped the player, or ""
        self._files = ExitStack()
        with ExitStack() as opened:
            try:
                reader = open_reader(path, opened)
                self.format = reader.version_name
                self.left_out = left_out(reader)
                self.timeline = Timeline(reader)
                self.span = self.timeline.span or (0, 0)
                self._bags = opened.enter_context(Bags([str(path)]))
            except BagUnindexedError as error:
                raise BagError(f"{name}: {error}. Run `rosbag reindex {name}`") from error
            self._files = opened.pop_all()
        self._is_ready = SignalSafeEvent()
        options = PlayOptions(paused=True, delay=0, quiet=True)
        self.player = Player(self._bags, options, lambda first, last: self._is_ready.set(), output)
        self.player.on_change = self._on_change = on_change
        self._thread = threading.Thread(target=self._play, name="bag-player", daemon=True)
        if self.timeline.topics:
            self._thread.start()
            # Wait until the player is ready, because it cannot be controlled earlier.
            self._is_ready.wait()

    @property
    def state(self) -> PlayerState:
        """Return the player's state; its time is within the bag. May be called from any thread."""
        found = self.player.state()
        return found._replace(time=min(max(found.time, self.span[0]), self.span[1]))

    def latched_before(self, topics: Collection[str], time: int) -> list[tuple[str, bytes]]:
        """Return (topic, last message up to ``time``) of each latched topic in ``topics``, for new subscribers."""
        return [
            (topic, message.body)
            for topic in topics
            if self.timeline.topics[topic].is_latched
            and (message := self.timeline.message_at(topic, time)) is not None
        ]

    def close(self) -> None:
        """Stop the player and close the file."""
        self.player.end()
        if self._thread.ident is not None:
            self._thread.join()
        self._files.close()

    def _play(self) -> None:
        try:
            self.player.run()
        except (MinirospyError, OSError) as error:
            self.failure = str(error)
        except Exception:  # noqa: BLE001 - the page shows that the player has ended
            self.failure = "the player failed: the terminal of the dashboard shows why"
            _log.exception("the player of %s", self.name)
        finally:
            self._is_ready.set()
            self._on_change()
