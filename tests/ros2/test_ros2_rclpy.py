"""The ROS 2 bridge in the thread of rclpy's executor, with fake classes in place of rclpy's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import MagicMock

import pytest

from minirospy.ros2.parameter_values import Value
from minirospy.ros2.rclpy_actions import ActionClient, ActionServer
from minirospy.ros2.rclpy_calls import Calls
from minirospy.ros2.rclpy_parameters import NodeParameters, ParameterServer
from minirospy.ros2.side import TopicPublisher, TopicSubscription


def test_a_server_is_reached_by_the_parameters_of_its_own_process(monkeypatch: pytest.MonkeyPatch) -> None:
    created: list[str] = []
    known: dict[str, list[tuple[str, bytes]]] = {}

    def infos(topic: str, *, no_mangle: bool) -> list[Any]:
        assert no_mangle
        return [
            SimpleNamespace(node_namespace="/" if name == "a" else "/ns", node_name=name, endpoint_gid=gid)
            for name, gid in known.get(topic, [])
        ]

    monkeypatch.setitem(sys.modules, "rcl_interfaces", MagicMock())
    monkeypatch.setitem(sys.modules, "rcl_interfaces.srv", MagicMock())
    calls = Calls.__new__(Calls)
    calls.options = {}
    node: Any = SimpleNamespace(
        get_publishers_info_by_topic=infos, create_client=lambda _, name: created.append(name)
    )
    calls.node = node
    one, other = bytes(12), b"\1" * 12

    assert calls.parameter_probe("/s") is None
    known["rr/sReply"] = [("a", one + b"0001"), ("b", other + b"0001")]
    known["rr/a/get_parametersReply"] = [("a", one + b"0002")]
    assert calls.parameter_probe("/s") is None, "b has no parameters"
    known["rr/ns/b/get_parametersReply"] = [("b", other + b"0002"), ("b", one + b"0003")]
    assert calls.parameter_probe("/s") is None, "two processes have a node b"
    known["rr/ns/b/get_parametersReply"].pop()
    assert not created
    assert calls.parameter_probe("/s")
    assert created == ["/a/get_parameters", "/ns/b/get_parameters"]


def test_parameters_are_requested_until_the_first_response(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that has not discovered the client yet responds, but the response is lost."""
    monkeypatch.setattr("minirospy.ros2.rclpy_parameters.AGAIN_SECONDS", 0.01)
    sent: list[tuple[bytes, Future[bytes]]] = []

    class Client:
        is_ready = True

        def call(self, request: bytes) -> Future[bytes]:
            answered: Future[bytes] = Future()
            sent.append((request, answered))
            if len(sent) > 2:
                answered.set_result(b"value")
            return answered

        def close(self) -> None: ...

    class Request:
        names: object = ()

    monkeypatch.setitem(sys.modules, "rcl_interfaces", MagicMock())
    srv = SimpleNamespace(GetParameters=SimpleNamespace(Request=Request, Response=None))
    monkeypatch.setitem(sys.modules, "rcl_interfaces.srv", srv)
    calls: Any = SimpleNamespace(
        client=lambda *_: Client(),
        serialize=lambda request: ",".join(request.names).encode(),
        deserialize=lambda *_: SimpleNamespace(values=[SimpleNamespace(type=2, integer_value=7)]),
    )
    assert NodeParameters(calls).get("/n", "a") == Value(2, 7)
    assert [request for request, _ in sent] == [b"", b"", b"", b"a"]
    assert [answered.cancelled() for _, answered in sent] == [True, True, False, False]


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
        "rclpy.utilities": SimpleNamespace(get_rmw_implementation_identifier=lambda: "rmw_fastrtps_cpp"),
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
        TopicPublisher(calls, node, node.create_publisher()),
        TopicSubscription(calls, node, class_, "/t", print, cast("Any", None)),
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
