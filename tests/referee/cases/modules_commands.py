"""The functions of rosnode's, rostopic's, rosservice's and rosparam's verbs, called by a program: they raise and return."""

import optparse
import os

import rosgraph
import rosnode
import rosparam
import rosservice
import rostopic
import yaml
from referee import outcome, printed, show

NODE = "http://localhost:1/"
master = rosgraph.Master("/other")
master.registerPublisher("/topic", "geometry_msgs/PoseStamped", NODE)
master.registerSubscriber("/heard", "std_msgs/Bool", NODE)
master.registerService("/served", "rosrpc://localhost:1", NODE)
with open("numbers.yaml", "w") as stream:
    stream.write("a: 1\nb: {c: text}\n")

CALLS = [
    (rosnode, "list", [], ["/"], ["-u"], ["-a"], ["/nope"], ["a", "b"], ["-z"]),
    (rosnode, "info", ["-q", "/other"], ["-q", "/nope"], []),
    (rosnode, "machine", [], ["localhost"], ["no.such.machine"], ["a", "b"]),
    (rosnode, "kill", ["/nope"], ["/nope", "/nope2"], ["-a", "/nope"]),
    (rosnode, "ping", ["-a", "/other"], ["-a", "-c", "1"], ["a", "b"], ["-c", "x", "a"]),
    (rostopic, "list", [], ["-v"], ["-p"], ["-s"], ["/topic"], ["-p", "-s"], ["a", "b"], ["-b", "/nope.bag"]),
    (rostopic, "info", ["/topic"], ["/nope"], [], ["a", "b"]),
    (rostopic, "type", ["/topic"], ["/topic/pose/position"], ["/nope"], [], ["a", "b"]),
    (rostopic, "find", ["std_msgs/Bool"], ["nope/Nope"], [], ["a", "b"]),
    (rostopic, "echo", [], ["a", "b"], ["-a", "/topic"], ["-b", "/nope.bag", "/topic"], ["-n", "x", "/topic"]),
    (rostopic, "hz", [], ["-w", "x", "/topic"]),
    (rostopic, "bw", [], ["-w", "x", "/topic"]),
    (rostopic, "delay", [], ["-w", "x", "/topic"]),
    (rostopic, "pub", [], ["/x"], ["/x", "nope/Nope", "1"]),
    (rostopic, "pub", ["-r", "0", "/x", "std_msgs/Bool"], ["-r", "1", "-1", "/x", "std_msgs/Bool"], ["/x", "std_msgs/Bool", "["]),
    (rosservice, "list", [], ["-n"], ["/served"], ["a", "b"]),
    (rosservice, "info", ["/nope"], [], ["a", "b"]),
    (rosservice, "type", ["/nope"], [], ["a", "b"]),
    (rosservice, "uri", ["/served"], ["/nope"], []),
    (rosservice, "node", ["/served"], ["/nope"], []),
    (rosservice, "args", ["/nope"], []),
    (rosservice, "find", ["nope/Nope"], [], ["a", "b"]),
    (rosservice, "call", ["/nope"], []),
    (rosparam, "set", ["/p/one", "1"], ["/p/text", "a: b"], ["/p"], [], ["a", "b", "c"]),
    (rosparam, "set", ["-t", "/nope", "/p/x"], ["/p/negative", "-1"]),
    (rosparam, "load", ["numbers.yaml", "/loaded"], ["/nope.yaml"], [], ["a", "b", "c"]),
    (rosparam, "list", [], ["/p"], ["/nope"]),
    (rosparam, "get", ["/p"], ["/p/one"], ["-p", "/p"], ["/nope"], [], ["a", "b"]),
    (rosparam, "dump", ["out.yaml", "/p"], ["out.yaml", "/nope"]),
    (rosparam, "delete", ["/p/one"], ["/p/one"], [], ["a", "b"], ["-v", "/p/text"]),
]  # fmt: skip


def call_all(calls):
    for module, verb, *lines in calls:
        name = module.__name__
        for words in lines:
            argv = [name, verb, *words]
            if module is rosparam and verb in ("get", "dump", "set", "load"):
                function = getattr(
                    rosparam, f"_rosparam_cmd_{'get_dump' if verb in ('get', 'dump') else 'set_load'}"
                )
                run = lambda function=function, verb=verb, argv=argv: function(verb, argv)  # noqa: E731
            else:
                function = getattr(module, f"_{name}_cmd_{verb}")
                run = lambda function=function, argv=argv: function(argv)  # noqa: E731
            printed(" ".join(argv), run)


call_all(CALLS)

show("# parts of them")
outcome("uri", lambda: rosnode.lookup_uri(master, master.getSystemState(), "/topic", NODE))
outcome("uri", lambda: rosnode.lookup_uri(master, master.getSystemState(), "/topic", "http://x:1/"))
outcome("same", lambda: rosnode.rosnode_debugnode is rosnode.rosnode_info)
outcome(
    "pattern",
    lambda: rosnode.CONNECTION_PATTERN.match("TCPROS connection on port 5 to [a:1 on socket 7]").groups(),
)
for module in (rostopic, rosservice):
    for name in ("a", "a/b", "a/b/c"):
        outcome(name, lambda m=module, n=name: m._resource_name_package(n))
printed("topic", lambda: rostopic._optparse_topic_only("x", ["rostopic", "x", "a"]))
printed("topic", lambda: rostopic._optparse_topic_only("x", ["rostopic", "x"]))
printed("service", lambda: rosservice._optparse_service_only("x", ["rosservice", "x", "a"]))
printed("service", lambda: rosservice._optparse_service_only("x", ["rosservice", "x", "a", "b"]))
printed("services", lambda: rosservice._rosservice_list())
printed("services", lambda: rosservice._rosservice_list("/", True))
for function in (rosservice._rosservice_node, rosservice._rosservice_uri):
    printed("served", lambda f=function: f("/served"))
    printed("not served", lambda f=function: f("/nope"))
printed("info", lambda: rosservice._rosservice_info("/nope"))
printed("type", lambda: rosservice._rosservice_type("/nope"))
outcome("succeeds", lambda: rosservice._succeed((1, "text", 5)))
outcome("fails", lambda: rosservice._succeed((0, "text", 5)))
rosparam.set_param_raw("/tree", {"b": {"c": "one\ntwo", "d": [1, 2]}, "a": True, "e": "text", "f": 1.5})
printed("parameter", lambda: rosparam._rosparam_cmd_get_param("/tree"))
printed("parameter", lambda: rosparam._rosparam_cmd_get_param("/tree", pretty=True, verbose=True))
printed("parameter", lambda: rosparam._rosparam_cmd_get_param("/tree/e", True))
printed("parameter", lambda: rosparam._rosparam_cmd_get_param("/nope"))
printed("pretty", lambda: rosparam._pretty_print(rosparam.get_param("/tree"), "  "))
printed("pretty", lambda: rosparam._pretty_print({}))
outcome("caller", lambda: rosparam._get_caller_id().replace(str(os.getpid()), "PID"))

parser = optparse.OptionParser()
parser.add_option("-t", "--textfile")
parser.add_option("-v", action="store_true")
for words in (["a", "-1"], ["-v", "a", "-.5"], ["-t", "f", "a"], ["-t", "-v"], ["a", "b", "c"], ["a", "-"]):
    printed(
        " ".join(words), lambda w=words: rosparam._set_optparse_neg_args(parser, ["rosparam", "set", *w])[1]
    )
for text in (
    "!degrees 90",
    "deg(90)",
    "!radians 2*pi",
    "rad(pi/2)",
    "rad(2**3)",
    "rad(7%4)",
    "!!binary aGVsbG8=",
):
    outcome(text, lambda t=text: repr(yaml.safe_load(t))[:20])

show("# without a master")
os.environ["ROS_MASTER_URI"] = "http://localhost:1/"
call_all(
    [
        (rosnode, "list", []),
        (rosnode, "info", ["/x"]),
        (rosnode, "machine", []),
        (rosnode, "kill", ["/x"]),
        (rosnode, "ping", ["/x"]),
        (rosnode, "cleanup", []),
        (rostopic, "list", []),
        (rostopic, "info", ["/x"]),
        (rostopic, "type", ["/x"]),
        (rostopic, "find", ["std_msgs/Bool"]),
        (rostopic, "echo", ["/x"]),
        (rostopic, "hz", ["/x"]),
        (rostopic, "bw", ["/x"]),
        (rostopic, "pub", ["/x", "std_msgs/Bool", "true"]),
        (rosservice, "list", []),
        (rosservice, "type", ["/x"]),
        (rosservice, "uri", ["/x"]),
        (rosservice, "find", ["std_srvs/Empty"]),
        (rosservice, "call", ["/x"]),
        (rosparam, "list", []),
        (rosparam, "get", ["/x"]),
        (rosparam, "set", ["/x", "1"]),
        (rosparam, "delete", ["/x"]),
    ]
)
