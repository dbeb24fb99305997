"""The responses of minirospy's buffer in a conversation: transforms are inserted one by one, or as serialized TFMessages."""

from __future__ import annotations

import struct
from typing import Any

from minirospy.base.errors import InvalidArgumentException, TransformException
from minirospy.core.tf2.buffer import StampedTransform, TransformBuffer
from minirospy.core.tf2.listing import frames_as_dot, frames_as_yaml
from tests.core.tf2.conversation import Answer, Question

BILLION = 1_000_000_000


def tf_message(*transforms: tuple[str, str, int, list[float]]) -> bytes:
    """Return a serialized TFMessage of (parent, child, stamp in nanoseconds, seven numbers)."""
    pieces = [struct.pack("<I", len(transforms))]
    for parent, child, stamp, numbers in transforms:
        above, below = parent.encode(), child.encode()
        pieces += [struct.pack("<4I", 7, *divmod(stamp, BILLION), len(above)), above]
        pieces += [struct.pack("<I", len(below)), below, struct.pack("<7d", *numbers)]
    return b"".join(pieces)


def our_answers(queries: list[Question], *, lazily: bool = False) -> list[Answer]:
    """Return minirospy's responses; ``lazily``: non-static transforms arrive as serialized messages."""
    buffer = TransformBuffer()

    def insert(
        parent: str, child: str, stamp: int, numbers: list[float], authority: str, is_static: bool
    ) -> None:
        if lazily and not is_static:
            buffer.insert_message(tf_message((parent, child, stamp, numbers)), authority)
            return
        x, y, z, *rotation = numbers
        a, b, c, d = rotation
        buffer.insert(parent, child, stamp, (x, y, z), (a, b, c, d), authority, is_static=is_static)

    def described(found: StampedTransform) -> list[Any]:
        return [found.stamp, list(found.translation), list(found.rotation)]

    def possible(verb: str, *arguments: Any) -> list[Any]:
        try:
            why = (buffer.why_not if verb == "can" else buffer.why_not_full)(*arguments)
        except InvalidArgumentException:
            return [0, ""]
        return [int(why is None), why or ""]

    verbs: dict[str, Any] = {
        "set": insert,
        "clear": buffer.clear,
        "lookup": lambda *arguments: described(buffer.lookup(*arguments)),
        "lookup_full": lambda *arguments: described(buffer.lookup_full(*arguments)),
        "can": lambda *arguments: possible("can", *arguments),
        "can_full": lambda *arguments: possible("can_full", *arguments),
        "common": buffer.latest_common_time,
        "chain": buffer.chain,
        "yaml": lambda: frames_as_yaml(buffer),
        "string": buffer.frames_as_string,
        "dot": lambda now: frames_as_dot(buffer, now),
        "frames": buffer.frame_names,
        "exists": buffer.frame_exists,
    }
    answers: list[Answer] = []
    for verb, *arguments in queries:
        try:
            answers.append(["ok", verbs[verb](*arguments)])
        except TransformException as error:
            answers.append([type(error).__name__, str(error)])
    return answers
