"""init_node: queries before it, and calling it twice."""

import time

import rospy
from referee import outcome, show

outcome("spin before", rospy.spin)
show(rospy.is_shutdown(), rospy.core.is_initialized(), rospy.core.is_shutdown_requested())
outcome("get_rostime", rospy.get_rostime)
outcome("get_time", rospy.get_time)
outcome("Rate", lambda: rospy.Rate(10))
outcome("a hook that is none", lambda: rospy.on_shutdown(5))
outcome("Timer", lambda: type(rospy.Timer(rospy.Duration(60), print)).__name__)
outcome("get_node_uri", rospy.get_node_uri)
started = time.monotonic()
outcome("init", lambda: rospy.init_node("case", argv=["x"]))
show("at once", time.monotonic() - started < 10)
outcome("again", lambda: rospy.init_node("case", argv=["x"]))
for name, options in (
    ("other", {"argv": ["x"]}), ("case", {"argv": ["x"], "anonymous": True}), ("case", {"argv": ["y"]}), ("", {}),
    ("case", {"argv": ["x"], "log_level": rospy.DEBUG}), ("case", {"argv": ["x"], "disable_rosout": True}),
    ("case", {"argv": ["x"], "disable_signals": True}), ("case", {"argv": ["x"], "disable_rostime": True}),
    ("case", {"argv": ["x"], "xmlrpc_port": 1, "tcpros_port": 1}), ("a/b", {"argv": ["x"]}), ("x-y", {"argv": ["x"]}),
):  # fmt: skip
    outcome(f"again {name} {options}", lambda: rospy.init_node(name, **options))
show(rospy.get_name(), rospy.core.is_initialized())
