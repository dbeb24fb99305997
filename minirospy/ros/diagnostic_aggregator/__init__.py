"""The programs of diagnostic_aggregator, which sort statuses from nodes into a tree.

Source: http://wiki.ros.org/diagnostic_aggregator.
"""
