"""diagnostic_updater._publisher, provided by minirospy. Source: http://wiki.ros.org/diagnostic_updater."""

from minirospy.ros.diagnostic_updater.diagnostic_updater._publisher import (
    DiagnosedPublisher,
    HeaderlessTopicDiagnostic,
    TopicDiagnostic,
)

__all__ = [
    "DiagnosedPublisher",
    "HeaderlessTopicDiagnostic",
    "TopicDiagnostic",
]
