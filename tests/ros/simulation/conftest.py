"""The fixture that starts programs of packages."""

from tests.ros.robot_state_publisher.conftest import start

__all__ = ["start"]
