"""The programs of diagnostic_aggregator, which sort the nodes' statuses into a tree.

Source: http://wiki.ros.org/diagnostic_aggregator.
"""
