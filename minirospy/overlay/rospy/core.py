"""rospy.core, filled in by minirospy."""

from logging import NullHandler as NullHandler

from rosgraph_msgs.msg import Log as Log

from minirospy.client import get_node_uri as get_node_uri
from minirospy.client import is_shutdown as is_shutdown
from minirospy.client import signal_shutdown as signal_shutdown
from minirospy.client.core import add_client_shutdown_hook as add_client_shutdown_hook
from minirospy.client.core import add_preshutdown_hook as add_preshutdown_hook
from minirospy.client.core import add_shutdown_hook as add_shutdown_hook
from minirospy.client.core import get_ros_root as get_ros_root
from minirospy.client.core import is_initialized as is_initialized
from minirospy.client.core import is_shutdown_requested as is_shutdown_requested
from minirospy.client.core import is_topic as is_topic
from minirospy.client.core import parse_rosrpc_uri as parse_rosrpc_uri
from minirospy.client.core import register_signals as register_signals
from minirospy.client.core import rospydebug as rospydebug
from minirospy.client.core import rospyerr as rospyerr
from minirospy.client.core import rospyinfo as rospyinfo
from minirospy.client.core import rospywarn as rospywarn
from minirospy.client.log import logdebug as logdebug
from minirospy.client.log import logdebug_once as logdebug_once
from minirospy.client.log import logdebug_throttle as logdebug_throttle
from minirospy.client.log import logdebug_throttle_identical as logdebug_throttle_identical
from minirospy.client.log import logerr as logerr
from minirospy.client.log import logerr_once as logerr_once
from minirospy.client.log import logerr_throttle as logerr_throttle
from minirospy.client.log import logerr_throttle_identical as logerr_throttle_identical
from minirospy.client.log import logfatal as logfatal
from minirospy.client.log import logfatal_once as logfatal_once
from minirospy.client.log import logfatal_throttle as logfatal_throttle
from minirospy.client.log import logfatal_throttle_identical as logfatal_throttle_identical
from minirospy.client.log import loginfo as loginfo
from minirospy.client.log import loginfo_once as loginfo_once
from minirospy.client.log import loginfo_throttle as loginfo_throttle
from minirospy.client.log import loginfo_throttle_identical as loginfo_throttle_identical
from minirospy.client.log import logout as logout
from minirospy.client.log import logwarn as logwarn
from minirospy.client.log import logwarn_once as logwarn_once
from minirospy.client.log import logwarn_throttle as logwarn_throttle
from minirospy.client.log import logwarn_throttle_identical as logwarn_throttle_identical
from minirospy.client.msproxy import xmlrpcapi as xmlrpcapi
from minirospy.client.process import process as _process
from rospy import names as _names
from rospy.impl.live import live_names as _live_names
from rospy.impl.passing import passing_on

MASTER_NAME = "master"
ROSRPC = "rosrpc://"
logerror = logerr

# Programs that want another node after the first has shut down say so by setting the flags to False.
_live_names(
    __name__,
    _shutdown_flag=(_process.is_shutdown, lambda value: value or _process.begin_again()),
    _in_shutdown=(lambda: _process.is_shutdown_requested, lambda value: value or _process.begin_again()),
    _client_shutdown_hooks=(
        lambda: _process.hooks,
        lambda value: _process.hooks.__setitem__(slice(None), value),
    ),
)
__getattr__, __dir__ = passing_on(__name__, _names)
