"""rospy.impl.simtime."""

from minirospy.client.startup import start_clock
from minirospy.errors import ROSInitException

__all__ = ["init_simtime"]


def init_simtime() -> bool:
    """Follow /clock if the parameter /use_sim_time is true, as init_node does; return whether the master answers."""
    try:
        start_clock()
    except ROSInitException:
        return False
    return True
