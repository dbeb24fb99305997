"""rosparam in programs that read configuration files and load them onto the server."""

import functools
import itertools
import os
import tempfile

import rosgraph
import rosparam
import yaml
from referee import outcome, show
from referee import printed as printed_with_texts

folder = tempfile.mkdtemp()
numbers = itertools.count()


printed = functools.partial(printed_with_texts, texts=False)


def file(text):
    path = os.path.join(folder, f"{next(numbers)}.yaml")
    with open(path, "w") as stream:
        stream.write(text)
    return path


show("# load")
settings = file("a: 1\nb: {c: 2.5, d: [1, x, true]}\ne: deg(90)\nf: rad(pi/2)\ng: !degrees 180\nh: on\n")
outcome("file", lambda: rosparam.load_file(settings))
outcome("namespace", lambda: rosparam.load_file(settings, default_namespace="/my")[0][1])
outcome("namespace", lambda: rosparam.load_file(settings, default_namespace="my")[0][1])
printed("verbose", lambda: rosparam.load_file(file("a: 1\n"), verbose=True))
for text in (
    "_ns: foo\na: 1\n",
    "a: 1\n---\nb: 2\n",
    "",
    "# nothing\n",
    "- first\n- second\n",
    "a:\nb: 1\n",
    "a: 2020-01-01\n",
    "1: a\n2: b\n",
    "a: 99999999999\n",
):
    outcome(repr(text), lambda t=text: rosparam.load_file(file(t)))
    outcome(repr(text), lambda t=text: rosparam.load_str(t, "name", default_namespace="/x"))
outcome("missing", lambda: rosparam.load_file("/no/such.yaml"))
for text in ("a: [1\n", "a: !odd 1\n", "a: !!python/tuple [1]\n"):
    try:
        rosparam.load_file(file(text))
    except yaml.YAMLError:
        show(repr(text), "is a YAMLError")
os.environ["ROS_NAMESPACE"] = "robot"
outcome("in a namespace", lambda: rosparam.load_str("a: 1", "name"))
outcome("in a namespace", lambda: rosparam.load_str("a: 1", "name", default_namespace="/x"))
del os.environ["ROS_NAMESPACE"]

show("# set and get")
for values, namespace in rosparam.load_file(settings):
    rosparam.upload_params(namespace, values)
printed("upload", lambda: rosparam.upload_params("/v", {"a": 1, "b": {"c": 2}, "t": "x"}, verbose=True))
printed("upload beside", lambda: rosparam.upload_params("/v", {"z": 1}))
printed("upload one", lambda: rosparam.upload_params("/one", 5))
printed("upload the root", lambda: rosparam.upload_params("/", [5]))
printed("upload keys that are numbers", lambda: rosparam.upload_params("/n", {1: 2}))
printed("set", lambda: rosparam.set_param("/s/a", "[1, 2]", verbose=True))
printed("set", lambda: rosparam.set_param("/s", "{b: {c: true}}"))
printed("set an angle", lambda: rosparam.set_param("/s/r", "deg(180)"))
printed("set as it is", lambda: rosparam.set_param_raw("/s/raw", "5", True))
for name in ("/v", "/b", "b/c", "/s", "/e", "/one", "/none"):
    outcome(name, lambda n=name: rosparam.get_param(n))
for namespace in ("/b", "b", "/b/c", "/none"):
    outcome(f"below {namespace}", lambda n=namespace: rosparam.list_params(n))
printed("delete", lambda: rosparam.delete_param("/b", verbose=True))
outcome("delete none", lambda: rosparam.delete_param("/b"))
outcome("delete an empty name", lambda: rosparam.delete_param(""))
outcome("get an empty name", lambda: rosparam.get_param(""))
outcome("the others are there", lambda: rosparam.get_param("/v/a"))
printed("print", lambda: rosparam.print_params({"a": {"b": 1}, "c": "x"}, "/n"))
printed("print", lambda: rosparam.print_params([1], "/n"))
dumped = os.path.join(folder, "dumped.yaml")
printed("dump", lambda: rosparam.dump_params(dumped, "/v", verbose=True))
with open(dumped) as stream:
    show(repr(stream.read()))
printed("dump into no folder", lambda: rosparam.dump_params("/no/such/dir", "/v"))
printed("dump none", lambda: rosparam.dump_params(dumped, "/none"))
printed("command", lambda: rosparam.yamlmain(["rosparam", "get", "/v/a"]))
printed("command", lambda: rosparam.yamlmain(["rosparam", "get", "/none"]))
outcome("server", lambda: rosparam.get_param_server().getParam("/v/a"))

show("# angles everywhere")
for loader in (yaml.SafeLoader, yaml.FullLoader, yaml.Loader):
    show(yaml.load("a: deg(-45.5)\nb: rad(2*pi)\nc: degree\nd: deg90\n", Loader=loader))

show("# without a master")
os.environ["ROS_MASTER_URI"] = "http://localhost:1"
for ask in (rosparam.list_params, rosparam.get_param):
    try:
        ask("/x")
    except rosparam.RosParamIOException as error:
        show(ask.__name__, type(error).__name__)
show([c.__name__ for c in rosparam.RosParamIOException.__mro__][:3])
show(rosgraph.is_master_online())
