"""relay: forward a topic under another name.

Parameters: ~lazy (subscribe only while the output has subscribers); ~stealth with ~monitor_topic and ~monitor_rate
(subscribe only while another node subscribes to that topic; the rate is a period in seconds, as in ROS).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from minirospy import client as rospy
from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcError
from minirospy.client.topics import AnyMsg
from minirospy.ros.topic_tools.programs.passing import Input, Output, base_name, checked_topic, flag, run_node
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["Relay", "main"]

_USAGE = "\nusage: relay IN_TOPIC [OUT_TOPIC]\n"


def main() -> int:
    """Run relay; return its exit status."""
    return run_node(_USAGE, lambda words: f"{base_name(words[0])}_relay", _prepare, range(1, 3))


def _prepare(words: Sequence[str]) -> Callable[[], Relay]:
    source = checked_topic(words[0])
    target = checked_topic(words[1]) if len(words) > 1 else f"{source}_relay"
    return lambda: _start(source, target)


def _start(source: str, target: str) -> Relay:
    relay = Relay(source, target, is_lazy=flag("lazy"))
    if flag("stealth"):
        topic = str(rospy.get_param("~monitor_topic", source))
        relay.monitor(rospy.resolve_name(topic), float(rospy.get_param("~monitor_rate", 1.0)))
    return relay


class Relay:
    """Forwards messages from one topic to another, unchanged."""

    def __init__(self, source: str, target: str, *, is_lazy: bool = False) -> None:
        self._is_lazy = is_lazy
        self._is_stealthy = False
        # Guards opening and closing the input, so that it is reopened if a subscriber arrives while it is being closed.
        self._lock = threading.Lock()
        self._output = Output(target, on_subscriber=self._subscribed, on_advertised=self._advertised)
        self._input = Input(source, self._received)
        self._input.open()

    def monitor(self, topic: str, period: float) -> None:
        """Subscribe to the input only while another node subscribes to ``topic``; check this every ``period`` seconds."""
        self._is_stealthy = True
        self._master = MasterProxy(Environment.read().master_uri, rospy.get_name())
        self._timer = rospy.Timer(rospy.Duration.from_sec(period), lambda _event: self._look_for(topic))

    def _look_for(self, topic: str) -> None:
        if not self._output.is_advertised:
            return
        try:
            subscribers = self._master.get_system_state().subscribers.get(topic, [])
        except (MasterUnreachableError, RpcError):
            rospy.logerr("Failed to communicate with rosmaster")
            return
        if set(subscribers) - {rospy.get_name()}:
            self._input.open()
        else:
            self._input.close()

    def _advertised(self) -> None:
        rospy.loginfo("advertised as %s\n", self._output.topic)

    def _subscribed(self) -> None:
        with self._lock:
            if self._is_lazy and not self._is_stealthy:
                self._input.open()

    def _received(self, message: AnyMsg) -> None:
        self._output.advertise(message)
        with self._lock:
            is_wanted = not (self._is_lazy or self._is_stealthy) or self._output.has_subscribers
            if not is_wanted:
                self._input.close()
        if is_wanted:
            self._output.publish(message)
