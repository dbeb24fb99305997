"""The frames of a buffer: inserts transforms and TFMessages into each frame's cache.

Not thread-safe. Source: http://wiki.ros.org/tf2/Design.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable

from minirospy.core.tf2.cache import Frame, StaticCache, TimeCache
from minirospy.core.tf2.insertion import Refusal, faults_of, misfit_refusal
from minirospy.core.tf2.pending import Arrival, Layout, Layouts, read_transforms, without_slash
from minirospy.core.tf2.rotation import Quaternion, Vector

__all__ = ["DEFAULT_CACHE_TIME", "FrameTree"]

DEFAULT_CACHE_TIME = 10_000_000_000  # nanoseconds


class FrameTree:
    """The frame tree over the last ``cache_time`` nanoseconds.

    ``on_refused`` is called with each rejected transform, during the call that inserts the transform. Transforms from
    :meth:`insert_message` may be inserted only when the frame is looked up.
    """

    def __init__(
        self,
        cache_time: int = DEFAULT_CACHE_TIME,
        on_refused: Callable[[Refusal], object] = lambda _: None,
    ) -> None:
        self.cache_time = cache_time
        self._on_refused = on_refused
        self._frames: dict[str, Frame] = {}  # keyed by name, in order of first appearance
        self._layouts = Layouts()
        self._lazy: dict[str, list[Layout]] = {}  # dict from child frame to the layouts that contain it
        self._arrived = 0

    # --- adding transforms

    def insert(
        self,
        parent: str,
        child: str,
        stamp: int,
        translation: Vector,
        rotation: Quaternion,
        authority: str = "",
        *,
        is_static: bool = False,
    ) -> bool:
        """Insert the pose of ``child`` in ``parent`` at ``stamp``; return whether tf2 would accept it.

        One leading slash is removed from names. ``is_static``: the pose is valid at every time, provided that the frame's
        first pose was static too.
        """
        return self._insert(
            without_slash(parent), without_slash(child), stamp, translation, rotation, authority, is_static
        )

    def insert_message(self, data: bytes, authority: str = "", *, is_static: bool = False) -> None:
        """Insert the transforms in a serialized TFMessage. Raise DeserializationError if the bytes are not a TFMessage.

        Messages with a known layout stay bytes until one of their frames is looked up.
        """
        if not is_static:
            layout = self._layouts.find(data)
            if layout is not None:
                self._arrived += 1
                for child in layout.keep(Arrival(self._arrived, authority, data), self.cache_time):
                    self._settle(self._frames[child])
                return

        is_regular = not is_static
        for parent, child, stamp, translation, rotation in read_transforms(data):
            self._insert(parent, child, stamp, translation, rotation, authority, is_static)
            # Add a layout only if all its frames exist and have samples.
            frame = self._frames.get(child)
            is_regular = (
                is_regular and frame is not None and frame.cache is not None and parent in self._frames
            )
        if is_regular:
            self._add_layout(data)

    def clear(self) -> None:
        """Drop all transforms that are not static. The names of the frames remain."""
        for layout in self._layouts:
            layout.forget()
        for frame in self._frames.values():
            if frame.cache is not None:
                frame.cache.clear()

    # --- queries

    def frames(self) -> list[Frame]:
        """Decode all messages and return every frame in order of first appearance."""
        for layout in self._layouts:
            self._settle_all(layout)
        return list(self._frames.values())

    def frame_names(self) -> list[str]:
        """Return the names of all frames, in order of first appearance."""
        return list(self._frames)

    def frame_exists(self, name: str) -> bool:
        """Return whether any inserted transform contained the frame."""
        return name in self._frames

    def frames_as_string(self) -> str:
        """Return a line for each child frame, in order of first appearance."""
        lines = []
        for frame in self.frames():
            if frame.cache is not None:
                sample = frame.cache.at(0)
                lines.append(
                    f"Frame {frame.name} exists with parent {sample[0].name if sample else 'NO_PARENT'}.\n"
                )
        return "".join(lines)

    # --- insertion into the tables

    def _insert(
        self,
        parent: str,
        child: str,
        stamp: int,
        translation: Vector,
        rotation: Quaternion,
        authority: str,
        is_static: bool,
    ) -> bool:
        """Insert a transform. The frame's earlier transforms must already have been inserted."""
        if child in self._lazy:
            self._settle(self._frames[child])
        return self._take(parent, child, stamp, translation, rotation, authority, is_static)

    def _take(
        self,
        parent: str,
        child: str,
        stamp: int,
        translation: Vector,
        rotation: Quaternion,
        authority: str,
        is_static: bool,
    ) -> bool:
        x, y, z, w = rotation
        a, b, c = translation
        # NaN does not equal itself, so comparing a value with itself detects NaN.
        is_sound = abs(x * x + y * y + z * z + w * w - 1.0) < 0.01 and a == a and b == b and c == c  # noqa: PLR0124
        if not (is_sound and child and parent and child != parent):
            for refusal in faults_of(parent, child, translation, rotation, authority):
                self._on_refused(refusal)
            return False

        frame = self._frames.get(child) or self._add_frame(child)
        above = self._frames.get(parent) or self._add_frame(parent)
        sample = (above, a, b, c, x, y, z, w)
        cache = frame.cache
        if cache is None:
            cache = frame.cache = StaticCache(sample) if is_static else TimeCache(self.cache_time)
        misfit = cache.insert(stamp, sample)
        if misfit is not None:
            self._on_refused(misfit_refusal(misfit, parent, child, stamp, authority))
            return False
        frame.authority = authority
        return True

    def _add_frame(self, name: str) -> Frame:
        frame = self._frames[name] = Frame(name)
        return frame

    def _add_layout(self, data: bytes) -> None:
        layout = self._layouts.add(data)
        if layout is not None:
            for child in layout.children:
                self._lazy.setdefault(child, []).append(layout)

    # --- undecoded messages

    def _settle(self, frame: Frame) -> None:
        """Insert the messages for a frame that have arrived since its last lookup, in their order of arrival."""
        frame.settled = self._arrived
        layouts = self._lazy.get(frame.name)
        if layouts is None:
            return
        pieces = [layout.take(frame.name) for layout in layouts]
        arrivals = pieces[0] if len(pieces) == 1 else heapq.merge(*pieces, key=_arrival_number)
        for _, authority, sample in arrivals:
            self._take(*sample, authority, False)

    def _settle_all(self, layout: Layout) -> None:
        for child in layout.children:
            self._settle(self._frames[child])
        layout.forget()


def _arrival_number(piece: tuple[int, str, object]) -> int:
    return piece[0]
