"""diagnostic_aggregator's programs. They sort the nodes' statuses into a tree.

Source: http://wiki.ros.org/diagnostic_aggregator.
"""
