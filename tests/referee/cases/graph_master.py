"""rosgraph.Master: answers, faults, and an unreachable master."""

import rosgraph
import rosgraph.masterapi
from referee import outcome, show

master = rosgraph.Master("/tester")
show(master.caller_id, type(master.getPid()).__name__, master.is_online(), rosgraph.is_master_online())
outcome("uri", master.getUri)
outcome("register", lambda: master.registerPublisher("/t", "std_msgs/Bool", "http://localhost:1"))
outcome("register", lambda: master.registerSubscriber("/t", "std_msgs/Bool", "http://localhost:1"))
outcome("register", lambda: master.registerService("/s", "rosrpc://localhost:1", "http://localhost:1"))
outcome("state", master.getSystemState)
outcome("topics", lambda: master.getPublishedTopics("/"))
outcome("types", master.getTopicTypes)
outcome("node", lambda: master.lookupNode("/tester"))
outcome("no node", lambda: master.lookupNode("/nobody"))
outcome("service", lambda: master.lookupService("/s"))
outcome("no service", lambda: master.lookupService("/none"))
outcome("bad service", lambda: master.lookupService(""))
outcome("set", lambda: master.setParam("/a/b", {"c": 1, "d": [1, "x", True, 2.5]}))
outcome("get", lambda: master.getParam("/a/b/d"))
outcome("get none", lambda: master.getParam("/none"))
outcome("get bad", lambda: master.getParam(""))
outcome("has", lambda: (master.hasParam("/a"), master.hasParam("/none")))
outcome("names", lambda: sorted(master.getParamNames()))
outcome("search", lambda: master.searchParam("a"))
outcome("search none", lambda: master.searchParam("zz"))
outcome("subscribe", lambda: master.subscribeParam("http://localhost:1", "/a/b/c"))
outcome("subscribe", lambda: master.subscribeParam("http://localhost:1", "/later"))
outcome("unsubscribe", lambda: master.unsubscribeParam("http://localhost:1", "/a/b/c"))
outcome("delete", lambda: master.deleteParam("/a/b/d"))
outcome("delete none", lambda: master.deleteParam("/none"))
outcome("unregister", lambda: master.unregisterPublisher("/t", "http://localhost:1"))
outcome("unregister", lambda: master.unregisterSubscriber("/t", "http://localhost:1"))
outcome("unregister", lambda: master.unregisterService("/s", "rosrpc://localhost:1"))
outcome("bad node", lambda: master.registerPublisher("bad name", "std_msgs/Bool", "http://localhost:1"))
outcome("bad api", lambda: master.registerPublisher("/t", "std_msgs/Bool", "nonsense"))
outcome("local name", lambda: rosgraph.Master("tester").caller_id)

show(
    [c.__name__ for c in rosgraph.MasterError.__mro__][:3],
    [c.__name__ for c in rosgraph.MasterFailure.__mro__][:3],
)
show(rosgraph.masterapi.Error is rosgraph.MasterError, rosgraph.masterapi.Failure is rosgraph.MasterFailure)
gone = rosgraph.Master("/tester", "http://localhost:1")
show(gone.is_online(), rosgraph.is_master_online("http://localhost:1"))
try:
    gone.getPid()
except OSError as error:
    show("OSError", type(error).__name__)
outcome("bad uri", lambda: rosgraph.Master("/tester", "nonsense"))
