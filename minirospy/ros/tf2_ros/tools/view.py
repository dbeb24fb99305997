"""tf's and tf2_tools' view_frames: record transforms for five seconds and draw the tree of frames.

The program writes frames.gv, and frames.pdf if `dot` is installed, otherwise frames.svg. Source:
http://wiki.ros.org/tf#view_frames, http://wiki.ros.org/tf2_tools.
"""

from __future__ import annotations

import optparse
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tf2_msgs.srv import FrameGraph as Tf2FrameGraph

from minirospy import client as rospy
from minirospy.base.tree_svg import Edge, tree_svg
from minirospy.core.tf2.listing import escaped_name
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["FrameRecord", "main_tf", "main_tf2", "read_edges", "read_records", "tf2_graph"]

_SECONDS = 5.0
_EDGE = re.compile(
    r'^"((?:[^"\\]|\\.)*)" -> "((?:[^"\\]|\\.)*)"\[label="((?:[^"\\]|\\.)*)"\];$', re.MULTILINE
)
_VERSION = re.compile(r"version (\d+\.?\d*)")


class FrameRecord(NamedTuple):
    """One frame in a buffer's listing; the values are strings, as printed."""

    name: str
    parent: str
    broadcaster: str
    rate: str
    most_recent: str
    oldest: str
    length: str


def main_tf(words: Sequence[str] | None = None) -> int:
    """Run tf's view_frames, for the received transforms or, with --node, for a node's buffer; return the exit status."""
    return run_program(_run_tf, words)


def main_tf2(words: Sequence[str] | None = None) -> int:
    """Run tf2_tools' view_frames.py; return the exit status."""
    return run_program(_run_tf2, words)


def _run_tf(words: Sequence[str]) -> None:
    parser = optparse.OptionParser(usage="usage: %prog [options]", prog="viewFrames.py")
    parser.add_option(
        "--node", metavar="node name", type="string", help="Node to get frames from", dest="node"
    )
    options, _ = parser.parse_args([*words])
    if options.node:
        print("Generating graph for node: ", options.node, flush=True)
        dot = _graph_of_node(options.node)
    else:
        rospy.init_node("view_frames", anonymous=True)
        buffer = Buffer()
        TransformListener(buffer)
        print(f"Listening to /tf for {_SECONDS} seconds", flush=True)
        _listen()
        print("Done Listening", flush=True)
        dot = buffer._allFramesAsDot(rospy.Time.now())
    _write(dot)

    program = shutil.which("dot")
    if program is None:
        print("Warning: Could not execute `dot -V`.  Is graphviz installed?")
        _draw_svg(dot)
        return
    version = subprocess.run([program, "-V"], capture_output=True, text=True, check=False).stderr.strip()
    print(version)
    if found := _VERSION.search(version):
        print(f"Detected dot version {found[1]}", flush=True)
    if _draw_pdf(program):
        print("frames.pdf generated")
    else:
        print("failed to generate frames.pdf", file=sys.stderr)


def _run_tf2(words: Sequence[str]) -> None:
    rospy.init_node("view_frames")
    rospy.loginfo("Listening to tf data during 5 seconds...")
    buffer = Buffer()
    TransformListener(buffer)
    _listen()
    rospy.loginfo("Generating graph in frames.pdf file...")
    dot = tf2_graph(read_records(buffer.all_frames_as_yaml()), rospy.Time.now().to_sec())
    _write(dot)
    program = shutil.which("dot")
    if program is None:
        rospy.logwarn("graphviz, which makes frames.pdf, is not installed: frames.svg is drawn instead")
        _draw_svg(dot)
    elif not _draw_pdf(program):
        raise ToolError("failed to generate frames.pdf", status=1)


def _listen() -> None:
    """Wait for transforms to arrive.

    Wait in real time, because a bag may be paused. Raise ROSInterruptException at a shutdown.
    """
    end = time.monotonic() + _SECONDS
    while time.monotonic() < end:
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException("rospy shutdown")
        time.sleep(0.1)


def _graph_of_node(name: str) -> str:
    """Wait for the frame service of a tf or tf2 node; return the graph that it provides.

    Raise ToolError if the call fails.
    """
    from tf.srv import FrameGraph

    rospy.init_node("view_frames", anonymous=True)
    print(f"Waiting for service {name}/tf_frames", flush=True)
    services = {f"{name}/tf_frames": FrameGraph, f"{name}/tf2_frames": Tf2FrameGraph}
    while True:
        for service, kind in services.items():
            try:
                rospy.wait_for_service(service, timeout=0.5)
            except rospy.ROSException:
                if rospy.is_shutdown():
                    raise
                continue
            print("Polling service", flush=True)
            try:
                answer = rospy.ServiceProxy(service, kind).call()
            except rospy.ServiceException as error:
                raise ToolError(f"Service call failed: {error}", status=1) from error
            if kind is FrameGraph:
                return str(answer.dot_graph)
            return tf2_graph(read_records(answer.frame_yaml), rospy.Time.now().to_sec())


def read_records(listing: str) -> list[FrameRecord]:
    """Parse a buffer's YAML listing into frames. Frame names may contain any characters."""
    pattern = re.compile(
        r"^(.*): \n  parent: '(.*)'\n  broadcaster: '(.*)'\n  rate: (.*)\n  most_recent_transform: (.*)\n"
        r"  oldest_transform: (.*)\n  buffer_length: (.*)\n",
        re.MULTILINE,
    )
    return [FrameRecord(*found.groups()) for found in pattern.finditer(listing)]


def tf2_graph(records: Sequence[FrameRecord], now: float) -> str:
    """Format the frames as a graphviz graph, like tf2_tools' view_frames.py."""
    if not records:
        return 'digraph G { "No tf data received" }'

    names = {record.name for record in records}
    # The legend is attached to the last root.
    root = next(
        (record.parent for record in reversed(records) if record.parent not in names), records[0].name
    )
    lines = ["digraph G {"]
    for record in records:
        label = (
            f" Broadcaster: {escaped_name(record.broadcaster)}\\nAverage rate: {float(record.rate)}\\n"
            f"Buffer length: {float(record.length)}\\nMost recent transform: {float(record.most_recent)}\\n"
            f"Oldest transform: {float(record.oldest)}\\n"
        )
        lines.append(f'"{escaped_name(record.parent)}" -> "{escaped_name(record.name)}"[label="{label}"];')
    lines += [
        "edge [style=invis];",
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";',
        f'"Recorded at time: {now}"[ shape=plaintext ] ;',
        f'}}->"{escaped_name(root)}";',
        "}",
    ]
    return "\n".join(lines)


def read_edges(dot: str) -> Iterator[Edge]:
    """Yield the edges of a graph written by tf's or tf2's view_frames."""
    for parent, child, label in _EDGE.findall(dot):
        lines = [line.strip() for line in label.split("\\n") if line.strip()]
        yield Edge(_unquoted(parent), _unquoted(child), tuple(lines))


def _unquoted(name: str) -> str:
    return re.sub(r"\\(.)", r"\1", name)


def _write(dot: str) -> None:
    _save("frames.gv", dot)


def _draw_pdf(program: str) -> bool:
    return subprocess.run([program, "-Tpdf", "frames.gv", "-o", "frames.pdf"], check=False).returncode == 0


def _draw_svg(dot: str) -> None:
    edges = [*read_edges(dot)]
    _save("frames.svg", tree_svg(edges, "view_frames Result" if edges else "no tf data received"))
    print("frames.svg generated")


def _save(name: str, text: str) -> None:
    """Write a file in the current folder. Raise ToolError if it cannot be written."""
    try:
        Path(name).write_text(text, encoding="utf-8")
    except OSError as error:
        why = f"{name} cannot be written in {Path.cwd()}: {error.strerror}"
        raise ToolError(why, status=1) from error
