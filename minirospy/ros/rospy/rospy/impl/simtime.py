"""rospy.impl.simtime: simulated time from /clock."""

from minirospy.base.errors import ROSInitException
from minirospy.client.startup import start_clock

__all__ = ["init_simtime"]


def init_simtime() -> bool:
    """Like init_node, use the time on /clock if /use_sim_time is true. Return whether the master responded."""
    try:
        start_clock()
    except ROSInitException:
        return False
    return True
