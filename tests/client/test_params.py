"""Improvements of minirospy's parameters over rospy's; tests/referee compares the common behaviour."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from minirospy.runtime.master.master import Master
from minirospy.runtime.transport.loop import LoopThread


@pytest.fixture
def serving(monkeypatch: pytest.MonkeyPatch) -> Iterator[Master]:
    """Return a master whose tables the test can read."""
    loop = LoopThread("test-master")

    async def start() -> Master:
        serving = Master()
        await serving.start()
        return serving

    master = loop.run(start())
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{master.port}")
    try:
        yield master
    finally:
        loop.run(master.close(), 30.0)
        loop.close()


def run(program: str) -> list[str]:
    """Return the output lines of a program that exits with 0."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        timeout=30,
        env=os.environ,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_numbers_of_numpy_and_of_a_programs_own(master: str) -> None:
    pytest.importorskip("numpy")
    assert run("""
import enum, numpy, rospy
rospy.init_node("case", disable_rosout=True)
Level = enum.IntEnum("Level", ["LOW", "HIGH"])
for value in (numpy.float64(2.5), Level.HIGH, {"gain": numpy.float64(1e-9)}, [numpy.str_("a")]):
    rospy.set_param("/p", value)
    print(rospy.get_param("/p"))
""") == ["2.5", "2", "{'gain': 1e-09}", "['a']"]


def test_numpys_numbers_and_arrays_become_numbers_and_lists(master: str) -> None:
    pytest.importorskip("numpy")
    assert run("""
import numpy as np, rosgraph, rosparam, rospy
rospy.init_node("case", disable_rosout=True)
values = [np.int8(-5), np.float32(1.5), np.bool_(True), np.array(3), np.arange(3), np.eye(2), np.array([]),
          {"gains": np.array([1, 2]), "deep": [np.float16(0.5), (np.uint8(7),)]}, np.array(["a", "bc"])]
for value in values:
    rospy.set_param("/p", value)
    print(rospy.get_param("/p"))
rosparam.upload_params("/q", {"a": np.arange(2), "b": np.int64(1)})
rosgraph.Master("/case").setParam("/q/c", np.ones(1))
print(rospy.get_param("/q"))
for value in (np.int64(2**40), np.array([2**40]), np.complex128(1j), np.array([1, None])):
    try:
        rospy.set_param("/p", value)
    except (TypeError, OverflowError) as error:
        print(type(error).__name__, error)
""") == [
        "-5", "1.5", "True", "3", "[0, 1, 2]", "[[1.0, 0.0], [0.0, 1.0]]", "[]",
        "{'gains': [1, 2], 'deep': [0.5, [7]]}", "['a', 'bc']",
        "{'a': [0, 1], 'b': 1, 'c': [1.0]}",
        "OverflowError int exceeds XML-RPC limits", "OverflowError int exceeds XML-RPC limits",
        "TypeError cannot marshal <class 'complex'> objects", "TypeError cannot marshal None unless allow_none is enabled",
    ]  # fmt: skip


CACHED = """
import os
import threading
import rospy
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.rpc.client import RpcClient
rospy.init_node("case", disable_rosout=True)
other = MasterProxy(os.environ["ROS_MASTER_URI"], "/other")
def eventually(name, value):
    for _ in range(3000):
        if rospy.get_param_cached(name, None) == value:
            return True
        threading.Event().wait(0.01)
    return rospy.get_param_cached(name, None)
"""


def test_cached_namespace_follows_changes_below_and_above_it(serving: Master) -> None:
    program = """
rospy.set_param("/g", {"a": 1, "n": {"x": 1}})
print(rospy.get_param_cached("/g"), rospy.get_param_cached("/g/n"), rospy.get_param_cached("/g/n/x"))
other.set_param("/g/n", {"x": 2, "y": 3})
print(eventually("/g", {"a": 1, "n": {"x": 2, "y": 3}}), eventually("/g/n", {"x": 2, "y": 3}), eventually("/g/n/x", 2))
other.set_param("/g", {"a": 5})
print(eventually("/g", {"a": 5}), eventually("/g/n", None), eventually("/g/n/x", None))
rospy.set_param("/g/n", {"x": 7})
print(rospy.get_param_cached("/g"), rospy.get_param_cached("/g/n"), rospy.get_param_cached("/g/n/x"))
rospy.delete_param("/g")
print(rospy.get_param_cached("/g", None), rospy.get_param_cached("/g/n/x", None))
"""
    assert run(CACHED + program) == [
        "{'a': 1, 'n': {'x': 1}} {'x': 1} 1",
        "True True True",
        "True True True",
        "{'a': 5, 'n': {'x': 7}} {'x': 7} 7",
        "None None",
    ]


def test_cached_value_needs_no_call_and_is_a_copy(serving: Master) -> None:
    program = """
rospy.set_param("/list", [1])
rospy.get_param_cached("/list").append(2)
rospy.get_param_cached("/none", None)
call, RpcClient.call = RpcClient.call, None
print(rospy.get_param_cached("/list"), rospy.get_param_cached("/none", "default"))
RpcClient.call = call
"""
    assert run(CACHED + program) == ["[1] default"]


def test_subscriptions_end_with_the_node(serving: Master) -> None:
    program = """
rospy.get_param_cached("/a", 1)
rospy.get_param_cached("~b", 1)
print(rospy.get_node_uri())
"""
    (uri,) = run(CACHED + program)
    for key in ("/a", "/case/b"):
        assert not serving.parameters.unsubscribe(key, "/case", uri)


def test_values_that_cannot_be_sent(serving: Master) -> None:
    program = r"""
for value in ("\x01", ["\x00"], {"a\x0b": 1}):
    try:
        rospy.set_param("v", value)
    except ValueError as error:
        print(error)
try:
    rospy.set_param("/", 1)
except rospy.ROSException as error:
    print(error)
"""
    lines = run(CACHED + program)
    assert lines[0] == r"'\x01' cannot be sent: XML has no character '\x01'"
    assert lines[1] == r"'\x00' cannot be sent: XML has no character '\x00'"
    assert lines[2] == r"'a\x0b' cannot be sent: XML has no character '\x0b'"
    assert "cannot set root of parameter tree to non-dictionary" in lines[3]


def test_no_master_is_rospys_exception_and_the_sockets() -> None:
    program = """
import rospy
for call in (lambda: rospy.get_param("a"), lambda: rospy.set_param("a", 1), lambda: rospy.has_param("a"),
             lambda: rospy.delete_param("a"), lambda: rospy.search_param("a"), rospy.get_param_names):
    try:
        call()
    except ConnectionRefusedError as error:
        print(isinstance(error, rospy.ROSException), "no ROS master answers at" in str(error))
"""
    assert run(program) == ["True True"] * 6
