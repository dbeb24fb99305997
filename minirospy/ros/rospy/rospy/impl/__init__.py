"""rospy.impl: the few internal names of rospy that programs use."""

import importlib
import importlib.util
from types import ModuleType


def __getattr__(name: str) -> ModuleType:
    # ROS's `import rospy` imports all of these modules. Here, each module is imported on first use.
    if not name.startswith("_") and importlib.util.find_spec(f"rospy.impl.{name}"):
        return importlib.import_module(f"rospy.impl.{name}")
    raise AttributeError(f"module 'rospy.impl' has no attribute {name!r}")
