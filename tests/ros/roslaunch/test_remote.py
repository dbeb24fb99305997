"""Nodes on other machines, as reported by their roslaunches; tests/interop/test_interop_roslaunch.py uses real ones."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from minirospy.ros.roslaunch.launcher import remote
from minirospy.ros.roslaunch.launcher.remote import RemoteMachines


@pytest.mark.parametrize("ended", [[], ["a-1"], ["a-1", "b-2"]])
def test_node_that_ends_before_the_others_have_started_does_not_run(
    ended: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its roslaunch reports the exit on a separate connection, perhaps before it reports the node's start."""
    machines = RemoteMachines(Mock(), "run", Mock(), Mock(), Mock())
    nodes: Any = [SimpleNamespace(name=name, to_xml=lambda: "<node/>") for name in ("/a", "/b")]
    ssh: Any = SimpleNamespace(is_running=True)
    child = remote._Child("m-0", Mock(timeout=60.0), nodes, ssh)
    child.has_registered.set()
    machines._children["m-0"] = child

    def call(*_: object) -> tuple[list[str], list[str]]:
        for name in ended:
            machines._process_died(name, 0)
        return ["a-1", "b-2"], []

    monkeypatch.setattr(remote, "call", call)
    machines._launch(child)
    assert child.running == {"a-1", "b-2"} - set(ended)
    assert machines.is_running is (len(ended) < 2)
