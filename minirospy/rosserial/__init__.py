"""Microcontrollers as nodes, over a serial line or TCP. Source: http://wiki.ros.org/rosserial, http://wiki.ros.org/rosserial_python."""
