"""Programs that pass topics on: relay, throttle, drop, mux. Source: http://wiki.ros.org/topic_tools."""
