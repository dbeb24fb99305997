"""Print the values that rosgraph reads from the command line: myargv, and the address, which is read at each call."""

import os
import sys

import rosgraph
import rosgraph.network as network
import rospy
from referee import outcome, show

WORDS = [
    "a",
    "b:=c",
    "d",
    "e=:=f",
    "__x:=1",
    "http://x:=y",
    ":=",
    "a b:=c d",
    "x:=",
    "_p:=1",
    ":=z",
    "--f:=1",
]
show("# myargv")
show(rosgraph.myargv(WORDS))
show(rospy.myargv(WORDS))
show(rosgraph.myargv([]))
sys.argv = ["program", "--flag:=x", "y"]
show(rosgraph.myargv(), rospy.myargv())

show("# addresses")
for variable in ("ROS_HOSTNAME", "ROS_IP"):
    os.environ.pop(variable, None)
outcome("none", network.get_address_override)
for words in (
    ["__ip:=1.2.3.4"],
    ["__hostname:=foo"],
    ["__hostname:=localhost"],
    ["__ip:=127.0.0.9", "__hostname:=bar"],
    ["__hostname:=bar", "__ip:=127.0.0.9"],
    ["__hostname:=a:=b"],
    ["x__ip:=1.2.3.4"],
    ["__ip=1.2.3.4"],
):
    sys.argv = ["program", *words]
    outcome(f"{words} override", network.get_address_override)
    if words[0].startswith("__") and ":=a:=" not in words[0] and ":=" in words[0]:
        outcome("name", network.get_host_name)
        outcome("address", network.get_local_address)
        outcome("bind", network.get_bind_address)
        outcome("bind to", lambda: network.get_bind_address("127.0.0.3"))
        show("uri", network.create_local_xmlrpc_uri(12).replace(":12/", " 12"))
os.environ["ROS_HOSTNAME"] = "named"
outcome("ROS_HOSTNAME", network.get_address_override)
sys.argv.append("__ip:=1.2.3.4")
outcome("and argument", network.get_address_override)
