"""Diagnostics for a topic: its publishing frequency, and the age of its time stamps.

Source: http://wiki.ros.org/diagnostic_updater.
"""

from __future__ import annotations

from typing import Any

from minirospy import client as rospy
from minirospy.base import times
from minirospy.core.idl.protocols import Stamped
from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_updater import (
    CompositeDiagnosticTask,
    DiagnosticTaskVector,
)
from minirospy.ros.diagnostic_updater.diagnostic_updater._update_functions import (
    FrequencyStatus,
    FrequencyStatusParam,
    TimeStampStatus,
    TimeStampStatusParam,
)

__all__ = ["DiagnosedPublisher", "HeaderlessTopicDiagnostic", "TopicDiagnostic"]


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """A task that reports a topic's frequency."""

    def __init__(self, name: str, diag: DiagnosticTaskVector, freq: FrequencyStatusParam) -> None:
        """Create the task and add it to the updater ``diag`` as "<name> topic status"."""
        super().__init__(f"{name} topic status")
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        self.diag.add(self)

    def tick(self, *args: Any) -> None:
        """Count a message."""
        self.freq.tick()

    def clear_window(self) -> None:
        """Reset the event counts."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """A task that reports a topic's frequency and the age of its timestamps."""

    def __init__(
        self, name: str, diag: DiagnosticTaskVector, freq: FrequencyStatusParam, stamp: TimeStampStatusParam
    ) -> None:
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp: times.Time | float) -> None:
        """Count a message with this timestamp."""
        self.stamp.tick(stamp)
        self.freq.tick()


class DiagnosedPublisher(TopicDiagnostic):
    """Wraps a publisher of messages with headers and reports its topic's diagnostics."""

    def __init__(
        self,
        pub: rospy.Publisher[Stamped],
        diag: DiagnosticTaskVector,
        freq: FrequencyStatusParam,
        stamp: TimeStampStatusParam,
    ) -> None:
        super().__init__(pub.name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message: Stamped) -> None:
        """Publish a message and count it by its header's timestamp."""
        self.tick(message.header.stamp)
        self.publisher.publish(message)
