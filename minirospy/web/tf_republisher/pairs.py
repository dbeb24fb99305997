"""Pairs of frames, and when to send their transforms to a client. Pure. Source: http://wiki.ros.org/tf2_web_republisher."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError

if TYPE_CHECKING:
    from geometry_msgs.msg import Quaternion, Transform, Vector3
    from tf2_web_republisher.msg import TFSubscriptionGoal
    from tf2_web_republisher.srv import RepublishTFsRequest

__all__ = ["FramePair", "pairs_of"]

_MAX_FRAMES = 1000


class FramePair:
    """A source frame and a target frame. Their transform is sent after it has changed by more than a threshold (m, rad)."""

    def __init__(self, source: str, target: str, angle: float, distance: float) -> None:
        self.source = source
        self.target = target
        self.is_okay = True
        """False after a failed lookup, until one succeeds."""

        self._angle = angle
        self._distance = distance
        self._sent: Transform | None = None

    def is_to_be_sent(self, transform: Transform) -> bool:
        """Return whether a transform differs enough from the last one that was sent. If so, record it as sent."""
        if not (
            self._sent is None
            or not self._angle
            or not self._distance
            or _distance(self._sent.translation, transform.translation) > self._distance
            or _angle(self._sent.rotation, transform.rotation) > self._angle
        ):
            return False
        self._sent = transform
        return True


def pairs_of(request: TFSubscriptionGoal | RepublishTFsRequest) -> list[FramePair]:
    """Return the frame pairs of a request, from its source_frames, target_frame, angular_thres and trans_thres.

    Raise BridgeError if there are too many frames.
    """
    if len(request.source_frames) > _MAX_FRAMES:
        raise BridgeError(f"a request has {_MAX_FRAMES} frames at most")
    target = request.target_frame.removeprefix("/")
    return [
        FramePair(source.removeprefix("/"), target, request.angular_thres, request.trans_thres)
        for source in request.source_frames
    ]


def _distance(one: Vector3, other: Vector3) -> float:
    return math.dist((one.x, one.y, one.z), (other.x, other.y, other.z))


def _angle(one: Quaternion, other: Quaternion) -> float:
    """Return the angle between two quaternions: half the angle of the rotation between them, as in tf2_web_republisher."""
    first, second = ((each.x, each.y, each.z, each.w) for each in (one, other))
    norm = math.hypot(*first) * math.hypot(*second)
    if not norm:
        return 0.0
    return math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(first, second, strict=True)) / norm)))
