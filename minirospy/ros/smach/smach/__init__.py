"""smach: hierarchical state machines for tasks, without ROS. Source: http://wiki.ros.org/smach.

The log and error messages are those of the real package. In two cases, the real package hangs or stays locked, but this
package raises an error: a child of a Concurrence returns nothing, or the construction of a container raises an exception.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.smach.smach import (
        concurrence,
        container,
        exceptions,
        iterator,
        log,
        sequence,
        state,
        state_machine,
        user_data,
        util,
    )
    from minirospy.ros.smach.smach.concurrence import Concurrence
    from minirospy.ros.smach.smach.container import Container
    from minirospy.ros.smach.smach.exceptions import (
        InvalidConstructionError,
        InvalidStateError,
        InvalidTransitionError,
        InvalidUserCodeError,
        SmachError,
    )
    from minirospy.ros.smach.smach.iterator import Iterator
    from minirospy.ros.smach.smach.log import logdebug, logerr, loginfo, logwarn, set_loggers
    from minirospy.ros.smach.smach.sequence import Sequence
    from minirospy.ros.smach.smach.state import CBState, State
    from minirospy.ros.smach.smach.state_machine import StateMachine
    from minirospy.ros.smach.smach.user_data import Remapper, UserData
    from minirospy.ros.smach.smach.util import (
        CBInterface,
        cb_interface,
        has_smach_interface,
        is_shutdown,
        set_shutdown_check,
    )

__all__ = [
    "CBInterface",
    "CBState",
    "Concurrence",
    "Container",
    "InvalidConstructionError",
    "InvalidStateError",
    "InvalidTransitionError",
    "InvalidUserCodeError",
    "Iterator",
    "Remapper",
    "Sequence",
    "SmachError",
    "State",
    "StateMachine",
    "UserData",
    "cb_interface",
    "concurrence",
    "container",
    "exceptions",
    "has_smach_interface",
    "is_shutdown",
    "iterator",
    "log",
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "sequence",
    "set_loggers",
    "set_shutdown_check",
    "state",
    "state_machine",
    "user_data",
    "util",
]
