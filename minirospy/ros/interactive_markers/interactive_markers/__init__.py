"""interactive_markers: markers that are moved and clicked in a viewer. Source: http://wiki.ros.org/interactive_markers."""
