"""Calibrations written by minirospy equal those by the real convert; random cameras yield the same numbers as the real model."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from camera_calibration_parsers import readCalibration, writeCalibration
from sensor_msgs.msg import CameraInfo

from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment

CONVERT = "/usr/lib/camera_calibration_parsers/convert"
OUR_CONVERT = (
    Path(__file__).parents[2] / "minirospy" / "ros" / "camera_calibration_parsers" / "nodes" / "convert"
)
QUERY = """
import json, sys
from image_geometry import PinholeCameraModel
from sensor_msgs.msg import CameraInfo
answers = []
for fields, points in json.load(sys.stdin):
    model = PinholeCameraModel()
    model.fromCameraInfo(CameraInfo(**fields))
    for x, y, z in points:
        u, v = model.project3dToPixel((x, y, z))
        ray, rectified = model.projectPixelTo3dRay((u, v)), model.rectifyPoint((u, v))
        answers.append([float(each) for each in (u, v, *ray, *rectified, model.getDeltaX(u, z))])
print(json.dumps(answers))
"""


@pytest.mark.parametrize("kind", ["yaml", "ini"])
@pytest.mark.parametrize("name", ["camera", "narrow_stereo/left", "00b09d0100a8fb8d", "with spaces: yes"])
def test_written_calibration_is_the_real_one(kind: str, name: str, tmp_path: Path) -> None:
    drawn = random.Random(name)
    info = CameraInfo(width=640, height=480, distortion_model="plumb_bob")
    for field, count in (("D", 5), ("K", 9), ("R", 9), ("P", 12)):
        numbers = [drawn.uniform(-1000, 1000) * 10.0 ** drawn.randint(-9, 3) for _ in range(count - 2)]
        setattr(info, field, [*numbers, 0.0, 1e-7])
    ours, theirs = tmp_path / f"ours.{kind}", tmp_path / f"theirs.{kind}"
    source = tmp_path / "source.yaml"
    assert writeCalibration(str(ours), name, info)
    assert writeCalibration(str(source), name, info)
    done = subprocess.run(
        [CONVERT, source, theirs], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert ours.read_text() == theirs.read_text()
    assert readCalibration(str(theirs)) == readCalibration(str(ours))


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "Usage: "),
        (["missing.yaml", "x.ini"], "Failed to load camera model from file missing.yaml"),
        (["good.ini", "x.foo"], "Failed to save camera model to file x.foo"),
        (["good.ini", "x.yaml"], "Saved x.yaml"),
    ],
)
def test_convert_exits_as_the_real_one(words: list[str], text: str, tmp_path: Path) -> None:
    info = CameraInfo(width=4, height=3, distortion_model="plumb_bob", D=[0.0] * 5)
    assert writeCalibration(str(tmp_path / "good.ini"), "camera", info)
    found = [
        subprocess.run(
            [*program, *words], capture_output=True, text=True, timeout=PATIENCE, cwd=tmp_path, check=False
        )
        for program in ([CONVERT], [sys.executable, str(OUR_CONVERT)])
    ]
    assert all(text in done.stdout + done.stderr for done in found)
    assert found[0].returncode == found[1].returncode


def test_random_cameras_give_the_real_numbers(tmp_path: Path) -> None:
    drawn = random.Random(7)

    def camera() -> dict[str, object]:
        fx, fy = drawn.uniform(300, 900), drawn.uniform(300, 900)
        return {
            "width": 640,
            "height": 480,
            "D": [drawn.uniform(-0.1, 0.1) for _ in range(drawn.choice((0, 4, 5, 8, 12, 14)))],
            "K": [fx, 0.0, drawn.uniform(300, 340), 0.0, fy, drawn.uniform(200, 280), 0.0, 0.0, 1.0],
            "P": [fy, 0.0, 320.0, drawn.uniform(-90, 0), 0.0, fx, 240.0, 0.5, 0.0, 0.0, 1.0, 0.0],
            "R": [1.0, 0.01, -0.02, -0.01, 1.0, 0.03, 0.02, -0.03, 1.0],
            "binning_x": drawn.choice((0, 2)),
        }

    def point() -> list[float]:
        return [drawn.uniform(-1, 1), drawn.uniform(-1, 1), drawn.uniform(2, 9)]

    queries = json.dumps([(camera(), [point() for _ in range(20)]) for _ in range(100)])
    found = []
    for stack in ("rospy", "ours"):
        python = REAL_PYTHON if stack == "rospy" else sys.executable
        done = subprocess.run(
            [python, "-c", QUERY],
            input=queries,
            env=environment("http://localhost:1", stack),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=True,
        )
        found.append(np.array(json.loads(done.stdout)))
    assert found[0].shape == (2000, 8)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)
