"""topic_tools: its programs that evaluate expressions of Python. Those that pass bytes on are in minirospy.topic_tools."""
