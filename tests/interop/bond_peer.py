"""One endpoint of a bond; minirospy's runs with this Python, Debian's with /usr/bin/python3.

It prints events, and breaks the bond on the line "break".
"""

import sys
import threading

import rospy
from bond.msg import Status
from bondpy import bondpy

rospy.init_node("bond", anonymous=True)


lock = threading.Lock()


def say(*words):
    with lock:
        print(*words, flush=True)


bond = bondpy.Bond(sys.argv[1], sys.argv[2], lambda: say("broken"), lambda: say("formed"))
bond.connect_timeout = float(sys.argv[3])
bond.set_heartbeat_timeout(float(sys.argv[4]))
bond.heartbeat_period = 0.2
bond.disconnect_timeout = 1.0
bond.start()


def wait():
    say("waited", bond.wait_until_broken(rospy.Duration(300)), bond.is_broken(), "Dead" in repr(bond))


threading.Thread(target=wait, daemon=True).start()
for line in sys.stdin:
    if line.strip() == "break":
        bond.break_bond()
    elif line.strip() == "wait":
        known = bond.wait_until_formed(rospy.Duration(200))
        beats = 0
        while beats < 3:
            # Debian's bondpy detects silence only after the second heartbeat.
            beats += rospy.wait_for_message(sys.argv[1], Status, 200).instance_id != bond.instance_id
        say("known", known)
bond.shutdown()
