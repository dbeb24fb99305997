"""The exceptions of ROS's rostopic."""

from __future__ import annotations

__all__ = ["ROSTopicException", "ROSTopicIOException"]


class ROSTopicException(Exception):
    """A request about a topic failed."""


class ROSTopicIOException(ROSTopicException):
    """The master does not respond."""
