"""The options for `rosbag record`, and parsers for their values: sizes, durations, topics.

Source: http://wiki.ros.org/rosbag/Commandline#record.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from minirospy.base.errors import UsageError

__all__ = ["MEGABYTE", "RecordOptions", "parse_duration", "parse_size", "topic_filter"]

KILOBYTE = 1024
MEGABYTE = 1024 * 1024
_SECOND = 10**9
_FOREVER = 1e12
_UNITS = {"s": 1, "m": 60, "h": 3600}
_MULTIPLIERS = {"": 1, "k": 2**10, "m": 2**20, "g": 2**30}
_NUMBER = re.compile(r"\s*[-+]?(\d+(?:\.\d*)?|\.\d+)([eE][-+]?\d+)?")


class RecordOptions(NamedTuple):
    """The topics to record and the files to write. Sizes are in bytes, times in nanoseconds; 0 means unlimited."""

    topics: tuple[str, ...] = ()
    all_topics: bool = False
    regex: bool = False
    exclude: str = ""
    node: str = ""
    prefix: str = ""  # file name without .bag, or its part before the date
    append_date: bool = True
    split: bool = False
    max_splits: int = 0
    max_size: int = 0
    max_duration: int = 0
    buffer_size: int = 256 * MEGABYTE
    chunk_size: int = 768 * KILOBYTE
    limit: int = 0  # maximum number of messages per topic
    min_space: int = 2**30
    min_space_text: str = "1G"
    compression: str = "none"
    tcp_nodelay: bool = False
    repeat_latched: bool = False
    publish: bool = False
    mcap: bool = False

    @property
    def follows_master(self) -> bool:
        """Return whether to query the master every second for topics to add."""
        return self.all_topics or self.regex or bool(self.node)

    @property
    def extension(self) -> str:
        """Return the file name extension."""
        return ".mcap" if self.mcap else ".bag"


def parse_duration(text: str) -> int:
    """Parse a duration such as ``30``, ``30s``, ``5m`` or ``1.5h`` to nanoseconds. Raise UsageError for other text."""
    number = _NUMBER.match(text)
    if not number:
        raise UsageError("Duration must start with a floating point number.")
    unit = text[number.end() :] or "s"
    if unit not in _UNITS:
        raise UsageError("Duration unit must be s, m, or h")
    seconds = float(number[0]) * _UNITS[unit]
    if not 0 < seconds < _FOREVER:
        raise UsageError("Duration must be positive.")
    return int(seconds * _SECOND)


def parse_size(text: str) -> int:
    """Parse a size such as ``1G``, ``500M``, ``20k`` or ``1000`` to bytes; units are powers of 1024.

    Raise UsageError if the size is invalid.
    """
    number = re.match(r"\s*\d+", text)
    multiplier = _MULTIPLIERS.get(text[number.end() :].lower()) if number else None
    if not number or not multiplier:
        raise UsageError(f"the size {text!r} must be a number with G, M or k behind it")
    return int(number[0]) * multiplier


def topic_filter(options: RecordOptions, subscribed_by_node: bool = False) -> Callable[[str], bool]:
    """Return a predicate that takes a topic's global name and returns whether to record the topic.

    Expressions must match the whole name. If ``subscribed_by_node``, topics found by ``--node`` need not match any
    expression. Raise UsageError if an expression is invalid.
    """
    exclude = _compiled(options.exclude) if options.exclude else None
    patterns = [_compiled(topic) for topic in options.topics] if options.regex else []
    names = frozenset(options.topics)

    def matches(topic: str) -> bool:
        if exclude and exclude.fullmatch(topic):
            return False
        if options.all_topics or subscribed_by_node:
            return True
        if options.regex:
            return any(pattern.fullmatch(topic) for pattern in patterns)
        return topic in names

    return matches


def _compiled(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as error:
        raise UsageError(f"the regular expression {text!r} is wrong: {error}") from error
