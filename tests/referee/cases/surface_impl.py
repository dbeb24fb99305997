"""rospy's internal names that programs import or use, mostly because an editor suggested them."""

import logging
import threading
from unittest import mock

import rospy
import rospy.impl.init
import rospy.impl.paramserver
import rospy.impl.rosout
import rospy.impl.simtime
import rospy.logger_level_service_caller
import rospy.rosconsole
from referee import eventually, outcome, show
from rosgraph_msgs.msg import Log
from rospy.client import _Unspecified, _unspecified
from rospy.impl.init import RosStreamHandler
from rospy.impl.registration import get_service_manager
from rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND, DeadTransport, Transport
from rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException
from rospy.service import ServiceManager, logger
from std_msgs.msg import String
from std_srvs.srv import Empty

show(INBOUND, OUTBOUND, BIDIRECTIONAL, callable(DeadTransport), callable(Transport), logger.name)
show(rospy.rosconsole.NAME, callable(rospy.rosconsole.main), rospy.impl.init.DEFAULT_NODE_PORT)
show(rospy.core._shutdown_flag, rospy.core._in_shutdown, rospy.core._client_shutdown_hooks)
show(rospy.client._init_node_args, rospy.rostime._rostime_initialized, rospy.rostime._rostime_current)
show(get_service_manager().get_services())
rospy.rostime.set_rostime_initialized(True)
show(rospy.impl.simtime.init_simtime(), rospy.rostime._rostime_initialized)
rospy.names._set_caller_id("/some/where")
show(rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("a"), rospy.resolve_name("~a"))
rospy.names._set_caller_id("/unnamed")

with mock.patch.object(rospy.rostime, "_rostime_initialized", False):
    outcome("now", lambda: rospy.Time.now())
show(rospy.rostime.is_rostime_initialized(), rospy.Time.now() > rospy.Time(0))

rospy.init_node("case", argv=[])
show(rospy.client._init_node_args, rospy.rostime._rostime_initialized, rospy.rostime._rostime_current)

# A service, as its manager reports it.
service = rospy.Service("x", Empty, lambda request: {})
manager = get_service_manager()
show(isinstance(manager, ServiceManager), sorted(name for name, _ in manager.get_services()))
show(
    dict(manager.get_services())["/x"] == service.uri,
    manager.get_service("/x") is service,
    manager.get_service("/y"),
)
service.shutdown()
show(manager.get_service("/x"))

# The connections of a publisher, by name.
publisher = rospy.Publisher("c", String, queue_size=1)
subscriber = rospy.Subscriber("c", String)
show(eventually(lambda: publisher.impl.has_connections() and subscriber.impl.has_connections()))
show(publisher.impl.has_connection("/case"), publisher.impl.has_connection("/other"))
show(subscriber.impl.has_connection("/case"), subscriber.impl.has_connection(rospy.get_node_uri()))

# The value of get_param's default that means no default.
for default in (_Unspecified, _unspecified):
    outcome("default", lambda default=default: rospy.get_param("/none", default) is default)

# Handlers for the program's own loggers.
levels = rospy.impl.rosout._rospy_to_logging_levels
show(levels, rospy.impl.rosout._logging_to_rospy_levels)
heard = threading.Event()


def on_log(message):
    if message.msg == "own words" and not heard.is_set():
        show(message.name, message.level)
        heard.set()


listener = rospy.Subscriber("/rosout", Log, on_log)
show(eventually(lambda: listener.get_num_connections() > 0))
own = logging.getLogger("mine")
own.setLevel(logging.DEBUG)
handler = rospy.impl.rosout.RosOutHandler()
show(handler.level)
own.addHandler(handler)


def say():
    own.warning("own %s", "words")
    return heard.wait(0.2)


show(eventually(say))
own.removeHandler(handler)
own.addHandler(RosStreamHandler())
logging.getLogger("rosout").setLevel(levels[rospy.ERROR])
show(logging.getLogger("rosout").level)

# The levels of a node's loggers, its own here.
caller = LoggerLevelServiceCaller()
show(caller.get_levels(), "/case" in caller.get_node_names())
show("rosout" in caller.get_loggers("/case"), caller._current_levels["rosout"])
for level in ("warn", "WARN", "ERROR"):
    show(caller.send_logger_change_message("/case", "rosout", level), caller._current_levels["rosout"])
show("mine" in caller.get_loggers("case"))
outcome("loggers", lambda: caller.get_loggers("/nobody"))
show(issubclass(ROSConsoleException, Exception))

# Parameters that the node caches, and the master's reports of them.
kept = rospy.impl.paramserver.get_param_server_cache()
show(kept is rospy.impl.paramserver.get_param_server_cache())
try:
    kept.get("/p")
except KeyError:
    show("not kept yet")
rospy.set_param("/p", 1)
show(rospy.get_param_cached("/p"), kept.get("/p"))
notified = []
kept.set_notifier(lambda key, value: notified.append((key, value)))
master = rospy.core.xmlrpcapi(__import__("os").environ["ROS_MASTER_URI"])
master.setParam("/other", "/p", 5)
show(eventually(lambda: notified), notified, kept.get("/p"))
kept.update = lambda key, value: notified.append(value)
master.setParam("/other", "/p", 6)
show(eventually(lambda: 6 in notified))

# A hook that is removed.
rospy.on_shutdown(lambda: show("hook", rospy.core._in_shutdown, rospy.core._shutdown_flag))
rospy.on_shutdown(lambda: show("never"))
del rospy.core._client_shutdown_hooks[-1]
rospy.signal_shutdown("end")
show(rospy.core._in_shutdown, rospy.core._shutdown_flag)
