"""diagnostic_updater._diagnostic_status_wrapper, provided by minirospy. Source: http://wiki.ros.org/diagnostic_updater."""

from minirospy.ros.diagnostic_updater.diagnostic_updater._diagnostic_status_wrapper import (
    ERROR,
    OK,
    WARN,
    DiagnosticStatusWrapper,
)

__all__ = [
    "ERROR",
    "OK",
    "WARN",
    "DiagnosticStatusWrapper",
]
