"""interactive_markers, provided by minirospy. Source: http://wiki.ros.org/interactive_markers."""
