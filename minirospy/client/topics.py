"""rospy's Publisher and Subscriber, and the list of published topics.

Source: http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers.
"""

from __future__ import annotations

from minirospy.base.errors import MasterUnreachableError, ROSException, RpcError
from minirospy.client.publisher import Publisher, SubscribeListener
from minirospy.client.session import current_session
from minirospy.client.subscriber import Subscriber, wait_for_message
from minirospy.client.topic import AnyMsg, Topic

__all__ = [
    "AnyMsg",
    "Publisher",
    "SubscribeListener",
    "Subscriber",
    "Topic",
    "get_published_topics",
    "wait_for_message",
]


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """Return [topic, type] for each published topic below ``namespace``. Raise ROSException if the master fails."""
    try:
        return [list(pair) for pair in current_session().master.get_published_topics(namespace or "")]
    except (MasterUnreachableError, RpcError) as error:
        raise ROSException(f"unable to get published topics: {error}") from error
