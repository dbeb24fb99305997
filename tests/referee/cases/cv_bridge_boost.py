"""cv_bridge.boost.cv_bridge_boost, which programs import for types and colors."""

import numpy as np
from cv_bridge.boost.cv_bridge_boost import CV_MAT_CNWrap, CV_MAT_DEPTHWrap, cvtColor2, getCvType
from referee import show

NAMES = """mono8 mono16 bgr8 rgba16 8UC1 8SC1 16UC1 16SC3 32SC2 32FC1 64FC4 8UC5 64FC12 bayer_rggb8 bayer_grbg16 yuv422
8UC jpeg"""
for name in NAMES.split():
    try:
        number = getCvType(name)
    except RuntimeError as error:
        show(name, error)
    else:
        show(name, number, CV_MAT_CNWrap(number), CV_MAT_DEPTHWrap(number))

image = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
for pair in (("bgr8", "rgb8"), ("bgr8", "mono8"), ("rgb8", "bgra8"), ("bgr8", "bgr8"), ("bgr8", "mono16"),
             ("8UC3", "bgr8"), ("bgr8", "nope")):  # fmt: skip
    try:
        found = cvtColor2(image, *pair)
    except RuntimeError:
        show(pair, "RuntimeError")
    else:
        show(pair, found.dtype, found.tolist())
