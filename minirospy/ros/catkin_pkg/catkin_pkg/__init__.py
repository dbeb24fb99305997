"""catkin_pkg: reads package.xml files, without commands. Source: http://docs.ros.org/en/independent/api/catkin_pkg/html/."""

from __future__ import annotations

__all__ = ["__version__"]

__version__ = "0.5.2"
