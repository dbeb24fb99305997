"""bondpy: a bond notifies each of two nodes when the other exits. Source: http://wiki.ros.org/bondpy."""
