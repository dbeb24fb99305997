"""bondpy: a bond notifies two nodes of each other's exit. Source: http://wiki.ros.org/bondpy."""
