"""diagnostic_updater._diagnostic_updater, provided by minirospy. Source: http://wiki.ros.org/diagnostic_updater."""

from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_updater import (
    CompositeDiagnosticTask,
    DiagnosticTask,
    DiagnosticTaskVector,
    FunctionDiagnosticTask,
    Updater,
)

__all__ = [
    "CompositeDiagnosticTask",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FunctionDiagnosticTask",
    "Updater",
]
