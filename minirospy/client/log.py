"""The log functions: loginfo, logwarn_once, logerr_throttle and the others.

They use Python's ``logging``, with the logger "rosout" and its children, so that a program may add its own handlers;
minirospy's handlers are in `log_handlers.py`. Source: http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Mapping
from types import FrameType
from typing import TYPE_CHECKING, Protocol, TypeVar

from minirospy.base import times
from minirospy.base.log_levels import DEBUG, ERROR, FATAL, INFO, SEVERITIES, WARN
from minirospy.client.log_handlers import check_message
from minirospy.client.session import current_session

if TYPE_CHECKING:
    from typing import TypedDict

    from typing_extensions import Unpack

    class Keywords(TypedDict, total=False):
        """The keyword arguments that a log function passes to Python's logging."""

        exc_info: object
        extra: Mapping[str, object] | None
        stack_info: bool
        stacklevel: int


__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
]

_rosout = logging.getLogger("rosout")
_F = TypeVar("_F", bound=Callable[..., None])


class LogFunction(Protocol):
    """The type of ``loginfo`` and the other plain log functions."""

    def __call__(
        self, msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[Keywords]
    ) -> None:
        """Log ``msg % args``; ``logger_name`` is a logger below "rosout"."""


class ThrottledLogFunction(Protocol):
    """The type of ``loginfo_throttle`` and the other throttled log functions."""

    def __call__(
        self,
        period: float | times.Duration,
        msg: object,
        *args: object,
        logger_name: str | None = None,
        **kwargs: Unpack[Keywords],
    ) -> None:
        """Log at most once per ``period`` seconds from this call site."""


def logger_of(name: str | None) -> logging.Logger:
    return logging.getLogger(f"rosout.{name}") if name else _rosout


def write(
    logger: logging.Logger,
    level: int,
    frame: FrameType,
    msg: object,
    args: tuple[object, ...],
    *,
    exc_info: object = None,
    extra: Mapping[str, object] | None = None,
    stack_info: bool = False,
    stacklevel: int = 1,
) -> None:
    """Log for the caller at ``frame``. Like rospy, prefix a method's name with its class name."""
    at = frame
    while stacklevel > 1 and at.f_back is not None:
        stacklevel, at = stacklevel - 1, at.f_back
    function = at.f_code.co_name
    if "self" in at.f_code.co_varnames or "self" in at.f_code.co_freevars:
        with contextlib.suppress(KeyError):
            function = f"{type(at.f_locals['self']).__name__}.{function}"
    error = exc_info if isinstance(exc_info, tuple) else sys.exc_info() if exc_info else None
    if isinstance(exc_info, BaseException):
        error = (type(exc_info), exc_info, exc_info.__traceback__)
    stack = None
    if stack_info:
        import traceback

        stack = "Stack (most recent call last):\n" + "".join(traceback.format_stack(at)).rstrip("\n")
    place = at.f_code.co_filename, at.f_lineno
    record = logger.makeRecord(logger.name, level, *place, msg, args, error, function, extra, stack)
    if args or not isinstance(msg, str):
        # Format the message once now: an error in a log call must not end the node, even in handlers that do not catch it.
        check_message(record)
    with current_session().lifecycle.deferral:
        logger.handle(record)


def _log_function(level: int, name: str) -> LogFunction:
    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[Keywords]) -> None:
        logger = logger_of(logger_name)
        if logger.isEnabledFor(level):
            write(logger, level, sys._getframe(1), msg, args, **kwargs)

    return _named(log, name, f"Log ``msg % args`` at level {SEVERITIES[level]}.")


class _CallSites:
    """The time and text of the last message from each call site.

    A call site is one call expression, even if it calls several functions.
    """

    def __init__(self) -> None:
        self._once: set[tuple[str, int, int]] = set()
        self._times: dict[tuple[str, int, int], int] = {}
        self._texts: dict[tuple[str, int, int], object] = {}

    def is_first(self, frame: FrameType) -> bool:
        """Return whether this is the first message from the call site at ``frame``."""
        place = _place(frame)
        if place in self._once:
            return False
        self._once.add(place)
        return True

    def is_due(self, frame: FrameType, period: float | times.Duration) -> bool:
        """Return whether the call site at ``frame`` last logged more than ``period`` seconds ago."""
        place, now = _place(frame), current_session().clock.now()
        before = self._times.get(place)
        pause = period.to_nsec() if isinstance(period, times.Duration) else int(period * 1e9)
        # If simulated time has jumped back, log again.
        due = before is None or now - before > pause or now < before
        if due:
            self._times[place] = now
        return due

    def is_new(self, frame: FrameType, text: object) -> bool:
        """Return whether this is the call site's first message, or differs from its previous one."""
        place = _place(frame)
        if place in self._texts and self._texts[place] == text:
            return False
        self._texts[place] = text
        return True


places = _CallSites()  # the call sites in the program that have logged


def _once_function(level: int, name: str) -> LogFunction:
    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[Keywords]) -> None:
        logger = logger_of(logger_name)
        if logger.isEnabledFor(level):
            frame = sys._getframe(1)
            if places.is_first(frame):
                write(logger, level, frame, msg, args, **kwargs)

    return _named(log, name, f"Log at level {SEVERITIES[level]}, from this place in the code only once.")


def _throttle_function(level: int, name: str, *, identical: bool) -> ThrottledLogFunction:
    def log(
        period: float | times.Duration,
        msg: object,
        *args: object,
        logger_name: str | None = None,
        **kwargs: Unpack[Keywords],
    ) -> None:
        logger = logger_of(logger_name)
        if not logger.isEnabledFor(level):
            return
        frame = sys._getframe(1)
        # With a period of 0, log every message; if ``identical`` is set, only changed messages.
        due = places.is_due(frame, period) if period else not identical
        if identical:
            due = places.is_new(frame, msg) or due
        if due:
            write(logger, level, frame, msg, args, **kwargs)

    what = "the same text " if identical else ""
    return _named(log, name, f"Log at level {SEVERITIES[level]}, {what}at most once in ``period`` seconds.")


def _named(function: _F, name: str, doc: str) -> _F:
    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


def _place(frame: FrameType) -> tuple[str, int, int]:
    """Return the location of a call site. Two calls on the same line have different locations."""
    return frame.f_code.co_filename, frame.f_lineno, frame.f_lasti


logdebug = _log_function(logging.DEBUG, "logdebug")
loginfo = _log_function(logging.INFO, "loginfo")
logwarn = _log_function(logging.WARNING, "logwarn")
logerr = _log_function(logging.ERROR, "logerr")
logfatal = _log_function(logging.CRITICAL, "logfatal")
logout = loginfo

logdebug_once = _once_function(logging.DEBUG, "logdebug_once")
loginfo_once = _once_function(logging.INFO, "loginfo_once")
logwarn_once = _once_function(logging.WARNING, "logwarn_once")
logerr_once = _once_function(logging.ERROR, "logerr_once")
logfatal_once = _once_function(logging.CRITICAL, "logfatal_once")

logdebug_throttle = _throttle_function(logging.DEBUG, "logdebug_throttle", identical=False)
loginfo_throttle = _throttle_function(logging.INFO, "loginfo_throttle", identical=False)
logwarn_throttle = _throttle_function(logging.WARNING, "logwarn_throttle", identical=False)
logerr_throttle = _throttle_function(logging.ERROR, "logerr_throttle", identical=False)
logfatal_throttle = _throttle_function(logging.CRITICAL, "logfatal_throttle", identical=False)

logdebug_throttle_identical = _throttle_function(logging.DEBUG, "logdebug_throttle_identical", identical=True)
loginfo_throttle_identical = _throttle_function(logging.INFO, "loginfo_throttle_identical", identical=True)
logwarn_throttle_identical = _throttle_function(logging.WARNING, "logwarn_throttle_identical", identical=True)
logerr_throttle_identical = _throttle_function(logging.ERROR, "logerr_throttle_identical", identical=True)
logfatal_throttle_identical = _throttle_function(
    logging.CRITICAL, "logfatal_throttle_identical", identical=True
)
