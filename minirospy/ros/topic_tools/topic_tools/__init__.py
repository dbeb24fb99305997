"""topic_tools: the base class for lazy nodes, and programs that evaluate Python expressions.

The programs that forward bytes are in minirospy.ros.topic_tools.programs. Source: http://wiki.ros.org/topic_tools.
"""

from __future__ import annotations

import threading
from typing import Any

from minirospy import client as rospy
from minirospy.client.topics import Publisher, SubscribeListener
from minirospy.core.idl.protocols import Message

__all__ = ["LazyTransport", "MetaLazyTransport"]

_WARN_SECONDS = 5


class MetaLazyTransport(type):
    """A metaclass that calls ``_post_init`` on each new object after its constructors have created the publishers."""

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        made = super().__call__(*args, **kwargs)
        made._post_init()
        return made


class LazyTransport(SubscribeListener, metaclass=MetaLazyTransport):
    """A base class for nodes that subscribe to their inputs only while their own topics have subscribers.

    Subclass it, create publishers with ``advertise``, and implement ``subscribe`` and ``unsubscribe``. If the parameter
    ``~lazy`` is false, the node subscribes when the object is created, and stays subscribed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._publishers: list[Publisher[Message]] = []
        self._connection_status: bool | None = None
        """True while the node is subscribed; None before the first subscription."""
        self._changing = threading.RLock()
        rospy.Timer(rospy.Duration(_WARN_SECONDS), self._warn_never_subscribed_cb, oneshot=True)

    def _post_init(self) -> None:
        if not rospy.get_param("~lazy", True):
            self._subscribe_once()

    def _warn_never_subscribed_cb(self, timer_event: object) -> None:
        if self._connection_status is None:
            rospy.logwarn(
                f"[{rospy.get_name()}] subscribes topics only with child subscribers. Set '~lazy' as False to have it "
                "always transport message."
            )

    def subscribe(self) -> None:
        """Subscribe to the inputs; subclasses implement this method."""
        raise NotImplementedError("Please overwrite this method")

    def unsubscribe(self) -> None:
        """Unregister the input subscribers; subclasses implement this method."""
        raise NotImplementedError("Please overwrite this method")

    def peer_subscribe(self, *args: object, **kwargs: object) -> None:
        """Subscribe to the inputs when one of the node's topics gets a subscriber."""
        rospy.logdebug(f"[{args[0]}] is subscribed")
        self._subscribe_once()

    def peer_unsubscribe(self, *args: object, **kwargs: object) -> None:
        """Unsubscribe from the inputs when none of the node's topics has a subscriber any more."""
        rospy.logdebug(f"[{args[0]}] is unsubscribed")
        if not rospy.get_param("~lazy", True):
            return

        with self._changing:
            if self._connection_status and not any(pub.get_num_connections() for pub in self._publishers):
                self.unsubscribe()
                self._connection_status = False

    def advertise(self, *args: Any, **kwargs: Any) -> Publisher[Message]:
        """Return a publisher. Takes the arguments of ``rospy.Publisher`` except ``subscriber_listener``."""
        assert len(args) < 3 or args[2] is None, "subscriber_listener is this object"
        assert kwargs.get("subscriber_listener") is None, "subscriber_listener is this object"
        if len(args) < 3:
            kwargs["subscriber_listener"] = self
        else:
            args = (*args[:2], self, *args[3:])

        publisher: Publisher[Message] = Publisher(*args, **kwargs)
        self._publishers.append(publisher)
        return publisher

    def _subscribe_once(self) -> None:
        # The constructor's thread and the listener's thread may run this at the same time.
        with self._changing:
            if self._connection_status is not True:
                self.subscribe()
                self._connection_status = True
