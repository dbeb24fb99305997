"""Names that rospy's modules re-export by accident, because ROS's modules star-import each other.

Programs can therefore use `rospy.core.resolve_name`, although editors list only the names that the module defines.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module

__all__ = ["core_dir", "core_getattr", "service_dir", "service_getattr", "topics_dir", "topics_getattr"]


def _passing_on(name: str, *sources: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` for the module ``name``, so that it also exports the public names of ``sources``."""

    def get(attribute: str) -> object:
        for source in () if attribute.startswith("_") else sources:
            module = import_module(source)
            if hasattr(module, attribute):
                return getattr(module, attribute)
        raise AttributeError(f"module {name!r} has no attribute {attribute!r}")

    def names() -> list[str]:
        found = (each for source in sources for each in dir(import_module(source)))
        public = (each for each in found if not each.startswith("_"))
        return sorted({*vars(sys.modules[name]), *public})

    return get, names


core_getattr, core_dir = _passing_on("rospy.core", "rospy.names")
service_getattr, service_dir = _passing_on("rospy.service", "rospy.core", "rospy.impl.transport")
topics_getattr, topics_dir = _passing_on("rospy.topics", "rospy.core")
