"""Poses of a model's links, joints and frames; each may be relative to another one (SDF 1.7). Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from minirospy.core.sdf.model import IDENTITY, Pose
from minirospy.core.sdf.poses import compose, relative

__all__ = ["MODEL", "Frame", "FrameError", "Frames"]

MODEL = "__model__"


class FrameError(ValueError):
    """Raised if a pose is relative to a missing frame or to itself; ``str()`` names the frame."""


@dataclass(frozen=True)
class Frame:
    """A pose, and the name of the frame to which it is relative."""

    parent: str
    pose: Pose = IDENTITY


class Frames:
    """The frames of one model, by name. Poses relative to the model are computed on demand."""

    def __init__(self, frames: Mapping[str, Frame]) -> None:
        self._frames = frames
        self._known: dict[str, Pose] = {MODEL: IDENTITY, "": IDENTITY}

    def __contains__(self, name: str) -> bool:
        return name in self._known or name in self._frames

    def in_model(self, name: str) -> Pose:
        """Return a frame's pose in the model. Raise FrameError if a frame is missing or relative to itself."""
        chain: dict[str, None] = {}
        while name not in self._known:
            if name not in self._frames:
                raise FrameError(f"the frame [{name}] does not exist")
            if name in chain:
                raise FrameError(f"the pose of [{name}] is relative to itself")
            chain[name] = None
            name = self._frames[name].parent

        pose = self._known[name]
        for link in reversed(chain):
            pose = self._known[link] = compose(pose, self._frames[link].pose)
        return pose

    def relative(self, pose: Pose, frame: str, target: str) -> Pose:
        """Return a pose given in ``frame``, converted to the frame ``target``. Raise FrameError as :meth:`in_model` does."""
        if frame == target:
            return pose
        return compose(relative(self.in_model(target), self.in_model(frame)), pose)
