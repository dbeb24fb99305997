"""The test nodes of rostest, configured by private parameters: `<test pkg="rostest" type="hztest" ...>`.

Source: http://wiki.ros.org/rostest/Nodes.
"""

from __future__ import annotations

import itertools
import time
import unittest
from collections.abc import Callable, Container
from typing import Any, TypeAlias

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.environment import Environment
from minirospy.introspect.graph import Graph
from minirospy.introspect.services import service_type
from minirospy.ros.rostest.runner.node import rosrun
from minirospy.runtime.rpc.master_proxy import MasterProxy, SystemState

__all__ = ["AdvertiseTest", "HzTest", "ParamTest", "PublishTest", "SubscribeTest", "main"]

_WAIT_SECONDS = 20.0
_POLL_SECONDS = 0.1
_UNSET = object()

_Item: TypeAlias = dict[str, Any]  # an item of a list parameter: a name and its conditions


def main(name: str) -> None:
    """Run a test node, as its program's main function."""
    test = _TESTS[name]
    # In ROS, the program itself defines the class, so the test results name the module __main__.
    test.__module__ = "__main__"
    rosrun("rostest", name, test)


class _NodeTest(unittest.TestCase):
    """Base class of the tests: a node with private parameters."""

    node: str

    def setUp(self) -> None:
        rospy.init_node(self.node)

    def require(self, holds: bool, text: str) -> None:
        """Fail the test with the message ``text`` if ``holds`` is False."""
        if not holds:
            self.fail(text)

    def param(self, name: str, default: object = _UNSET) -> Any:
        """Return a private parameter; fail the test if it is not set and has no default."""
        value = rospy.get_param(f"~{name}", None)
        if value is None and default is _UNSET:
            self.fail(
                f"{self.node} not initialized properly. Parameter [~{name}] not set: {rospy.resolve_name(f'~{name}')}"
            )
        return default if value is None else value

    def seconds(self, name: str, default: object = _UNSET) -> float:
        """Return a private parameter in seconds."""
        value = self.param(name, default)
        if not isinstance(value, int | float) or isinstance(value, bool) or value < 0:
            self.fail(f"bad parameter ({name}): [{value}] is not a number of seconds")
        return float(value)

    def listed(self, name: str) -> list[_Item]:
        """Return a private parameter that is a list of dictionaries with names."""
        value = self.param(name, [])
        if not isinstance(value, list) or not all(
            isinstance(each, dict) and each.get("name") for each in value
        ):
            self.fail(f"bad parameter ({name}): it is a list as [{{name: /chatter, timeout: 5}}]")
        return [{**each, "name": rospy.resolve_name(str(each["name"]))} for each in value]

    def limits(self, name: str) -> list[tuple[str, float, bool, _Item]]:
        """Return (name, timeout, negative, item) for each item of a list parameter, shortest timeout first."""
        found = [
            (each["name"], float(each.get("timeout", _WAIT_SECONDS)), bool(each.get("negative")), each)
            for each in self.listed(name)
        ]
        return sorted(found, key=lambda each: each[1])


class HzTest(_NodeTest):
    """Check a topic's rate: ~topic, ~hz, ~hzerror (Hz), ~test_duration, ~wait_time (s), ~check_intervals."""

    node = "hztest"

    def test_hz(self) -> None:
        hz, error = self.seconds("hz"), self.seconds("hzerror")
        topic, duration = str(self.param("topic")), self.seconds("test_duration")
        wait = self.seconds("wait_time", _WAIT_SECONDS)
        check_intervals = bool(self.param("check_intervals", False))
        print(f"Hz: {hz}\nHz Error: {error}\nTopic: {topic}\nTest Duration: {duration}")
        times: list[float] = []
        first = SignalSafeEvent()

        def received(_: object) -> None:
            times.append(time.monotonic())
            first.set()

        rospy.Subscriber(topic, rospy.AnyMsg, received)
        print("Waiting for messages")
        has_begun = first.wait(wait if hz else wait + duration)
        if hz == 0:
            self.require(not has_begun, f"message received on [{topic}]")
            return
        self.require(has_begun, f"no messages before timeout: [{topic}], {wait:g} s")
        print("Starting rate measurement")
        del times[:]
        time.sleep(duration)
        measured = times[:]
        self._judge(measured, hz, error, check_intervals)

    def _judge(self, times: list[float], hz: float, error: float, check_intervals: bool) -> None:
        self.require(len(times) > 1, f"only {len(times)} messages received")
        rate = (len(times) - 1) / (times[-1] - times[0])
        low, high = hz - error, hz + error
        self.require(rate >= low, f"average rate ({rate:.3f}Hz) is below minimum ({low:.3f}Hz)")
        self.require(rate <= high, f"average rate ({rate:.3f}Hz) exceeded maximum ({high:.3f}Hz)")
        if check_intervals:
            shortest, longest = 1 / high, 1 / low if low > 0 else float("inf")
            wrong = [
                f"interval {after - before:.6f} s is not between {shortest:.6f} and {longest:.6f} s"
                for before, after in itertools.pairwise(times)
                if not shortest <= after - before <= longest
            ]
            self.require(not wrong, "\n".join(wrong))


class PublishTest(_NodeTest):
    """Check that topics are published: ~topics, a list of {name, timeout (s), negative}."""

    node = "publishtest"

    def test_publish(self) -> None:
        waiting = []
        for topic, timeout, negative, _ in self.limits("topics"):
            print(f"Waiting [{topic}] for [{timeout:g}] seconds with negative [{negative}]")
            event = SignalSafeEvent()
            rospy.Subscriber(topic, rospy.AnyMsg, lambda _, event=event: event.set())
            waiting.append((topic, timeout, negative, event))
        started = time.monotonic()
        for topic, timeout, negative, event in waiting:
            is_published = event.wait(max(0.0, started + timeout - time.monotonic()))
            self.require(
                is_published != negative, f"Topic [{topic}] is {'' if is_published else 'not '}published"
            )


class _GraphTest(_NodeTest):
    """Checks conditions by polling the master."""

    def setUp(self) -> None:
        super().setUp()
        self.master = MasterProxy(Environment.read().master_uri, rospy.get_name())
        self.addCleanup(self.master.close)

    def check(self, parameter: str, known: Callable[[SystemState], Container[str]], text: str) -> list[_Item]:
        """Wait for each name in a list parameter, shortest timeout first; return the items found."""
        started = time.monotonic()
        came = []
        for name, timeout, negative, each in self.limits(parameter):
            while not (is_there := name in known(self.master.get_system_state())):
                if time.monotonic() - started > timeout:
                    break
                time.sleep(_POLL_SECONDS)
            self.require(is_there != negative, text.format(name, "" if is_there else "not "))
            if is_there:
                came.append(each)
        return came


class AdvertiseTest(_GraphTest):
    """Check that topics and services are advertised: ~topics and ~services, lists of {name, type, timeout (s), negative}."""

    node = "advertisetest"

    def test_advertise_topics(self) -> None:
        for each in self.check("topics", lambda state: state.publishers, "Topic [{}] is {}advertised"):
            found = self.master.get_topic_types().get(each["name"])
            expected = each.get("type", found)
            text = f"Topic type of [{each['name']}] is [{found}] instead of [{expected}]"
            self.require(found == expected, text)

    def test_advertise_services(self) -> None:
        for each in self.check("services", lambda state: state.services, "Service [{}] is {}advertised"):
            if each.get("type"):
                found = service_type(Graph(self.master, self.node), each["name"])
                text = f"Service type of [{each['name']}] is [{found}] instead of [{each['type']}]"
                self.require(found == each["type"], text)


class SubscribeTest(_GraphTest):
    """Check that topics are subscribed to: ~topics, a list of {name, timeout (s), negative}."""

    node = "subscribetest"

    def test_subscribe(self) -> None:
        self.check("topics", lambda state: state.subscribers, "Topic [{}] is {}subscribed to")


class ParamTest(_NodeTest):
    """Check that a parameter is set: ~param_name_target, ~param_value_expected (default: any value), ~wait_time (s)."""

    node = "paramtest"

    def test_param(self) -> None:
        name, expected = str(self.param("param_name_target")), self.param("param_value_expected", None)
        duration, wait = self.seconds("test_duration", 5.0), self.seconds("wait_time", _WAIT_SECONDS)
        print(f"Parameter: {name} Test Duration: {duration}")
        end = time.monotonic() + wait
        while not rospy.has_param(name) and time.monotonic() < end:
            time.sleep(_POLL_SECONDS)
        value = rospy.get_param(name, None)
        self.require(value is not None, f"parameter [{rospy.resolve_name(name)}] is not set after {wait:g} s")
        self.require(
            expected in (None, value),
            f"parameter [{rospy.resolve_name(name)}] is [{value}] instead of [{expected}]",
        )


_TESTS: dict[str, type[_NodeTest]] = {
    test.node: test for test in (AdvertiseTest, HzTest, ParamTest, PublishTest, SubscribeTest)
}
