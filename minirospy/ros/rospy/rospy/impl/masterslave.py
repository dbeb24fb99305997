"""rospy.impl.masterslave: the Slave API of this process's node, as an object with one method per call.

The server itself is ``runtime/node/slave.py``; this object is for programs that call the methods within the process.
Source: http://wiki.ros.org/ROS/Slave_API.
"""

from __future__ import annotations

from typing import Any, cast

from minirospy.client.session import current_session
from minirospy.ros.rosgraph.rosgraph.xmlrpc import XmlRpcHandler

__all__ = ["LOG_API", "MSG", "STATUS", "VAL", "ROSHandler"]

STATUS, MSG, VAL = 0, 1, 2
LOG_API = True

Answer = tuple[int, str, Any]


class ROSHandler(XmlRpcHandler):
    """Serves the Slave API of the node ``name``.

    Each method's first argument is the caller's name; it returns (code, status message, value).
    """

    _remap_table = {"requestTopic": [0]}

    def __init__(self, name: str, master_uri: str) -> None:
        self.name = name
        self.masterUri = master_uri
        self.uri: str | None = None
        self.done = False

    @classmethod
    def remappings(cls, methodName: str) -> list[int]:
        """Return the indices of a method's arguments that are names."""
        return cls._remap_table.get(methodName, [])

    def getName(self, *args: object) -> Answer:
        """Return the node's name."""
        return self._call("getName", args, value=self.name)

    def getUri(self, *args: object) -> Answer:
        """Return the URI of the server that uses this handler, or None if there is none yet."""
        return self._call("getUri", args, value=self.uri)

    def getMasterUri(self, *args: object) -> Answer:
        """Return the master's URI."""
        code, _, value = self._call("getMasterUri", args, value=self.masterUri)
        return code, str(value), value

    def getPid(self, *args: object) -> Answer:
        """Return the process id."""
        return self._call("getPid", args)

    def getBusStats(self, *args: object) -> Answer:
        """Return the number of transferred bytes and messages."""
        return self._call("getBusStats", args)

    def getBusInfo(self, *args: object) -> Answer:
        """Return a row for each connection."""
        return self._call("getBusInfo", args)

    def getPublications(self, *args: object) -> Answer:
        """Return [topic, type] for each topic that the node publishes."""
        return self._call("getPublications", args)

    def getSubscriptions(self, *args: object) -> Answer:
        """Return [topic, type] for each topic that the node subscribes to."""
        return self._call("getSubscriptions", args)

    def paramUpdate(self, *args: object) -> Answer:
        """Update a parameter in the cache."""
        return self._call("paramUpdate", args)

    def publisherUpdate(self, *args: object) -> Answer:
        """Update a topic's publishers."""
        return self._call("publisherUpdate", args)

    def requestTopic(self, *args: object) -> Answer:
        """Return the address where this node serves a topic."""
        return self._call("requestTopic", args)

    def shutdown(self, *args: object) -> Answer:
        """Shut the node down."""
        return self._call("shutdown", args)

    def _ready(self, uri: str) -> None:
        self.uri = uri

    def _is_registered(self) -> bool:
        return self.uri is not None

    def _shutdown(self, reason: str = "") -> None:
        self.done = True

    def _call(self, method: str, args: tuple[object, ...], **known: object) -> Answer:
        """Return the response of the node's own API. ``value``, if given, replaces the value in the response."""
        session = current_session()
        if session.node is None:
            return -1, "the node has not been initialized", known.get("value", 0)

        from minirospy.base.steps import Steps, finish
        from minirospy.runtime.node.slave import SlaveApi

        answer = SlaveApi(session.node).dispatch(method, args)
        code, text, value = answer if isinstance(answer, list) else finish(cast("Steps[list[Any]]", answer))
        return code, text, known.get("value", value) if code == 1 else value
