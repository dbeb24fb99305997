"""message_filters, provided by minirospy: messages that belong together. Source: http://wiki.ros.org/message_filters."""

from minirospy.ros.message_filters.message_filters import (
    ApproximateTimeSynchronizer,
    Cache,
    SimpleFilter,
    Subscriber,
    TimeSynchronizer,
)

__all__ = ["ApproximateTimeSynchronizer", "Cache", "SimpleFilter", "Subscriber", "TimeSynchronizer"]
