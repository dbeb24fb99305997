"""image_geometry: pixels, rays and rectified images of cameras with every kind of distortion, binning and region of interest."""

import math
import warnings

import numpy as np
from image_geometry import PinholeCameraModel, StereoCameraModel
from referee import outcome, show
from sensor_msgs.msg import CameraInfo

warnings.simplefilter("ignore")
QUERIES = "intrinsicMatrix projectionMatrix rotationMatrix distortionCoeffs fullIntrinsicMatrix fullProjectionMatrix"
VALUES = "fullResolution cx cy fx fy Tx Ty fovX fovY tfFrame"
DISTORTIONS = {
    "none": [],
    "four": [0.1, -0.2, 0.001, 0.002],
    "plumb_bob": [0.1, -0.2, 0.001, 0.002, 0.01],
    "rational": [0.1, -0.2, 0.001, 0.002, 0.01, 0.02, -0.03, 0.004],
    "thin prism": [0.1, -0.2, 0.001, 0.002, 0.01, 0.02, -0.03, 0.004, 0.01, 0.02, -0.01, 0.02],
    "strong": [-2.5, 0.9, 0.0, 0.0, 0.3],
}
ROTATION = [0.9999, -0.0101, 0.0085, 0.0102, 0.99993, -0.0061, -0.0084, 0.0062, 0.99994]


def rounded(value):
    """Return a result with its numbers rounded to nine places."""
    if isinstance(value, (np.ndarray, list, tuple)):
        return [rounded(each) for each in np.asarray(value).ravel().tolist()] if len(value) else []
    if isinstance(value, float) and not math.isfinite(value):
        return float(value)
    if isinstance(value, float):
        return round(float(value), 9) + 0.0
    return value


def camera(distortion, **changed):
    """Return the CameraInfo of a camera of 64x48 pixels."""
    info = CameraInfo(width=64, height=48, D=DISTORTIONS[distortion], R=ROTATION)
    info.header.frame_id = "camera"
    info.K = [50.0, 0.0, 32.0, 0.0, 51.0, 24.0, 0.0, 0.0, 1.0]
    info.P = [49.0, 0.0, 32.1, -4.9, 0.0, 49.5, 24.1, 3.0, 0.0, 0.0, 1.0, 0.0]
    for name, value in changed.items():
        setattr(info, name, value)
    return info


def region(info, x, y, width, height):
    """Return the CameraInfo with a region of interest."""
    info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height = x, y, width, height
    return info


def describe(label, info):
    """Print all results of a model."""
    model = PinholeCameraModel()
    model.fromCameraInfo(info)
    for name in QUERIES.split():
        matrix = getattr(model, name)()
        show(label, name, type(matrix).__name__, getattr(matrix, "shape", None), rounded(matrix))
    show(label, [(name, rounded(getattr(model, name)())) for name in VALUES.split()])
    show(label, model.binning_x, model.binning_y, str(model.raw_roi).split())
    for pixel in ((0, 0), (10, 20.5), (32.1, 24.1), (63, 47), (-5, 200)):
        show(label, pixel, rounded(model.rectifyPoint(pixel)), rounded(model.projectPixelTo3dRay(pixel)))
    for point in ((1, 2, 3), (0, 0, 1), (1, 2, 0), (1, 2, -4), (0.5, -0.25, 10.0)):
        show(label, point, rounded(model.project3dToPixel(point)))
    show(label, [rounded(call(0.5, z)) for call in (model.getDeltaU, model.getDeltaV) for z in (0, 2, -1)])
    show(label, [rounded(call(3, z)) for call in (model.getDeltaX, model.getDeltaY) for z in (0, 2, -1)])


for name in DISTORTIONS:
    describe(name, camera(name))
describe("binned", camera("plumb_bob", binning_x=2, binning_y=4))
describe("region", region(camera("plumb_bob"), 8, 4, 40, 20))
describe("region, binned", region(camera("plumb_bob", binning_x=2, binning_y=2), 8, 4, 40, 20))
describe("empty", CameraInfo())

# The images are smooth, so that a difference of a last bit in the map of pixels changes no rounded mean.
v, u = np.mgrid[:48, :64]
for name in ("none", "plumb_bob", "rational", "strong"):
    model = PinholeCameraModel()
    model.fromCameraInfo(camera(name))
    for label, raw in (
        ("gray", (2 * u + v).astype(np.uint8)),
        ("color", np.stack([2 * u + v, 3 * u, 5 * v], axis=-1).astype(np.uint8)),
        ("depth", (100 * u + 50 * v).astype(np.uint16)),
        ("floats", (u / 3 + v / 7).astype(np.float32)),
    ):
        image = np.zeros_like(raw)
        show(name, label, model.rectifyImage(raw, image))
        show(image[24, 8::8].tolist() if label == "gray" else "", round(float(image.mean()), 2))

left, right = camera("none"), camera("none")
left.P = [49.0, 0.0, 32.1, 0.0, 0.0, 49.0, 24.1, 0.0, 0.0, 0.0, 1.0, 0.0]
right.P = [49.0, 0.0, 32.1, -4.9, 0.0, 49.0, 24.1, 0.0, 0.0, 0.0, 1.0, 0.0]
for first, second in ((left, right), (right, left)):
    stereo = StereoCameraModel()
    stereo.fromCameraInfo(first, second)
    show(stereo.tfFrame(), rounded(stereo.Q), rounded([stereo.getZ(d) for d in (5, 0, -1)]))
    show(rounded(stereo.getDisparity(2)))
    for point in ((1, 2, 3), (1, 2, 0)):
        show(point, [rounded(each) for each in stereo.project3dToPixel(point)])
    for disparity in (5, 0.5):
        show(disparity, rounded(stereo.projectPixelTo3d((10, 20), disparity)))
show(stereo.getDisparity(0), stereo.left.rectifyPoint((1, 1)).shape)

outcome("no camera", lambda: PinholeCameraModel().tfFrame())
