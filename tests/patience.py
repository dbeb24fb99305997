"""Raise the product's time limits in a test above any stall of the machine."""

from __future__ import annotations

import pytest

__all__ = ["PATIENCE", "patient_limits"]

PATIENCE = 60.0  # seconds; longer than any stall of a machine that runs tests
LIMITS = (
    "aio.topics.JOIN_SECONDS",
    "fleet.definitions.ANSWER_SECONDS",
    "web.foxglove.channels.TYPE_SECONDS",
    "web.rosbridge.client_actions.SERVER_SECONDS",
    "introspect.node_queries.QUERY_SECONDS",
    "ros2.action_to_ros1.SERVER_SECONDS",
    "ros2.action_to_ros2.ACCEPT_SECONDS",
    "ros2.bridge.JOIN_SECONDS",
    "ros2.bridge.QUERY_SECONDS",
    "ros2.services.QUERY_SECONDS",
    "cli.bridge_status.ANSWER_SECONDS",
)
"""Limits, in seconds, after which the product gives up or continues without a response."""


@pytest.fixture(autouse=True)
def patient_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the limits above a machine's stalls. A test of a limit sets it after calling this."""
    for name in LIMITS:
        monkeypatch.setattr(f"minirospy.{name}", PATIENCE)
