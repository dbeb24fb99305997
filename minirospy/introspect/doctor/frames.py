"""Check tf frames for duplicate publishers, loops, several trees, and invalid, old or future transforms.

Source: http://wiki.ros.org/roswtf ("tf"), http://wiki.ros.org/tf/Errors%20explained.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from minirospy.base.environment import Environment
from minirospy.base.errors import DeserializationError
from minirospy.core.tf2.insertion import faults_of
from minirospy.core.tf2.pending import read_transforms
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.introspect.doctor.findings import Finding, ok, problem, warning
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.rpc.master_proxy import SystemState

__all__ = ["Observation", "check_frames", "frame_findings"]

_TOPICS = {"/tf": False, "/tf_static": True}
_SECONDS = 1.5  # seconds to listen: long enough to receive transforms published at 1 Hz
_OLD_SECONDS = 1.0
_AHEAD_SECONDS = 1.1
"""Seconds that a stamp may be in the future.

static_transform_publisher stamps each transform one period ahead, in practice at most a second.
"""
_SIMILAR = 0.8
_SHOWN = 5


@dataclass
class Observation:
    """The stamps received for a child frame; ``offset`` is the newest stamp minus its arrival time, in nanoseconds."""

    child: str
    senders: set[str] = field(default_factory=set)
    parents: set[str] = field(default_factory=set)
    offset: int | None = None
    faults: set[str] = field(default_factory=set)


def check_frames(environment: Environment, state: SystemState) -> Iterator[Finding]:
    """If /tf or /tf_static is published, listen for _SECONDS; yield the findings about the frames.

    Raise MasterUnreachableError if no master responds.
    """
    published = [topic for topic in _TOPICS if state.publishers.get(topic)]
    if not published:
        return
    seen: dict[str, Observation] = {}
    unreadable: set[str] = set()
    with ToolNode(environment, "minirospy_doctor") as node:

        def listen(topic: str) -> None:
            def take(body: Frame, header: Header) -> None:
                sender = header.get("callerid", "?")
                try:
                    _add(seen, bytes(body), sender, node.clock.now(), is_static=_TOPICS[topic])
                except DeserializationError:
                    unreadable.add(f"{sender} on {topic}")

            node.listen(topic, take)

        for topic in published:
            listen(topic)
        node.wait(_SECONDS)
    if unreadable:
        names = ", ".join(sorted(unreadable))
        yield problem(
            "frames", f"no transforms, but other bytes: {names}", "publish tf2_msgs/TFMessage there"
        )
    # The node's workers have stopped, so ``seen`` is final. In simulated time, stamps and arrival times cannot be compared.
    yield from frame_findings([*seen.values()], is_simulated=bool(state.publishers.get("/clock")))


def _add(seen: dict[str, Observation], body: bytes, sender: str, now: int, *, is_static: bool) -> None:
    for each in read_transforms(body):
        observation = seen.setdefault(each.child, Observation(each.child))
        observation.senders.add(sender)
        observation.parents.add(each.parent)
        if not is_static:
            observation.offset = each.stamp - now
        faults = faults_of(each.parent, each.child, each.translation, each.rotation, sender)
        observation.faults.update(fault.text for fault in faults)


def frame_findings(seen: Sequence[Observation], *, is_simulated: bool = False) -> Iterator[Finding]:
    """Yield the problems found in the frames, one ok finding if there are none, or a warning if there are no frames."""
    if not seen:
        yield warning(
            "frames",
            "nothing came on /tf while listening",
            "`rosrun tf tf_monitor` shows when something does",
        )
        return
    findings = [*_faults(seen), *_owners(seen), *_loops(seen), *_trees(seen)]
    if not is_simulated:
        findings += _times(seen)
    yield from findings
    if not findings:
        names = {each.child for each in seen} | {parent for each in seen for parent in each.parents}
        yield ok("frames", f"{len(names)} in one tree")


def _faults(seen: Sequence[Observation]) -> Iterator[Finding]:
    for text in sorted({fault for each in seen for fault in each.faults})[:_SHOWN]:
        yield problem("frames", text, "listeners ignore it: correct what that node publishes")


def _owners(seen: Sequence[Observation]) -> Iterator[Finding]:
    for each in sorted(seen, key=_child):
        if len(each.parents) > 1:
            yield problem(
                "frames",
                f"[{each.child}] has {len(each.parents)} parents ({_listed(each.parents)}), "
                f"published by {_listed(each.senders)}: lookups jump from one to the other",
                "let one node publish it, with one parent",
            )
        elif len(each.senders) > 1:
            yield problem(
                "frames",
                f"[{each.child}] is published by {len(each.senders)} nodes ({_listed(each.senders)}): it may jump",
                "stop all but one of them (two drivers, two robot_state_publishers, a bag that is played besides?)",
            )


def _loops(seen: Sequence[Observation]) -> Iterator[Finding]:
    parent = {each.child: sorted(each.parents)[0] for each in seen if each.parents}
    walked: set[str] = set()
    for child in sorted(parent):
        # Visit each frame only once, so that the run time is linear in the number of frames.
        way: dict[str, None] = {}
        at = child
        while at in parent and at not in walked:
            walked.add(at)
            way[at] = None
            at = parent[at]
        if at in way and parent[at] != at:
            names = [*way]
            loop = names[names.index(at) :]
            shown = " -> ".join([*loop[:_SHOWN], *(["..."] if len(loop) > _SHOWN else []), at])
            yield problem(
                "frames", f"a loop, which makes every lookup there fail: {shown}", "take one of them out"
            )


def _trees(seen: Sequence[Observation]) -> Iterator[Finding]:
    """Yield a warning if the frames form several trees. If a root may be misspelt, suggest a similar frame name."""
    children = {each.child for each in seen}
    parent = {each.child: sorted(each.parents)[0] for each in seen if each.parents}
    roots = sorted({above for above in parent.values() if above not in children})
    if len(roots) < 2:
        return
    tree = {root: root for root in roots}
    for name in parent:
        way: dict[str, None] = {}
        at = name
        while at not in tree and at in parent and at not in way:
            way[at] = None
            at = parent[at]
        # Assign all frames of a loop to the same tree.
        tree.update(dict.fromkeys(way, tree.get(at, at)))

    hints: list[str] = []
    hinted: set[str] = set()
    for root in roots:
        others = [name for name in tree if tree[name] != root]
        near = _similar(root, others)
        if near and root not in hinted:
            hinted.add(near)
            hints.append(f"[{root}] is nearly [{near}]")
    shown = _listed(f"[{root}]" for root in roots)
    meant = f" ({'; '.join(hints)}: was one of them meant?)" if hints else ""
    yield warning(
        "frames",
        f"{len(roots)} trees that are not connected, with the roots {shown}{meant}",
        "publish a transform between them (`rosrun tf2_ros static_transform_publisher`), or correct the name",
    )


def _similar(name: str, others: Iterable[str]) -> str:
    """Return the most similar name, or "" if none is similar. Ignore names that differ only in digits."""

    def plain(text: str) -> str:
        return text.strip("/").lower().replace("-", "_")

    def letters(text: str) -> str:
        return "".join(letter for letter in plain(text) if not letter.isdecimal())

    by_plain: dict[str, str] = {}
    for other in sorted(others):
        # Robots with numbered prefixes intentionally have similar frame names.
        if letters(other) != letters(name) or plain(other) == plain(name):
            by_plain.setdefault(plain(other), other)
    found = difflib.get_close_matches(plain(name), by_plain, n=1, cutoff=_SIMILAR)
    if not found or {"/" in name, "/" in by_plain[found[0]]} == {True}:
        return ""
    return by_plain[found[0]]


def _times(seen: Sequence[Observation]) -> Iterator[Finding]:
    """For each node, yield findings if a stamp is too far ahead of or behind its arrival time."""
    worst: dict[tuple[str, bool], tuple[float, str]] = {}
    for each in sorted(seen, key=_child):
        if each.offset is None:
            continue
        seconds = each.offset / 1e9
        if -_OLD_SECONDS <= seconds <= _AHEAD_SECONDS:
            continue
        for sender in each.senders:
            key = sender, seconds < 0
            if abs(seconds) > abs(worst.get(key, (0.0, ""))[0]):
                worst[key] = (seconds, each.child)

    for (sender, _), (seconds, child) in sorted(worst.items()):
        where = f"{sender} stamps its transforms ([{child}])"
        if seconds > 0:
            yield problem(
                "frames",
                f"{where} {seconds:.1f} s ahead: lookups of now fail, or take old ones",
                "set the clocks of both machines by the same server (chrony, ntp); `minirospy doctor` says whose is off",
            )
        else:
            yield problem(
                "frames",
                f"{where} {-seconds:.1f} s behind: lookups of now fail (extrapolation into the future)",
                "if its machine's clock is right, the node is late or a bag is played without --clock and /use_sim_time",
            )


def _child(observation: Observation) -> str:
    return observation.child


def _listed(names: Iterable[str]) -> str:
    found = sorted(names)
    return ", ".join(found[:_SHOWN]) + (", ..." if len(found) > _SHOWN else "")
