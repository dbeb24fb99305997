"""The logging handlers for the terminal and for /rosout.

Source: http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import sys
import threading
import time
from collections.abc import Callable
from typing import TextIO

from minirospy.base.clock import SimulatedClock
from minirospy.base.log_levels import SEVERITIES, ros_level
from minirospy.client.session import current_session

__all__ = ["DeferringHandler", "RosOutHandler", "RosStreamHandler", "check_message"]

_COLOUR = {
    logging.DEBUG: "\033[32m",
    logging.WARNING: "\033[33m",
    logging.ERROR: "\033[31m",
    logging.CRITICAL: "\033[31m",
}
_DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"
_FIELD = re.compile(r"\$\{(\w+)(?::([^}]*))?\}")
_text = logging.Formatter()


class DeferringHandler(logging.Handler):
    """A handler that defers signals while it writes a record, because files and streams are not reentrant."""

    def handle(self, record: logging.LogRecord) -> bool:
        """Write one record."""
        with current_session().lifecycle.deferral:
            return super().handle(record)


class RosStreamHandler(DeferringHandler):
    """Prints log lines as rospy does: debug and info to stdout, other levels to stderr, coloured on a terminal.

    ROSCONSOLE_FORMAT sets the format (http://wiki.ros.org/rosconsole#Console_Output_Formatting).
    """

    def __init__(
        self, colorize: bool = True, stdout: TextIO | None = None, stderr: TextIO | None = None
    ) -> None:
        """Print to ``stdout`` and ``stderr``; by default, to ``sys.stdout`` and ``sys.stderr`` as set when a line is written."""
        super().__init__()
        self._colorize = colorize
        self._stdout = stdout
        self._stderr = stderr

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line."""
        line = _line(record)
        is_fine = record.levelno < logging.WARNING
        stream = (self._stdout or sys.stdout) if is_fine else (self._stderr or sys.stderr)

        try:
            colour = _COLOUR.get(record.levelno) if self._colorize else None
            if colour and stream.isatty():
                line = f"{colour}{line}\033[0m"
            try:
                stream.write(line + "\n")
            except UnicodeEncodeError:
                # Escape characters that the terminal's encoding lacks, for example on Windows.
                encoding = stream.encoding or "ascii"
                stream.write(line.encode(encoding, "backslashreplace").decode(encoding) + "\n")
            stream.flush()
        except RuntimeError:
            # Write to the file descriptor: a signal handler logs while it is interrupting a write to the stream.
            with contextlib.suppress(OSError, ValueError):
                os.write(stream.fileno(), (line + "\n").encode(errors="backslashreplace"))
        except (OSError, ValueError, AttributeError):
            # Drop the line: there is no terminal, or it has been closed, and neither is the program's fault.
            pass


class RosOutHandler(DeferringHandler):
    """Publishes log records to /rosout (http://wiki.ros.org/rosout); a program may add it to its own loggers."""

    def __init__(self, level: int = 0, *, tell_topics: bool = True) -> None:
        """Create the handler; with ``tell_topics``, each message includes the topics that the node publishes."""
        from rosgraph_msgs.msg import Log

        from minirospy.client.publisher import Publisher

        super().__init__(level)
        self._publisher = Publisher("/rosout", Log, latch=True, queue_size=100)
        self._tell_topics = tell_topics
        self._busy = threading.local()

    def emit(self, record: logging.LogRecord) -> None:
        """Publish one record, unless it comes from the publishing code itself."""
        session = current_session()
        node = session.node
        if getattr(self._busy, "yes", False) or node is None or session.is_shutdown():
            return

        self._busy.yes = True
        try:
            message = self._publisher.data_class()
            stamp = message.header.stamp
            stamp.secs, stamp.nsecs = divmod(session.clock.now(), 10**9)
            message.level = ros_level(record.levelno)
            message.name = session.name
            message.msg = _message(record)
            message.file = record.filename
            message.function = record.funcName or ""
            message.line = record.lineno
            if self._tell_topics:
                message.topics = list(node.publications)
            self._publisher.publish(message)
        except Exception as error:  # noqa: BLE001 - a log line must never stop the program that logs
            print(f"Unable to report rosout: {error}", file=sys.stderr)
        finally:
            self._busy.yes = False


def check_message(record: logging.LogRecord) -> str:
    """Return the record's text. If the arguments do not match the format string, return a description of the error."""
    try:
        return record.getMessage()
    except Exception as error:  # noqa: BLE001 - also what a program's own __str__() raises
        text = record.msg if isinstance(record.msg, str) else f"<{type(record.msg).__name__}>"
        record.msg = f"{text} (at {record.pathname}:{record.lineno}: the arguments do not fit: {error})"
        record.args = ()
        return record.msg


def _message(record: logging.LogRecord) -> str:
    text = check_message(record)
    if record.exc_info and not record.exc_text:
        record.exc_text = _text.formatException(record.exc_info)
    return f"{text}\n{record.exc_text}" if record.exc_text else text


def _line(record: logging.LogRecord) -> str:
    message = _message(record)
    severity = SEVERITIES.get(record.levelno, record.levelname)
    template = os.environ.get("ROSCONSOLE_FORMAT")
    if not template or template == _DEFAULT_FORMAT:
        return f"[{severity}] [{_stamp(record)}]: {message}"
    fields: dict[str, Callable[[str | None], object]] = {
        "severity": lambda _: severity,
        "message": lambda _: message,
        "time": lambda form: _stamp(record, form),
        "walltime": lambda form: _wall_time(record, form),
        "thread": lambda _: record.thread,
        "logger": lambda _: record.name,
        "file": lambda _: record.pathname,
        "line": lambda _: record.lineno,
        "function": lambda _: record.funcName,
        "node": lambda _: current_session().name,
    }

    def field(found: re.Match[str]) -> str:
        name, form = found.groups()
        if name not in fields or (form is not None and name not in ("time", "walltime")):
            return found[0]
        return str(fields[name](form))

    return _FIELD.sub(field, template)


def _wall_time(record: logging.LogRecord, form: str | None = None) -> str:
    return f"{record.created:f}" if form is None else time.strftime(form, time.localtime(record.created))


def _stamp(record: logging.LogRecord, form: str | None = None) -> str:
    """Return the wall time, followed by the simulated time if the node uses it."""
    wall = _wall_time(record, form)
    clock = current_session().clock
    return f"{wall}, {clock.now() / 1e9:f}" if isinstance(clock, SimulatedClock) else wall
