"""Functions for tests to query the graph and to run themselves. ``import rostest`` re-exports them.

Source: http://wiki.ros.org/rostest/Writing, http://wiki.ros.org/rospy/Overview.
"""

from __future__ import annotations

import unittest
import warnings
from collections.abc import Sequence

from minirospy.base.environment import Environment
from minirospy.ros.rosunit.runner import unit
from minirospy.runtime.rpc.master_proxy import MasterProxy, SystemState

__all__ = ["get_master", "is_publisher", "is_subscriber", "rosrun", "run", "unitrun"]

_CALLER_ID = "/script"


def rosrun(
    package: str,
    test_name: str,
    test: type[unittest.TestCase] | str,
    sysargs: Sequence[str] | None = None,
) -> None:
    """Run a TestCase that is a node. A ``<test>``'s program calls this as its main function.

    This function works like rosunit.unitrun, but shuts the node down afterwards. Raise SystemExit(1) if a test fails.
    """
    try:
        unit.unitrun(package, test_name, test, sysargs)
    finally:
        from minirospy.client import signal_shutdown

        signal_shutdown("test complete")


def run(
    package: str,
    test_name: str,
    test: type[unittest.TestCase] | str,
    sysargs: Sequence[str] | None = None,
) -> None:
    """Call rosrun, under its old name."""
    rosrun(package, test_name, test, sysargs)


def unitrun(
    package: str,
    test_name: str,
    test: type[unittest.TestCase] | str,
    sysargs: Sequence[str] | None = None,
    coverage_packages: Sequence[str] | None = None,
) -> None:
    """Call rosunit.unitrun."""
    warnings.warn("rostest.unitrun is called rosunit.unitrun now", DeprecationWarning, stacklevel=2)
    unit.unitrun(package, test_name, test, sysargs, coverage_packages)


def get_master() -> MasterProxy:
    """Return a proxy for the environment's master."""
    return MasterProxy(Environment.read(host="localhost").master_uri, _CALLER_ID)


def is_publisher(topic: str, publisher_id: str) -> bool:
    """Return whether a node publishes a topic; both are global names."""
    return publisher_id in _state().publishers.get(topic, ())


def is_subscriber(topic: str, subscriber_id: str) -> bool:
    """Return whether a node subscribes to a topic; both are global names."""
    return subscriber_id in _state().subscribers.get(topic, ())


def _state() -> SystemState:
    master = get_master()
    try:
        return master.get_system_state()
    finally:
        master.close()
