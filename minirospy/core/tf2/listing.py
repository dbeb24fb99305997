"""Lists of a buffer's frames: YAML that view_frames can parse, and a graph in graphviz's language.

Source: http://wiki.ros.org/tf2/view_frames; the text equals the output of tf2's BufferCore, byte for byte, except that
quotation marks and backslashes in names are escaped in the graph, as graphviz requires.
"""

from __future__ import annotations

from minirospy.core.tf2.buffer import TransformBuffer
from minirospy.core.tf2.cache import Frame, StaticCache, TimeCache, seconds

__all__ = ["escaped_name", "frames_as_dot", "frames_as_yaml"]

_MIN_SPAN = 0.0001  # seconds; the time span assumed for a single sample when a rate is computed


def frames_as_yaml(buffer: TransformBuffer) -> str:
    """Return parent, broadcaster, rate and times for each frame that has a parent, or ``{}`` if there are no frames."""
    if not buffer.frame_names():
        return "{}"

    texts = []
    for frame in buffer.frames():
        cache = frame.cache
        sample = None if cache is None else cache.at(0)
        if cache is None or sample is None:
            continue
        texts.append(
            f"{frame.name}: \n"
            f"  parent: '{sample[0].name}'\n"
            f"  broadcaster: '{frame.authority}'\n"
            f"  rate: {_rate(cache):.3f}\n"
            f"  most_recent_transform: {seconds(cache.newest):.3f}\n"
            f"  oldest_transform: {seconds(cache.oldest):.3f}\n"
            f"  buffer_length: {_span(cache):.3f}\n"
        )
    return "".join(texts)


def frames_as_dot(buffer: TransformBuffer, now: int = 0) -> str:
    """Return the tree as a graph for `dot`; if ``now`` (nanoseconds) is given, also the age of each transform."""
    if not buffer.frame_names():
        return 'digraph G {\n"no tf data recieved"}'
    frames = buffer.frames()
    edges = [_edge(frame, now) for frame in frames]
    roots = [_root(frame, now) for frame in frames]
    return "".join(["digraph G {\n", *edges, *roots, "}"])


def _edge(frame: Frame, now: int) -> str:
    cache = frame.cache
    sample = None if cache is None else cache.at(0)
    if cache is None or sample is None:
        return ""
    age = f"( {seconds(now) - seconds(cache.newest):.3f} sec old)" if now else ""
    return (
        f'"{escaped_name(sample[0].name)}" -> "{escaped_name(frame.name)}"'
        f'[label="Broadcaster: {escaped_name(frame.authority)}\\n'
        f"Average rate: {_rate(cache):.3f} Hz\\nMost recent transform: {seconds(cache.newest):.3f} {age}\\n"
        f'Buffer length: {_span(cache):.3f} sec\\n"];\n'
    )


def _root(frame: Frame, now: int) -> str:
    """Return the graph's legend if the frame has no parent. Without ``now``, only if it had one before, as in tf2."""
    is_root = bool(now) if frame.cache is None else frame.cache.at(0) is None
    if not is_root:
        return ""
    recorded = f'"Recorded at time: {seconds(now):.3f}"[ shape=plaintext ] ;\n ' if now else ""
    return (
        "edge [style=invis];\n"
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";\n'
        f'{recorded}}}->"{escaped_name(frame.name)}";\n'
    )


def escaped_name(name: str) -> str:
    """Escape a name for a quoted string in graphviz's language."""
    return name.replace("\\", "\\\\").replace('"', '\\"')


def _span(cache: TimeCache | StaticCache) -> float:
    return seconds(cache.newest) - seconds(cache.oldest)


def _rate(cache: TimeCache | StaticCache) -> float:
    return len(cache) / max(_span(cache), _MIN_SPAN)
