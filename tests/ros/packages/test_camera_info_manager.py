"""camera_info_manager: URLs, files and the service. tests/referee and tests/interop compare the contents."""

from __future__ import annotations

import logging
import subprocess
import sys
from pathlib import Path

import pytest
from camera_calibration_parsers import readCalibration, writeCalibration
from camera_info_manager import (
    CameraInfoManager,
    CameraInfoMissingError,
    genCameraName,
    getPackageFileName,
    loadCalibrationFile,
    parseURL,
    resolveURL,
    saveCalibration,
)
from camera_info_manager import camera_info_manager as module
from sensor_msgs.msg import CameraInfo

DRIVER = """
import sys, rospy
from camera_info_manager import CameraInfoManager, CameraInfoMissingError
from sensor_msgs.msg import CameraInfo
from sensor_msgs.srv import SetCameraInfo
rospy.init_node("driver", log_level=rospy.WARN)
manager = CameraInfoManager("front", sys.argv[1], namespace="front")
try:
    manager.getCameraInfo()
except CameraInfoMissingError as error:
    print(error)
manager.loadCameraInfo()
print(manager.isCalibrated(), manager.getURL() == sys.argv[1], manager.getCameraName(), manager.svc.resolved_name)
info = CameraInfo(width=4, height=3, K=[1.5] + [0.0] * 8)
info.distortion_model, info.D = "plumb_bob", [0.0] * 5
answer = rospy.ServiceProxy("front/set_camera_info", SetCameraInfo)(info)
print(answer.success, repr(answer.status_message))
print(manager.isCalibrated(), manager.getCameraInfo().width)
print(manager.setCameraName("side"), manager.setCameraName("a b"), manager.setURL("nonsense"), manager.setURL(""))
"""


def calibration() -> CameraInfo:
    info = CameraInfo(width=640, height=480, distortion_model="plumb_bob", D=[0.1, 0.2, 0.0, 0.0, 1e-9])
    info.K = [500.0, 0.0, 320.0, 0.0, 1 / 3, 240.0, 0.0, 0.0, 1.0]
    return info


@pytest.mark.parametrize(
    ("url", "kind"),
    [
        ("", module.URL_empty),
        ("file:///tmp/x.yaml", module.URL_file),
        ("FILE:///tmp/x.yaml", module.URL_file),
        ("file://host/x.yaml", module.URL_invalid),
        ("package://my_pkg/x.yaml", module.URL_package),
        ("package://my_pkg", module.URL_invalid),
        ("package:///x.yaml", module.URL_invalid),
        ("http://host/x.yaml", module.URL_invalid),
        ("/tmp/x.yaml", module.URL_invalid),
    ],
)
def test_url_kind(url: str, kind: int) -> None:
    assert parseURL(url) == kind


def test_url_variables_are_replaced(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("ROS_HOME", "/home/me/.ros")
    assert (
        resolveURL("file://${ROS_HOME}/${NAME}-${NAME}.yaml", "left") == "file:///home/me/.ros/left-left.yaml"
    )
    assert resolveURL("a$ {NAME} ${", "left") == "a$ {NAME} ${"
    with caplog.at_level(logging.WARNING, "rosout"):
        assert resolveURL("file:///${HOME}", "left") == "file:///${HOME}"
    assert "invalid URL substitution (not resolved): ${HOME}" in caplog.text


def test_camera_name_of_any_text() -> None:
    assert genCameraName("Logitech C920 (2)") == "Logitech_C920__2_"


def test_file_of_a_package_is_found(caplog: pytest.LogCaptureFixture) -> None:
    assert getPackageFileName("package://std_msgs/a/b.yaml").endswith("std_msgs/a/b.yaml")
    assert getPackageFileName("package://no_such_package/b.yaml") == ""
    assert "unknown package: no_such_package (ignored)" in caplog.text


@pytest.mark.parametrize("name", ["c.yaml", "c.yml", "c.ini"])
def test_calibration_is_read_as_it_was_written(tmp_path: Path, name: str) -> None:
    info = calibration()
    assert writeCalibration(str(tmp_path / name), "a/camera: 7", info)
    found = readCalibration(str(tmp_path / name))
    assert found is not None
    assert found[0] == "a/camera: 7"
    if name == "c.ini":
        info.K[4], info.D[4] = 0.33333, 0.0
    assert found[1] == info


def test_default_place_is_in_ros_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    assert saveCalibration(calibration(), "", "left")
    assert loadCalibrationFile(str(tmp_path / "camera_info" / "left.yaml"), "left") == calibration()


@pytest.mark.parametrize("width", ["[]", "9" * 5000, "4294967296", "-1"])
def test_missing_or_broken_file_is_an_empty_calibration(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, width: str
) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text(f"image_width: {width}", encoding="utf-8")
    assert loadCalibrationFile(str(tmp_path / "missing.yaml"), "left") == CameraInfo()
    assert not caplog.records
    assert loadCalibrationFile(str(broken), "left") == CameraInfo()
    assert "is not a number of pixels: " in caplog.text


def test_file_of_another_camera_is_used_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = str(tmp_path / "c.yaml")
    writeCalibration(path, "left", calibration())
    assert loadCalibrationFile(path, "right") == calibration()
    assert f"[right] does not match name left in file {path}" in caplog.text


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("http://host/x.yaml", "Invalid camera calibration URL: http://host/x.yaml"),
        ("package://no_such_package/x.yaml", "unknown package: no_such_package"),
        ("file:///dev/null/x.yaml", "Failed to save camera calibration to file"),
        ("file:///tmp/x.txt", "A camera calibration is a .yaml, .yml or .ini file"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="paths of POSIX")
def test_calibration_that_cannot_be_saved_is_reported(
    url: str, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert not saveCalibration(calibration(), url, "left")
    assert reason in caplog.text


def test_fisheye_calibration_is_refused_as_ini(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    info = calibration()
    info.distortion_model = "equidistant"
    assert not writeCalibration(str(tmp_path / "c.ini"), "left", info)
    assert "plumb_bob" in caplog.text


def test_driver_saves_calibration_of_its_service(master: str, tmp_path: Path) -> None:
    url = (
        (tmp_path / "new" / "${NAME}.yaml")
        .as_uri()
        .replace("%7B", "{")
        .replace("%7D", "}")
        .replace("%24", "$")
    )
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, url], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout.splitlines() == [
        "Calibration missing, loadCameraInfo() needed.",
        "False True front /front/set_camera_info",
        "True ''",
        "True 4",
        "True False False True",
    ], done.stderr
    found = readCalibration(str(tmp_path / "new" / "front.yaml"))
    assert found is not None
    assert (found[0], found[1].width, found[1].K[0]) == ("front", 4, 1.5)


ZOOM = """
import sys, rospy
from camera_info_manager import ApproximateZoomCameraInfoManager, CameraInfoError, InterpolatingZoomCameraInfoManager
rospy.init_node("driver")
def show(info):
    print([round(info.K[at], 3) for at in (0, 2, 4, 5, 8)], info.width, info.height, [round(each, 6) for each in info.D])
def attempt(call, *args):
    try:
        call(*args)
    except CameraInfoError as error:
        print(type(error).__name__, error)
with ApproximateZoomCameraInfoManager(2.7, 48, 720, 576, 1, 9999, "front", sys.argv[1] + "1.yaml", "a") as manager:
    manager.set_zoom(5)
    attempt(manager.getCameraInfo)
    manager.loadCameraInfo()
    for zoom in (1, 5000, 9999):
        manager.set_zoom(zoom)
        show(manager.getCameraInfo())
    manager.set_resolution(360, 288)
    show(manager.getCameraInfo())
    attempt(manager.set_zoom, 0)
template = sys.argv[1] + "%d.yaml"
with InterpolatingZoomCameraInfoManager(template, [1, 9], "front", template % 1, "b") as manager:
    attempt(manager.set_zoom, 1)
    manager.loadCameraInfo()
    for zoom in (1, 3, 5, 9):
        manager.set_zoom(zoom)
        show(manager.getCameraInfo())
for template, levels in ((template, [1]), ("package://no_such_package/%d.yaml", [1, 9])):
    with InterpolatingZoomCameraInfoManager(template, levels, "front", sys.argv[1] + "1.yaml", "c") as manager:
        attempt(manager.loadCameraInfo)
"""


def test_zoom_changes_the_calibration(master: str, tmp_path: Path) -> None:
    for level, focal_length in (("1", 500.0), ("9", 900.0)):
        info = CameraInfo(width=640, height=480, distortion_model="plumb_bob", D=[focal_length / 1000])
        info.K = [focal_length, 0.0, 320.0, 0.0, focal_length, 240.0, 0.0, 0.0, 1.0]
        assert writeCalibration(str(tmp_path / f"{level}.yaml"), "front", info)
    done = subprocess.run(
        [sys.executable, "-c", ZOOM, f"{tmp_path.as_uri()}/"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    # ROS's package computes the same, except for zoom 3, for which it uses three quarters of the farther calibration.
    assert [line for line in done.stdout.splitlines() if not line.startswith("[INFO]")] == [
        "CameraInfoMissingError Calibration missing, loadCameraInfo() needed.",
        "[808.573, 360.0, 827.023, 288.0, 1.0] 720 576 [0.5]",
        "[1600.702, 360.0, 1610.31, 288.0, 1.0] 720 576 [0.5]",
        "[15276.047, 360.0, 15277.065, 288.0, 1.0] 720 576 [0.5]",
        "[7638.023, 180.0, 7638.532, 144.0, 1.0] 360 288 [0.5]",
        "CameraInfoError Zoom got outside the allowed range",
        "CameraInfoMissingError Calibration missing, loadCameraInfo() needed.",
        "[500.0, 320.0, 500.0, 240.0, 1.0] 640 480 [0.5]",
        "[600.0, 320.0, 600.0, 240.0, 1.0] 640 480 [0.6]",
        "[700.0, 320.0, 700.0, 240.0, 1.0] 640 480 [0.7]",
        "[900.0, 320.0, 900.0, 240.0, 1.0] 640 480 [0.9]",
        "CameraInfoError Interpolating zoom camera info manager needs at least two calibrations to exist.",
        "CameraInfoMissingError Calibration package missing.",
    ], done.stderr


def test_calibration_is_missing_until_it_is_loaded() -> None:
    manager = CameraInfoManager.__new__(CameraInfoManager)
    manager.camera_info = None
    with pytest.raises(CameraInfoMissingError):
        manager.isCalibrated()
