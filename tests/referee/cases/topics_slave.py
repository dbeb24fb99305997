"""The Slave API of a node with topics: its reports on connections to tools, and its answers to bad calls."""

import os
import re
import xmlrpc.client

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import String

# For minirospy: use only ROS 1's transport.
os.environ["MINIROSPY_TRANSPORT"] = "tcp"
rospy.init_node("case", argv=[])
node = xmlrpc.client.ServerProxy(rospy.get_node_uri())
publisher = rospy.Publisher("/topic", String, queue_size=1)
got = []
subscriber = rospy.Subscriber("/topic", String, got.append)
show(eventually(lambda: publisher.get_num_connections() == 1 and subscriber.get_num_connections() == 1))
publisher.publish("abc")
show(eventually(lambda: len(got) == 1))
code, text, rows = node.getBusInfo("/me")
show("getBusInfo", code, text)
for row in sorted(rows, key=lambda row: row[2]):
    if row[4] == "/topic":
        # The subscriber's endpoint may not know its socket any more: a race in real rospy.
        what = re.sub(r"\d+|None", "<number>", row[6].split(" to [")[0]) if len(row) > 6 else None
        show("row", row[1:6], what, type(row[0]).__name__, len(row))
code, text, (publications, subscriptions, services) = node.getBusStats("/me")
show("getBusStats", code, text, services)
show(
    "publications",
    [(topic, data > 0, [row[2:] for row in rows]) for topic, data, rows in publications if topic == "/topic"],
)
show("subscriptions", [(topic, len(rows[0])) for topic, rows in subscriptions])
outcome("getPublications", lambda: node.getPublications("/me"))
outcome("getSubscriptions", lambda: node.getSubscriptions("/me"))
outcome("getName", lambda: node.getName("/me"))
outcome("getMasterUri", lambda: node.getMasterUri("/me")[:2])
outcome("getPid", lambda: node.getPid("/me")[:2])
outcome("getUri", lambda: node.getUri("/me"))
outcome("publisherUpdate of nothing", lambda: node.publisherUpdate("/me", "/nobody", []))
outcome("publisherUpdate with a string", lambda: node.publisherUpdate("/me", "/topic", "x"))
outcome("publisherUpdate with numbers", lambda: node.publisherUpdate("/me", "/topic", [5]))
outcome("publisherUpdate without a topic", lambda: node.publisherUpdate("/me"))
outcome("publisherUpdate with a number", lambda: node.publisherUpdate("/me", 5, []))
outcome("publisherUpdate with no name", lambda: node.publisherUpdate("/me", "", []))
outcome("paramUpdate of a number", lambda: node.paramUpdate("/me", 5, 5))
outcome("no caller", node.getName)
outcome("a number as caller", lambda: node.getName(5))
outcome("an empty caller", lambda: node.getName(""))
outcome("one argument too many", lambda: node.getName("/me", 5))

# Arguments that are refused, and a topic's name without its slash.
outcome("paramUpdate, relative key", lambda: node.paramUpdate("/me", "x", 1))
outcome("paramUpdate, empty key", lambda: node.paramUpdate("/me", "", 1))
outcome("paramUpdate, number as key", lambda: node.paramUpdate("/me", 3, 1))
outcome("publisherUpdate, no URL", lambda: node.publisherUpdate("/me", "/topic", ["x"]))
outcome("publisherUpdate, no list", lambda: node.publisherUpdate("/me", "/topic", 3))
outcome("requestTopic, relative name", lambda: node.requestTopic("/me", "topic", [["TCPROS"]])[0])

PROTOCOLS = ([3], [[]], ["TCPROS"], ["x"], [""], [{}], [["x"], 3], [["x"]], [], "x", "TCPROS", {"a": 1}, 3,
             [["TCPROS"], 3], [True], [1.5], [["x"], []])  # fmt: skip
for protocols in PROTOCOLS:
    outcome(f"requestTopic, {protocols!r}", lambda: node.requestTopic("/me", "/topic", protocols)[:2])
outcome("requestTopic of another topic", lambda: node.requestTopic("/me", "/nobody", [3]))

# Names of topics that do not exist, and methods that do not exist.
for name in ("/", "a b", "http://x", "~x", "~", "a//b/"):
    outcome(f"requestTopic {name!r}", lambda: node.requestTopic("/me", name, [["TCPROS"]]))
    outcome(f"publisherUpdate {name!r}", lambda: node.publisherUpdate("/me", name, []))
    outcome(f"paramUpdate {name!r}", lambda: node.paramUpdate("/me", name, 1))
for call in ("getMaster", "_shutdown", "registerPublisher"):
    outcome(call, lambda: getattr(node, call)("/me"))
