"""Read parameters of plugins and sensors: texts, and numbers within the range that their tag allows."""

from __future__ import annotations

import math

from minirospy.base.errors import MinirospyError
from minirospy.base.xml_text import XmlElement

__all__ = ["PluginError", "number_of", "numbers_of", "text_of"]

_POSITIVE = {
    "controlPeriod", "height", "horizontal_fov", "max", "samples", "wheelDiameter", "wheelSeparation", "width",
}  # fmt: skip
_NOT_NEGATIVE = {
    "covariance_x", "covariance_y", "covariance_yaw", "far", "focalLength", "fov", "gaussianNoise", "max_range", "min",
    "min_range", "near", "pointCloudCutoff", "pointCloudCutoffMax", "resolution", "stddev", "torque", "wheelAcceleration",
    "wheelTorque",
}  # fmt: skip
_MAY_BE_INFINITE = {
    "cmdTimeout", "max", "maxEffort", "max_range", "pointCloudCutoffMax", "torque", "wheelTorque",
}  # fmt: skip


class PluginError(MinirospyError):
    """Raised by ``load`` if a plugin's parameters are invalid. The message is one line."""


def text_of(element: XmlElement | None, tag: str, default: str = "") -> str:
    """Return a child element's text, or the default if it is missing or empty."""
    child = element.first(tag) if element is not None else None
    return (child.text.strip() or default) if child is not None else default


def number_of(element: XmlElement | None, tag: str, default: float) -> float:
    """Return a child element's number, or the default. Raise PluginError if the text is not a number within the tag's range."""
    text = text_of(element, tag)
    return _number(tag, text, text) if text else default


def numbers_of(element: XmlElement | None, tag: str, counts: tuple[int, ...]) -> tuple[float, ...]:
    """Return a child element's numbers, or () if it has none. Raise PluginError if a number or the count is invalid."""
    text = text_of(element, tag)
    words = text.split()
    if words and len(words) not in counts:
        raise PluginError(f"<{tag}> is '{text}': {' or '.join(map(str, counts))} numbers are needed")
    return tuple(_number(tag, word, text) for word in words)


def _number(tag: str, word: str, text: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise PluginError(f"<{tag}> is '{text}', not a number") from None
    if math.isnan(value) or (math.isinf(value) and tag not in _MAY_BE_INFINITE):
        raise PluginError(f"<{tag}> is '{text}', not a finite number")
    if value < 0 and tag in _NOT_NEGATIVE:
        raise PluginError(f"<{tag}> is '{text}': it must not be negative")
    if value <= 0 and tag in _POSITIVE:
        raise PluginError(f"<{tag}> is '{text}': it must be positive")
    return value
