"""The message packages included in minirospy: their folder, and which of them are precompiled in the wheel."""

from __future__ import annotations

from pathlib import Path

__all__ = ["COMPILED_AHEAD", "own_definitions"]

COMPILED_AHEAD = frozenset(
    [
        "actionlib_msgs",
        "dynamic_reconfigure",
        "geometry_msgs",
        "minirospy_msgs",
        "nav_msgs",
        "roscpp",
        "rosgraph_msgs",
        "rpi_msgs",
        "sensor_msgs",
        "sick_safetyscanners",
        "std_msgs",
        "std_srvs",
        "tf",
        "tf2_msgs",
        "visualization_msgs",
    ]
)
"""Packages whose modules are files in the wheel: ROS's own packages and the workshop's, which most programs import."""

_OURS = Path(__file__).parents[2]


def own_definitions() -> Path:
    """Return the folder of minirospy's own definitions: ``share/msgs`` if installed, ``msgs`` in a checkout."""
    installed = _OURS / "share" / "msgs"
    return installed if installed.is_dir() else _OURS.parent / "msgs"
