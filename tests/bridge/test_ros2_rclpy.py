"""What the bridge to ROS 2 does in the thread of rclpy's executor, with classes in place of rclpy's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import MagicMock

import pytest

from minirospy.bridge.ros2.rclpy_actions import ActionClient, ActionServer
from minirospy.bridge.ros2.rclpy_calls import Calls
from minirospy.bridge.ros2.rclpy_parameters import ParameterServer
from minirospy.bridge.ros2.side import _Publisher, _Subscription


def test_ends_of_rclpy_are_destroyed_in_the_executors_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    destroyed: list[str] = []
    tasks: list[Callable[[], object]] = []

    def made(name: str) -> Callable[..., object]:
        return lambda *_, **__: SimpleNamespace(
            destroy=lambda: destroyed.append(name), get_child=lambda _: None
        )

    def destroy(name: str) -> Callable[..., object]:
        return lambda _: destroyed.append(name)

    kinds = ("publisher", "subscription", "client", "service")
    node: Any = SimpleNamespace(
        **{f"create_{kind}": made(kind) for kind in kinds},
        **{f"destroy_{kind}": destroy(kind) for kind in kinds},
        get_logger=lambda: None,
    )
    modules = {
        "rclpy.serialization": SimpleNamespace(serialize_message=None, deserialize_message=None),
        "rclpy.task": SimpleNamespace(Future=None),
        "rclpy.callback_groups": SimpleNamespace(ReentrantCallbackGroup=lambda: None),
        "rclpy.qos": SimpleNamespace(QoSProfile=lambda **_: None),
        "rclpy.impl.implementation_singleton": SimpleNamespace(
            rclpy_implementation=SimpleNamespace(InvalidHandle=Exception)
        ),
        "rclpy.action": SimpleNamespace(
            ActionClient=type(
                "", (), {"__init__": lambda *_, **__: None, "destroy": destroy("action client")}
            ),
            ActionServer=type(
                "", (), {"__init__": lambda *_, **__: None, "destroy": destroy("action server")}
            ),
        ),
        "rcl_interfaces.msg": SimpleNamespace(),
        "rcl_interfaces.srv": MagicMock(),
    }
    for name in modules:
        for part in (name.rpartition(".")[0], name):
            monkeypatch.setitem(sys.modules, part, modules.get(part, SimpleNamespace()))
    executor: Any = SimpleNamespace(create_task=tasks.append)
    calls = Calls(node, executor)
    class_: Any = SimpleNamespace(Impl=SimpleNamespace(FeedbackMessage=None))
    ends: list[Any] = [
        _Publisher(calls, node, node.create_publisher()),
        _Subscription(calls, node, class_, "/t", print, cast("Any", None)),
        calls.client("/s", class_),
        calls.server("/s", class_, cast("Any", None)),
        ActionClient(calls, "/a", class_),
        ActionServer(calls, "/a", class_, cast("Any", None)),
        ParameterServer(calls, "node", cast("Any", None), cast("Any", None)),
    ]
    for end in ends:
        end.close()
    assert not destroyed
    for task in tasks:
        task()
    assert destroyed == [
        "publisher", "subscription", "client", "service", "subscription", "action client", "action server", *["service"] * 6,
    ]  # fmt: skip
