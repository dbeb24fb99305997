"""Conversations with a transform buffer, the real tf2_py's or minirospy's: queries as JSON in, responses as JSON out.

Run as a program by the interpreter that has the real tf2_py, it reads queries from stdin and writes responses to stdout. It
imports nothing else from this folder, so that it runs there.
"""

from __future__ import annotations

import hashlib
import json
import math
import random
import subprocess
import sys
from typing import Any

Question = list[Any]
Answer = list[Any]


def questions(seed: int, count: int) -> list[Question]:
    """Return a random tree, filled over some seconds, and ``count`` valid and invalid lookups in it."""
    rng = random.Random(seed)
    names = [f"frame{n}" for n in range(rng.randrange(4, 14))]
    queries: list[Question] = []
    statics = {child for child in names if rng.random() < 0.25}
    trees = rng.choice([1, 1, 1, 2])
    start = rng.choice([0, 5, 1000])

    for step in range(rng.randrange(2, 25)):
        for index, child in enumerate(names):
            if index < trees or (child in statics and step) or rng.random() < 0.2:
                continue
            above = names[(index * 7 + trees) % index] if rng.random() < 0.97 else rng.choice(names)
            stamp = start + step * 0.5 + rng.choice([0, 0, 0.25, -3])
            queries.append(
                ["set", above, child, nanoseconds(stamp), pose(rng), f"/node{index % 3}", child in statics]
            )

    for _ in range(count):
        target, source, fixed = (rng.choice([*names, *names, "nowhere"]) for _ in range(3))
        times = [rng.choice([0, nanoseconds(start + rng.uniform(-1, 14)), nanoseconds(start + rng.randrange(28) * 0.25)])
                 for _ in range(2)]  # fmt: skip
        queries.append(
            rng.choice(
                [
                    ["lookup", target, source, times[0]],
                    ["lookup", target, source, times[0]],
                    ["lookup_full", target, times[0], source, times[1], fixed],
                    ["can", target, source, times[0]],
                    ["can_full", target, times[0], source, times[1], fixed],
                    ["common", target, source],
                ]
            )
        )

    return [*queries, ["yaml"], ["string"], ["dot", 0], ["dot", nanoseconds(99.5)], ["frames"]]


def edge_cases() -> list[list[Question]]:
    """Return conversations about cases that are rare in random trees: loops, deep trees, odd names, cleared and static frames."""
    unit = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]
    second = 1_000_000_000

    def given(
        parent: str, child: str, stamp: int, numbers: list[float] = unit, is_static: bool = False
    ) -> Question:
        return ["set", parent, child, stamp, numbers, "/me", is_static]

    loop = [
        given("a", "b", second),
        given("l1", "l2", second),
        given("l2", "l1", second),
        given("l2", "l3", second),
    ]
    pairs = [("a", "l1"), ("l1", "a"), ("l2", "l1"), ("l1", "l2"), ("l3", "l1"), ("l1", "l3"), ("l3", "b")]
    for target, source in pairs:
        loop += [[verb, target, source, time] for verb in ("lookup", "can") for time in (0, second)]
        loop += [["common", target, source], ["chain", target, second, source, second, "l1"]]

    deep = [given(f"f{n}", f"f{n + 1}", second, [0.001, 0, 0, 0, 0, 0, 1.0]) for n in range(1003)]
    for depth in (999, 1000, 1001, 1002):
        ends = [("f0", f"f{depth}"), (f"f{depth}", "f0")]
        deep += [["common", *each] for each in ends] + [
            ["can", *each, time] for each in ends for time in (0, second)
        ]

    names = [given("/map", "/odom", second), given("odom", "//base", second), given("odom", "Gerät", second)]
    names += [
        given("", "x", second),
        given("x", "", second),
        given("x", "x", second),
        given("/y", "y", second),
    ]
    names += [
        given("x", "y", second, [math.inf, 0, 0, 0, 0, 0, 1.0]),
        given("x", "z", second, [0, 0, 0, 0, 0, 0, 1.1]),
    ]
    names += [
        given("x", "z", second, [0, 0, 0, 0, 0, 0, 1.0049]),
        given("x", "w", second, [0, 0, 0, 0, 0, 0, 0.9949]),
    ]
    for name in ("map", "/map", "base", "/base", "Gerät", "", "x", "y", "z", "nowhere"):
        names += [["lookup", "map", name, 0], ["lookup", name, name, 5 * second], ["can", name, "map", 0]]
        names += [["common", name, "map"], ["exists", name], ["can_full", name, 0, "map", 0, "odom"]]
        names += [["lookup_full", "map", 0, "odom", 0, name], ["can_full", "odom", 0, "map", 0, name]]
    names += [["frames"], ["yaml"], ["string"], ["dot", 0]]

    static: list[Question] = [["yaml"], ["string"], ["dot", 0], ["dot", second]]
    static += [given("a", "b", 7 * second, is_static=True), given("b", "c", 7 * second, is_static=True)]
    static += [
        ["lookup", "a", "c", 0],
        ["common", "a", "c"],
        ["lookup", "a", "c", 99 * second],
        ["lookup", "c", "c", 0],
    ]
    static += [given("b", "c", 8 * second, [9.0, 0, 0, 0, 0, 0, 1.0]), ["lookup", "a", "c", 0]]
    static += [given("c", "d", stamp * second) for stamp in (30, 31, 15, 30, 20, 42)]
    static += [given("c", "d", 50 * second, is_static=True), given("a", "e", 0), given("a", "e", 3 * second)]
    static += [["lookup", "a", "d", stamp * second] for stamp in (0, 30, 31, 32, 41, 42, 43, 50, 51)]
    static += [["lookup", "e", "d", stamp * second] for stamp in (0, 1, 3, 40, 50)]
    static += [["yaml"], ["clear"], ["yaml"], ["string"], ["dot", 0], ["dot", 50 * second], ["frames"]]
    static += [[verb, *pair, time] for verb in ("lookup", "can") for pair in (("a", "c"), ("c", "d"), ("d", "a"), ("d", "d"))
               for time in (0, 5 * second)]  # fmt: skip
    static += [
        ["common", "a", "d"],
        ["common", "a", "c"],
        given("c", "d", second),
        ["lookup", "a", "d", second],
    ]

    chain: list[Question] = [given(above, below, n * second) for n in (1, 2, 3)
             for above, below in (("a", "b"), ("b", "c"), ("c", "d"), ("b", "e"), ("e", "f"), ("x", "y"))]  # fmt: skip
    for target, source, fixed in [
        *_triples("abdf"),
        ("y", "a", "b"),
        ("a", "y", "a"),
        ("x", "y", "x"),
        ("y", "y", "y"),
    ]:
        chain += [
            ["chain", target, second, source, time, fixed] for time in (0, second, 2 * second, 9 * second)
        ]
    return [loop, deep, names, static, chain]


def _triples(letters: str) -> list[tuple[str, str, str]]:
    return [(a, b, c) for a in letters for b in letters for c in letters]


def pose(rng: random.Random) -> list[float]:
    """Return a translation and a rotation."""
    translation = [rng.uniform(-5, 5) for _ in range(3)]
    rotation = [rng.gauss(0, 1) for _ in range(4)]
    if rng.random() < 0.2:
        rotation = [0.0, 0.0, 0.0, 1.0]
    length = math.sqrt(sum(each * each for each in rotation))
    if rng.random() < 0.1:
        length *= rng.choice([1.003, 0.998, 1.2])
    return [*translation, *(each / length for each in rotation)]


def nanoseconds(seconds: float) -> int:
    """Return a time that a float of seconds represents exactly, as tf2_py needs it."""
    return max(0, int(round(seconds * 1024) * 9765625 // 10))


def real_answers(queries: list[Question]) -> list[Answer]:
    """Return the responses of the tf2_py that this interpreter imports."""
    import rospy
    import tf2_py
    from geometry_msgs.msg import TransformStamped

    core = tf2_py.BufferCore(rospy.Duration(10))

    def time(stamp: int) -> Any:
        return rospy.Time(*divmod(stamp, 1_000_000_000))

    def insert(
        parent: str, child: str, stamp: int, numbers: list[float], authority: str, is_static: bool
    ) -> None:
        message = TransformStamped()
        message.header.frame_id, message.child_frame_id, message.header.stamp = parent, child, time(stamp)
        where, turn = message.transform.translation, message.transform.rotation
        where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w = numbers
        (core.set_transform_static if is_static else core.set_transform)(message, authority)

    def described(found: Any) -> list[Any]:
        where, turn = found.transform.translation, found.transform.rotation
        return [found.header.stamp.to_nsec(), [where.x, where.y, where.z], [turn.x, turn.y, turn.z, turn.w]]

    verbs: dict[str, Any] = {
        "set": insert,
        "clear": core.clear,
        "lookup": lambda a, b, t: described(core.lookup_transform_core(a, b, time(t))),
        "lookup_full": lambda a, t, b, u, f: described(
            core.lookup_transform_full_core(a, time(t), b, time(u), f)
        ),
        "can": lambda a, b, t: list(core.can_transform_core(a, b, time(t))),
        "can_full": lambda a, t, b, u, f: list(core.can_transform_full_core(a, time(t), b, time(u), f)),
        "common": lambda a, b: core.get_latest_common_time(a, b).to_nsec(),
        "chain": lambda a, t, b, u, f: core._chain(a, time(t), b, time(u), f),
        "yaml": core.all_frames_as_yaml,
        "string": core.all_frames_as_string,
        "dot": lambda t: core._allFramesAsDot(time(t)),
        "frames": core._getFrameStrings,
        "exists": lambda name: bool(core._frameExists(name)),
    }
    answers: list[Answer] = []
    for verb, *arguments in queries:
        try:
            answers.append(["ok", verbs[verb](*arguments)])
        except tf2_py.TransformException as error:
            answers.append([type(error).__name__, str(error)])
    return answers


def query_real(conversations: list[list[Question]]) -> list[list[Answer]]:
    """Return the responses of the system's tf2_py, which /usr/bin/python3 imports."""
    done = subprocess.run(
        ["/usr/bin/python3", __file__],
        input=json.dumps(conversations),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    answers: list[list[Answer]] = json.loads(done.stdout)
    return answers


def shortened(answer: Answer) -> Answer:
    """Return the response, with a digest in place of a string that would bloat the recording."""
    verb, value = answer
    is_long = isinstance(value, (str, list)) and len(json.dumps(value)) > 1000
    return [verb, hashlib.sha256(json.dumps(value).encode()).hexdigest()] if is_long else answer


def difference(real: Answer, ours: Answer, tolerance: float = 1e-12) -> str:
    """Return the difference between two responses, or "" if there is none; numbers may differ by a relative tolerance."""
    if real[0] != ours[0]:
        return f"{real} but ours {ours}"
    if isinstance(real[1], list) and len(real[1]) == 3 and isinstance(real[1][1], list):
        stamp, *parts = real[1]
        pairs = [pair for a, b in zip(parts, ours[1][1:], strict=True) for pair in zip(a, b, strict=True)]
        is_near = all(abs(a - b) <= tolerance * max(1.0, abs(a)) for a, b in pairs)
        return "" if is_near and stamp == ours[1][0] else f"{real} but ours {ours}"
    return "" if list(real) == list(ours) else f"{real!r} but ours {ours!r}"


if __name__ == "__main__":
    json.dump([real_answers(queries) for queries in json.load(sys.stdin)], sys.stdout)
