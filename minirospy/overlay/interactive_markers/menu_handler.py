"""interactive_markers.menu_handler, provided by minirospy. Source: http://wiki.ros.org/interactive_markers."""

from minirospy.ros.interactive_markers.interactive_markers.menu_handler import EntryContext, MenuHandler

__all__ = [
    "EntryContext",
    "MenuHandler",
]
