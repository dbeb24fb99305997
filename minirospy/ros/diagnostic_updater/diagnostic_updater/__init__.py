"""diagnostic_updater: tasks that fill diagnostic statuses, and the updater that publishes them on /diagnostics.

Source: http://wiki.ros.org/diagnostic_updater.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import threading as threading

    import rospy as rospy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_status_wrapper import (
        ERROR,
        OK,
        WARN,
        DiagnosticStatusWrapper,
    )
    from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_updater import (
        CompositeDiagnosticTask,
        DiagnosticTask,
        DiagnosticTaskVector,
        FunctionDiagnosticTask,
        Updater,
    )
    from minirospy.ros.diagnostic_updater.diagnostic_updater._publisher import (
        DiagnosedPublisher,
        HeaderlessTopicDiagnostic,
        TopicDiagnostic,
    )
    from minirospy.ros.diagnostic_updater.diagnostic_updater._update_functions import (
        FrequencyStatus,
        FrequencyStatusParam,
        Heartbeat,
        TimeStampStatus,
        TimeStampStatusParam,
    )

__all__ = [
    "ERROR",
    "OK",
    "WARN",
    "CompositeDiagnosticTask",
    "DiagnosedPublisher",
    "DiagnosticArray",
    "DiagnosticStatus",
    "DiagnosticStatusWrapper",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FrequencyStatus",
    "FrequencyStatusParam",
    "FunctionDiagnosticTask",
    "HeaderlessTopicDiagnostic",
    "Heartbeat",
    "KeyValue",
    "TimeStampStatus",
    "TimeStampStatusParam",
    "TopicDiagnostic",
    "Updater",
    "rospy",
    "threading",
]
