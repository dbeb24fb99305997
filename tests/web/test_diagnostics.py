"""The bridge's entries on /diagnostics: one for each client, with a warning while messages are dropped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import UInt8MultiArray

from minirospy.web import bridge as bridge_module
from minirospy.web.server.client import Limits

if TYPE_CHECKING:
    from tests.web.conftest import Running


def test_diagnostics_name_clients_and_warn_of_drops(
    run_bridge: Callable[..., Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bridge_module, "DIAGNOSTICS_SECONDS", 0.05)
    bridge = run_bridge(diagnostics=True, limits=Limits(queue=500_000, silent_seconds=1000.0))
    publisher = bridge.publisher(bridge.node("camera"), "/image", UInt8MultiArray, queue_size=1000)
    monitor = bridge.node("monitor")

    async def line(accepts: Callable[[DiagnosticStatus], bool]) -> DiagnosticStatus:
        async with monitor.subscribe("/diagnostics", DiagnosticArray) as arrays:
            async for array in arrays:
                assert array.header.stamp.to_sec() > 0
                for status in array.status:
                    if accepts(status):
                        return status
        raise AssertionError("the subscription has ended")

    client = bridge.client(max_queue=1, close_timeout=0.1)
    client.subscribe("/image")
    bridge.run(publisher.wait_for_subscribers())
    status = bridge.run(line(lambda _: True))
    assert (status.name, status.hardware_id) == ("bridge: foxglove client 127.0.0.1", "127.0.0.1")
    assert (status.level, status.message) == (DiagnosticStatus.OK, "all messages sent")
    values = {each.key: each.value for each in status.values}
    assert list(values) == ["sent", "sent bytes", "waiting bytes", "dropped", "received"]
    assert (values["dropped"], values["received"]) == ("0", "1")

    async def overflow() -> DiagnosticStatus:
        async def publish() -> None:
            while True:
                await publisher.publish(data=bytes(200_000))
                await asyncio.sleep(0.001)

        publishing = asyncio.ensure_future(publish())
        try:
            return await line(lambda status: status.level == DiagnosticStatus.WARN)
        finally:
            publishing.cancel()

    # The client does not read any more data.
    warned = bridge.run(overflow())
    assert "messages dropped in a second" in warned.message
    counts = {each.key: int(each.value) for each in warned.values}
    assert counts["dropped"] > 0
    assert counts["waiting bytes"] <= 500_000
