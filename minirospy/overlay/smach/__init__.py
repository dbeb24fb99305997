"""smach, provided by minirospy: hierarchical state machines. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach.concurrence import Concurrence
from minirospy.compat.smach.container import Container
from minirospy.compat.smach.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    SmachError,
)
from minirospy.compat.smach.iterator import Iterator
from minirospy.compat.smach.log import logdebug, logerr, loginfo, logwarn, set_loggers
from minirospy.compat.smach.sequence import Sequence
from minirospy.compat.smach.state import CBState, State
from minirospy.compat.smach.state_machine import StateMachine
from minirospy.compat.smach.user_data import Remapper, UserData
from minirospy.compat.smach.util import (
    CBInterface,
    cb_interface,
    has_smach_interface,
    is_shutdown,
    set_shutdown_check,
)
from smach import (
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
