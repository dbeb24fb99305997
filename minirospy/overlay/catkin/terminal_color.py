"""catkin.terminal_color, provided by minirospy: texts with colors."""

from minirospy.ros.catkin.catkin.terminal_color import (
    ColorTemplate,
    ansi,
    disable_ANSI_colors,
    enable_ANSI_colors,
    fmt,
    sanitize,
)

__all__ = [
    "ColorTemplate",
    "ansi",
    "disable_ANSI_colors",
    "enable_ANSI_colors",
    "fmt",
    "sanitize",
]
