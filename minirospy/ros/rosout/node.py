"""The /rosout node: collects log messages from all nodes, republishes them on /rosout_agg and writes them to a file.

Like every ROS node, it lists its loggers and sets their levels. These are the master's loggers, because the master runs in
the same process. Source: http://wiki.ros.org/rosout.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.base.environment import Environment
from minirospy.base.errors import DeserializationError, ServiceException
from minirospy.base.escape import escaped
from minirospy.base.log_levels import LEVEL_NAMES, logger_levels, set_logger_level
from minirospy.base.ros1_imports import prefer_ros1
from minirospy.base.steps import Steps
from minirospy.core.idl.protocols import Message, ServiceClass
from minirospy.core.wire.framing import Frame, serialize_frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.master.log_file import LogFile
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.services import AsyncHandler, LoopServiceServer
from minirospy.runtime.node.subscription import InTurns
from minirospy.runtime.rpc.turns import Turns
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from rosgraph_msgs.msg import Log

__all__ = ["RosoutNode"]

_log = logging.getLogger(__name__)

_LOG_BYTES = 100 * 1024 * 1024

_MAX_BYTES = 256 * 1024
"""Maximum size of a message in bytes.

Longer messages are dropped, so that no node can fill the memory of the master's process.
"""

_LARGE, _MAX_LARGE = 16 * 1024, 100
"""Size in bytes, and number of messages: a message larger than this is not sent to a subscriber with that many queued
messages.
"""

STEP_LETTERS = 1024  # characters to process per step; escaping a character may take a microsecond


class RosoutNode:
    """Republishes log messages byte for byte, on the event loop that starts the node."""

    def __init__(
        self, environment: Environment, log_file: Path | None, omits_topics: Callable[[], bool]
    ) -> None:
        """Create the node. ``omits_topics`` returns whether log file lines omit the node's published topics."""
        self.node = Node("/rosout", environment)
        self._log_file = log_file
        self._omits_topics = omits_topics
        self._file: LogFile | None = None
        self._log_class: type[Log] | None = None
        self._aggregated: Publication | None = None
        self._turns = Turns()
        self._limited_log = RateLimitedLogger(_log)

    async def start(self) -> None:
        """Register with the master.

        Raise OSError if the node's port cannot be opened, MasterUnreachableError if the master does not respond.
        """
        prefer_ros1()
        from rosgraph_msgs.msg import Log

        self._log_class = Log
        if self._log_file:
            try:
                self._file = LogFile(self._log_file, _LOG_BYTES, "rosout")
            except OSError as error:
                _log.warning("%s cannot be written: %s", self._log_file, error.strerror or error)
            else:
                self._file.text(f"\n\n{time.time():.9f}  Node Startup")
        type_ = InterfaceType.of(Log)
        await self.node.start()
        self._aggregated = Publication("/rosout_agg", type_, queue_size=1000)
        await self.node.advertise(self._aggregated)
        await self.node.subscribe(
            self.node.make_subscription(
                "/rosout",
                type_,
                InTurns(self.on_message, self._turns.start, _MAX_BYTES, self._on_left_out),
            )
        )
        await self._serve_loggers()

    async def close(self) -> None:
        """Unregister from the master. Idempotent."""
        await self.node.close()
        # A pending read completes once its connection is closed.
        while self._turns:
            await asyncio.sleep(0)
        self._limited_log.close()
        if self._file:
            self._file.close()

    async def _serve_loggers(self) -> None:
        from roscpp.msg import Logger
        from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelRequest

        async def get_loggers(body: bytes, header: Header) -> bytes:
            ours = [name for name in logging.root.manager.loggerDict if name.startswith("minirospy")]
            levels = logger_levels(sorted(ours)).items()
            return _bytes_of(
                GetLoggersResponse([Logger(_ros_name(name), level.lower()) for name, level in levels])
            )

        async def set_level(body: bytes, header: Header) -> bytes:
            request = SetLoggerLevelRequest()
            try:
                request.deserialize(body)
                set_logger_level(_python_name(request.logger), request.level)
            except (DeserializationError, ValueError) as error:
                raise ServiceException(str(error)) from error
            return b""

        await self._serve("get_loggers", GetLoggers, get_loggers)
        await self._serve("set_logger_level", SetLoggerLevel, set_level)

    async def _serve(self, name: str, class_: ServiceClass, handler: AsyncHandler) -> None:
        await self.node.serve(
            LoopServiceServer(
                f"/rosout/{name}",
                InterfaceType.of(class_),
                self.node.name,
                handler,
                request_type=class_._request_class._type,
                response_type=class_._response_class._type,
                workers=self.node.workers,
            )
        )

    def on_message(self, frame: Frame, header: Header) -> Steps[None]:
        assert self._aggregated
        body = bytes(frame)
        whole = serialize_frame(body)
        for link in self._aggregated.links:
            if len(whole) <= _LARGE or link.waiting < _MAX_LARGE:
                link.send(whole)
            # Yield to the event loop, because there may be many or large messages.
            yield None
        if self._file:
            yield from self._write(self._file, body)

    def _on_left_out(self, header: Header) -> None:
        self._limited_log.warning(
            "a log message of %s was left out: it is longer than %d KiB",
            header.get("callerid") or "a node without a name",
            _MAX_BYTES // 1024,
        )

    def _write(self, file: LogFile, body: bytes) -> Steps[None]:
        assert self._log_class
        message = self._log_class()
        try:
            message.deserialize(body)
        except DeserializationError:
            return
        stamp = message.header.stamp
        topics = "" if self._omits_topics() else f" [topics: {', '.join(message.topics)}]"
        head = (
            f"{stamp.secs}.{stamp.nsecs:09d} {LEVEL_NAMES.get(message.level, message.level)} {message.name} "
            f"[{message.file}:{message.line}({message.function})]{topics} "
        )

        parts: list[str] = []
        # As in the real log file, keep line breaks only in the message.
        for text, keep in ((head, ""), (message.msg, "\n\t")):
            for at in range(0, len(text), STEP_LETTERS):
                parts.append(escaped(text[at : at + STEP_LETTERS], keep))
                if at:
                    yield None
        file.text("".join(parts))


def _bytes_of(message: Message) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _ros_name(name: str) -> str:
    """Convert a Python logger's name to roscpp's style: the root logger is ``ros``, its children ``ros.NAME``."""
    return "ros" + name.removeprefix("minirospy")


def _python_name(ros_name: str) -> str:
    is_ours = ros_name == "ros" or ros_name.startswith("ros.")
    return "minirospy" + ros_name[3:] if is_ours else ros_name
