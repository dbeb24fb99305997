"""Log publishers that cannot be reached, with advice."""

from __future__ import annotations

import asyncio
import logging

from minirospy.base.environment import split_uri
from minirospy.base.errors import SUSPENDED, RpcTimeout, RpcUnreachable
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["Unreachable", "advice"]

_log = logging.getLogger(__name__)

# maximum number of log lines about unreachable publishers; further lines are only counted
_MAX_LINES = 10

# seconds within which a publisher's unreachable topics are combined in one log line
TOGETHER_SECONDS = 0.25
MAX_TOPICS_SHOWN = 5  # maximum number of topics named in one log line about an unreachable publisher


class Unreachable:
    """Logs unreachable publishers. One line covers all topics of a node, for example of a bridge that was killed.

    Use this class on the loop only.
    """

    def __init__(self) -> None:
        # A list may contain a thousand publishers that refuse connections; logging each would block the loop for 0.2 s.
        self._limited_log = RateLimitedLogger(_log, _MAX_LINES)
        self._waiting: dict[str, tuple[list[str], Exception, str]] = {}
        """For each publisher, by URI: its topics, and the first topic's error and advice."""
        self._timer: asyncio.TimerHandle | None = None

    def add(self, uri: str, topic: str, error: Exception, advice: str) -> None:
        """Log an unreachable publisher after a short delay, in one line for all its unreachable topics."""
        self._waiting.setdefault(uri, ([], error, advice))[0].append(topic)
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(TOGETHER_SECONDS, self._report)

    def close(self) -> None:
        """Log the lines still pending and the number of omitted lines. Idempotent."""
        if self._timer:
            self._timer.cancel()
        self._report()
        self._limited_log.close()

    def _report(self) -> None:
        self._timer = None
        waiting, self._waiting = self._waiting, {}
        for uri, (topics, error, advice) in waiting.items():
            shown = ", ".join(topics[:MAX_TOPICS_SHOWN])
            rest = len(topics) - MAX_TOPICS_SHOWN
            self._limited_log.warning(
                "cannot connect to the publisher of %s at %s: %s. %s. Will keep trying.",
                f"{shown} and {rest} more topic{'s' if rest > 1 else ''}" if rest > 0 else shown,
                uri,
                error,
                advice,
            )


def advice(uri: str, error: Exception, *, nameless: bool) -> str:
    """Return advice for an unreachable publisher: the likely cause, and what to set or run on which machine."""
    if not isinstance(error, OSError | RpcUnreachable):
        return "Its address is right, since it answered"
    if isinstance(error, RpcTimeout):
        return SUSPENDED[0].upper() + SUSPENDED[1:]
    try:
        host = split_uri(uri)[0]
    except ValueError:
        return "That is not the address of a node: it must be registered as http://host:port/"

    if nameless:
        return (
            f"This machine does not know the name '{host}': on the publisher's machine set ROS_IP to its address, "
            "or add the name to the hosts file of this one"
        )
    if host == "localhost" or host.startswith("127."):
        return (
            f"'{host}' is this machine: if the publisher runs on another one, set ROS_IP to its address there; "
            "if it was killed, `rosnode cleanup` makes the master forget it"
        )
    if isinstance(error, ConnectionRefusedError) or isinstance(error.__cause__, ConnectionRefusedError):
        return (
            "Nothing listens there: if the publisher was killed, `rosnode cleanup` makes the master forget it; "
            "if it runs, set ROS_IP to its address on its machine"
        )
    return (
        f"If this machine cannot `ping {host}`, set ROS_IP on the publisher's machine to the address by which "
        "this one reaches it; if it can, a firewall is in the way"
    )
