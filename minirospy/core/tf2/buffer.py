"""tf2's transform buffer: stores transforms, and looks up the transform between any two frames in the tree.

Results, exceptions and their messages are the same as those of tf2's BufferCore. Stamps are exact, in nanoseconds since
the epoch; tf2_py rounds them to a float in seconds. Not thread-safe. Source: http://wiki.ros.org/tf2/Design,
http://docs.ros.org/en/noetic/api/tf2/html/classtf2_1_1BufferCore.html.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from minirospy.base.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from minirospy.core.tf2.cache import Frame, Sample
from minirospy.core.tf2.rotation import IDENTITY, Quaternion, Vector, compose, invert, multiply, rotate
from minirospy.core.tf2.tree import DEFAULT_CACHE_TIME, FrameTree

__all__ = ["DEFAULT_CACHE_TIME", "StampedTransform", "TransformBuffer"]

_MAX_HOPS = 1000
_FOREVER = 1 << 62
_ORIGIN: Vector = (0.0, 0.0, 0.0)


class StampedTransform(NamedTuple):
    """The result of a lookup: the pose of the source frame in the target frame at ``stamp``."""

    stamp: int
    translation: Vector
    rotation: Quaternion


class _Walk(NamedTuple):
    """The samples on the path between two frames, from each frame up to a common ancestor, and the time of the samples."""

    time: int
    from_source: list[Sample]
    from_target: list[Sample]


class TransformBuffer(FrameTree):
    """Looks up transforms in the frame tree of the last ``cache_time`` nanoseconds."""

    # --- lookups

    def lookup(self, target: str, source: str, time: int) -> StampedTransform:
        """Return the pose of the frame ``source`` in the frame ``target`` at ``time``; 0 means the latest common time.

        Raise LookupException if a frame does not exist, ConnectivityException if the frames are not connected,
        ExtrapolationException if there is no data for the time, InvalidArgumentException if a name is invalid.
        """
        if target == source:
            # As in tf2, a frame's pose relative to itself is the identity, even for an unknown frame.
            return StampedTransform(time or self._newest_of(target), _ORIGIN, IDENTITY)
        target_frame = self._valid(target, "lookupTransform argument target_frame")
        source_frame = self._valid(source, "lookupTransform argument source_frame")
        return _accumulated(self._walk(time, target_frame, source_frame))

    def lookup_full(
        self, target: str, target_time: int, source: str, source_time: int, fixed: str
    ) -> StampedTransform:
        """Return the pose of ``source`` at ``source_time`` in ``target`` at ``target_time``.

        Assume that the frame ``fixed`` has not moved in between. Raise the same exceptions as :meth:`lookup`.
        """
        self._valid(target, "lookupTransform argument target_frame")
        self._valid(source, "lookupTransform argument source_frame")
        self._valid(fixed, "lookupTransform argument fixed_frame")
        first = self.lookup(fixed, source, source_time)
        second = self.lookup(target, fixed, target_time)
        return StampedTransform(second.stamp, *compose(second[1:], first[1:]))

    def why_not(self, target: str, source: str, time: int) -> str | None:
        """Return None if :meth:`lookup` would succeed, else the error message that tf2's can_transform gives.

        Raise InvalidArgumentException if a frame name is invalid.
        """
        if target == source:
            return None
        self._check_name(target, "canTransform argument target_frame")
        self._check_name(source, "canTransform argument source_frame")
        target_frame, source_frame = self._frames.get(target), self._frames.get(source)
        if target_frame is None or source_frame is None:
            return self._unknown(target, source)
        return self._why_no_walk(target_frame, source_frame, time)

    def why_not_full(
        self, target: str, target_time: int, source: str, source_time: int, fixed: str
    ) -> str | None:
        """Return None if :meth:`lookup_full` would succeed, else the error message that tf2's can_transform gives.

        Raise InvalidArgumentException if a frame name is invalid.
        """
        self._check_name(target, "canTransform argument target_frame")
        self._check_name(source, "canTransform argument source_frame")
        self._check_name(fixed, "canTransform argument fixed_frame")
        target_frame, source_frame = self._frames.get(target), self._frames.get(source)
        fixed_frame = self._frames.get(fixed)
        if target_frame is None or source_frame is None:
            # If the source frame is missing, report the fixed frame as missing: tf2 does so because it tests the wrong frame.
            missing = "" if source_frame else f" fixed_frame: {fixed}does not exist."
            return self._unknown(target, source) + missing
        if fixed_frame is None:
            return ""
        why = self._why_no_walk(target_frame, fixed_frame, target_time)
        return self._why_no_walk(fixed_frame, source_frame, source_time) if why is None else why

    def latest_common_time(self, target: str, source: str) -> int:
        """Return the newest time at which :meth:`lookup` succeeds, or 0 if all transforms between the frames are static.

        Raise LookupException if a frame does not exist, InvalidArgumentException if a name is invalid, and a plain
        TransformException if the frames are not connected.
        """
        target_frame = self._valid(target, "get_latest_common_time")
        source_frame = self._valid(source, "get_latest_common_time")
        try:
            return self._common_time(target_frame, source_frame)
        except (ConnectivityException, LookupException) as error:
            raise TransformException(*error.args) from None

    def chain(self, target: str, target_time: int, source: str, source_time: int, fixed: str) -> list[str]:
        """Return the frames on the path from ``source`` to ``fixed``, and from there to ``target``.

        Raise the same exceptions as :meth:`lookup`.
        """
        first = self._path(fixed, source, source_time)
        second = self._path(target, fixed, target_time)
        return [*first, *second[1:]] if first else second

    # --- walking the tree

    def _valid(self, name: str, where: str) -> Frame:
        self._check_name(name, where)
        frame = self._frames.get(name)
        if frame is None:
            raise LookupException(f'"{name}" passed to {where} does not exist. ')
        return frame

    @staticmethod
    def _check_name(name: str, where: str) -> None:
        if not name:
            raise InvalidArgumentException(
                f"Invalid argument passed to {where} in tf2 frame_ids cannot be empty"
            )
        if name[0] == "/":
            raise InvalidArgumentException(
                f"Invalid argument \"{name}\" passed to {where} in tf2 frame_ids cannot start with a '/' like: "
            )

    def _unknown(self, target: str, source: str) -> str:
        texts = [
            f"canTransform: {role} {name} does not exist."
            for role, name in (("target_frame", target), ("source_frame", source))
            if name not in self._frames
        ]
        return " ".join(texts)

    def _newest_of(self, name: str) -> int:
        frame = self._frames.get(name)
        if frame is None or frame.cache is None:
            return 0
        if frame.settled != self._arrived:
            self._settle(frame)
        return frame.cache.newest

    def _why_no_walk(self, target: Frame, source: Frame, time: int) -> str | None:
        if target is source:
            return None
        try:
            self._walk(time, target, source)
        except TransformException as error:
            return str(error)
        return None

    def _walk(self, time: int, target: Frame, source: Frame) -> _Walk:
        """Return the samples from the source and from the target up to a common ancestor; the frames must differ.

        The common ancestor is one of the two frames, or the root, or the first frame for which the source's path has no data.
        Raise the same exceptions as :meth:`lookup`.
        """
        if time == 0:
            time = self._common_time(target, source)
        arrived = self._arrived

        missed: Frame | None = None
        from_source: list[Sample] = []
        frame = source
        while (cache := frame.cache) is not None:
            if frame.settled != arrived:
                self._settle(frame)
            sample = cache.at(time)
            if sample is None:
                # There may still be a path: this frame may be one of the target's ancestors.
                missed = frame
                break
            if frame is target:
                return _Walk(time, from_source, [])
            from_source.append(sample)
            frame = sample[0]
            if len(from_source) > _MAX_HOPS:
                raise self._loop()
        top = frame

        from_target: list[Sample] = []
        frame = target
        while frame is not top and (cache := frame.cache) is not None:
            if frame.settled != arrived:
                self._settle(frame)
            sample = cache.at(time)
            if sample is None:
                raise _extrapolation(frame, target, source, time)
            if frame is source:
                return _Walk(time, [], from_target)
            from_target.append(sample)
            frame = sample[0]
            if len(from_target) > _MAX_HOPS:
                raise self._loop()

        if frame is not top:
            raise _extrapolation(missed, target, source, time) if missed else _unconnected(target, source)
        return _Walk(time, from_source, from_target)

    def _common_time(self, target: Frame, source: Frame) -> int:
        """Return the newest time at which every frame between source and target has data; static frames have data at any time.

        Raise ConnectivityException if the frames are not connected, LookupException if the transforms form a loop.
        """
        if target is source:
            return self._newest_of(target.name)

        # This inlines :meth:`_ancestors` for speed, because most lookups need only this part.
        above_source: list[tuple[int, Frame]] = []
        common = _FOREVER
        frame, arrived = source, self._arrived
        while (cache := frame.cache) is not None:
            if frame.settled != arrived:
                self._settle(frame)
            latest = cache.latest()
            if latest is None:
                break
            stamp, frame = latest
            if 0 < stamp < common:
                common = stamp
            if frame is target:
                return common % _FOREVER
            above_source.append(latest)
            if len(above_source) > _MAX_HOPS:
                raise self._loop()

        known = {id(parent) for _, parent in above_source}
        common = _FOREVER
        for stamp, parent in self._ancestors(target):
            common = min(common, stamp or _FOREVER)
            if id(parent) in known:
                for each, above in above_source:
                    common = min(common, each or _FOREVER)
                    if above is parent:
                        return common % _FOREVER
            if parent is source:
                return common % _FOREVER
        raise _unconnected(target, source)

    def _ancestors(self, frame: Frame) -> Iterator[tuple[int, Frame]]:
        """Yield the newest stamp and the parent of a frame and of each ancestor. Raise LookupException if there is a loop."""
        depth = 0
        while (cache := frame.cache) is not None:
            if frame.settled != self._arrived:
                self._settle(frame)
            latest = cache.latest()
            if latest is None:
                return
            yield latest
            frame = latest[1]
            depth += 1
            if depth > _MAX_HOPS:
                raise self._loop()

    def _path(self, target: str, source: str, time: int) -> list[str]:
        target_frame, source_frame = self._frames.get(target), self._frames.get(source)
        if target_frame is source_frame:
            # The frames are the same, or both are unknown (None).
            return []
        if target_frame is None or source_frame is None:
            if time == 0:
                raise LookupException("")
            raise _unconnected(target_frame or Frame("NO_PARENT"), source_frame or Frame("NO_PARENT"))
        _, up, down = self._walk(time, target_frame, source_frame)
        rising = [source, *(sample[0].name for sample in up)] if up else []
        falling = [target, *(sample[0].name for sample in down)] if down else []
        if not rising or not falling:
            return rising or falling[::-1]
        while len(rising) > 1 and len(falling) > 1 and rising[-2] == falling[-2]:
            del rising[-1], falling[-1]
        return [*rising, *falling[-2::-1]]

    def _loop(self) -> LookupException:
        return LookupException(
            f"The tf tree is invalid because it contains a loop.\n{self.frames_as_string()}\n"
        )


def _accumulated(walk: _Walk) -> StampedTransform:
    """Return the source's pose in the target, by composing both paths."""
    if not walk.from_target:
        return StampedTransform(walk.time, *_composed(walk.from_source))
    back, turn_back = invert(*_composed(walk.from_target))
    if not walk.from_source:
        return StampedTransform(walk.time, back, turn_back)
    up, turn_up = _composed(walk.from_source)
    x, y, z = rotate(turn_back, up)
    return StampedTransform(walk.time, (x + back[0], y + back[1], z + back[2]), multiply(turn_back, turn_up))


def _composed(samples: list[Sample]) -> tuple[Vector, Quaternion]:
    """Return the pose of the first sample's child frame in the last sample's parent frame.

    The functions from `rotation` are inlined here, because a lookup spends most of its time in this function.
    """
    _, a, b, c, x, y, z, w = samples[0]
    for _, ta, tb, tc, qx, qy, qz, qw in samples[1:]:
        scale = qw * qw - qx * qx - qy * qy - qz * qz
        along = 2.0 * (qx * a + qy * b + qz * c)
        turn = 2.0 * qw
        a, b, c = (
            scale * a + along * qx + turn * (qy * c - qz * b) + ta,
            scale * b + along * qy + turn * (qz * a - qx * c) + tb,
            scale * c + along * qz + turn * (qx * b - qy * a) + tc,
        )
        x, y, z, w = (
            qw * x + qx * w + qy * z - qz * y,
            qw * y + qy * w + qz * x - qx * z,
            qw * z + qz * w + qx * y - qy * x,
            qw * w - qx * x - qy * y - qz * z,
        )
    return (a, b, c), (x, y, z, w)


def _extrapolation(frame: Frame, target: Frame, source: Frame, time: int) -> ExtrapolationException:
    why = "" if frame.cache is None else frame.cache.why_not(time)
    return ExtrapolationException(
        f"{why}, when looking up transform from frame [{source.name}] to frame [{target.name}]"
    )


def _unconnected(target: Frame, source: Frame) -> ConnectivityException:
    return ConnectivityException(
        f"Could not find a connection between '{target.name}' and '{source.name}' because they are not part of the "
        "same tree.Tf has two or more unconnected trees."
    )
