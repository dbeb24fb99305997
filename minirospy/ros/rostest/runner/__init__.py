"""Launch files whose ``<test>`` tags are run. Source: http://wiki.ros.org/rostest."""
