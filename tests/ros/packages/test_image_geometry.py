"""image_geometry: rectification with and without OpenCV, the inverse, and faults. tests/referee compares the numbers."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from image_geometry import PinholeCameraModel, StereoCameraModel
from sensor_msgs.msg import CameraInfo

from minirospy.ros.image_geometry.image_geometry import rectification


def camera(*distortion: float, **changed: object) -> PinholeCameraModel:
    info = CameraInfo(width=64, height=48, D=distortion, R=[1, 0, 0, 0, 1, 0, 0, 0, 1])
    info.K = [50.0, 0.0, 32.0, 0.0, 51.0, 24.0, 0.0, 0.0, 1.0]
    info.P = [49.0, 0.0, 32.1, -4.9, 0.0, 49.5, 24.1, 0.0, 0.0, 0.0, 1.0, 0.0]
    for name, value in changed.items():
        setattr(info, name, value)
    model = PinholeCameraModel()
    model.fromCameraInfo(info)
    return model


@pytest.mark.parametrize(
    "distortion",
    [
        (),
        (0.1, -0.05, 0.001, 0.002),
        (0.1, -0.05, 0.001, 0.002, 0.01, 0.02, -0.03, 0.004, 0, 0, 0, 0, 0.02, -0.01),
    ],
)
def test_unrectified_point_is_rectified_to_itself(distortion: tuple[float, ...]) -> None:
    model = camera(*distortion)
    for point in ((32.0, 24.0), (20.0, 30.0), (40.5, 10.25)):
        back = model.rectifyPoint(model.unrectifyPoint(point))
        assert back == pytest.approx(point, abs=0.01)


def test_pixel_ray_leads_back_to_the_pixel() -> None:
    model = camera()
    model.P[0, 3] = 0
    ray = model.projectPixelTo3dRay((10.0, 40.0))
    assert math.hypot(*ray) == pytest.approx(1)
    assert model.project3dToPixel(ray) == pytest.approx((10.0, 40.0))


def test_image_is_shifted_by_whole_pixels_exactly() -> None:
    model = camera(P=[50.0, 0, 35.0, 0, 0, 51.0, 22.0, 0, 0, 0, 1, 0])
    raw = np.random.default_rng(1).integers(0, 256, (48, 64, 3), np.uint8)
    image = np.zeros_like(raw)
    model.rectifyImage(raw, image)
    np.testing.assert_array_equal(image[:-2, 3:], raw[2:, :-3])
    assert not image[-2:].any()
    assert not image[:, :3].any()


def test_weights_of_all_parts_of_a_pixel_add_up_to_one() -> None:
    assert (rectification._fixed_weights().sum(axis=(2, 3)) == 1 << 15).all()


def test_opencv_is_used_if_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Cv2:
        INTER_CUBIC = 2

        @staticmethod
        def remap(raw: np.ndarray, map_x: np.ndarray, map_y: np.ndarray, how: int) -> np.ndarray:
            assert (map_x.dtype, map_y.shape, how) == (np.float32, (48, 64), 2)
            return raw + 1

    monkeypatch.setitem(sys.modules, "cv2", Cv2)
    raw, image = np.zeros((48, 64), np.uint8), np.zeros((48, 64), np.uint8)
    camera(0.1, 0, 0, 0).rectifyImage(raw, image)
    assert (image == 1).all()


@pytest.mark.parametrize(
    ("raw", "image", "reason"),
    [
        (
            np.zeros((48, 64), np.uint8),
            np.zeros((48, 63), np.uint8),
            "the array given for it is uint8 (48, 63)",
        ),
        (
            np.zeros((48, 64), np.uint8),
            np.zeros((48, 64), np.uint16),
            "the array given for it is uint16 (48, 64)",
        ),
        (np.zeros(48, np.uint8), np.zeros((48, 64), np.uint8), "image of uint8 (48,)"),
        (np.zeros((48, 64), np.int64), np.zeros((48, 64), np.int64), "images of int64 cannot be rectified"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(raw: np.ndarray, image: np.ndarray, reason: str) -> None:
    with pytest.raises(ValueError, match=r"images? of") as caught:
        camera(0.1, 0, 0, 0).rectifyImage(raw, image)
    assert reason in str(caught.value)


def test_camera_without_a_size_is_refused() -> None:
    with pytest.raises(ValueError, match="its CameraInfo is empty"):
        camera(width=0).rectifyImage(np.zeros((48, 64)), np.zeros((48, 64)))


def test_wrong_number_of_coefficients_is_named() -> None:
    with pytest.raises(ValueError, match=r"D has 3 coefficients: there are 0, 4, 5, 8, 12, 14"):
        camera(1, 2, 3).rectifyPoint((1, 1))


@pytest.mark.parametrize(
    "call",
    [
        lambda: PinholeCameraModel().project3dToPixel((1, 2, 3)),
        lambda: PinholeCameraModel().rectifyPoint((1, 2)),
        lambda: PinholeCameraModel().fovX(),
        lambda: StereoCameraModel().getZ(1.0),
        lambda: StereoCameraModel().projectPixelTo3d((1, 2), 3.0),
    ],
)
def test_empty_model_error_names_the_missing_call(call: object) -> None:
    with pytest.raises(TypeError, match=r"the camera model is empty: call fromCameraInfo\(\) first"):
        call()  # type: ignore[operator]


def test_matrix_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot reshape"):
        camera(K=[1.0, 2.0])
