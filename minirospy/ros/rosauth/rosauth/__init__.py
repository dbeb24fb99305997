"""rosauth: authentication of web clients. Source: http://wiki.ros.org/rosauth."""
