"""bondpy, provided by minirospy. Source: http://wiki.ros.org/bondpy."""
