"""Limits of the product that a test waits out: longer than a machine that runs tests may stand still."""

from __future__ import annotations

import pytest

__all__ = ["PATIENCE", "patient_limits"]

PATIENCE = 60.0
"""Seconds: a machine that runs tests may stand still for some."""
LIMITS = (
    "aio.topics._JOIN_SECONDS",
    "fleet.definitions._SECONDS",
    "web.foxglove.channels._SECONDS",
    "introspect.node_queries._QUERY_SECONDS",
    "ros2.action_to_ros1._SERVER_SECONDS",
    "ros2.action_to_ros2._ACCEPT_SECONDS",
    "ros2.bridge._JOIN_SECONDS",
    "ros2.bridge._QUERY_SECONDS",
    "ros2.services._QUERY_SECONDS",
    "cli.bridge_status._SECONDS",
)
"""What gives up, or goes on without an answer, after some seconds."""


@pytest.fixture(autouse=True)
def patient_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait longer than a machine may stand still for. A test of a limit sets it after this."""
    for name in LIMITS:
        monkeypatch.setattr(f"minirospy.{name}", PATIENCE)
