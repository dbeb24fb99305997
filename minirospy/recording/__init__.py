"""Recording topics into bags and playing bags: two nodes on the node API of `client/`, and what they decide by.

`options` and `splits` (what to record, into which files) and `schedule` (when to publish what) are pure; `recorder` and
`player` are the nodes, `disk` writes files in a thread, `keys` reads single keys of a terminal.
Source: http://wiki.ros.org/rosbag/Commandline.
"""
