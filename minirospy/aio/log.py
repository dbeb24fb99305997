"""A node's log handlers in an event loop, for the terminal and /rosout. They use Python's ``logging``."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from typing import TYPE_CHECKING

from minirospy.aio.topics import Publisher
from minirospy.base.errors import ROSSerializationException
from minirospy.base.log_levels import SEVERITIES, ros_level

if TYPE_CHECKING:
    from rosgraph_msgs.msg import Log

    from minirospy.aio.node import Node

__all__ = ["RosoutHandler", "TerminalHandler"]


class TerminalHandler(logging.Handler):
    """Prints log lines as rospy does: debug and info to stdout, other levels to stderr."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._node = node

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line."""
        name = SEVERITIES.get(record.levelno, record.levelname)
        stream = sys.stdout if record.levelno < logging.WARNING else sys.stderr
        # Ignore a closed terminal, because logging must not end the program.
        with contextlib.suppress(OSError, ValueError):
            stream.write(f"[{name}] [{record.created:f}]: {self.format(record)}\n")
            stream.flush()


class RosoutHandler(logging.Handler):
    """Publishes log records to /rosout."""

    def __init__(self, node: Node, publisher: Publisher[Log], message_class: type[Log]) -> None:
        super().__init__()
        self._node = node
        self._publisher = publisher
        self._message_class = message_class

    def emit(self, record: logging.LogRecord) -> None:
        """Publish one record."""
        state = self._publisher._state
        if state is None or self._node.is_shutdown:
            return
        message = self._message_class()
        message.header.stamp = self._node.now()
        message.level = ros_level(record.levelno)
        message.name = self._node.name
        message.msg = self.format(record)
        message.file = os.path.basename(record.pathname)
        message.function = record.funcName or ""
        message.line = record.lineno
        message.topics = list(self._node._node.publications)
        with contextlib.suppress(ROSSerializationException):
            state.publish(message)
