"""mux: forward one of several input topics, selected through services.

Topic mux/selected (latched); services mux/select, mux/add, mux/list, mux/delete, OUT_select; ``__none`` selects no input.
Parameters: ~lazy (subscribe only to the selected topic, while the output has subscribers), ~latch, ~initial_topic.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Sequence

from std_msgs.msg import String
from topic_tools.srv import (
    MuxAdd,
    MuxAddRequest,
    MuxAddResponse,
    MuxDelete,
    MuxDeleteRequest,
    MuxDeleteResponse,
    MuxList,
    MuxListRequest,
    MuxListResponse,
    MuxSelect,
    MuxSelectRequest,
    MuxSelectResponse,
)

from minirospy import client as rospy
from minirospy.client.topics import AnyMsg
from minirospy.ros.topic_tools.programs.passing import (
    NONE,
    Input,
    Output,
    base_name,
    checked_topic,
    flag,
    run_node,
)

__all__ = ["Mux", "main"]

_USAGE = "\nusage: mux OUT_TOPIC IN_TOPIC1 [IN_TOPIC2 [...]]\n"


def main() -> int:
    """Run mux; return its exit status."""
    return run_node(
        _USAGE,
        lambda words: f"{base_name(words[0])}_mux",
        _prepare,
        range(2, 10_000),
    )


def _prepare(words: Sequence[str]) -> Callable[[], Mux]:
    target, *sources = map(checked_topic, words)
    return lambda: Mux(target, sources, is_lazy=flag("lazy"), latch=flag("latch"))


class Mux:
    """Forwards the messages on the selected topic, unchanged."""

    def __init__(self, target: str, sources: Sequence[str], *, is_lazy: bool, latch: bool) -> None:
        self._is_lazy = is_lazy
        self._lock = threading.RLock()
        self._inputs: dict[str, Input] = {}
        self._output = Output(
            target, latch=latch, on_subscriber=self._subscribed, on_advertised=self._advertised
        )
        self._selected_topic = rospy.Publisher("mux/selected", String, queue_size=1, latch=True)

        for source in sources:
            self._input(rospy.resolve_name(source))
        first = str(rospy.get_param("~initial_topic", "") or "") or next(iter(self._inputs))
        name = rospy.resolve_name(first) if first != NONE else ""
        self._selected = name if name in self._inputs else ""
        self._selected_topic.publish(String(first if self._selected else NONE))
        for each in self._inputs.values():
            each.open()

        self._services = [
            rospy.Service("mux/select", MuxSelect, self._select),
            rospy.Service(f"{target}_select", MuxSelect, self._select_deprecated),
            rospy.Service("mux/add", MuxAdd, self._add),
            rospy.Service("mux/list", MuxList, self._list),
            rospy.Service("mux/delete", MuxDelete, self._delete),
        ]

    def _input(self, topic: str) -> Input:
        made = self._inputs[topic] = Input(topic, functools.partial(self._received, topic))
        return made

    def _advertised(self) -> None:
        rospy.loginfo("advertising")
        if self._is_lazy:
            with self._lock:
                for topic, each in self._inputs.items():
                    if topic != self._selected:
                        each.close()

    def _subscribed(self) -> None:
        with self._lock:
            if self._is_lazy and self._selected:
                self._inputs[self._selected].open()

    def _received(self, topic: str, message: AnyMsg) -> None:
        self._output.advertise(message)
        with self._lock:
            if topic != self._selected:
                return
            if self._is_lazy and not self._output.has_subscribers:
                rospy.loginfo("lazy mode; unsubscribing")
                self._inputs[topic].close()
                return
        self._output.publish(message)

    def _select(self, request: MuxSelectRequest) -> MuxSelectResponse | None:
        with self._lock:
            before = self._selected
            if before and self._is_lazy:
                self._inputs[before].close()
            if request.topic == NONE:
                rospy.loginfo("mux selected to no input.")
                self._selected = ""
            else:
                rospy.loginfo("trying to switch mux to %s", request.topic)
                topic = rospy.resolve_name(request.topic)
                if topic not in self._inputs:
                    return None
                rospy.loginfo("mux selected input: [%s]", topic)
                self._selected = topic
                if not self._output.is_advertised or self._output.has_subscribers:
                    self._inputs[topic].open()
        self._selected_topic.publish(String(request.topic))
        return MuxSelectResponse(before)

    def _select_deprecated(self, request: MuxSelectRequest) -> MuxSelectResponse | None:
        rospy.logwarn("the <topic>_select service is deprecated; use mux/select instead")
        return self._select(request)

    def _add(self, request: MuxAddRequest) -> MuxAddResponse | None:
        rospy.loginfo("trying to add %s to mux", request.topic)
        if request.topic == NONE:
            rospy.logwarn(
                "failed to add topic %s to mux, because it's reserved for special use", request.topic
            )
            return None
        with self._lock:
            topic = rospy.resolve_name(request.topic)
            if topic in self._inputs:
                rospy.logwarn("tried to add a topic that mux was already listening to: [%s]", topic)
                return None
            added = self._input(topic)
        if not self._is_lazy:
            added.open()
        rospy.loginfo("added %s to mux", request.topic)
        return MuxAddResponse()

    def _list(self, request: MuxListRequest) -> MuxListResponse:
        with self._lock:
            return MuxListResponse(list(self._inputs))

    def _delete(self, request: MuxDeleteRequest) -> MuxDeleteResponse | None:
        rospy.loginfo("trying to delete %s from mux", request.topic)
        with self._lock:
            topic = rospy.resolve_name(request.topic)
            if topic not in self._inputs:
                rospy.logwarn("tried to delete non-subscribed topic %s from mux", request.topic)
                return None
            if topic == self._selected:
                rospy.logwarn("tried to delete currently selected topic %s from mux", request.topic)
                return None
            deleted = self._inputs.pop(topic)
        deleted.close()
        rospy.loginfo("deleted topic %s from mux", request.topic)
        return MuxDeleteResponse()
