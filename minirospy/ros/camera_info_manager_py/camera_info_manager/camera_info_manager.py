"""camera_info_manager.camera_info_manager: CameraInfoManager and its helper functions.

URLs: ``file:///FILE``, ``package://PACKAGE/FILE``, or "" for the default. ``${NAME}`` is the camera's name and
``${ROS_HOME}`` the folder for ROS's files. Source: http://wiki.ros.org/camera_info_manager_py. The file format is that of
camera_calibration_parsers, as in the C++ package.
"""

from __future__ import annotations

import re
from pathlib import Path
from urllib.request import url2pathname

from sensor_msgs.msg import CameraInfo
from sensor_msgs.srv import SetCameraInfo, SetCameraInfoRequest, SetCameraInfoResponse

from minirospy import client as rospy
from minirospy.ros.camera_calibration_parsers.camera_calibration_parsers import (
    readCalibration,
    writeCalibration,
)
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rospkg.rospkg.environment import get_ros_home
from minirospy.ros.rospkg.rospkg.rospack import RosPack

__all__ = [
    "CameraInfoError",
    "CameraInfoManager",
    "CameraInfoMissingError",
    "URL_empty",
    "URL_file",
    "URL_invalid",
    "URL_package",
    "default_camera_info_url",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
]

default_camera_info_url = "file://${ROS_HOME}/camera_info/${NAME}.yaml"

URL_empty = 0
URL_file = 1
URL_package = 2
URL_invalid = 3

_VARIABLE = re.compile(r"\$\{(\w+)\}")


class CameraInfoError(Exception):
    """The base class of this module's errors."""


class CameraInfoMissingError(CameraInfoError):
    """Raised if the calibration has not been loaded, or its package is missing."""


class CameraInfoManager:
    """Loads a camera's calibration, and saves calibrations sent to the service ``set_camera_info``.

    Create the manager after ``init_node``.
    """

    def __init__(self, cname: str = "camera", url: str = "", namespace: str = "") -> None:
        """Advertise the service ``set_camera_info``.

        ``cname``: the camera's name; ``url``: the calibration file; ``namespace``: the service's namespace.
        """
        self.cname = cname
        self.url = url
        self.camera_info: CameraInfo | None = None
        service = f"{namespace.rstrip('/')}/set_camera_info" if namespace else "set_camera_info"
        self.svc = rospy.Service(service, SetCameraInfo, self.setCameraInfo)

    def getCameraInfo(self) -> CameraInfo:
        """Return the calibration, or an empty one if the file is missing.

        Raise CameraInfoMissingError if the calibration has not been loaded.
        """
        if self.camera_info is None:
            raise CameraInfoMissingError("Calibration missing, loadCameraInfo() needed.")
        return self.camera_info

    def getCameraName(self) -> str:
        """Return the camera's name."""
        return self.cname

    def getURL(self) -> str:
        """Return the calibration's URL with its variables unresolved."""
        return self.url

    def isCalibrated(self) -> bool:
        """Return whether the camera is calibrated. Raise CameraInfoMissingError if the calibration has not been loaded."""
        return bool(self.getCameraInfo().K[0] != 0.0)

    def loadCameraInfo(self) -> None:
        """Load the calibration, or an empty one if the file is missing. Errors are logged."""
        filename = filename_of(self.url, self.cname)
        if filename is not None:
            self.camera_info = loadCalibrationFile(filename, self.cname)

    def setCameraInfo(self, req: SetCameraInfoRequest) -> SetCameraInfoResponse:
        """Store and save a calibration; this is the service's handler."""
        rospy.logdebug("SetCameraInfo received for %s", self.cname)
        self.camera_info = req.camera_info
        if saveCalibration(req.camera_info, self.url, self.cname):
            return SetCameraInfoResponse(success=True)
        return SetCameraInfoResponse(success=False, status_message="Error storing camera calibration.")

    def setCameraName(self, cname: str) -> bool:
        """Set the camera's name (letters, digits and ``_``); return False if it is invalid.

        Load the calibration again afterwards, because the file may depend on the name.
        """
        if not re.fullmatch(r"\w+", cname, re.ASCII):
            return False
        if self.cname != cname:
            self.cname, self.camera_info = cname, None
        return True

    def setURL(self, url: str) -> bool:
        """Set the calibration's URL; return False if it is invalid. Load the calibration again afterwards."""
        if parseURL(resolveURL(url, self.cname)) >= URL_invalid:
            return False
        if self.url != url:
            self.url, self.camera_info = url, None
        return True


def genCameraName(from_string: str) -> str:
    """Convert a string to a valid camera name: replace all characters except letters and digits with ``_``."""
    return re.sub(r"\W", "_", from_string, flags=re.ASCII)


def parseURL(url: str) -> int:
    """Return a resolved URL's type: ``URL_empty``, ``URL_file``, ``URL_package`` or ``URL_invalid``."""
    if not url:
        return URL_empty
    if url[:8].upper() == "FILE:///":
        return URL_file
    if url[:10].upper() == "PACKAGE://":
        package, _, name = url[10:].partition("/")
        if package and name:
            return URL_package
    return URL_invalid


def resolveURL(url: str, cname: str) -> str:
    """Substitute the variables in a URL. Leave an unknown variable unchanged and log a warning."""

    def value(match: re.Match[str]) -> str:
        if match[1] == "NAME":
            return cname
        if match[1] == "ROS_HOME":
            home = Path(get_ros_home()).as_posix()
            return home if home.startswith("/") else f"/{home}"
        rospy.logwarn("[%s] invalid URL substitution (not resolved): %s", cname, match[0])
        return match[0]

    return _VARIABLE.sub(value, url)


def getPackageFileName(url: str) -> str:
    """Return the path for a package:// URL. If the package is not found, log a warning and return ""."""
    package, _, name = url[len("package://") :].partition("/")
    try:
        return f"{RosPack().get_path(package)}/{name}"
    except ResourceNotFound:
        rospy.logwarn("unknown package: %s (ignored)", package)
        return ""


def loadCalibrationFile(filename: str, cname: str) -> CameraInfo:
    """Return the calibration in a file, or an empty one if the file is missing or invalid."""
    if not Path(filename).exists():
        return CameraInfo()
    found = readCalibration(filename)
    if found is None:
        return CameraInfo()
    name, info = found
    if name != cname:
        rospy.logwarn("[%s] does not match name %s in file %s", cname, name, filename)
    return info


def saveCalibration(new_info: CameraInfo, url: str, cname: str) -> bool:
    """Save a calibration to a URL; on failure, log the reason and return False."""
    filename = filename_of(url, cname)
    return filename is not None and saveCalibrationFile(new_info, filename, cname)


def saveCalibrationFile(ci: CameraInfo, filename: str, cname: str) -> bool:
    """Save a calibration to a file, creating missing folders; on failure, log the reason and return False."""
    rospy.loginfo("writing calibration data to %s", filename)
    return writeCalibration(filename, cname, ci)


def filename_of(url: str, cname: str) -> str | None:
    """Return the path for a URL; if the URL has no path, log the reason and return None."""
    resolved = resolveURL(url or default_camera_info_url, cname)
    kind = parseURL(resolved)
    if kind == URL_file:
        return url2pathname(resolved[len("file://") :])
    if kind == URL_package:
        return getPackageFileName(resolved) or None
    rospy.logerr(
        "Invalid camera calibration URL: %s (there is file:///FILE and package://PACKAGE/FILE)", resolved
    )
    return None
