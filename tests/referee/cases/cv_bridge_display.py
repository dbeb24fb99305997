"""cv_bridge.cvtColorForDisplay: labels, scaling, and what cannot be shown."""

import numpy as np
from cv_bridge import cvtColorForDisplay
from referee import show

nan = float("nan")
deep = np.array([[0, 1000], [2500, 60000]], np.uint16)
real = np.array([[0.0, 1.5], [nan, 3.0]], np.float32)
small = np.array([[0, 50], [100, 255]], np.uint8)
labels = np.array([[-2, -1, 0, 1, 145, 146, 1000]], np.int32)
color = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)

CASES = [
    (labels, "32SC1", ""),
    (labels, "32SC1", "rgb8"),
    (deep, "16UC1", ""),
    (deep, "16UC1", "mono8"),
    (deep, "16UC1", "", False, 0.0, 3000.0),
    (deep, "16UC1", "mono8", False, 500.5, 3000.0),
    (deep, "mono16", "rgb8", True),
    (real, "32FC1", ""),
    (real, "32FC1", "", True),
    (real, "32FC1", "rgba8", False, 1.0, 2.0),
    (small, "mono8", ""),
    (small, "mono8", "", False, 10.0, 110.0),
    (small, "8UC1", ""),
    (small * 0, "mono8", "mono8", True),
    (color, "rgb8", ""),
    (color, "bgr8", "bgr8"),
    (color, "8UC3", "rgb8"),
    (color, "rgb8", "", True),
    (color, "rgb8", "mono16"),
    (color, "rgb8", "nope"),
    (color.astype(np.float64), "64FC3", ""),
    (color, "jpeg", ""),
]
for case in CASES:
    try:
        found = cvtColorForDisplay(*case)
    except RuntimeError:
        show(case[1:], "RuntimeError")
    else:
        show(case[1:], found.dtype, found.tolist())
