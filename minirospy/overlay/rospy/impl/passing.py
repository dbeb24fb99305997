"""What rospy's modules have of one another by accident: ROS's import each other's names with a star.

Programs that say `rospy.core.resolve_name` find it; an editor is told only of what is at home in a module.
"""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

__all__ = ["passing_on"]


def passing_on(name: str, source: ModuleType) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` for the module ``name``, which has the public names of ``source``, too."""

    def get(attribute: str) -> Any:
        if not attribute.startswith("_") and hasattr(source, attribute):
            return getattr(source, attribute)
        raise AttributeError(f"module {name!r} has no attribute {attribute!r}")

    def names() -> list[str]:
        return sorted({*vars(sys.modules[name]), *(each for each in dir(source) if not each.startswith("_"))})

    return get, names
