"""rosauth: authenticates web clients. Source: http://wiki.ros.org/rosauth."""
