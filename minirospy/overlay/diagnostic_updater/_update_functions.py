"""diagnostic_updater._update_functions, provided by minirospy. Source: http://wiki.ros.org/diagnostic_updater."""

from minirospy.ros.diagnostic_updater.diagnostic_updater._update_functions import (
    FrequencyStatus,
    FrequencyStatusParam,
    Heartbeat,
    TimeStampStatus,
    TimeStampStatusParam,
)

__all__ = [
    "FrequencyStatus",
    "FrequencyStatusParam",
    "Heartbeat",
    "TimeStampStatus",
    "TimeStampStatusParam",
]
