"""Turtlesim: the window of turtles in pure Python, and its tutorials' programs. Source: http://wiki.ros.org/turtlesim."""
