"""rosparam called from Python code."""

import os
import tempfile

import rosparam
import yaml
from referee import outcome, show

outcome("set", lambda: rosparam.set_param("/a", "1"))
outcome("set", lambda: rosparam.set_param("/angle", "deg(90)"))
outcome("set", lambda: rosparam.set_param("/text", "hello"))
outcome("set", lambda: rosparam.set_param("/table", "{x: 1, y: {z: [1, 2]}}"))
for name in ("/a", "/angle", "/text", "/table", "/table/y/z", "/none", "a"):
    outcome(f"get {name}", lambda n=name: rosparam.get_param(n))
outcome("raw", lambda: rosparam.set_param_raw("/raw", {"p": 1.5, "q": ["a"]}))
outcome("raw", lambda: rosparam.set_param_raw("/raw/r", 2, verbose=True))
outcome("get raw", lambda: sorted(rosparam.get_param("/raw").items()))
outcome(
    "list",
    lambda: [
        each for each in sorted(rosparam.list_params("/")) if "run_id" not in each and "ros" not in each
    ],
)
outcome("list below", lambda: sorted(rosparam.list_params("/table")))
outcome("list none", lambda: rosparam.list_params("/nothing"))
outcome("delete", lambda: rosparam.delete_param("/a"))
outcome("delete aloud", lambda: rosparam.delete_param("/text", verbose=True))
outcome("delete none", lambda: rosparam.delete_param("/none"))
outcome("upload", lambda: rosparam.upload_params("/up", {"a": 1, "b": {"c": 2}}))
outcome("upload aloud", lambda: rosparam.upload_params("/up", {"d": 1}, verbose=True))
outcome("upload single", lambda: rosparam.upload_params("/up/e", 5))
outcome("upload single at root", lambda: rosparam.upload_params("/", 5))
outcome("upload list at root", lambda: rosparam.upload_params("/", [5]))
outcome("uploaded", lambda: sorted(rosparam.list_params("/up")))

with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "p.yaml")
    with open(path, "w") as file:
        file.write("a: 1\nb: {c: rad(pi/2), d: !degrees 180.0, e: deg(180.0), f: !radians pi}\n---\nx: 2\n")
    outcome("load", lambda: rosparam.load_file(path))
    outcome("load below", lambda: rosparam.load_file(path, default_namespace="/ns"))
    with open(path, "w") as file:
        file.write("_ns: here\nq: 1\n")
    outcome("load with its own", lambda: rosparam.load_file(path, default_namespace="/ns"))
    with open(path, "w") as file:
        file.write("")
    outcome("load nothing", lambda: rosparam.load_file(path))
    try:
        rosparam.load_file(os.path.join(folder, "none.yaml"))
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(type(error).__name__)
    outcome("dump", lambda: rosparam.dump_params(path, "/up"))
    with open(path) as file:
        show(file.read())
    outcome("dump aloud", lambda: rosparam.dump_params(path, "/table", verbose=True))
outcome("text", lambda: rosparam.load_str("a: [1, two]", "where"))
outcome("text below", lambda: rosparam.load_str("a: 1", "where", default_namespace="/ns"))
outcome("yaml's own", lambda: yaml.safe_load("{a: deg(180), b: rad(2*pi)}"))
outcome("yaml's own", lambda: yaml.load("{a: !radians pi}", Loader=yaml.SafeLoader))
show(rosparam.NAME, rosparam.NS, [c.__name__ for c in rosparam.RosParamIOException.__mro__][:3])
outcome("server", lambda: rosparam.get_param_server().getParam("/up/a"))
outcome("print", lambda: rosparam.print_params({"a": 1, "b": {"c": "x"}}, "/"))
outcome("print single", lambda: rosparam.print_params(5, "/a"))
os.environ["ROS_MASTER_URI"] = "http://localhost:1"
for ask in (
    lambda: rosparam.get_param("/a"),
    lambda: rosparam.list_params("/"),
    lambda: rosparam.set_param("/a", "1"),
):
    try:
        ask()
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(type(error).__name__)
