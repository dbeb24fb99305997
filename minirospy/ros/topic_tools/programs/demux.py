"""demux: forward a topic to one of several output topics, selected through services.

Topic demux/selected (latched); services demux/select, demux/add, demux/list, demux/delete; ``__none`` selects no output.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from std_msgs.msg import String
from topic_tools.srv import (
    DemuxAdd,
    DemuxAddRequest,
    DemuxAddResponse,
    DemuxDelete,
    DemuxDeleteRequest,
    DemuxDeleteResponse,
    DemuxList,
    DemuxListRequest,
    DemuxListResponse,
    DemuxSelect,
    DemuxSelectRequest,
    DemuxSelectResponse,
)

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.client.topics import AnyMsg
from minirospy.ros.topic_tools.programs.passing import NONE, Input, Output, base_name, checked_topic, run_node

__all__ = ["Demux", "main"]

_USAGE = "\nusage: demux IN_TOPIC OUT_TOPIC1 [OUT_TOPIC2 [...]]\n"
_FIRST_SUBSCRIBER = 0.5
"""Maximum time in seconds that an output's first message waits for a subscriber after its topic is advertised."""


def main() -> int:
    """Run demux; return its exit status."""
    return run_node(
        _USAGE,
        lambda words: f"{base_name(words[0])}_demux",
        _prepare,
        range(2, 10_000),
    )


def _prepare(words: Sequence[str]) -> Callable[[], Demux]:
    source, *targets = map(checked_topic, words)
    return lambda: Demux(source, targets)


class Demux:
    """Forwards the messages on a topic, unchanged, to the selected output."""

    def __init__(self, source: str, targets: Sequence[str]) -> None:
        self._lock = threading.RLock()
        self._outputs: dict[str, Output] = {}
        self._selected_topic = rospy.Publisher("demux/selected", String, queue_size=1, latch=True)
        for target in targets:
            self._output(rospy.resolve_name(target))
        self._selected = next(iter(self._outputs))
        self._selected_topic.publish(String(self._selected))
        self._input = Input(source, self._received)
        self._input.open()

        self._services = [
            rospy.Service("demux/select", DemuxSelect, self._select),
            rospy.Service("demux/add", DemuxAdd, self._add),
            rospy.Service("demux/list", DemuxList, self._list),
            rospy.Service("demux/delete", DemuxDelete, self._delete),
        ]

    def _output(self, topic: str) -> None:
        connected = SignalSafeEvent()
        self._outputs[topic] = Output(
            topic,
            latch=False,
            on_subscriber=connected.set,
            on_advertised=lambda: connected.wait(_FIRST_SUBSCRIBER),
        )

    def _received(self, message: AnyMsg) -> None:
        with self._lock:
            output = self._outputs.get(self._selected)
        if output is not None:
            output.advertise(message)
            output.publish(message)

    def _select(self, request: DemuxSelectRequest) -> DemuxSelectResponse | None:
        with self._lock:
            before = self._selected
            if request.topic == NONE:
                rospy.loginfo("demux selected to no output.")
                self._selected = ""
            else:
                rospy.loginfo("trying to switch demux to %s", request.topic)
                topic = rospy.resolve_name(request.topic)
                if topic not in self._outputs:
                    rospy.logwarn("Failed to switch to non-existing topic %s in demux.", request.topic)
                    return None
                rospy.loginfo("demux selected output: [%s]", topic)
                self._selected = topic
        self._selected_topic.publish(String(request.topic))
        return DemuxSelectResponse(before)

    def _add(self, request: DemuxAddRequest) -> DemuxAddResponse | None:
        rospy.loginfo("trying to add %s to demux", request.topic)
        if request.topic == NONE:
            rospy.logwarn(
                "failed to add topic %s to demux, because it's reserved for special use", request.topic
            )
            return None
        with self._lock:
            topic = rospy.resolve_name(request.topic)
            if topic in self._outputs:
                rospy.logwarn("tried to add a topic that demux was already publishing: [%s]", topic)
                return None
            self._output(topic)
        rospy.loginfo("added %s to demux", request.topic)
        return DemuxAddResponse()

    def _list(self, request: DemuxListRequest) -> DemuxListResponse:
        with self._lock:
            return DemuxListResponse(list(self._outputs))

    def _delete(self, request: DemuxDeleteRequest) -> DemuxDeleteResponse | None:
        rospy.loginfo("trying to delete %s from demux", request.topic)
        with self._lock:
            topic = rospy.resolve_name(request.topic)
            if topic not in self._outputs:
                rospy.logwarn("tried to delete non-published topic %s from demux", request.topic)
                return None
            if topic == self._selected:
                rospy.logwarn("tried to delete currently selected topic %s from demux", request.topic)
                return None
            deleted = self._outputs.pop(topic)
        deleted.close()
        rospy.loginfo("deleted topic %s from demux", request.topic)
        return DemuxDeleteResponse()
