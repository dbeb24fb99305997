"""The exceptions of ROS's rostopic."""

from __future__ import annotations

__all__ = ["ROSTopicException", "ROSTopicIOException"]


class ROSTopicException(Exception):
    """Raised if a request about a topic failed."""


class ROSTopicIOException(ROSTopicException):
    """Raised if the master does not respond."""
