"""Bags: files of messages with their times. Pure: they work on binary streams, without sockets or message classes.

`records` parses the format and `encoding` serializes it, `compression` compresses chunks, `writer` writes a bag, `reader`
and `index` read it, `repair` rebuilds the index of a bag that was not closed, `info` summarizes one.
Source: http://wiki.ros.org/Bags/Format/2.0.
"""
