"""Compute a bag's summary from a reader, and format it as text or YAML as `rosbag info` does.

Source: http://wiki.ros.org/rosbag/Commandline#info. The wording is ROS's own, because programs parse it.
"""

from __future__ import annotations

import re
import time
from array import array
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from minirospy.base.yaml_text import safe_load
from minirospy.core.bag import compression
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.records import Connection

__all__ = [
    "Stored",
    "Summary",
    "Topic",
    "as_text",
    "as_yaml",
    "compression_of",
    "seconds",
    "span_out_of_order",
    "summarize",
    "value_of",
]

NUMPY_PAYS = 100_000
"""Number of timestamps above which numpy computes the median faster than Python, even including the time to import numpy."""

MAX_OVERLAP = 1.0  # seconds by which the chunks of a recording may overlap
BLOCK = 1 << 16  # number of timestamps that numpy processes together


class Topic(NamedTuple):
    """A topic: its first connection's type, its numbers of messages and connections, and its rate in Hz if known."""

    name: str
    type: str
    messages: int
    connections: int
    frequency: float | None


class Stored(NamedTuple):
    """The chunks that share a compression: their number, and their total size in bytes before and after compression."""

    compression: str
    chunks: int
    size: int
    compressed_size: int


class Summary(NamedTuple):
    """A bag's summary. ``start`` and ``end``, in seconds, are None if the bag has no messages."""

    path: str | None
    version: str
    size: int
    start: float | None
    end: float | None
    messages: int
    stored: list[Stored]
    types: list[tuple[str, str]]  # pairs of a type and its md5sum
    topics: list[Topic]


def summarize(reader: BagReader, path: str | None, *, frequencies: bool) -> Summary:
    """Return a bag's summary; with ``frequencies``, read the whole index for the topics' rates.

    Raise BagFormatError if the bag is damaged.
    """
    version = reader.version_name
    connections = list(reader.connections.values())
    counts: Counter[int] = Counter()
    if reader.chunks:
        start, end = seconds(reader.chunks[0].start_time), seconds(reader.chunks[-1].end_time)
        if not reader.version:
            # Use the true span of an MCAP file: ROS cannot read MCAP files, so there is no output to match.
            start, end = _span(reader)
        for chunk in reader.chunks:
            counts.update(chunk.counts)
    else:
        indexes = reader.index(reader.connections)
        counts.update({each.id: len(index) for each, index in zip(connections, indexes, strict=True)})
        if not any(indexes):
            return Summary(path, version, reader.size(), None, None, 0, [], [], [])
        start = seconds(min(index.times[0] for index in indexes if index))
        end = seconds(max(index.times[-1] for index in indexes if index))

    if frequencies:
        # Omit connections without messages, as ROS's reader does. Bags from ROS's Python writer may contain such connections.
        connections = [each for each in connections if counts[each.id]]
    types: dict[str, str] = {}
    by_topic: dict[str, list[Connection]] = {}
    for each in connections:
        types.setdefault(each.type, each.md5sum)
        by_topic.setdefault(each.topic, []).append(each)

    times: dict[int, array[int]] = {}
    if frequencies:
        numbers = [each.id for each in connections]
        times = dict(zip(numbers, reader.times(numbers), strict=True))
    topics = [
        Topic(
            name,
            of_topic[0].type,
            sum(counts[each.id] for each in of_topic),
            len(of_topic),
            _frequency([times.pop(each.id) for each in of_topic]) if frequencies else None,
        )
        for name, of_topic in sorted(by_topic.items())
    ]
    return Summary(
        path,
        version,
        reader.size(),
        start,
        end,
        counts.total(),
        compression_of(reader),
        sorted(types.items()),
        topics,
    )


def span_out_of_order(reader: BagReader) -> tuple[float, float] | None:
    """Return the times of the first and last messages if ROS's summary would show other times, else None.

    For bags, ROS takes the times from the first and last chunks in the file. Chunks that overlap slightly, as those of recorders
    do, count as in order.
    """
    if not reader.chunks or not reader.version:
        return None
    start, end = _span(reader)
    late = max(seconds(reader.chunks[0].start_time) - start, end - seconds(reader.chunks[-1].end_time))
    return (start, end) if late > MAX_OVERLAP else None


def _span(reader: BagReader) -> tuple[float, float]:
    start = min(chunk.start_time for chunk in reader.chunks)
    return seconds(start), seconds(max(chunk.end_time for chunk in reader.chunks))


def compression_of(reader: BagReader) -> list[Stored]:
    """Return the compressions used for a bag's chunks, most frequent first."""
    found: dict[str, list[int]] = {}
    for header in reader.chunk_headers().values():
        sums = found.setdefault(header.chunk.compression, [0, 0, 0])
        for at, value in enumerate((1, header.chunk.size, header.chunk.compressed_size)):
            sums[at] += value
    stored = [Stored(name, *sums) for name, sums in found.items()]
    return sorted(stored, key=lambda each: (each.chunks, each.compression), reverse=True)


def seconds(nanoseconds: int) -> float:
    """Return a time in seconds, rounded as genpy's to_sec does."""
    whole, rest = divmod(nanoseconds, 10**9)
    return whole + rest / 1e9


def as_text(summary: Summary) -> str:
    """Return the output of `rosbag info`."""
    rows = [("path", summary.path)] if summary.path else []
    rows.append(("version", summary.version))
    if summary.start is None or summary.end is None:
        rows.append(("size", _human_size(summary.size)))
        return _aligned(rows)

    duration = summary.end - summary.start
    rows += [
        ("duration", _human_duration(duration)),
        ("start", f"{_local_time(summary.start)} ({summary.start:.2f})"),
        ("end", f"{_local_time(summary.end)} ({summary.end:.2f})"),
        ("size", _human_size(summary.size)),
        ("messages", str(summary.messages)),
        ("compression", _compressions(summary.stored)),
    ]
    if any(each.compression != compression.NONE for each in summary.stored):
        rows += _sizes(summary.stored, duration)

    widest = max((len(name) for name, _ in summary.types), default=0)
    rows += _listed("types", (f"{name:<{widest}} [{md5sum}]" for name, md5sum in summary.types))
    rows += _listed("topics", _topic_lines(summary.topics, widest))
    return _aligned(rows)


def as_yaml(summary: Summary) -> str:
    """Return the output of `rosbag info -y`."""
    lines = [f"path: {summary.path}"] if summary.path else []
    lines.append(f"version: {summary.version}")
    if summary.start is None or summary.end is None:
        return "\n".join([*lines, f"size: {summary.size}", "indexed: False", ""])

    lines += [
        f"duration: {summary.end - summary.start:.6f}",
        f"start: {summary.start:.6f}",
        f"end: {summary.end:.6f}",
        f"size: {summary.size}",
        f"messages: {summary.messages}",
        "indexed: True",
        f"compression: {summary.stored[0].compression if summary.stored else compression.NONE}",
    ]
    if any(each.compression != compression.NONE for each in summary.stored):
        lines.append(f"uncompressed: {sum(each.size for each in summary.stored)}")
        lines.append(f"compressed: {sum(each.compressed_size for each in summary.stored)}")

    lines.append("types:")
    for name, md5sum in summary.types:
        lines += [f"    - type: {name}", f"      md5: {md5sum}"]
    lines.append("topics:")
    for topic in summary.topics:
        lines += [
            f"    - topic: {topic.name}",
            f"      type: {topic.type}",
            f"      messages: {topic.messages}",
        ]
        if topic.connections > 1:
            lines.append(f"      connections: {topic.connections}")
        if topic.frequency is not None:
            lines.append(f"      frequency: {topic.frequency:.4f}")
    return "\n".join([*lines, ""])


def value_of(text: str, key: str) -> str:
    """Look up a key in the output of :func:`as_yaml`; return its value in the format of `rosbag info -k`.

    Keys are, for example, ``start`` or ``topics[0].type``. Raise LookupError if the key does not exist.
    """
    if not re.fullmatch(r"[A-Za-z_]\w*(\[-?\d+\])*(\.[A-Za-z_]\w*(\[-?\d+\])*)*", key):
        raise LookupError(key)
    value: object = safe_load(text)
    for part in re.findall(r"\w+|-\d+", key):
        if isinstance(value, dict):
            value = value[part]
        elif isinstance(value, list) and re.fullmatch(r"-?\d+", part):
            value = value[int(part)]
        else:
            raise LookupError(key)

    if isinstance(value, list):
        return "".join(f"- {_printed(each)}\n" for each in value)
    return _printed(value).replace("\n  ", "\n") if isinstance(value, dict) else str(value)


def _printed(value: object) -> str:
    """Format a list item as `rosbag info -k` prints it."""
    if not isinstance(value, dict):
        return f"  {value}"
    return "\n  ".join(f"{name}: {each}" for name, each in value.items())


def _frequency(times: list[array[int]]) -> float | None:
    """Return a topic's message rate in Hz: the inverse of the median period, or None if that is not positive."""
    count = sum(map(len, times))
    if count < 2:
        return None
    median = (_median_by_numpy if count > NUMPY_PAYS else _median)(times)
    return 1.0 / median if median > 0.0 else None


def _median(times: list[array[int]]) -> float:
    in_order = [seconds(each) for each in sorted(each for part in times for each in part)]
    periods = sorted(after - before for before, after in pairwise(in_order))
    middle = len(periods) // 2
    return periods[middle] if len(periods) % 2 else (periods[middle - 1] + periods[middle]) / 2


def _median_by_numpy(times: list[array[int]]) -> float:
    """Return the median period, computed with numpy. Overwrites ``times``."""
    import numpy as np

    joined = np.frombuffer(times[0], np.uint64)
    if len(times) > 1:
        joined = np.concatenate([np.frombuffer(each, np.uint64) for each in times if each])
    joined.sort()
    periods = joined.view(np.float64)
    last = 0.0
    for start in range(0, len(joined), BLOCK):
        block = joined[start : start + BLOCK]
        stamps = block // 10**9 + (block % 10**9) / 1e9
        periods[start : start + BLOCK] = np.diff(stamps, prepend=last)
        last = float(stamps[-1])

    periods = periods[1:]
    middle = len(periods) // 2
    if len(periods) % 2:
        periods.partition(middle)
        return float(periods[middle])
    periods.partition((middle - 1, middle))
    return float(periods[middle - 1] + periods[middle]) / 2


def _compressions(stored: Sequence[Stored]) -> str:
    chunks = sum(each.chunks for each in stored)
    parts = []
    for each in stored:
        fraction = ""
        if each.compression != compression.NONE:
            fraction = f"; {_percent(each.compressed_size, each.size)}"
        parts.append(f"{each.compression} [{each.chunks}/{chunks} chunks{fraction}]")
    return ", ".join(parts) or compression.NONE


def _sizes(stored: Sequence[Stored], duration: float) -> list[tuple[str, str]]:
    size, compressed = sum(each.size for each in stored), sum(each.compressed_size for each in stored)
    before, after = _right_aligned(_human_size(size), _human_size(compressed))
    if duration <= 0:
        return [("uncompressed", before), ("compressed", after)]
    rate_before, rate_after = _right_aligned(_human_size(size / duration), _human_size(compressed / duration))
    return [
        ("uncompressed", f"{before} @ {rate_before}/s"),
        ("compressed", f"{after} @ {rate_after}/s ({_percent(compressed, size)})"),
    ]


def _topic_lines(topics: Sequence[Topic], widest_type: int) -> Iterable[str]:
    name_width = max((len(topic.name) for topic in topics), default=0)
    count_width = max((len(str(topic.messages)) for topic in topics), default=0)
    rates = [_human_frequency(topic.frequency) for topic in topics if topic.frequency is not None]
    rate_width = max(map(len, rates), default=0)
    for topic in topics:
        line = f"{topic.name:<{name_width}}   {topic.messages:>{count_width}} "
        line += "msgs" if topic.messages > 1 else "msg "
        if topic.frequency is not None:
            line += f" @ {_human_frequency(topic.frequency):>{rate_width}}"
        else:
            line += "   " + " " * rate_width
        line += f" : {topic.type:<{widest_type}}"
        if topic.connections > 1:
            line += f" ({topic.connections} connections)"
        yield line


def _listed(name: str, lines: Iterable[str]) -> list[tuple[str, str]]:
    """Return a table row for each line; only the first row contains the name."""
    return [("" if number else name, line) for number, line in enumerate(lines)]


def _aligned(rows: Sequence[tuple[str, str | None]]) -> str:
    width = max(len(name) for name, _ in rows) + 1
    return "\n".join(f"{name + ':' if name else '':<{width}} {value}" for name, value in rows).rstrip()


def _right_aligned(*texts: str) -> list[str]:
    width = max(map(len, texts))
    return [text.rjust(width) for text in texts]


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.2f}%" if whole else "0.00%"


def _human_duration(duration: float) -> str:
    minutes = int(duration / 60)
    if not minutes:
        return f"{duration:.1f}s"
    text = f"{minutes % 60 if minutes >= 60 else minutes}:{int(duration % 60):02d}s ({int(duration)}s)"
    return f"{minutes // 60}hr {text}" if minutes >= 60 else text


def _local_time(stamp: float) -> str:
    fraction = f"{stamp - int(stamp):.2f}"[1:]
    try:
        return time.strftime("%b %d %Y %H:%M:%S", time.localtime(stamp)) + fraction
    except (OSError, OverflowError, ValueError):
        # Print the number if the time is outside the range of the system calendar, for example in a damaged bag.
        return f"{stamp:.2f}"


def _human_size(size: float) -> str:
    for unit in ("KB", "MB", "GB", "TB", "PB", "EB", "ZB", "YB"):
        size /= 1024.0
        if size < 1024.0:
            return f"{size:.1f} {unit}"
    return "-"


def _human_frequency(frequency: float) -> str:
    for unit in ("Hz", "kHz", "MHz", "GHz", "THz", "PHz", "EHz", "ZHz", "YHz"):
        if frequency < 1000.0:
            return f"{frequency:.1f} {unit}"
        frequency /= 1000.0
    return "-"
