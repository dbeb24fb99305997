"""bondpy: two nodes that notice when the other one ends. Source: http://wiki.ros.org/bondpy."""
