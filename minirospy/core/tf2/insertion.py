"""A transform's faults with tf2's error messages, and a rate-limited log of them.

The messages are those of tf2 in noetic, which include the parent frame, because users search for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from minirospy.core.tf2.cache import Misfit, seconds
from minirospy.core.tf2.rotation import Quaternion, Vector

__all__ = ["Refusal", "RefusalLog", "faults_of", "misfit_refusal"]

_TOLERANCE = 0.01  # maximum deviation of a quaternion's squared length from 1
_PAUSE = 1.0
_MAX_KEYS = 1000


class Refusal(NamedTuple):
    """A rejected transform: the child frame, tf2's name for the fault, and the message."""

    frame: str
    kind: str
    text: str
    is_error: bool  # True if the transform itself is invalid; False if it is only too late, or a duplicate


def faults_of(
    parent: str, child: str, translation: Vector, rotation: Quaternion, authority: str
) -> list[Refusal]:
    """Return all reasons, in tf2's order, why tf2 would reject this transform regardless of other transforms."""
    found = []

    def add(kind: str, text: str) -> None:
        found.append(Refusal(child, kind, f"{kind}: {text}", True))

    if child == parent:
        add(
            "TF_SELF_TRANSFORM",
            f'Ignoring transform from authority "{authority}" with frame_id and child_frame_id  "{child}" '
            "because they are the same",
        )
    if not child:
        add(
            "TF_NO_CHILD_FRAME_ID",
            f'Ignoring transform from authority "{authority}" because child_frame_id not set ',
        )
    if not parent:
        add(
            "TF_NO_FRAME_ID",
            f'Ignoring transform with child_frame_id "{child}"  from authority "{authority}" because frame_id not set',
        )

    shown_rotation = " ".join(f"{each:.6f}" for each in rotation)
    if any(math.isnan(each) for each in (*translation, *rotation)):
        shown = " ".join(f"{each:.6f}" for each in translation)
        add(
            "TF_NAN_INPUT",
            f'Ignoring transform for child_frame_id "{child}" from authority "{authority}" because of a nan value in '
            f"the transform ({shown}) ({shown_rotation})",
        )
    if not abs(math.fsum(each * each for each in rotation) - 1.0) < _TOLERANCE:
        add(
            "TF_DENORMALIZED_QUATERNION",
            f'Ignoring transform for child_frame_id "{child}" from authority "{authority}" because of an invalid '
            f"quaternion in the transform ({shown_rotation})",
        )
    return found


def misfit_refusal(misfit: Misfit, parent: str, child: str, stamp: int, authority: str) -> Refusal:
    """Return the refusal for a transform that a frame's cache has rejected."""
    text = f"{misfit.value} for frame {child} (parent {parent}) at time {seconds(stamp):.6f} according to authority {authority}"
    return Refusal(child, misfit.value.partition(" ")[0], text, False)


class RefusalLog:
    """Passes a refusal to ``write`` at most once a second for each frame and fault; the next one includes the number suppressed.

    ``clock`` returns seconds. tf2 itself prints each refusal, which floods terminals if two nodes publish the same frame.
    """

    def __init__(self, write: Callable[[str, bool], object], clock: Callable[[], float]) -> None:
        self._write = write
        self._clock = clock
        self._written: dict[tuple[str, str], tuple[float, int]] = {}

    def __call__(self, refusal: Refusal) -> None:
        """Pass a refusal to ``write(text, is_error)``, or only count it if the same one was written recently."""
        key = refusal.frame, refusal.kind
        now = self._clock()
        last, held_back = self._written.get(key, (-math.inf, 0))
        if now - last < _PAUSE:
            self._written[key] = last, held_back + 1
            return

        if len(self._written) >= _MAX_KEYS:
            self._written.clear()
        self._written[key] = now, 0
        times = f" ({held_back} more like it in {now - last:.0f} s)" if held_back else ""
        self._write(refusal.text + times, refusal.is_error)
