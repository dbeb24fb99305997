"""interactive_markers: markers that the user moves and clicks in a viewer. Source: http://wiki.ros.org/interactive_markers."""
