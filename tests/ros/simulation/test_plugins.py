"""gazebo_ros/plugins: running plugins, with a simulation that only has a time."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from types import SimpleNamespace
from typing import Any, cast

import pytest

from minirospy.core.sdf.model import Plugin
from minirospy.ros.gazebo_ros.plugins import LIBRARIES, PluginHost, WorldPlugin

PERIOD_NS = 1_000_000_000


class Beacon(WorldPlugin):
    """A user's plugin, due once per second, that does not override reset()."""

    def load(self) -> None:
        self.times: list[int] = cast(Any, self.loop).times

    def update(self) -> None:
        self.times.append(self.simulation.time_ns)
        self.due_ns = self.simulation.time_ns + PERIOD_NS


def test_plugin_is_due_at_once_after_a_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LIBRARIES, "beacon", f"{__name__}:Beacon")
    loop = SimpleNamespace(simulation=SimpleNamespace(time_ns=0), times=[])
    host = PluginHost(cast(Any, loop))
    host.add_world((Plugin("beacon", "beacon", cast(Any, ET.Element("plugin"))),))
    for time_ns in (0, PERIOD_NS // 2, PERIOD_NS, 5 * PERIOD_NS):
        loop.simulation.time_ns = time_ns
        host.update()
    assert loop.times == [0, PERIOD_NS, 5 * PERIOD_NS]

    loop.simulation.time_ns = 0
    host.reset()
    host.update()
    assert loop.times == [0, PERIOD_NS, 5 * PERIOD_NS, 0]
