"""Parameters: values of all types, set and read."""

import datetime
import xmlrpc.client

import rosgraph
import rosparam
import rospy
from referee import outcome, show

rospy.init_node("case", argv=[])


def plain(value):
    if isinstance(value, xmlrpc.client.Binary):
        return ("Binary", value.data)
    if isinstance(value, xmlrpc.client.DateTime):
        return ("DateTime", value.value)
    return value


def there_and_back(value):
    rospy.set_param("v", value)
    try:
        got = rospy.get_param("v")
        return type(got).__name__, plain(got)
    finally:
        rospy.delete_param("v")


for value in [
    *(0, 1, -1, 2**31 - 1, -(2**31), 2**31, -(2**31) - 1, 2**63, 10**30),
    *(1.5, -0.0, 1e300, 5e-324, 0.1, 1 / 3, float("inf"), float("-inf"), float("nan")),
    *(True, False, "", "word", "\u00e4\u20ac\U0001f600", "a\nb\tc", "<&>'\"", " spaces ", "]]>", "1", "true"),
    *(None, [], [1, "a", 2.5, True], (1, 2), [[1], [2, [3, []]]], [None], [{"a": [{}]}]),
    *(
        {},
        {"a": 1},
        {"a": {"b": {"c": [1]}}},
        {"a/b": 1},
        {"": 1},
        {"\u00e4": 1},
        {"a": None},
        {1: 2},
        {None: 1},
    ),
    *(b"bytes", b"", b"\x00\xff", bytearray(b"x"), [b"in a list"], {"b": b"in a dictionary"}),
    *(
        datetime.datetime(2020, 1, 2, 3, 4, 5),
        xmlrpc.client.DateTime("20200102T03:04:05"),
        xmlrpc.client.Binary(b"x"),
    ),
    *({1}, 1j, range(3), Ellipsis),
]:
    outcome(f"{plain(value)!r}", lambda value=value: there_and_back(value))
outcome("long list", lambda: len(there_and_back(list(range(5000)))[1]))
outcome("long text", lambda: len(there_and_back("x" * 1_000_000)[1]))
got = rospy.set_param("dates", [b"1"]) or rospy.get_param("dates")
outcome("set what was got", lambda: rospy.set_param("again", got))
outcome("again", lambda: [each.data for each in rospy.get_param("again")])
show([name for name in rospy.get_param_names() if name in ("/dates", "/again", "/v")])


# The same through the modules of the tools.
def deep(value):
    if isinstance(value, list):
        return [deep(each) for each in value]
    if isinstance(value, dict):
        return {key: deep(each) for key, each in value.items()}
    return plain(value)


rospy.set_param("bytes", [b"a", {"b": b"c"}])
rospy.set_param("date", datetime.datetime(2020, 1, 2))
master = rosgraph.Master("/tool")
for name in ("/bytes", "/date"):
    show(deep(master.getParam(name)), deep(rosparam.get_param(name)), deep(rospy.get_master().getParam(name)))
    show(deep(master.subscribeParam("http://localhost:1/", name)), deep(rospy.get_master()[name]))
