"""The namespace and address of a node, from the environment and the process's own command line."""

from referee import Other, show

CODE = """
import rospy, sys
print(rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("a"), flush=True)
rospy.init_node("node", argv=sys.argv)
host = rospy.get_node_uri().split(":")[1]
print(rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("a"), rospy.resolve_name("~a"), host, flush=True)
"""


def run(*arguments, **environment):
    program = Other(CODE, *arguments, environment=environment)
    show(*arguments, environment, "|", program.read(), "|", program.read())
    return program


RUNS = [
    run("__ns:=x", "a:=b", "__name:=other"),
    run("__ns:=/x/y/", "__name:=/global/name"),
    run("a:=b", ROS_NAMESPACE="env"),
    run("__ns:=arg", "__name:=of/it", ROS_NAMESPACE="/env/"),
    run("__ip:=127.0.0.1", "__hostname:=localhost"),
    run("__hostname:=localhost", "__ip:=127.0.0.1", ROS_NAMESPACE="/"),
    run("__name:=~private", ROS_NAMESPACE="a/b"),
]
for program in RUNS:
    show(program.close())
