"""rospy.impl, filled in by minirospy: the few names of rospy's inside that programs reach for."""

import importlib
import importlib.util
from types import ModuleType


def __getattr__(name: str) -> ModuleType:
    # `import rospy` of ROS imports them all; here each comes when somebody asks for it.
    if not name.startswith("_") and importlib.util.find_spec(f"{__name__}.{name}"):
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
