"""diagnostic_aggregator: its programs, which sort what nodes report into one tree. Source: http://wiki.ros.org/diagnostic_aggregator."""
