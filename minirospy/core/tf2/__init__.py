"""Coordinate frames: the tree of transforms over time, and lookups in it. Pure: no sockets, threads or clocks."""
