"""Bags: files of messages with their times. Pure: binary streams in and out, no sockets, no message classes.

`records` reads the format and `encoding` writes it, `compression` is that of chunks, `writer` makes a bag, `reader` and
`index` read it, `repair` rebuilds the index of one that was not closed, `info` describes one.
Source: http://wiki.ros.org/Bags/Format/2.0.
"""
