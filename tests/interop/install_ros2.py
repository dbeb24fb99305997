"""`make ros2`: install real ROS 2 from PyPI in build/ros2, for the tests of the ROS 2 bridge.

The PyPI packages are unofficial, for Linux on x86_64 and CPython 3.10 to 3.13. On other platforms, print one line that they
are not available; the tests are then skipped.
"""

from __future__ import annotations

import sys
import sysconfig

from tests.interop.environments import ROOT, PeerEnvironment

PACKAGES = (
    "ros-rclpy==9.1.2",
    "ros-rmw-fastrtps-cpp==9.3.3",
    "ros-std-msgs==5.5.1",
    "ros-geometry-msgs==5.5.1",
    "ros-sensor-msgs==5.5.1",
    "ros-nav-msgs==5.5.1",
    "ros-diagnostic-msgs==5.5.1",
    "ros-rosgraph-msgs==2.3.0",
    "ros-rcl-interfaces==2.3.0",
    "ros-std-srvs==5.5.1",
    "ros-test-msgs==2.3.0",
)
PEER = PeerEnvironment("ros2", PACKAGES)
PYTHON, STAMP = PEER.python, PEER.stamp


def main() -> int:
    """Install; always return 0, because the tests are skipped if the installation fails."""
    if PEER.is_complete:
        return 0
    if not PEER.create():
        print("ROS 2 cannot be installed from PyPI here: the bridge to it is not tested against it")
        return 0

    # Put minirospy, its libraries and its own packages behind ROS 2's packages.
    places = [sysconfig.get_path("purelib"), str(ROOT), str(ROOT / "minirospy" / "overlay")]
    site = next((PEER.folder / "lib").glob("python*/site-packages"))
    (site / "zz_minirospy.pth").write_text("".join(f"{place}\n" for place in places))
    PEER.complete()
    return 0


if __name__ == "__main__":
    sys.exit(main())
