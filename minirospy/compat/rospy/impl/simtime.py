"""rospy.impl.simtime, filled in by minirospy."""

from minirospy.client.process import process
from minirospy.errors import ROSInitException

__all__ = ["init_simtime"]


def init_simtime() -> bool:
    """Go by /clock where the parameter /use_sim_time says so, as init_node does; whether the master tells."""
    try:
        process.start_clock()
    except ROSInitException:
        return False
    return True
