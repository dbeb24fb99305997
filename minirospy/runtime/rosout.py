"""The /rosout node: gathers the log lines of all nodes, republishes them on /rosout_agg and keeps them in a file.

Source: http://wiki.ros.org/rosout.
"""

from __future__ import annotations

import contextlib
import logging
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any

from minirospy.environment import Environment
from minirospy.errors import DeserializationError
from minirospy.runtime.node import Node
from minirospy.runtime.topics import Publication
from minirospy.wire.framing import serialize_frame
from minirospy.wire.header import Header
from minirospy.wire.tcpros import InterfaceType

__all__ = ["RosoutNode"]

_LOG_BYTES = 100 * 1024 * 1024
_LEVELS = {1: "DEBUG", 2: "INFO", 4: "WARN", 8: "ERROR", 16: "FATAL"}


class RosoutNode:
    """Runs on the loop of whoever starts it; a message is passed on as it came, bytes for bytes."""

    def __init__(self, environment: Environment, log_file: Path) -> None:
        self._node = Node("/rosout", environment)
        self._log_file = log_file
        self._handler: logging.Handler | None = None
        self._log_class: Any = None
        self._aggregated: Publication | None = None

    async def start(self) -> None:
        """Join the graph. Raises OSError, MasterUnreachableError."""
        from rosgraph_msgs.msg import Log

        self._log_class = Log
        with contextlib.suppress(OSError):
            self._handler = RotatingFileHandler(
                self._log_file, maxBytes=_LOG_BYTES, backupCount=3, encoding="utf-8", delay=True
            )
        type_ = InterfaceType(Log._type, Log._md5sum, Log._full_text)
        await self._node.start()
        self._aggregated = Publication("/rosout_agg", type_, queue_size=1000)
        await self._node.advertise(self._aggregated)
        await self._node.subscribe(
            self._node.make_subscription("/rosout", type_, self._on_message, on_loop=True)
        )

    async def close(self) -> None:
        """Leave the graph. Idempotent."""
        await self._node.close()
        if self._handler:
            self._handler.close()

    def _on_message(self, frame: memoryview, header: Header) -> None:
        assert self._aggregated
        body = bytes(frame)
        self._aggregated.publish(serialize_frame(body))
        if self._handler:
            self._write(self._handler, body)

    def _write(self, handler: logging.Handler, body: bytes) -> None:
        message = self._log_class()
        try:
            message.deserialize(body)
        except DeserializationError:
            return
        stamp = message.header.stamp
        line = (
            f"{stamp.secs}.{stamp.nsecs:09d} {_LEVELS.get(message.level, message.level)} {message.name} "
            f"[{message.file}:{message.line}({message.function})] [topics: {', '.join(message.topics)}] {message.msg}"
        )
        handler.emit(logging.LogRecord("rosout", logging.INFO, "", 0, line, None, None))
