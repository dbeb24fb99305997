"""bondpy: a bond notifies each of two nodes when the other one exits. Source: http://wiki.ros.org/bondpy."""
